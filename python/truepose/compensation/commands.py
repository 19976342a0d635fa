"""Commands for a controller with nominal kinematics, and where the actual machine goes with them.

The actual machine is the nominal one with every source at its shift, `nominal + shifts(X)`, the
shifts taken at the pose X where the tool is (docs/results.md). A controller that cannot be given
other kinematics is asked for another pose instead:

    corrected(X) = forward(inverse(X, nominal + shifts(X)), nominal)

(of sources that follow the joints with the shifts at those very joints, `corrected.py`),
and takes the actual machine, which stands where its shifts are those of the pose it stands at,

    actual(p) = Y  with  Y = forward(inverse(p, nominal), nominal + shifts(Y)),

back to X. Y is found by iterating from p: the shifts change a thousand times less than the pose
does, so that each pass gains about three digits.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from truepose._kernel import STATUS
from truepose.arrays import Codes, Flags, Floats
from truepose.compensation.corrected import corrected_joints
from truepose.errors import Problem, RequestError
from truepose.machine import Condition, Machine
from truepose.runs.controller_geometry import require_known_controller
from truepose.runs.displacement import ParameterDeviation, displacement, sum_deviations
from truepose.runs.poses import BLOCK, OK, requested_poses
from truepose.sources import PoseBlock, acting
from truepose.spatial import rotate_quaternions

MOST_PASSES = 12
"""Passes after which the pose that is reached is taken for one that does not settle.

