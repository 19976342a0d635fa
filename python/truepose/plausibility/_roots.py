"""Joint coordinates by which a carriage or a crank takes its struts to where home is.

Both roots of a drive's closure in closed form, so that rules can ask what another working mode or
the opposite axis would give. A drive of a kind that has no such pair has none.
"""

from __future__ import annotations

import math

import numpy as np

from truepose.arrays import Floats
from truepose.machine.parts import Drive
from truepose.plausibility._base import MachineAtHome


def roots(view: MachineAtHome, drive: Drive, *, mode: float, turn: float) -> Floats:
    """(n_strut,) coordinates, SI, of the drive's struts in a working mode (+1 or -1).

    `turn` -1: with its axis the other way. NaN where a strut does not reach.
    """
    axis = np.array(drive.fields["axis"]) * turn
    axis = axis / np.linalg.norm(axis)
    origin = np.array(drive.fields.get("origin", (0.0, 0.0, 0.0)))
    offset, scale = (_number(drive, name, usual) for name, usual in (("offset", 0), ("scale", 1)))
    coordinates = []
    for at, strut in enumerate(view.machine.struts):
        if strut.drive != drive.name:
            continue
        base, length = view.vector(f"{strut.part}.base"), float(view.lengths[at])
        assert base is not None
        solve = _of_slider if drive.kind == "slider" else _of_crank
        place = solve(axis, base, length, view.centres[at, 1] - origin, mode)
        coordinates.append((place - offset) / scale)
    return np.array(coordinates)


def within(drive: Drive, coordinates: Floats) -> bool:
    """Whether all coordinates are inside the drive's travel, of cranks but for whole turns."""
    first, last = drive.travel
    if drive.coordinate == "angle":
        middle = 0.5 * (first + last)
        coordinates = middle + (coordinates - middle + math.pi) % (2.0 * math.pi) - math.pi
    return bool(coordinates.size and ((coordinates >= first) & (coordinates <= last)).all())


def inside_otherwise(view: MachineAtHome, *, mode: float = 1.0, turn: float = 1.0) -> list[str]:
    """Paths of drives whose coordinate at home is out of travel, and would be inside otherwise.

    With the working mode times `mode`, the axis times `turn`. None where home is reached.
    """
    paths = []
    for drive in () if view.is_reached else filter(sided, view.machine.drives):
        own = 1.0 if drive.working_mode == "+" else -1.0
        if within(drive, roots(view, drive, mode=own, turn=1.0)):
            continue
        if within(drive, roots(view, drive, mode=mode * own, turn=turn)):
            paths.append(drive.part)
    return paths


def sided(drive: Drive) -> bool:
    """Whether the drive has a working mode and an axis, and two roots for them."""
    return drive.kind in ("slider", "crank") and drive.working_mode in ("+", "-")


def _number(drive: Drive, name: str, usual: float) -> float:
    value = drive.fields.get(name, usual)
    assert not isinstance(value, tuple)
    return float(value)


def _of_slider(axis: Floats, base: Floats, length: float, to: Floats, mode: float) -> float:
    away = to - base
    foot = float(away @ axis)
    margin = length**2 - float(away @ away) + foot**2
    return foot + mode * math.sqrt(margin) if margin >= 0.0 else math.nan


def _of_crank(axis: Floats, base: Floats, length: float, to: Floats, mode: float) -> float:
    """With the arm's end at `to` less a rod: P cos + Q sin = C."""
    along = axis * float(axis @ base)
    radial, ahead = base - along, np.cross(axis, base)
    p, q = float(to @ radial), float(to @ ahead)
    c = 0.5 * (float(to @ to) + float(base @ base) - length**2) - float(to @ along)
    margin = p**2 + q**2 - c**2
    if margin < 0.0:
        return math.nan
    side = mode * math.sqrt(margin)
    return math.atan2(q * c + p * side, p * c - q * side)
