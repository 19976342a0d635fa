"""The poses that the same joint coordinates take the platform to: its assembly modes.

Struts of given lengths can be assembled in several ways: a hexapod in up to forty (P. Dietmaier,
The Stewart-Gough platform of general geometry can have 40 real postures, Advances in Robot
Kinematics, 1998, 7-16). Here they are looked for by Newton's iteration from many starts. That finds
most, and proves nothing about those that it does not find.
"""

from __future__ import annotations

import operator
from dataclasses import dataclass
from typing import SupportsIndex

import numpy as np
from numpy.typing import ArrayLike

from truepose._kernel import STATUS
from truepose.arrays import Flags, Floats, Indices
from truepose.errors import ArgumentError
from truepose.machine import Machine
from truepose.representation import Facts, Represented
from truepose.runs.arguments import checked
from truepose.runs.poses import OK
from truepose.runs.working_modes import in_working_mode, mode_at, one_row
from truepose.spatial import angle_between, matrix_to_euler, quaternion_to_matrix

STARTS = 2000
"""Of Dietmaier's forty poses these reach thirty-nine, and ten times as many the fortieth."""

MOST_STARTS = 1_000_000

SAME = 1e-6
"""Of the characteristic length: poses nearer to each other are one."""

ENDS = 1e-9
"""Of a workspace's extent: what rounding makes of its ends."""


@dataclass(frozen=True, eq=False, repr=False)
class ForwardSolutions(Represented):
    """Poses that joint coordinates take the nominal machine to. They need not be all there are.

    `joints` (n_joint,), m or rad. Of the k solutions, the one nearest to where the search began
    first: `poses` (k, n_dof), m and rad; `apart` (k, k) m between each other, a rotation counted at
    the machine's characteristic length; `residual` (k,) m by which the worst strut does not close;
    `joint_residual` (k,) m or rad by which the inverse of the pose, in its `working_modes` (k,),
    misses `joints`; `status` (k,) of that inverse: "ok", "out_of_travel" or "joint_limit" where
    joints may not stand so; `in_workspace` (k,), between the ends of the file's poses in every
    commanded freedom, None without a workspace; `reached` (k,): from how many of the starts.
    Of the `starts` that were tried so many `converged`, each on the branch on which it began.
    """

    machine: Machine
    joints: Floats
    poses: Floats
    apart: Floats
    residual: Floats
    joint_residual: Floats
    working_modes: tuple[str, ...]
    status: tuple[str, ...]
    in_workspace: Flags | None
    reached: Indices
    starts: int
    converged: int
    seed: int

    def _facts(self) -> Facts:
        yield "machine", self.machine.name
        yield "solutions found, not proven complete", len(self.poses)
        yield "working modes", self.working_modes
        yield "status", self.status
        yield "starts", self.starts
        yield "converged", self.converged


@checked
def forward_solutions(
    machine: Machine,
    joints: ArrayLike,
    start: ArrayLike | None = None,
    *,
    starts: int = STARTS,
    seed: int = 0,
) -> ForwardSolutions:
    """The poses that joint coordinates take the nominal machine to, found from many starts.

    `joints` (n_joint,), m or rad. `start` (n_dof,), default home, is tried first; so many `starts`
    more are drawn of `seed`, evenly over all orientations and over a box that holds every place
    that the struts let the tool be. NOT proven complete: what no start reaches is not found.

    Raises `RequestError` (bad-argument) for anything but one row of finite numbers, for a number of
    starts that is not from 1 to 1,000,000, and for a seed that is not a whole number from 0 on.
    """
    given = one_row("joints", joints, len(machine.joints))
    first = machine.home if start is None else one_row("start", start, len(machine.dof))
    count = _whole("starts", starts, 1, MOST_STARTS)
    number = _whole("seed", seed, 0, 2**64 - 1)
    kernel = machine.kernel
    tried = np.vstack([first, _drawn(machine, given, count, number)])
    many = np.repeat(given[np.newaxis], len(tried), axis=0)
    poses, codes = kernel.forward(many, tried, status=True)
    reached = kernel.placement_of(poses[codes == OK])
    # With more closures than freedoms the kernel also settles where struts are strained.
    reached = reached[_open(machine, given, reached) < SAME * machine.characteristic_length]
    placements, times = _distinct(reached, machine.characteristic_length)
    from_start = _apart(
        placements, kernel.placement_of(first[np.newaxis])[0], machine.characteristic_length
    )
    order = np.argsort(from_start, kind="stable")
    placements, times = placements[order], times[order]
    distinct = kernel.pose_of(placements)
    modes = tuple(mode_at(machine, given, placement) for placement in placements)
    off, status = _checked_back(machine, given, distinct, modes)
    return ForwardSolutions(
        machine=machine,
        joints=given,
        poses=distinct,
        apart=np.array(
            [_apart(placements, one, machine.characteristic_length) for one in placements]
        ).reshape(len(distinct), len(distinct)),
        residual=_open(machine, given, placements),
        joint_residual=off,
        working_modes=modes,
        status=status,
        in_workspace=_in_workspace(machine, distinct),
        reached=times,
        starts=len(tried),
        converged=len(reached),
        seed=number,
    )


