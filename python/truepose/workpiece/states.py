"""The machine at the points of a part, as commanded and after compensation, and samples of it.

    point of sample s = programmed point + error of machine s there

with the machine of a sample one and the same at all points. The error is exact, or to first order
about the known shifts, `value + effects t`; both are told apart.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from truepose._kernel import Points, Study
from truepose.arrays import Flags, Floats, Indices
from truepose.compensation.corrected import corrected
from truepose.machine import Condition, Machine
from truepose.runs.displacement import at_shifts
from truepose.runs.first_order import first_order
from truepose.runs.poses import OK
from truepose.runs.quantities import POSITIONS
from truepose.runs.variables import Variables, variables_at
from truepose.sources import PoseBlock, Source
from truepose.uncertainty_analysis.sampler import study_of
from truepose.verdict.states import AFTER, BEFORE
from truepose.workpiece.varying import Varying


@dataclass(frozen=True, eq=False)
class PartState:
    """One state, `BEFORE` or `AFTER` compensation, at the n points of a part.

    `block`: its joints are what is commanded; `variables`: what all sources leave unknown there.
    """

    name: str
    machine: Machine
    block: PoseBlock
    variables: Variables

    def alone(self) -> PartState:
        """The same without what is computed from it: what is sent elsewhere is small."""
        return dataclasses.replace(self, block=self.block.alone())

    @cached_property
    def points(self) -> Floats:
        """(n, 3) programmed tool points, m, base frame."""
        return np.ascontiguousarray(self.block.placements[:, :3])

    @cached_property
    def first_order(self) -> tuple[Floats, Floats]:
        """Value (n, m), exact where all variables are 0, and effects (n, m, v), m and rad."""
        value, effects, _ = first_order(self.machine, self.block, self.variables)
        return value, effects

    @cached_property
    def known_error(self) -> Floats:
        """(n, 3) exact error of the tool point where all variables are 0, m."""
        return in_space(self.machine, self.first_order[0])

    @cached_property
    def effects(self) -> Floats:
        """(n, 3, v) what each variable adds to it, to first order, m."""
        slopes = np.swapaxes(self.first_order[1], 1, 2)
        return np.ascontiguousarray(np.swapaxes(in_space(self.machine, slopes), 1, 2))

    def varying(self, seed: int, run: int = 0) -> Varying:
        """The variables along the path, drawn with a seed."""
        return Varying(self.variables, self.block.drive_joints, seed, run)

    def linear_errors(self, varying: Varying, first: int, count: int) -> Floats:
        """(count, n, 3) errors of the samples from number `first` on, to first order, m."""
        every = np.ones(len(self.variables.names), np.bool_)
        return self.linear_of(varying, varying.rows(first, count), first, every)

    def linear_of(self, varying: Varying, rows: Floats, first: int, chosen: Flags) -> Floats:
        """(s, n, 3) the same of drawn `rows` (s, v), the first of number `first`.

        Variables that are not `chosen` (v,) are 0.
        """
        effects = self.effects if chosen.all() else np.where(chosen, self.effects, 0.0)
        return varying.linear(rows, first, self.known_error, effects)

    def exact_errors(self, varying: Varying, first: int, count: int) -> tuple[Floats, Flags]:
        """The same exactly, (count, n, 3), and which of the samples could be assembled (count,)."""
        rows = varying.rows(first, count)
        return self.exact(rows if varying.constant else every_point(varying, rows, first))

    def exact(self, t: Floats, points: Indices | None = None) -> tuple[Floats, Flags]:
        """Exact errors (s, n, 3), and which are (s,), where the variables are t.

        `t` (s, v) at all points, or (n, s, v), of each point its own; at some `points`, or at all.
        """
        count, names = t.shape[-2], len(self.variables.names)
        chosen = np.arange(self.block.indices.size) if points is None else points
        if not names:
            same = np.broadcast_to(self.known_error[chosen], (count, chosen.size, 3))
            return same, np.ones(count, np.bool_)
        errors = np.empty((count, chosen.size, 3))
        shared = Points(np.ascontiguousarray(t), names) if t.ndim == 2 else None
        for place, point in enumerate(chosen.tolist()):
            given = shared or Points(np.ascontiguousarray(t[point]), names)
            exact, _ = self.study.errors(point, given)
            errors[:, place] = in_space(self.machine, np.asarray(exact))
        good = np.isfinite(errors).all(axis=(1, 2))
        return errors, np.asarray(good, np.bool_)

    @cached_property
    def study(self) -> Study:
        """The kernel's, of every point."""
        return study_of(self.machine, self.block, self.variables)


def position_columns(machine: Machine) -> Indices:
    """Numbers of the error's components that are of the position."""
    names = machine.components
    return np.array([at for at, name in enumerate(names) if name in POSITIONS], np.intp)


def in_space(machine: Machine, errors: Floats) -> Floats:
    """(..., 3) errors of the tool point, m, base frame, of errors (..., m); 0 where none moves."""
    columns = position_columns(machine)
    axes = [POSITIONS.index(machine.components[column]) for column in columns]
    positions = np.zeros((*errors.shape[:-1], 3))
    positions[..., axes] = errors[..., columns]
    return positions


def every_point(varying: Varying, rows: Floats, first: int) -> Floats:
    """(n, s, v) variables at all points, of drawn `rows` (s, v), the first of number `first`."""
    return np.ascontiguousarray(np.moveaxis(varying.at(rows, first), 1, 0))


def part_states(
    machine: Machine,
    condition: Condition,
    sources: Sequence[Source],
    poses: Floats,
    travel: Floats,
) -> tuple[tuple[PartState, ...], np.ndarray]:
    """The part as commanded and after compensation, and a kernel status (n,) of each point.

    `poses` (n, n_commanded), m and rad; `travel` (n, n_joint), the direction in which each joint
    last moved on its way there. A state is not to be used where a status is not ok.
    """
    joints, placements, status = machine.kernel.place(poses)
    every = np.arange(len(poses), dtype=np.intp)
    block = PoseBlock(machine, condition, poses, every, joints, placements, travel)
    if (status != OK).any():
        return (), status
    variables = variables_at(machine, block, sources)
    status = at_shifts(machine, block, variables.alone, variables.shift)
    before = PartState(BEFORE, machine, block, variables)
    commanded, after, followed = corrected(machine, block, sources)
    status = np.where(status == OK, followed, status)
    return (before, PartState(AFTER, machine, commanded, after)), status
