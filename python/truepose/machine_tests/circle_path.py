"""The path of a circular test: once round either way, with an overshoot before and after."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from truepose._kernel import STATUS
from truepose.arrays import Floats, Indices
from truepose.errors import Problem, RequestError
from truepose.files.wording import one_of
from truepose.machine import Machine
from truepose.runs.poses import OK, Travel, faults_text, pose_in_words, reason_text
from truepose.runs.quantities import POSITIONS

PLANES = {"xy": ("x", "y"), "yz": ("y", "z"), "zx": ("z", "x")}
"""Planes by name: angles count from the first axis towards the second."""

COARSEST, FINEST = math.radians(10.0), math.radians(0.02)
"""Steps of the angle: of fewer points no circle is told, of more no test consists."""

MOST_OVERSHOOT = 4.0 * math.pi

SHORTLY = 1e-3
"""Of a step: how long before a point its drives are looked at, to see which way they come."""


@dataclass(frozen=True, eq=False)
class CirclePath:
    """A circle of a machine, driven counter-clockwise and then clockwise.

    `angles` (n,), rad, evenly spaced over one turn from 0 on; `poses` (n, n_commanded) and `joints`
    (n, n_joint) there. `travel` (2, n, n_joint): in which direction each joint last moved, either
    way. `first`: number of the angle at which the readings begin; `middle` (3,), m.
    """

    machine: Machine
    plane: str
    radius: float
    middle: Floats
    angles: Floats
    poses: Floats
    joints: Floats
    travel: Floats
    first: int
    overshoot: float

    @property
    def count(self) -> int:
        """How many angles there are."""
        return len(self.angles)

    @property
    def both(self) -> tuple[Floats, Floats]:
        """Poses (2 n, n_commanded) and travel (2 n, n_joint) of the readings, as driven."""
        order = np.concatenate([self.order(0), self.order(1)])
        travel = np.concatenate([self.travel[way][self.order(way)] for way in (0, 1)])
        return self.poses[order], travel

    def order(self, way: int) -> Indices:
        """(n,) numbers of the angles in the order of the readings, of one direction."""
        steps = np.arange(self.count) if way == 0 else -np.arange(self.count)
        return np.asarray((self.first + steps) % self.count, np.intp)

    def by_angle(self, driven: Floats) -> Floats:
        """(..., 2, n) of values (..., 2 n) in the order in which the readings are taken."""
        n = self.count
        sorted_ = np.empty((*driven.shape[:-1], 2, n))
        for way in (0, 1):
            sorted_[..., way, self.order(way)] = driven[..., way * n : (way + 1) * n]
        return sorted_


def circle_path(
    machine: Machine,
    radius: float,
    centre: Mapping[str, float],
    plane: str,
    start: float,
    overshoot: float,
    step: float,
) -> CirclePath:
    """The path of a test. Coordinates in m and rad; those of angles default to home.

    Raises `RequestError`: test-option, circle-out-of-reach.
    """
    _check(machine, radius, centre, plane, start, overshoot, step)
    count = 4 * math.ceil(0.5 * math.pi / step - 1e-9)
    angles = 2.0 * np.pi * np.arange(count) / count
    home = dict(zip(machine.dof, machine.home, strict=True))
    middle = np.array([float(centre.get(name, home[name])) for name in machine.commanded])

    def on_circle(at: Floats) -> Floats:
        there = np.tile(middle, (count, 1))
        for axis, along in zip(PLANES[plane], (np.cos(at), np.sin(at)), strict=True):
            there[:, machine.commanded.index(axis)] += radius * along
        return there

    poses = on_circle(angles)
    joints, placements, status = machine.kernel.place(poses)
    if (status != OK).any():
        raise out_of_reach(machine, angles, poses, np.array(STATUS)[status])
    drives = joints.shape[1]
    first = round(start / (2.0 * np.pi) * count) % count
    before = math.ceil(overshoot / (2.0 * np.pi) * count - 1e-9)
    along = Travel(machine)
    # The way back begins where the overshoot of the way there has ended.
    there = first - before + np.arange(count + 2 * before + 1)
    back = first + before - np.arange(count + before)
    travel = np.empty((2, count, drives))
    for way, steps in enumerate((there, back)):
        # Just before each point too, so that a drive that turns in between has turned.
        ahead = (1.0, -1.0)[way] * SHORTLY * 2.0 * np.pi / count
        short, _, _ = machine.kernel.place(on_circle(angles - ahead))
        numbers = steps % count
        passed = along.into(np.stack([short[numbers], joints[numbers]], axis=1).reshape(-1, drives))
        readings = slice(before, before + count)
        travel[way][numbers[readings]] = passed[1::2][readings]
    point = placements[0, :3].copy()
    for axis, name in enumerate(POSITIONS):
        if name in machine.commanded:
            point[axis] = float(middle[machine.commanded.index(name)])
    reached = before * 2.0 * np.pi / count
    return CirclePath(machine, plane, radius, point, angles, poses, joints, travel, first, reached)


def _check(
    machine: Machine,
    radius: float,
    centre: Mapping[str, float],
    plane: str,
    start: float,
    overshoot: float,
    step: float,
) -> None:
    """Raises `RequestError` (test-option) with all that is wrong."""
    wrong: list[tuple[str, str, str, str | None]] = []
    possible = planes(machine)
    if not possible:
        axes = " ".join(machine.commanded)
        wrong.append(("plane", f"a machine that is commanded in {axes}", "two of x y z", None))
    elif plane not in possible:
        wrong.append(("plane", plane, one_of(possible), None))
    if not (math.isfinite(radius) and radius > 0.0):
        wrong.append(("radius", f"{radius:g} m", "a length above zero", None))
    lacking = [name for name in machine.commanded if name in POSITIONS and name not in centre]
    example = ", ".join(f"{name}=0 mm" for name in machine.commanded if name in POSITIONS)
    if lacking:
        said = ", ".join(centre) or "nothing"
        wrong.append(("centre", said, f"also {' and '.join(lacking)}, as in {example!r}", None))
    for name, value in centre.items():
        if name not in machine.commanded:
            wrong.append(("centre", name, one_of(machine.commanded), None))
        elif not math.isfinite(value):
            wrong.append(("centre", f"{name} = {value}", "finite coordinates", None))
    if not math.isfinite(start):
        wrong.append(("start", f"{start}", "an angle", None))
    if not 0.0 <= overshoot <= MOST_OVERSHOOT:
        wrong.append(("overshoot", f"{math.degrees(overshoot):g} deg", "0 to 720 deg", None))
    if not FINEST <= step <= COARSEST:
        wrong.append(("step", f"{math.degrees(step):g} deg", "0.02 to 10 deg", None))
    if wrong:
        raise RequestError(*(option_problem(*fault) for fault in wrong))


def planes(machine: Machine) -> tuple[str, ...]:
    """The planes in which a machine can be commanded along a circle."""
    return tuple(
        name for name, axes in PLANES.items() if all(axis in machine.commanded for axis in axes)
    )


def option_problem(option: str, found: str, expected: str, hint: str | None = None) -> Problem:
    """A problem of an option of a test."""
    return Problem(
        "test-option",
        f"the test cannot be made with this {option}",
        found=found,
        expected=expected,
        hint=hint,
    )


def out_of_reach(
    machine: Machine, angles: Floats, poses: Floats, status: np.ndarray
) -> RequestError:
    """The error where the machine cannot take some of the circle: first and last such angle.

    `status` (n,) by name, "ok" where it can be taken.
    """
    failed = np.flatnonzero(status != "ok")
    first = int(failed[0])
    why = faults_text(machine, machine.kernel.explain(poses[first])) or reason_text(
        str(status[first])
    )
    where = pose_in_words(machine, poses[first])
    share = (
        f"{failed.size} of {len(angles)} angles, the first {math.degrees(angles[first]):.4g} deg"
    )
    return RequestError(
        Problem(
            "circle-out-of-reach",
            "the machine cannot drive this circle",
            file=machine.file,
            found=f"{share}, {where}: {why}",
            expected="a circle within reach and travel, off singularities",
            hint="take a smaller radius, or another centre",
        )
    )