def _drawn(machine: Machine, joints: Floats, count: int, seed: int) -> Floats:
    """(count, n_dof) starts. The box holds every solution.

    The tool point is no farther from a strut's base joint than the strut is long, and than its
    platform joint is from it.
    """
    kernel, random = machine.kernel, np.random.default_rng(seed)
    at_home = kernel.placement_of(machine.home[np.newaxis])
    centres = kernel.joint_centres(joints[np.newaxis], at_home)[0]
    arms = np.linalg.norm(centres[:, 1] - at_home[0, :3], axis=1)
    values = dict(zip(machine.parameters, machine.nominal.tolist(), strict=True))
    # On a ring the joint goes to where it is nearest, at most across the ring.
    arms += [2.0 * values.get(f"{strut.part}.ring_radius", 0.0) for strut in machine.struts]
    reach = (kernel.lengths_at(joints[np.newaxis], at_home)[0] + arms)[:, np.newaxis]
    low, high = (centres[:, 0] - reach).max(axis=0), (centres[:, 0] + reach).min(axis=0)
    quaternions = random.standard_normal((count, 4))
    quaternions /= np.linalg.norm(quaternions, axis=1, keepdims=True)
    evenly = matrix_to_euler(quaternion_to_matrix(quaternions))
    turning = [name for name in machine.dof if name in "abc"]
    columns = []
    for name in machine.dof:
        if name in "xyz":
            axis = "xyz".index(name)
            first, last = sorted((float(low[axis]), float(high[axis])))
            columns.append(random.uniform(first, last, count))
        elif len(turning) == 3:
            columns.append(evenly[:, "abc".index(name)])
        else:
            columns.append(random.uniform(-np.pi, np.pi, count))
    return np.stack(columns, axis=1)


def _distinct(placements: Floats, length: float) -> tuple[Floats, Indices]:
    """Placements (k, 7) that differ, in the order in which they were reached, and how often."""
    kept, times = [], []
    left = placements
    while len(left):
        same = _apart(left, left[0], length) < SAME * length
        kept.append(left[0])
        times.append(int(same.sum()))
        left = left[~same]
    return np.array(kept).reshape(-1, 7), np.array(times, np.intp)


def _apart(placements: Floats, one: Floats, length: float) -> Floats:
    """(n,) m from each placement (n, 7) to one (7,), a rotation counted at `length`."""
    turned = angle_between(placements[:, 3:], np.broadcast_to(one[3:], (len(placements), 4)))
    return np.asarray(np.linalg.norm(placements[:, :3] - one[:3], axis=1) + length * turned)


def _open(machine: Machine, joints: Floats, placements: Floats) -> Floats:
    """(k,) m by which the worst strut does not close at placements (k, 7)."""
    kernel = machine.kernel
    many = np.repeat(joints[np.newaxis], len(placements), axis=0)
    centres = kernel.joint_centres(many, placements)
    distances = np.linalg.norm(centres[:, :, 1] - centres[:, :, 0], axis=2)
    gaps = np.abs(distances - kernel.lengths_at(many, placements))
    return np.asarray(gaps.max(axis=1, initial=0.0))


def _checked_back(
    machine: Machine, joints: Floats, poses: Floats, modes: tuple[str, ...]
) -> tuple[Floats, tuple[str, ...]]:
    """(k,) by how much the inverse of each pose misses the joints, and the inverse's status."""
    kernel = machine.kernel
    commanded = [machine.dof.index(name) for name in machine.commanded]
    turns = _turns(machine)
    off, status = np.full(len(poses), np.nan), []
    for row, (pose, mode) in enumerate(zip(poses, modes, strict=True)):
        # Freedoms that nobody commands are found from home: here from where they are.
        home = dict(zip(machine.dof, pose.tolist(), strict=True))
        there = in_working_mode(kernel, mode, home)
        again, _, codes = there.place(pose[np.newaxis, commanded])
        status.append(STATUS[codes[0]])
        difference = again[0] - joints
        whole = np.divide(difference, turns, out=np.zeros_like(turns), where=turns > 0.0)
        off[row] = np.abs(difference - turns * np.round(whole)).max()
    return off, tuple(status)


def _turns(machine: Machine) -> Floats:
    """(n_joint,) what one whole turn adds to a joint coordinate; 0 where it is a length."""
    values = dict(zip(machine.parameters, machine.nominal.tolist(), strict=True))
    return np.array(
        [
            2.0 * np.pi / abs(values[f"{drive.part}.scale"]) if drive.coordinate == "angle" else 0.0
            for drive in machine.drives
        ]
    )


def _in_workspace(machine: Machine, poses: Floats) -> Flags | None:
    if machine.workspace is None:
        return None
    low, high = machine.workspace.ends
    slack = ENDS * np.maximum(high - low, machine.characteristic_length)
    values = poses[:, [machine.dof.index(name) for name in machine.commanded]]
    return np.asarray(((values >= low - slack) & (values <= high + slack)).all(axis=1))


def _whole(name: str, value: SupportsIndex, least: int, most: int) -> int:
    """A whole number between two. Raises `ArgumentError` for anything else."""
    try:
        number = operator.index(value)
    except TypeError:
        number = least - 1
    if isinstance(value, bool) or not least <= number <= most:
        raise ArgumentError.of(name, value, f"a whole number from {least} to {most}")
    return number


__all__ = ["MOST_STARTS", "STARTS", "ForwardSolutions", "forward_solutions"]
