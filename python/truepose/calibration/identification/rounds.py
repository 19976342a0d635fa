"""The rounds of a robust fit: solved, weighed anew from what is left, until nothing changes.

A round may find that the search does not settle. Then, in this order: rows at which the machine
cannot be assembled on the way lose their weight; what the first solution began to see is held
again; directions that are seen too faintly for a search to follow them are held.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from truepose.arrays import Flags, Floats
from truepose.calibration.identification.approach import approach, rows_in_the_way
from truepose.calibration.identification.data_snooping import FEW, given_up
from truepose.calibration.identification.equations import (
    EXACT,
    FAINT,
    SETTLED,
    Equations,
    no_fit,
    whitened_jacobian,
)
from truepose.calibration.identification.problem import IdentificationProblem, Prior, Solved
from truepose.calibration.identification.robust import noise_of, weights_of

SNOOPINGS = 10
"""Most times that it is asked which readings to give up; two or three do."""

SAME = 1e-3
"""A scale by this share, and weights by this much, are those of the round before."""

FOLLOWED = 1.01
"""The sum of squares, worked out afresh, is no larger than this times that of the search."""

Hold = tuple[Callable[[Equations], Floats], Callable[[Equations], Floats]]
"""Of equations: the rows that hold what is not determined, and the directions that count as it."""


class Rounds:
    """Where the fit stands after a round.

    `values` (n,), `slope` (m, n) whitened derivatives and `residual` (m,) there, `weights` (m,) and
    `scale` of the next round, `equations` of this, `leverage` (m,), `noise`, `in_the_way` (n_row,)
    rows that cannot be placed, `evaluations` so far.
    """

    def __init__(
        self,
        problem: IdentificationProblem,
        prior: Prior,
        slope: Floats,
        equations: Equations,
        extent: Floats,
        *,
        robust: bool,
    ) -> None:
        """At the machine as filed, its `slope` (m, n) and `equations`, tolerances included.

        `extent` (n,): what an unknown is small against.
        """
        self._problem, self._prior, self._robust = problem, prior, robust
        self._unknowns, self._row = problem.unknowns, problem.measurements.row
        m = problem.measurements.n_observation
        self.values, self.slope, self.equations = self._unknowns.prior_mean, slope, equations
        self.residual = self.leverage = np.zeros(m)
        self.weights, self.scale, self.noise = np.ones(m), 1.0, float("nan")
        self.in_the_way: Flags = np.zeros(problem.measurements.n_row, np.bool_)
        self.evaluations = 0
        self._counted, self._factor = np.ones(m, np.bool_), self.weights
        self._pardoned, self._snooped, self._same = False, 0, True
        self._freed: Floats = np.empty((0, self._unknowns.count))
        self._left_out: Floats | None = None
        self._firmer: Iterator[Hold] = _firmer_holds(extent)
        self._holding: Callable[[Equations], Floats] = Equations.gauge_rows
        if robust:
            self._approach()
        self._begin = self.values

    def _approach(self) -> None:
        """The first steps, on which readings that are far off lead nowhere."""
        held = self._prior.with_rows(self.equations.gauge_rows())
        near = approach(self._problem, held, self.values, self._counted)
        self.values, self.evaluations = near.values, near.evaluations
        self.in_the_way = self._problem.status(self.values) != 0
        self._counted = ~self.in_the_way[self._row]
        self.weights = near.weights * self._counted

    def settle(self, most: int) -> None:
        """At most so many rounds.

        Raises `RequestError` (no-fit) where the search does not settle, whatever is held.
        """
        for _ in range(most):
            held = self._prior.with_rows(self._holding(self.equations))
            solved = self._problem.solve(
                prior=held, weights=self.weights / self.scale**2, start=self.values
            )
            self.evaluations += solved.evaluations[0]
            jacobian = self._problem.jacobian(solved.values[0])
            settled = self._settled(solved) and self._is_followed(held, solved)
            usable = settled and bool(np.isfinite(jacobian[self._counted]).all())
            if not usable and self._retreats(held, solved):
                continue
            if not settled:
                ending = f"it ended as {solved.ending[0]}"
                if self._settled(solved):
                    ending = "it ended in another assembly mode"
                raise no_fit(self._problem, ending, np.empty(0, np.intp))
            self._arrive(solved.values[0], jacobian)
            if self._stays():
                return

    def _settled(self, solved: Solved) -> bool:
        # Readings that fit to the last digit leave nothing that a step could be judged by.
        exact = solved.cost[0] < EXACT**2 * self._problem.measurements.n_observation
        return bool(solved.ending[0] in SETTLED or exact)

    def _is_followed(self, held: Prior, solved: Solved) -> bool:
        """Whether the machine found, assembled afresh, reads what the search ended with.

        A search along what nothing determines may carry poses over into another assembly mode.
        """
        residual = self._problem.residual(solved.values[0])
        known = np.isfinite(residual) & (self.weights > 0.0)
        squares = (self.weights[known] / self.scale**2) @ residual[known] ** 2
        away = held.rows @ (solved.values[0] - held.mean)
        return bool(squares + away @ away <= FOLLOWED * solved.cost[0] + EXACT)

    def _retreats(self, held: Prior, solved: Solved) -> bool:
        """Whether something could be held or left out, of a search that cannot be used."""
        if self._robust and self._clears_the_way(held, solved.values[0]):
            return True
        if not self._same and self._left_out is None:
            # What the first solution begins to see is seen too little to be followed.
            self._left_out = self._freed
        elif (firmer := next(self._firmer, None)) is not None:
            self._holding, faint = firmer
            self._left_out = faint(self.equations)
        else:
            return False
        # From where none of it was free yet: what is held is held as the drawing has it.
        self.values = self._begin
        self._set_equations()
        return True

    def _clears_the_way(self, held: Prior, values: Floats) -> bool:
        """Whether a few rows at which no machine can be assembled on the way lost their weight."""
        weights = self.weights / self.scale**2
        ahead = rows_in_the_way(self._problem, held, values, weights)
        most = max(1, FEW * ahead.size)
        if not ahead.any() or (self.in_the_way | ahead).sum() > most:
            return False
        self.in_the_way = self.in_the_way | ahead
        self._counted = self._counted & ~ahead[self._row]
        self.weights, self.values = self.weights * self._counted, values
        return True

    def _set_equations(self) -> None:
        rows = self._factor[:, np.newaxis] * self.slope
        self.equations = Equations.of(rows, self._prior, self._unknowns, self._left_out)

    def _arrive(self, values: Floats, jacobian: Floats) -> None:
        """Everything that is known about the solution of a round."""
        self.values = values
        residual = self._problem.residual(values)
        self.slope = whitened_jacobian(self._problem, values, jacobian, self._counted)
        # Rows that only the way there could not pass count again, once.
        missing = self._problem.status(values) != 0
        back = self.in_the_way & ~missing & (not self._pardoned)
        self._pardoned |= bool(self.in_the_way.any())
        self.in_the_way = (self.in_the_way | missing) & ~back
        self._counted = (self._counted | back[self._row]) & ~self.in_the_way[self._row]
        self._freed = self.equations.null_space * self.equations.scale
        self._factor = np.sqrt(self.weights) / self.scale
        self._set_equations()
        of_itself = np.square(self.slope @ self.equations.root).sum(axis=1)
        self.leverage = of_itself * self._factor**2
        self.residual = np.where(self.in_the_way[self._row], 0.0, residual)
        freedom = float(np.sum((1.0 - self.leverage)[self.weights > 0.0]))
        self.noise = noise_of(self.weights * self.residual, freedom)

    def _stays(self) -> bool:
        """Whether weights and scale are those of the round; if not, they are changed."""
        larger = max(1.0, self.noise) if np.isfinite(self.noise) else 1.0
        changed = self._weighed(larger)
        # What nothing saw at the start may be seen where the machine really is.
        self._same = len(self.equations.null_space) == len(self._freed)
        stays = (
            self._same
            and abs(larger / self.scale - 1.0) < SAME
            and bool(np.abs(changed - self.weights).max() < SAME)
        )
        # At once the first time: with many unknowns gross errors raise the scale round by round,
        # until they no longer look like any.
        if stays or not self._snooped:
            kept = self._snoop()
            if stays and (kept is None or np.array_equal(kept, self._counted)):
                return True
            if kept is not None:
                self._counted = kept
                changed = self._weighed(larger)
        self.weights, self.scale = changed, larger
        return False

    def _weighed(self, scale: float) -> Floats:
        return weights_of(self.residual / scale) * self._counted if self._robust else self.weights

    def _snoop(self) -> Flags | None:
        """(m,) readings that belong to the others; None where it was asked often enough."""
        if not self._robust or self._snooped == SNOOPINGS:
            return None
        self._snooped += 1
        judged = ~self.in_the_way[self._row]
        away = self._prior.rows @ (self.values - self._prior.mean)
        kept = judged.copy()
        kept[judged] = ~given_up(
            self.slope[judged], self.residual[judged], (self._prior.rows, away), self.equations.root
        )
        return kept


def _firmer_holds(extent: Floats) -> Iterator[Hold]:
    """What to try in turn where a search does not settle, the slightest change first."""
    for own_scale in (True, False):
        for share in FAINT:
            yield (
                partial(Equations.gauge_rows, extent=extent, own_scale=own_scale),
                partial(Equations.faint, extent=extent, share=share),
            )


__all__ = ["Rounds"]
