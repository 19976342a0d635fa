"""Validation on rows that were not used: k-fold, or a set that the measurements state.

Every fold fits the others' rows, instruments' frames and all, and then says what the left-out rows
should have read; so does the machine as its file has it, with the same frames' freedom. A fit that
only follows its own noise shows here.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from truepose.calibration.identification.fit import Fit, fit
from truepose.calibration.identification.problem import Problem
from truepose.calibration.identification.robust import OUTLIER
from truepose.calibration.measurements import Measurements
from truepose.calibration.observables import UNITS
from truepose.errors import RequestError
from truepose.machine import Machine
from truepose.sources._base import Flags, Floats

FEW = 0.1
"""Share of the readings up to which those that do not fit are left out of what is counted."""

LEAST_ROWS = 4
"""Fewer rows are not divided."""


@dataclass(frozen=True, eq=False)
class Validation:
    """Residuals of rows that were not used for the fit that predicts them.

    `kind`: "folds" or "stated set"; `folds` how many. `used` (m,): which observations were
    predicted. `before`, `after` (m,): (predicted - measured) over the uncertainty, NaN where not;
    of the machine as filed and of the calibrated one.
    """

    kind: str
    folds: int
    used: Flags
    before: Floats
    after: Floats
    uncertainty: Floats
    units: tuple[str, ...]

    @property
    def rms_before(self) -> float:
        """Root mean square over the uncertainty."""
        return _rms(self.before[self.used])

    @property
    def rms_after(self) -> float:
        """Root mean square over the uncertainty: about 1 where the noise is as stated."""
        return _rms(self.after[self.used])

    def rms_in(self, unit: str) -> tuple[float, float]:
        """(before, after) root mean squares of readings of one SI unit; NaN without any."""
        mine = self.used & (np.array(self.units) == unit)
        sigma = self.uncertainty[mine]
        return _rms(self.before[mine] * sigma), _rms(self.after[mine] * sigma)


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else float("nan")


def fold_numbers(count: int, folds: int, seed: int) -> np.ndarray:
    """(count,) which fold each row is in: shuffled, as equal as can be."""
    numbers = np.arange(count) % folds
    return np.random.default_rng(seed).permutation(numbers)


def validate(
    machine: Machine,
    whole: Measurements,
    fitted: Fit,
    *,
    folds: int = 5,
    seed: int = 0,
    robust: bool = True,
) -> Validation | None:
    """Predict rows that were not used.

    `whole`: all measurements; where some are `held_out`, these are predicted by `fitted`, which did
    not use them, else every fold by the others. None where there are too few rows, or where what is
    left without a fold does not determine the unknowns.
    """
    units = tuple(UNITS[what] for what in whole.observable.tolist())
    before, after = np.full((2, whole.n_observation), np.nan)
    if whole.held_out.any():
        used = whole.held_out[whole.row]
        both = _predicted(machine, whole.select(whole.held_out), fitted)
        before[used], after[used] = both
        return Validation("stated set", 1, used, before, after, whole.uncertainty, units)
    count = min(folds, whole.n_row)
    if whole.n_row < LEAST_ROWS or count < 2:
        return None
    numbers = fold_numbers(whole.n_row, count, seed)
    for number in range(count):
        left_out = numbers == number
        try:
            others = fit(
                machine,
                whole.select(~left_out),
                fitted.unknowns,
                use_prior=fitted.use_prior,
                robust=robust,
            )
            both = _predicted(machine, whole.select(left_out), others)
        except RequestError:
            return None
        at = left_out[whole.row]
        before[at], after[at] = both
    # Readings that do not fit, where they are few, would be all that the root mean square shows.
    odd = np.abs(fitted.standardised) >= OUTLIER
    odd = odd if odd.mean() <= FEW else np.zeros_like(odd)
    used = np.isfinite(after) & ~odd
    return Validation("folds", count, used, before, after, whole.uncertainty, units)


def _predicted(machine: Machine, rows: Measurements, fitted: Fit) -> tuple[Floats, Floats]:
    """Residuals of rows that `fitted` did not see: of the machine as filed, and calibrated."""
    # The instruments stand where the fit's own rows put them: its values are relative to that.
    standing = dataclasses.replace(rows, instruments=fitted.measurements.instruments)
    problem = Problem(machine, standing, fitted.unknowns)
    return problem.residual(fitted.as_filed), problem.residual(fitted.values)
