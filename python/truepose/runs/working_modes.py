"""The joint coordinates that take the platform to one pose: one working mode for each.

A carriage or a crank reaches its strut from either side of it; a strut that changes its length has
one coordinate. The kernel solves each combination in closed form, or by its own iteration where the
platform has freedoms that nobody commands.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from truepose._kernel import STATUS, elements
from truepose._kernel import Machine as KernelMachine
from truepose.arrays import Floats, real_numbers
from truepose.errors import ArgumentError
from truepose.machine import Machine
from truepose.machine.parts import Drive
from truepose.representation import Facts, Represented
from truepose.runs.arguments import checked

SIDES = "+-"
"""The two ways in which a drive reaches its strut."""

ONE_WAY = "."
"""What stands in a working mode for a drive that has one way only."""

SOLVED = ("ok", "out_of_travel", "joint_limit")
"""Statuses of joint coordinates that are right, whether or not they may be commanded."""

STEP = 1e-6
"""Of a drive's travel: how far it is moved to see on which side of its strut it stands."""


@dataclass(frozen=True, eq=False, repr=False)
class InverseSolutions(Represented):
    """The joint coordinates for one pose of the nominal machine, each in a working mode.

    `pose` (n_commanded,), m or rad. Of the k solutions, that of the file's own working mode first:
    `joints` (k, n_joint), m or rad; `working_modes` (k,), a sign for each drive, or "." for a drive
    that has one way only; `poses` (k, n_dof) of the platform; `status` (k,): "ok", "out_of_travel"
    or "joint_limit". `unsolved`: how many other combinations of signs do not reach the pose.
    """

    machine: Machine
    pose: Floats
    joints: Floats
    working_modes: tuple[str, ...]
    poses: Floats
    status: tuple[str, ...]
    unsolved: int

    @property
    def has_modes(self) -> bool:
        """Whether any drive of the machine has two ways at all."""
        return any(map(has_two_ways, self.machine.drives))

    def _facts(self) -> Facts:
        yield "machine", self.machine.name
        yield "working modes", self.working_modes
        yield "status", self.status
        yield "combinations that do not reach", self.unsolved


@checked
def inverse_solutions(machine: Machine, pose: ArrayLike) -> InverseSolutions:
    """The joint coordinates that take the nominal machine to a pose, in every working mode.

    `pose` (n_commanded,), m or rad. What a joint cannot do, travel or leaning, is in the status;
    where no mode reaches the pose there are none. Raises `RequestError` (bad-argument) for anything
    but one pose of finite numbers.
    """
    given = one_row("pose", pose, len(machine.commanded))
    kernel = machine.kernel
    own = mode_of_file(machine)
    ways = [SIDES if has_two_ways(drive) else ONE_WAY for drive in machine.drives]
    every = sorted(("".join(signs) for signs in itertools.product(*ways)), key=lambda m: m != own)
    joints, poses, modes, status = [], [], [], []
    for mode in every:
        there = in_working_mode(kernel, mode)
        solved, placements, codes = there.place(given[np.newaxis])
        word = STATUS[codes[0]]
        if word in SOLVED:
            joints.append(solved[0])
            poses.append(there.pose_of(placements)[0])
            modes.append(mode)
            status.append(word)
    return InverseSolutions(
        machine,
        given,
        np.array(joints).reshape(-1, len(machine.joints)),
        tuple(modes),
        np.array(poses).reshape(-1, len(machine.dof)),
        tuple(status),
        len(every) - len(modes),
    )


def mode_of_file(machine: Machine) -> str:
    """The working mode in which the machine is commanded."""
    modes = zip(machine.kernel.working_modes, machine.drives, strict=True)
    return "".join(sign if has_two_ways(drive) else ONE_WAY for sign, drive in modes)


def mode_at(machine: Machine, joints: Floats, placement: Floats) -> str:
    """The working mode in which joints (n_joint,) hold a placement (7,).

    A drive is on the "+" side where moving it on takes its joint centre away from the platform's.
    """
    kernel = machine.kernel
    signs = []
    for number, drive in enumerate(machine.drives):
        if not has_two_ways(drive):
            signs.append(ONE_WAY)
            continue
        low, high = drive.travel
        step = STEP * (high - low)
        moved = np.repeat(joints[np.newaxis], 2, axis=0)
        moved[:, number] += (step, -step)
        centres = kernel.joint_centres(moved, np.repeat(placement[np.newaxis], 2, axis=0))
        # Which of several struts of a drive is asked matters only where they contradict each other.
        strut = next(n for n, strut in enumerate(machine.struts) if strut.drive == drive.name)
        ahead, behind = np.linalg.norm(centres[:, strut, 1] - centres[:, strut, 0], axis=1)
        signs.append(SIDES[0] if ahead >= behind else SIDES[1])
    return "".join(signs)


def in_working_mode(
    kernel: KernelMachine, mode: str, home: Mapping[str, float] | None = None
) -> KernelMachine:
    """The same machine, whose drives reach by `mode`, and whose solutions start at `home`."""
    reduced: Any = kernel.__reduce__()  # its description and what was replaced since
    rebuild, (description, replaced) = reduced
    drives: Sequence[Mapping[str, Any]] = description["drives"]
    other = dict(description)
    other["drives"] = [
        {**drive, "working_mode": None if sign == ONE_WAY else sign}
        for drive, sign in zip(drives, mode, strict=True)
    ]
    if home is not None:
        other["home"] = dict(home)
    built: KernelMachine = rebuild(other, replaced)
    return built


def has_two_ways(drive: Drive) -> bool:
    """Whether two joint coordinates of the drive reach the same pose."""
    return drive.kind in _two_ways()


@cache
def _two_ways() -> frozenset[str]:
    return frozenset(row["kind"] for row in elements()["drive"] if not row["sets_length"])


def one_row(name: str, value: ArrayLike, count: int) -> Floats:
    """The argument `name` as (`count`,) finite numbers. Raises `ArgumentError` (bad-argument)."""
    given = real_numbers(name, value)
    if given.shape != (count,) or not np.isfinite(given).all():
        raise ArgumentError.of(name, value, f"{count} finite numbers, SI, shape ({count},)")
    return np.array(given)


__all__ = [
    "InverseSolutions",
    "in_working_mode",
    "inverse_solutions",
    "mode_at",
    "mode_of_file",
    "one_row",
]
