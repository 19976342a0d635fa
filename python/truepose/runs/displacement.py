"""Exact: drive the nominal command through the machine as it is (equations 3-7 of the paper).

    error = forward(q, nominal + deviation) - X,    q = inverse(X, nominal)

as a small displacement of the tool point and a rotation vector, base frame.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.machine import Machine
from truepose.runs.poses import OK, finite_or
from truepose.sources import PoseBlock

ParameterDeviation = tuple[Indices, Floats]
"""Parameters (k,), each once, and their deviations (n or 1, k), SI."""


def sum_deviations(parts: Iterable[ParameterDeviation]) -> ParameterDeviation:
    """Deviations of several causes as one: each parameter once, with the sum of its deviations."""
    listed = list(parts)
    if not listed:
        return np.empty(0, np.intp), np.empty((1, 0))
    columns, place = np.unique(np.concatenate([c for c, _ in listed]), return_inverse=True)
    if len(listed) == 1 and columns.size == place.size:
        return listed[0]
    rows = max(len(values) for _, values in listed)
    total = np.zeros((rows, columns.size))
    at = 0
    for given, values in listed:
        for column in range(given.size):
            total[:, place[at + column]] += values[:, column]
        at += given.size
    return np.asarray(columns, np.intp), total


def displacement(
    machine: Machine, joints: Floats, placements: Floats, moved: ParameterDeviation
) -> tuple[Floats, np.ndarray]:
    """Where `joints` (n, n_joint) take the tool of the moved machine, less `placements` (n, 7).

    Returns (n, n_component) errors, m and rad, and (n,) kernel status; none is ok of an error that
    is not finite.
    """
    columns, values = moved
    error, status = machine.kernel.displacement(
        joints, placements, columns, np.ascontiguousarray(values)
    )
    return error, finite_or(status, error)


def at_shifts(
    machine: Machine,
    block: PoseBlock,
    alone: Iterable[ParameterDeviation],
    all_: ParameterDeviation,
) -> np.ndarray:
    """(n,) kernel status of the nominal command with each source `alone`, and `all_`, at shifts.

    Ok where the pose belongs to a run, the same for every command (`budget.poses`); else the first
    status that is not.
    """
    shifted = [moved for moved in alone if moved[1].any()]
    status_of_all = np.full(block.indices.size, OK, np.uint8)
    # One source that moves anything is all of them together.
    for moved in [*(shifted if len(shifted) > 1 else []), all_]:
        _, status = _error(machine, block, moved)
        status_of_all = np.where(status_of_all == OK, status, status_of_all)
    return status_of_all


def _error(
    machine: Machine, block: PoseBlock, moved: ParameterDeviation
) -> tuple[Floats, np.ndarray]:
    if not moved[1].any():
        shape = (block.indices.size, len(machine.components))
        return np.zeros(shape), np.full(shape[0], OK, np.uint8)
    return displacement(machine, block.joints, block.placements, moved)
