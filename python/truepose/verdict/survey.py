"""The largest error at every pose: to first order, proven not to be exceeded, and reached.

    linear maximum          the largest length of the set of errors, to first order
    + proven remainder  =   bound
    the machine at which the linear one is largest, or the opposite one, solved exactly
                        =  the first witness

The linear maximum itself is of no machine: it may be a little above or below what there is.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.compensation.remainder import Remainder
from truepose.error_budget.largest import Largest, largest
from truepose.runs.first_order import ExactError, first_order
from truepose.runs.poses import OK
from truepose.verdict.states import State

POSES = 1024
"""Poses whose effects stay in the cache together."""


@dataclass(frozen=True, eq=False)
class Survey:
    """What is known of the errors of q quantities at n poses, m and rad.

    `numbers` (n,) of the poses in the run; `linear` (n, q): linear maximum; `bound` (n, q): with
    the proven remainder, inf where there is none; `witness` (n, q): of the machine where the
    linear maximum is reached, or of the opposite one where that is farther off, solved exactly: inf
    where it cannot be assembled. `status` (n,): the kernel's of the state, ok where it can be
    commanded; the others are inf.
    """

    numbers: Indices
    linear: Floats
    bound: Floats
    witness: Floats
    status: np.ndarray


def survey(states: Iterable[State], quantities: Sequence[Indices]) -> Survey:
    """Over all poses of the states; `quantities`: components of each length."""
    parts = [
        _surveyed(state.select(_part(state, start)), quantities)
        for state in states
        for start in range(0, state.block.indices.size, POSES)
    ]
    return Survey(
        *(
            np.concatenate([getattr(part, name) for part in parts])
            for name in ("numbers", "linear", "bound", "witness", "status")
        )
    )


def _part(state: State, start: int) -> np.ndarray:
    chosen = np.zeros(state.block.indices.size, np.bool_)
    chosen[start : start + POSES] = True
    return chosen


def _surveyed(state: State, quantities: Sequence[Indices]) -> Survey:
    machine, block, variables = state.machine, state.block, state.variables
    value, effects, status = first_order(machine, block, variables)
    status = np.where(state.status == OK, status, state.status)
    fine = np.asarray(status == OK, np.bool_)
    shape = (block.indices.size, len(quantities))
    linear, bound, witness = (np.full(shape, np.inf) for _ in range(3))
    if fine.any():
        usable = state.select(fine)
        value, effects = value[fine], effects[fine]
        far = largest(value, effects, variables.domain, quantities)
        linear[fine] = far.length
        beyond = Remainder(machine).bound(usable.block, usable.variables, value, effects)
        bound[fine] = np.where(beyond.proven[:, np.newaxis], far.length + beyond.norms, np.inf)
        # Both ends: to first order they are alike where nothing is known, and it is rounding that
        # says which of them is the maximiser; exactly they are not alike.
        witness[fine] = np.maximum(
            _reached(usable, far, effects, quantities),
            _reached(usable, far.opposite, effects, quantities),
        )
    return Survey(block.indices, linear, bound, witness, status)


def _reached(state: State, far: Largest, effects: Floats, quantities: Sequence[Indices]) -> Floats:
    """(n, q) sizes of the machines that lie farthest along the directions; inf where none."""
    exact_error = ExactError(state.machine, state.block, state.variables)
    maximisers = far.maximiser(effects, state.variables.domain, quantities)
    sizes = np.empty(far.length.shape)
    every = np.arange(len(sizes))
    for at, columns in enumerate(quantities):
        reached, failed = exact_error(every, maximisers[:, at].copy())
        size = np.sqrt(np.square(reached[:, columns]).sum(axis=1))
        sizes[:, at] = np.where(failed == OK, size, np.inf)
    return sizes


__all__ = ["Survey", "survey"]
