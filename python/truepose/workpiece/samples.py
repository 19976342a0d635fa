"""Sampled parts: the values of all quantities of parts that machines drawn at random make.

A sample is one machine, that goes to every point of the part. Errors are to first order where that
is enough: some samples are solved exactly too, and where a quantity differs between the two by more
than a share of its spread, all of them are. Samples are drawn some at a time, by whom does not
matter: sample number k is the same machine wherever it is drawn.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from truepose.arrays import Flags, Floats
from truepose.cluster.evaluator import Here, TaskEvaluator
from truepose.runs.divided import in_order
from truepose.workpiece.states import PartState
from truepose.workpiece.varying import Varying

CHECKED = 128
"""Samples that are solved exactly too."""

ENOUGH = 0.01
"""Share of half the 95 % interval by which first order may be off at any of them."""

NOTHING = 1e-12
"""m or rad: a difference that is none."""

NUMBERS = 1 << 20
"""Coordinates that are worked on at a time."""

SHARES, FEW = 32, 250
"""Ranges of samples at least, for workers to share, as far as each then has so many samples."""

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


@dataclass(frozen=True, eq=False)
class SampledState:
    """What is drawn: machines of a `state` with a `seed`, and the `values` of the parts of each."""

    state: PartState
    values: Values
    seed: int

    @cached_property
    def varying(self) -> Varying:
        """The variables along the path."""
        return self.state.varying(self.seed)

    def alone(self) -> SampledState:
        """The same without what is computed from it: what is sent elsewhere is small."""
        return dataclasses.replace(self, state=self.state.alone())


@dataclass(frozen=True)
class _Range:
    """Samples `first` .. `first + count`, solved exactly or not."""

    first: int
    count: int
    exact: bool


@dataclass(frozen=True, eq=False)
class _Drawn:
    """Samples of a range: their `values` (s, n_quantity), and which could be assembled (s,)."""

    values: Floats
    good: Flags


def sampled(
    of: SampledState,
    samples: int,
    evaluator: TaskEvaluator,
    exact: bool | None = None,
    account: Account | None = None,
) -> SampledParts:
    """Draw `samples` machines. `exact` None: to first order where that is enough.

    Raises as the evaluator does.
    """
    shared = of if isinstance(evaluator, Here) else of.alone()
    fair = max(FEW, -(-samples // SHARES))
    at_once = max(1, min(fair, NUMBERS // max(1, of.state.points.size)))

    def ranges(exact: bool) -> Iterator[tuple[int, _Range]]:
        for number, first in enumerate(range(0, samples, at_once)):
            yield number, _Range(first, min(at_once, samples - first), exact)

    def counted(made: Iterator[tuple[int, _Drawn]]) -> Iterator[tuple[int, _Drawn]]:
        done = 0
        for number, drawn in made:
            done += len(drawn.values)
            if account is not None:
                account(done)
            yield number, drawn

    def every(exact: bool) -> tuple[Floats, int]:
        made = list(in_order(counted(evaluator.results(_drawn, shared, ranges(exact)))))
        values = np.concatenate([drawn.values for drawn in made])
        return values, sum(int((~drawn.good).sum()) for drawn in made)

    if exact:
        values, failed = every(True)
        return SampledParts(values, failed, True, np.zeros(values.shape[1]))
    values, failed = every(False)
    count = min(CHECKED, samples)
    both = _drawn(of, _Range(0, count, True))
    off = np.abs(both.values - values[:count])[both.good].max(axis=0, initial=0.0)
    spread = 0.5 * (np.quantile(values, 0.975, axis=0) - np.quantile(values, 0.025, axis=0))
    enough = both.good.all() and (off <= ENOUGH * spread + NOTHING).all()
    if exact is False or enough:
        return SampledParts(values, failed, False, off)
    values, failed = every(True)
    return SampledParts(values, failed, True, off)


def _drawn(of: SampledState, asked: _Range) -> _Drawn:
    """The samples of a range."""
    points, values = of.state.points, of.values
    if not asked.exact:
        errors = of.state.linear_errors(of.varying, asked.first, asked.count)
        errors += points
        return _Drawn(values(errors), np.ones(asked.count, np.bool_))
    errors, good = of.state.exact_errors(of.varying, asked.first, asked.count)
    width = values(points[np.newaxis]).shape[1]
    quantities = np.full((asked.count, width), np.nan)
    if good.any():
        quantities[good] = values(points + errors[good])
    return _Drawn(quantities, good)


__all__ = ["SampledParts", "SampledState", "sampled"]
