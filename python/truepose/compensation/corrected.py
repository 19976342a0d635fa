"""The state after compensation: the corrected command, and what is known and unknown there.

The corrected joints are `inverse(X, nominal + shifts)`. What happens at a drive's own coordinate,
such as a periodic error of its screw, follows the joints that are really commanded, so that

    q = inverse(X, nominal + shifts(q))

is a fixed point. It is found by iteration: by how much the shifts change with q (2 um on 5 mm: by
1/400) is by how much each round comes nearer. Loads, lengths and temperatures stay those of the
nominal command (`PoseBlock.sent_to`). Where no source follows the joints the first round is the
last.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import TypeVar

import numpy as np

from truepose.arrays import Floats
from truepose.machine import Machine
from truepose.runs.displacement import ParameterDeviation, sum_deviations
from truepose.runs.poses import NOT_CONVERGED, OK
from truepose.runs.variables import Variables, variables_of
from truepose.sources import Deviation, PoseBlock, Source

Deviations = TypeVar("Deviations")
"""What is known of the machine at the poses of a block, in whatever form."""

MOST_ROUNDS = 12
"""Rounds after which a command that still moves is taken for one that does not settle."""

SETTLED = 1e-14
"""What the next round may still move a joint by, in its travel: rounding."""

ROUNDING = 1e-13
"""Step of a joint, in its travel, that may be rounding alone."""


def corrected(
    machine: Machine, block: PoseBlock, sources: Sequence[Source]
) -> tuple[PoseBlock, Variables, np.ndarray]:
    """The block with the corrected joints, the variables of all sources there, and a status (n,).

    The variables are about the shifts at that command. Statuses are the kernel's: not_converged
    also where the command does not settle.
    """
    first = [source.deviation(machine, block.condition, block) for source in sources]
    after, deviations, status = corrected_deviations(block, sources, first)
    return after, variables_of(machine, sources, deviations), status


def corrected_deviations(
    block: PoseBlock, sources: Sequence[Source], first: list[Deviation]
) -> tuple[PoseBlock, list[Deviation], np.ndarray]:
    """The block with the corrected joints, the sources' deviations there, and a status (n,).

    `first`: the deviations at the nominal command, as the sources found them in this block.
    """
    joints, deviations, status = corrected_joints(
        block,
        first,
        lambda known: sum_deviations(
            [(deviation.parameters, deviation.shift) for deviation in known]
        ),
        (
            lambda sent: [
                source.deviation(block.machine, block.condition, sent) for source in sources
            ]
        )
        if block.is_followed
        else None,
    )
    return dataclasses.replace(block, joints=joints), deviations, status


def corrected_joints(
    block: PoseBlock,
    first: Deviations,
    shift_of: Callable[[Deviations], ParameterDeviation],
    look: Callable[[PoseBlock], Deviations] | None,
) -> tuple[Floats, Deviations, np.ndarray]:
    """Corrected joints (n, n_joint), what is known at them, and kernel status (n,).

    `first` is what is known at the nominal command of the block, `shift_of` it are parameters and
    their deviations. `look` finds it with the drives sent elsewhere; None where that changes
    nothing.
    """
    machine = block.machine
    poses = block.requested[block.indices]
    known = first
    joints, _, status = _inverse(machine, poses, shift_of(known))
    if look is None:
        return joints, known, status
    travel = np.array([drive.travel[1] - drive.travel[0] for drive in machine.drives])
    before = np.full(len(poses), ROUNDING)
    for _ in range(MOST_ROUNDS):
        # Of a pose without joints the command is not looked at again: its status says why.
        reached = np.where(np.isfinite(joints), joints, block.joints)
        known = look(block.sent_to(reached))
        again, _, status = _inverse(machine, poses, shift_of(known))
        step = np.nan_to_num(np.abs((again - joints) / travel).max(axis=1), nan=0.0)
        joints = again
        # Steps shrink by one factor: the next one is foretold from the last two.
        to_come = np.where(step > ROUNDING, step * np.minimum(step / before, 1.0), 0.0)
        if (to_come <= SETTLED).all():
            break
        before = np.maximum(step, ROUNDING)
    moving = (to_come > SETTLED) & (status == OK)
    return joints, known, np.where(moving, NOT_CONVERGED, status).astype(np.uint8)


def _inverse(
    machine: Machine, poses: Floats, moved: ParameterDeviation
) -> tuple[Floats, Floats, np.ndarray]:
    columns, values = moved
    return machine.kernel.corrected(poses, columns, np.ascontiguousarray(values))


__all__ = ["corrected", "corrected_deviations", "corrected_joints"]
