"""The machine file of a hexapod from the joint centres of its six struts.

Each strut is of variable length, and its drive's coordinate is that length, as LinuxCNC's
genhexkins counts it. What nobody said is assumed widely, in lines whose comment says so.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal

import numpy as np

from truepose.arrays import Floats
from truepose.controllers._decimals import plain
from truepose.controllers._delta_file import quoted
from truepose.controllers._reader import ASSUMED, Assumption
from truepose.spatial import euler_to_matrix

STRUTS = 6
FREEDOMS = "xyzabc"

ASSUMED_BAND = "0.5 mm"
"""Of every coordinate of a joint centre and of every strut's zero: wide for anything machined."""

ANGLE = Decimal(10)
"""Degrees, of the assumed workspace."""

Point = tuple[Decimal, Decimal, Decimal]
Range = tuple[Decimal, Decimal]


@dataclass(frozen=True)
class Hexapod:
    """What is known of a hexapod, in a `unit` of length ("mm", "in") and degrees.

    `base`, `platform`: six points each, frame and platform axes. `names`: of the struts. `home`:
    the pose x y z a b c. `travel`: of each strut's length, None where nothing says. `ranges`: of
    each freedom, as far as they are known.
    """

    name: str
    description: str
    unit: str
    names: Sequence[str]
    base: Sequence[Point]
    platform: Sequence[Point]
    home: Sequence[Decimal]
    travel: Sequence[Range] | None
    ranges: Mapping[str, Range]

    def lengths(self, pose: Sequence[float] | Floats) -> Floats:
        """(6,) lengths of the struts at a pose x y z a b c, in the unit and degrees."""
        return lengths(self.base, self.platform, pose)


def lengths(
    base: Sequence[Point], platform: Sequence[Point], pose: Sequence[float] | Floats
) -> Floats:
    """(6,) distances of the joint centres at a pose x y z a b c, in their unit and degrees."""
    place = np.array([float(value) for value in pose])
    turned = (
        np.array(platform, np.float64) @ euler_to_matrix(np.radians(place[np.newaxis, 3:]))[0].T
    )
    found: Floats = np.linalg.norm(place[:3] + turned - np.array(base, np.float64), axis=1)
    return found


def hexapod_text(hexapod: Hexapod) -> tuple[str, tuple[Assumption, ...]]:
    """The text of the machine file, and what is assumed in it."""
    assumptions = [
        Assumption(
            f"every joint centre's coordinates are within {ASSUMED_BAND} of these, and every "
            "strut's zero too",
            "tolerance",
        )
    ]
    travel, said = _travel(hexapod)
    assumptions += said
    ranges, said = _ranges(hexapod)
    assumptions += said
    lines = [
        "schema = 1",
        "",
        "[machine]",
        f"name = {quoted(hexapod.name)}",
        f"description = {quoted(hexapod.description)}",
        'dof = ["x", "y", "z", "a", "b", "c"]',
        "",
        "[units]",
        f'length = "{hexapod.unit}"',
        'angle = "deg"',
    ]
    note = f" # {ASSUMED}" if hexapod.travel is None else ""
    for name, (low, high) in zip(hexapod.names, travel, strict=True):
        lines += [
            "",
            "[[drive]]",
            f"name = {quoted(name)}",
            'kind = "telescopic" # its coordinate is the length of the strut',
            f"travel = [{plain(low)}, {plain(high)}]{note}",
        ]
    for at, name in enumerate(hexapod.names):
        lines += [
            "",
            "[[strut]]",
            f"name = {quoted(name)}",
            f"drive = {quoted(name)}",
            f"base = {_point(hexapod.base[at])}",
            f"platform = {_point(hexapod.platform[at])}",
        ]
    lines += [
        "",
        f"[tolerance] # {ASSUMED}, widely: put in what is known",
        f'"strut.*.base.*" = "{ASSUMED_BAND}"',
        f'"strut.*.platform.*" = "{ASSUMED_BAND}"',
        f'"drive.*.offset" = "{ASSUMED_BAND}"',
        "",
        "[workspace]",
        f"home = {_table(zip(FREEDOMS, hexapod.home, strict=True))}",
        f"grid = {{ {', '.join(ranges)} }}",
        "",
        "# [accuracy]",
        '# target = "0.1 mm" # the largest error allowed, for truepose check',
        "",
    ]
    return "\n".join(lines), tuple(assumptions)


def _travel(hexapod: Hexapod) -> tuple[Sequence[Range], list[Assumption]]:
    """Of every strut: what is known, else half to one and a half of its length at home."""
    if hexapod.travel is not None:
        return hexapod.travel, []
    at_home = [Decimal(f"{length:.6g}") for length in hexapod.lengths(_floats(hexapod.home))]
    half = Decimal("0.5")
    return [(length * half, length + length * half) for length in at_home], [
        Assumption("struts go from half to one and a half of their lengths at home", "drive.travel")
    ]


def _ranges(hexapod: Hexapod) -> tuple[list[str], list[Assumption]]:
    """The grid's freedoms, and which of them are assumed."""
    radius = float(np.hypot(*np.array(hexapod.base, np.float64).T[:2]).max())
    height = float(np.min(hexapod.lengths(_floats(hexapod.home))))
    reach = {"x": 0.1 * radius, "y": 0.1 * radius, "z": 0.05 * height}
    counts = {"x": 5, "y": 5, "z": 3, "a": 3, "b": 3, "c": 1}
    shown, assumed = [], []
    for freedom, middle in zip(FREEDOMS, hexapod.home, strict=True):
        if freedom in hexapod.ranges:
            low, high = hexapod.ranges[freedom]
            count = 3 if freedom == "c" and high > low else counts[freedom]
        else:
            assumed.append(freedom)
            span = Decimal(f"{reach[freedom]:.2g}") if freedom in reach else ANGLE
            span = Decimal(0) if freedom == "c" else span
            low, high, count = middle - span, middle + span, counts[freedom]
        count = count if high > low else 1
        shown.append(f"{freedom} = [{plain(low)}, {plain(high)}, {count}]")
    if not assumed:
        return shown, []
    sentence = f"the workspace in {' '.join(assumed)} is about home: nothing says how large it is"
    return shown, [Assumption(sentence, "workspace.grid")]


def _floats(values: Sequence[Decimal]) -> list[float]:
    return [float(value) for value in values]


def _point(point: Point) -> str:
    return f"[{', '.join(plain(value) for value in point)}]"


def _table(pairs: object) -> str:
    assert isinstance(pairs, zip)
    shown = [f"{key} = {plain(value)}" for key, value in pairs if value != 0]
    return f"{{ {', '.join(shown)} }}" if shown else "{ z = 0 }"


__all__ = ["FREEDOMS", "STRUTS", "Hexapod", "Point", "Range", "hexapod_text", "lengths"]
