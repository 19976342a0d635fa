"""Sampled parts: the values of all quantities of parts that machines drawn at random make.

A sample is one machine, that goes to every point of the part. Errors are to first order where that
is enough: some samples are solved exactly too, and where a quantity differs between the two by more
than a share of its spread, all of them are.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from truepose.arrays import Flags, Floats
from truepose.workpiece.states import PartState

CHECKED = 128
"""Samples that are solved exactly too."""

ENOUGH = 0.01
"""Share of half the 95 % interval by which first order may be off at any of them."""

NOTHING = 1e-12
"""m or rad: a difference that is none."""

NUMBERS = 1 << 22
"""Coordinates that are worked on at a time."""

Values = Callable[[Floats], Floats]
"""(s, n_quantity) of parts whose points are (s, n, 3)."""

Account = Callable[[int], None]
"""Called with the number of samples done."""


@dataclass(frozen=True, eq=False)
class SampledParts:
    """`values` (s, n_quantity), NaN of a machine that could not be assembled; `failed` of them.

    `exact`: every sample is solved exactly. `off` (n_quantity,): the most that first order was off
    at the samples that were solved both ways.
    """

    values: Floats
    failed: int
    exact: bool
    off: Floats


def sampled(
    state: PartState,
    values: Values,
    samples: int,
    seed: int,
    exact: bool | None = None,
    account: Account | None = None,
) -> SampledParts:
    """Draw `samples` machines. `exact` None: to first order where that is enough."""
    varying = state.varying(seed)
    points = state.points

    def part(first: int, count: int, exactly: bool) -> tuple[Floats, Flags]:
        if not exactly:
            errors = state.linear_errors(varying, first, count)
            errors += points
            return values(errors), np.ones(count, np.bool_)
        errors, good = state.exact_errors(varying, first, count)
        quantities = np.full((count, _width(values, points)), np.nan)
        if good.any():
            quantities[good] = values(points + errors[good])
        return quantities, good

    def every(exactly: bool) -> tuple[Floats, int]:
        at_once = max(1, NUMBERS // max(1, points.size))
        rows, failed = [], 0
        for first in range(0, samples, at_once):
            count = min(at_once, samples - first)
            quantities, good = part(first, count, exactly)
            rows.append(quantities)
            failed += int((~good).sum())
            if account is not None:
                account(first + count)
        return np.concatenate(rows), failed

    if exact:
        quantities, failed = every(True)
        return SampledParts(quantities, failed, True, np.zeros(quantities.shape[1]))
    quantities, failed = every(False)
    count = min(CHECKED, samples)
    both, good = part(0, count, True)
    off = np.abs(both - quantities[:count])[good].max(axis=0, initial=0.0)
    spread = 0.5 * (np.quantile(quantities, 0.975, axis=0) - np.quantile(quantities, 0.025, axis=0))
    enough = good.all() and (off <= ENOUGH * spread + NOTHING).all()
    if exact is False or enough:
        return SampledParts(quantities, failed, False, off)
    quantities, failed = every(True)
    return SampledParts(quantities, failed, True, off)


def _width(values: Values, points: Floats) -> int:
    return int(values(points[np.newaxis]).shape[1])