Three or four do, unless a source jumps there: a play whose load changes its sign.
"""

SETTLED = 1e-13
"""What a further pass may still move, in characteristic lengths or rad: rounding."""

TURNS = {"a": "rx", "b": "ry", "c": "rz"}
"""The component of an error that belongs to each angle of a pose."""

_NOT_CONVERGED = STATUS.index("not_converged")
_WITH_JOINTS = tuple(STATUS.index(name) for name in ("ok", "out_of_travel", "joint_limit"))
"""Statuses of poses whose joints are known, though some of them must not be commanded."""

NO_DEVIATION: ParameterDeviation = (np.empty(0, np.intp), np.empty((1, 0)))
"""The nominal machine."""


def corrected_poses(
    machine: Machine, poses: ArrayLike, condition: Condition | None = None
) -> tuple[Floats, Codes]:
    """What to ask a controller with nominal kinematics for, so that the tool comes to `poses`.

    `poses` (..., n_commanded), m and rad, base frame; `condition`, default the machine's. Returns
    the commanded poses (n, n_commanded) and the status (n,) of each, codes of
    `truepose._kernel.STATUS`. Angles are the ones nearest to those of `poses`. A pose that has no
    command is NaN; one that must not be commanded (out_of_travel, joint_limit) still has numbers.
    Play that nothing presses to one side has no known side and is left as it is.

    Raises `RequestError` (bad-poses, unknown-part; controller-unsaid, controller-contradicted for
    a calibrated file of which it is not known what its controller works with), `TrueposeError` as
    `truepose.budget` does.
    """
    require_known_controller(machine)
    actual = ActualMachine(machine, condition)
    table = requested_poses(machine, poses)
    commanded = np.full(table.shape, np.nan)
    status = np.empty(len(table), np.uint8)
    for rows in blocks(len(table)):
        known = actual.deviations_at(table[rows])
        command = actual.command(known)
        commanded[rows][known.block.indices] = command.poses
        status[rows] = known.expand_status(command.status)
    return commanded, status


def actual_poses(
    machine: Machine, commanded: ArrayLike, condition: Condition | None = None
) -> tuple[Floats, Codes]:
    """Where the actual machine's tool goes when a nominal controller is asked for `commanded`.

    `commanded` (..., n_commanded), m and rad, base frame. Returns poses (n, n_commanded) and the
    status (n,) of each; where there is none, NaN. A command whose nominal joints are out of travel
    has that status and the pose to which they would go. Raises as `corrected_poses`.
    """
    actual = ActualMachine(machine, condition)
    table = requested_poses(machine, commanded)
    poses_reached = np.full(table.shape, np.nan)
    status = np.empty(len(table), np.uint8)
    for rows in blocks(len(table)):
        joints, _, placed = machine.kernel.place(table[rows])
        at = np.flatnonzero(has_joints(placed))
        reached, settled = actual.reached(joints[at], table[rows][at])
        poses_reached[rows][at] = reached
        placed[at] = _first(placed[at], settled)
        status[rows] = placed
    return poses_reached, status


def actual_of_joints(
    machine: Machine,
    joints: ArrayLike,
    condition: Condition | None = None,
    near: ArrayLike | None = None,
) -> tuple[Floats, Codes]:
    """Where the actual machine's tool goes at `joints` (n, n_joint), m or rad, whoever set them.

    `near` (n, n_commanded) poses from which the solution starts and to whose angles the result is
    nearest; default the nominal machine's poses, by the forward solution from home. Returns poses
    (n, n_commanded) and the status (n,) of each; where there is none, NaN. Travel is not looked at.

    Raises `RequestError` (bad-poses) where joints or poses are no finite numbers of that shape.
    """
    actual = ActualMachine(machine, condition)
    given = _joints(machine, joints)
    placed = np.full(len(given), OK, np.uint8)
    if near is None:
        forward, placed = machine.kernel.forward(given, status=True)
        starts = np.ascontiguousarray(forward[:, actual.commanded])
    else:
        starts = requested_poses(machine, near)
        if len(starts) != len(given):
            raise _bad(f"{len(starts)} poses for {len(given)} joints", "one pose for each")
    commanded = np.full(starts.shape, np.nan)
    status = placed.copy()
    for rows in blocks(len(given)):
        at = np.flatnonzero(has_joints(placed[rows]))
        reached, settled = actual.reached(given[rows][at], starts[rows][at])
        commanded[rows][at] = reached
        status[rows][at] = settled
    return commanded, status


@dataclass(frozen=True, eq=False)
class PoseDeviations:
    """Some poses, and how far every parameter is known to be off its nominal value there.

    `block`: those of the poses that have joints and a balance of forces, with their numbers in
    `block.indices` (m,); `moved`: parameters and their deviations (m or 1, k) with the nominal
    command; `status` (n,) why the others have none; `followed`: a source deviates as the joints
    that are commanded say, so that with another command `moved` is another.
    """

    block: PoseBlock
    moved: ParameterDeviation
    status: Codes
    followed: bool = False

    def expand_status(self, status: Codes) -> Codes:
        """(n,) of all poses, from `status` (m,) of those in the block.

        That their nominal joints are out of travel does not count: what is commanded does.
        """
        if len(status) == len(self.status):
            return status
        statuses = self.status.copy()
        statuses[self.block.indices] = status
        return statuses


@dataclass(frozen=True, eq=False)
class Command:
    """Corrected `joints` (m, n_joint), the `poses` (m, n_commanded) that ask for them, `status`."""

    joints: Floats
    poses: Floats
    status: Codes


class ActualMachine:
    """The machine in a condition, every source at its shift. For blocks of at most `BLOCK` poses.

    `commanded`: columns of the commanded freedoms in a pose of all freedoms, `components`: of what
    they move the tool in, in an error; `unit` (n_commanded,): the characteristic length, m, or
    1 rad, by which each is measured.
    """

    def __init__(self, machine: Machine, condition: Condition | None = None) -> None:
        """Raises `RequestError` (unknown-part) where the condition does not fit the machine."""
        self.machine = machine
        self.condition = machine.condition if condition is None else condition
        machine.check_condition(self.condition)
        self.sources = acting(machine, self.condition)
        self.commanded = [machine.dof.index(name) for name in machine.commanded]
        self._angles = [at for at, name in enumerate(machine.commanded) if name in "abc"]
        self._linear = [machine.components.index(c) for c in machine.components if c in "xyz"]
        self._into_linear = ["xyz".index(c) for c in machine.components if c in "xyz"]
        turns = ("rx", "ry", "rz")
        self._angular = [machine.components.index(c) for c in machine.components if c in turns]
        self._into_angular = [turns.index(c) for c in machine.components if c in turns]
        names = (TURNS.get(name, name) for name in machine.commanded)
        self.components = [machine.components.index(name) for name in names]
        length = machine.characteristic_length
        self.unit = np.array([length if name in "xyz" else 1.0 for name in machine.commanded])

    def deviations_at(
        self, poses: Floats, moved: ParameterDeviation | None = None
    ) -> PoseDeviations:
        """What is known at `poses` (n, n_commanded).

        `moved`: the deviations there, where they are known already; for poses that have joints.
        """
        joints, placements, placed = self.machine.kernel.place(poses)
        indices = np.arange(len(poses), dtype=np.intp)
        block = PoseBlock(self.machine, self.condition, poses, indices, joints, placements)
        block = block.select(has_joints(placed))
        if moved is not None and block.indices.size == len(poses):
            return PoseDeviations(block, moved, placed)
        try:
            moved = self._moved(block)
        except ValueError:
            # A load that is not finite, where the statics have no solution: seldom looked for.
            _, balanced = block.balance
            failed = balanced != OK
            placed[block.indices[failed]] = balanced[failed]
            block = block.select(~failed)
            moved = self._moved(block)
        return PoseDeviations(block, moved, placed, block.is_followed)

    def _moved(self, block: PoseBlock) -> ParameterDeviation:
        """What the sources move, each at its shift. Raises `ValueError` if that is not finite."""
        if not (block.indices.size and self.sources):
            return NO_DEVIATION
        shifts = []
        for source in self.sources:
            deviation = source.deviation(self.machine, self.condition, block)
            # Columns that only have a band would be carried through every solution.
            shifted = deviation.shift.any(axis=0)
            shifts.append((deviation.parameters[shifted], deviation.shift[:, shifted]))
        columns, values = sum_deviations(shifts)
        return columns, np.ascontiguousarray(values)

    def command(self, known: PoseDeviations) -> Command:
        """The corrected command for the poses of `known`."""
        poses = _requested(known.block)
        if not len(poses):
            return Command(np.empty((0, len(self.machine.joints))), poses, np.empty(0, np.uint8))
        joints, _, corrected = corrected_joints(
            known.block, known.moved, lambda moved: moved, self._moved if known.followed else None
        )
        nominal, solved = displacement(self.machine, joints, known.block.placements, NO_DEVIATION)
        commanded = self.poses_from(known.block.placements, nominal, poses)
        return Command(joints, commanded, _first(corrected, solved))

    def error(self, known: PoseDeviations, joints: Floats) -> tuple[Floats, Codes]:
        """Where `joints` (m, n_joint) take the tool, less the poses of `known`.

        (m, n_component) and a status (m,). The shifts are those of the poses of `known`, not of
        the ones reached: second order, as in `truepose.budget`. What follows the joints deviates
        as `joints` say.
        """
        if not len(joints):
            return np.empty((0, len(self.machine.components))), np.empty(0, np.uint8)
        moved = self._moved(known.block.sent_to(joints)) if known.followed else known.moved
        return displacement(self.machine, joints, known.block.placements, moved)

    def reached(self, joints: Floats, near: Floats) -> tuple[Floats, Codes]:
        """Where `joints` (n, n_joint) take the tool, by iteration from `near` (n, n_commanded).

        Poses (n, n_commanded), NaN without one, and the status (n,).
        """
        commanded = near.copy()
        status = np.full(len(near), OK, np.uint8)
        size = np.zeros(len(near))
        left = np.arange(len(near))
        for _ in range(MOST_PASSES):
            if not left.size:
                break
            poses = commanded[left]
            known = self.deviations_at(poses)
            at, placements = known.block.indices, known.block.placements
            error, solved = self.error(known, joints[left[at]])
            status[left] = known.expand_status(solved)
            commanded[left[at]] = self.poses_from(placements, error, poses[at])
            step = np.abs((commanded[left] - poses) / self.unit).max(axis=1)
            # Steps shrink by one factor: the next one is foretold from the last two.
            to_come = step * np.minimum(step / np.maximum(size[left], SETTLED), 1.0)
            size[left] = step
            left = left[(to_come > SETTLED) & (status[left] == OK)]
        status[left] = _NOT_CONVERGED
        commanded[status != OK] = np.nan
        return commanded, status

    def poses_from(self, placements: Floats, error: Floats, near: Floats) -> Floats:
        """(n, n_commanded) `placements` (n, 7) moved on by `error` (n, n_component).

        With the angles nearest to those of `near`.
        """
        if not len(near):
            return near.copy()
        moved = placements.copy()
        moved[:, self._into_linear] += error[:, self._linear]
        if self._angular:
            turn = np.zeros((len(error), 3))
            turn[:, self._into_angular] = error[:, self._angular]
            moved[:, 3:] = rotate_quaternions(placements[:, 3:], turn)
        poses = self.machine.kernel.pose_of(moved)
        commanded = np.ascontiguousarray(poses[:, self.commanded])
        if self._angles:
            self._turn_towards(near, commanded)
        return commanded

    def _turn_towards(self, near: Floats, poses: Floats) -> None:
        """Replace the angles of `poses` by those of the same rotations nearest to `near`."""
        angles = self._angles
        own, wanted = poses[:, angles], near[:, angles]
        nearest = own - 2.0 * np.pi * np.round((own - wanted) / (2.0 * np.pi))
        far = np.flatnonzero(np.abs(nearest - wanted).max(axis=1) > 0.5 * np.pi)
        if len(angles) == 3 and far.size:
            # a, b, c and a + pi, pi - b, c + pi are one rotation.
            other = own[far] * [1.0, -1.0, 1.0] + np.pi
            other -= 2.0 * np.pi * np.round((other - wanted[far]) / (2.0 * np.pi))
            nearer = np.abs(other - wanted[far]).sum(1) < np.abs(nearest[far] - wanted[far]).sum(1)
            nearest[far[nearer]] = other[nearer]
        poses[:, angles] = nearest


def _requested(block: PoseBlock) -> Floats:
    requested = block.requested
    if isinstance(requested, np.ndarray) and block.indices.size == len(requested):
        return requested
    return block.requested[block.indices]


def blocks(count: int) -> Iterator[slice]:
    """Rows of a table of `count`, a block of poses at a time."""
    for start in range(0, count, BLOCK):
        yield slice(start, min(start + BLOCK, count))


def has_joints(status: Codes) -> Flags:
    """(n,) whether poses of this status have joints, be they such as must not be commanded."""
    flags: Flags = status == OK
    for code in _WITH_JOINTS[1:]:
        flags = flags | (status == code)
    return flags


def _first(*statuses: Codes) -> Codes:
    """(n,) the first of several statuses of a pose that is not ok."""
    combined = statuses[0].copy()
    for status in statuses[1:]:
        np.copyto(combined, status, where=combined == OK)
    return combined


def _joints(machine: Machine, joints: ArrayLike) -> Floats:
    count = len(machine.joints)
    try:
        given = np.asarray(joints, np.float64)
    except (TypeError, ValueError):
        raise _bad("something that is not an array of numbers", "joints") from None
    expected = f"(..., {count}) finite numbers: {', '.join(machine.joints)} in m, rad"
    if given.ndim == 0 or given.shape[-1] != count or given.size == 0:
        raise _bad(f"joints of shape {given.shape}", expected)
    if not np.isfinite(given).all():
        raise _bad("a joint that is not finite", expected)
    return np.ascontiguousarray(given.reshape(-1, count))


def _bad(found: str, expected: str) -> RequestError:
    return RequestError(
        Problem("bad-poses", "these are no joints of the machine", found=found, expected=expected)
    )


__all__ = [
    "ActualMachine",
    "Command",
    "PoseDeviations",
    "actual_of_joints",
    "actual_poses",
    "corrected_poses",
]
