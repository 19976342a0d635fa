"""Exact: drive the nominal command through the machine as it is (equations 3-7 of the paper).

    error = forward(q, nominal + deviation) - X,    q = inverse(X, nominal)

as a small displacement of the tool point and a rotation vector, base frame.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.machine import Machine
from truepose.runs.poses import OK, finite_or
from truepose.sources import Deviation, PoseBlock

ParameterDeviation = tuple[Indices, Floats]
"""Parameters (k,), each once, and their deviations (n or 1, k), SI."""


@dataclass(frozen=True)
class Edges:
    """Errors (n, n_component) at the shift and at both edges, and a status (n,) for each."""

    error: Floats
    lower: Floats
    upper: Floats
    status: tuple[np.ndarray, np.ndarray, np.ndarray]


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


def add_deviations(
    moved: ParameterDeviation, parts: Iterable[ParameterDeviation]
) -> ParameterDeviation:
    """What is `moved` already, moved on by `parts` of the same parameters."""
    columns, values = moved
    place = {int(column): at for at, column in enumerate(columns)}
    total = values.copy()
    for given, added in parts:
        if len(added) > len(total):
            total = np.repeat(total, len(added), axis=0)
        for at, column in enumerate(given):
            total[:, place[int(column)]] += added[:, at]
    return columns, total


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


def edges(
    machine: Machine,
    block: PoseBlock,
    centre: ParameterDeviation,
    lower: ParameterDeviation,
    upper: ParameterDeviation,
) -> Edges:
    """Errors of the nominal command with the parameters moved to a centre and two edges.

    A machine that is not moved has no error, and where an edge is the centre, so is its error:
    neither is computed.
    """
    error, centred = _error(machine, block, centre)
    if _same(centre, lower) and _same(centre, upper):
        return Edges(error, error, error, (centred, centred, centred))
    low, at_low = _error(machine, block, lower)
    high, at_high = _error(machine, block, upper)
    return Edges(error, low, high, (centred, at_low, at_high))


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


def source_edges(machine: Machine, block: PoseBlock, deviation: Deviation) -> Edges:
    """Errors of one source alone: at its shift and at the edges of its lengths and offsets."""
    columns = deviation.parameters
    return edges(
        machine,
        block,
        sum_deviations([(columns, deviation.shift)]),
        sum_deviations([(columns, deviation.at_edge(-1.0))]),
        sum_deviations([(columns, deviation.at_edge(+1.0))]),
    )


def overall_edges(
    machine: Machine, block: PoseBlock, parts: Iterable[tuple[Deviation, bool]]
) -> Edges:
    """Errors of all sources together (equations 3-6).

    `parts` are the sources' deviations, each with whether it goes to its edges at the overall
    minimum and maximum (the tolerance does); all others stay at their shift.
    """
    listed = list(parts)
    centre = sum_deviations([(d.parameters, d.shift) for d, _ in listed])
    bands = [d for d, moves in listed if moves]

    def at(side: float) -> ParameterDeviation:
        return add_deviations(centre, [(d.parameters, d.at_edge(side) - d.shift) for d in bands])

    return edges(machine, block, centre, at(-1.0), at(+1.0))


def _error(
    machine: Machine, block: PoseBlock, moved: ParameterDeviation
) -> tuple[Floats, np.ndarray]:
    if not moved[1].any():
        shape = (block.indices.size, len(machine.components))
        return np.zeros(shape), np.full(shape[0], OK, np.uint8)
    return displacement(machine, block.joints, block.placements, moved)


def _same(one: ParameterDeviation, other: ParameterDeviation) -> bool:
    return np.array_equal(one[1], other[1])
