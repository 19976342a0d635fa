"""The corrected machine in use: the built one, commanded with what was written for it.

The calibrated file is written for a controller that was not touched: it goes on with the geometry
of the drawing. Its joints are worked out in NumPy, and so is where the tool then is.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.interpolate import RegularGridInterpolator  # type: ignore[import-untyped]

import truepose as tp
from calibration_study.judge import answer_of, errors_at, tools_of
from calibration_study.kinematics import inverse
from calibration_study.study import DrawnSet
from calibration_study.truth import DEG, MM, Floats, Twin
from truepose.calibration.calibrate import Calibration
from truepose.machine import Machine

NODES = {2: 7, 3: 5, 6: 3}
"""Along each axis of a pose map, by the number of axes: what lies between them stays small."""


@dataclass(frozen=True)
class Used:
    """How far the tool is off over the headline, at its pose: the worse of position and rotation.

    `at`: at every pose, against the headline, the highest.
    """

    way: str
    ratio: float
    at: float


def written(found: Calibration, twin: Twin, folder: Path) -> Machine:
    """The machine file of a controller that keeps the drawing's geometry, as it is read again."""
    path = folder / f"{twin.path.stem}-calibrated.toml"
    path.unlink(missing_ok=True)
    return found.save(path, original=twin.path, date="2026-01-01")


def used_of(drawn: DrawnSet) -> list[Used]:
    """Of a set that is accepted; nothing of one that is not."""
    answer = answer_of(drawn.twin, drawn.write(), drawn.judged)
    if not answer.accepted or answer.found is None:
        return []
    return used(drawn.twin, answer.found, drawn.folder)


def used(twin: Twin, found: Calibration, folder: Path) -> list[Used]:
    """By compensation, by a corrected program, and by a pose map."""
    machine = written(found, twin, folder)
    poses = np.asarray(found.poses[found.usable], float)
    results = []
    ways: dict[str, Callable[[], Floats]] = {
        "compensate": lambda: tp.compensate(machine, poses)["joint_corrected"].values,
        "gcode": lambda: _joints(twin, _program(machine, twin, poses, folder)),
        "pose-map": lambda: _joints(twin, _mapped(machine, twin, poses)),
    }
    for way, joints in ways.items():
        each = tools_of(twin, found, errors_at(twin, found, joints()))
        highest = max(float((t.off / t.stated.max()).max()) for t in each)
        results.append(Used(way, max(t.ratio for t in each), highest))
    return results


def _joints(twin: Twin, commanded: Floats) -> Floats:
    """(n, n_drive) of commanded poses, by the controller: the geometry of the drawing."""
    return np.array([inverse(twin.nominal, pose)[0] for pose in commanded])


def _factors(twin: Twin) -> Floats:
    """(n_commanded,) what makes mm and deg of SI."""
    return np.array([MM if name in "xyz" else DEG for name in twin.description["commanded"]])


def _program(machine: Machine, twin: Twin, poses: Floats, folder: Path) -> Floats:
    """(n, n_commanded) what a corrected program commands at the ends of its blocks.

    Each wanted pose is the end of a block, and an auxiliary code follows, at which all motion ends.
    """
    letters = [name.upper() for name in twin.description["commanded"]]
    source, target = folder / "program.ngc", folder / "corrected.ngc"
    target.unlink(missing_ok=True)
    lines = ["G21 G90 G94"]
    for number, pose in enumerate(poses * _factors(twin)):
        words = " ".join(f"{n}{v:.7f}" for n, v in zip(letters, pose, strict=True))
        lines += [f"G1 {words} F1000", f"(wanted {number})"]
    source.write_text("\n".join([*lines, "M2", ""]), encoding="ascii")
    tp.correct_program(machine, source, target, digits=7, force=True)
    state = dict.fromkeys(letters, np.nan)
    ends = []
    for line in target.read_text(encoding="ascii").splitlines():
        words = re.findall(r"([A-Z])\s*(-?\d+\.?\d*)", re.sub(r"\(.*?\)|;.*", "", line))
        state |= {n: float(v) for n, v in words if n in state}
        if "(wanted" in line:
            ends.append([state[n] for n in letters])
    return np.array(ends) / _factors(twin)


def _mapped(machine: Machine, twin: Twin, poses: Floats) -> Floats:
    """(n, n_commanded) wanted poses and what a table adds to them, multilinear between nodes."""
    names = list(twin.description["commanded"])
    nodes = NODES.get(len(names), 3)
    files = tp.export(machine, "pose-map", {"count": str(nodes)}).files
    (text,) = (text for name, text in files.items() if name.endswith(".csv"))
    rows = list(csv.DictReader(io.StringIO(re.sub(r"(?m)^#.*\n", "", text))))
    units = {name.split(" ")[0]: name for name in rows[0]}
    place = np.array([[float(row[units[n]]) for n in names] for row in rows])
    added = np.array([[float(row[units[f"add_{n}"]] or "nan") for n in names] for row in rows])
    axes = [np.unique(column) for column in place.T]
    shape = tuple(len(axis) for axis in axes)
    at = tuple(np.searchsorted(axis, column) for axis, column in zip(axes, place.T, strict=True))
    table = np.full((*shape, len(names)), np.nan)
    table[at] = added
    between = RegularGridInterpolator(axes, table)
    wanted = poses * _factors(twin)
    inside = np.clip(wanted, [a[0] for a in axes], [a[-1] for a in axes])
    return np.asarray((wanted + between(inside)) / _factors(twin))
