"""Validation on rows that were not used: k-fold, or a set that the measurements state.

For every fold the other folds are fitted, the instruments' frames included, and the fit predicts
the readings of the fold's rows; so does the machine as its file has it, its instruments fitted to
the same rows. A fit that only follows the noise of its own rows is found out here.

A reading is not predicted where the other rows leave the frame, target or constant of its
instrument open, nor what was measured of a part where they say nothing of it. For every prediction
the fit states how uncertain it is.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from truepose.arrays import Flags, Floats, Indices
from truepose.calibration.identification.fit import Fit, fit
from truepose.calibration.identification.problem import IdentificationProblem
from truepose.calibration.identification.robust import OUTLIER
from truepose.calibration.measurements import Measurements
from truepose.calibration.observables import is_parameter
from truepose.errors import RequestError
from truepose.machine import Machine
from truepose.representation import Represented

FEW = 0.1
"""Share of the readings up to which those that do not fit are left out of what is counted."""

LEAST_ROWS = 4
"""Fewer rows are not divided into folds."""

CONSISTENT = 1.5
"""Up to this times what the fit promises for them, rows that were not used agree with it."""

OPEN = 1e-6
"""Share of an open direction, or of a reading's slope along it, that is not rounding."""

STATED, FOLDS = "stated set", "folds"


@dataclass(frozen=True, eq=False, repr=False)
class Validation(Represented):
    """Residuals of rows that were not used for the fit that predicts them.

    `kind`: "folds" or "stated set"; `folds` how many. `used` (m,): which observations were
    predicted and count. `before`, `after` (m,): (predicted - measured) over the uncertainty, NaN
    where not predicted; of the machine as filed and of the calibrated one. `promised` (m,):
    variance of the prediction by the calibrated one, over the uncertainty squared. `noise`: by what
    the fit multiplied the stated uncertainties, 1 or more.
    """

    kind: str
    folds: int
    used: Flags
    before: Floats
    after: Floats
    promised: Floats
    noise: float = 1.0

    @property
    def standardised(self) -> Floats:
        """(m,) `after` over what the fit promises for it, noise and prediction; NaN where not."""
        quotients: Floats = self.after / np.sqrt(self.noise**2 + self.promised)
        return quotients

    @property
    def consistent(self) -> bool:
        """Whether the errors that are left are no larger than the fit itself promises."""
        return _rms(self.standardised[self.used]) <= CONSISTENT

    @property
    def rms_before(self) -> float:
        """Root mean square over the uncertainty."""
        return _rms(self.before[self.used])

    @property
    def rms_after(self) -> float:
        """Root mean square over the uncertainty: about 1 where the noise is as stated."""
        return _rms(self.after[self.used])


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else float("nan")


def fold_numbers(instrument: Indices, folds: int, seed: int) -> Indices:
    """(n_row,) which fold each row is in: shuffled, as equal as can be, of each instrument too.

    `instrument` (n_row,): which one measured the row.
    """
    count = len(instrument)
    shuffled = np.random.default_rng(seed).permutation(np.arange(count))
    numbers = np.empty(count, np.intp)
    numbers[np.lexsort((shuffled, instrument))] = np.arange(count) % folds
    return numbers


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
    not use them, else every fold by the others, as where they are of instruments that may stand
    anywhere and so cannot be predicted. None where there are too few rows, or where what is
    left for the fit determines none of the readings.
    """
    predicted = np.full((3, whole.n_observation), np.nan)
    fitting = ~whole.held_out
    if whole.held_out.any():
        kept = whole.select(whole.held_out)
        predicted[:, whole.held_out[whole.row]] = _predicted(machine, kept, fitted)
        checked = _validation_of(STATED, 1, whole, predicted, fitted)
        if checked is not None:
            return checked
    rows = int(fitting.sum())
    count = min(folds, rows)
    if rows < LEAST_ROWS or count < 2:
        return None
    numbers = np.full(whole.n_row, -1)
    numbers[fitting] = fold_numbers(whole.instrument[fitting], count, seed)
    for number in range(count):
        left_out = numbers == number
        try:
            others = fit(
                machine,
                whole.select(fitting & ~left_out),
                fitted.unknowns,
                use_prior=fitted.use_prior,
                robust=robust,
            )
        except RequestError:  # what is left does not say enough: the others still do
            continue
        predicted[:, left_out[whole.row]] = _predicted(machine, whole.select(left_out), others)
    return _validation_of(FOLDS, count, whole, predicted, fitted)


def _validation_of(
    kind: str, folds: int, whole: Measurements, predicted: Floats, fitted: Fit
) -> Validation | None:
    """Of (3, m) residuals before and after and promised variances; None where all are NaN."""
    used: Flags = np.asarray(np.isfinite(predicted).all(axis=0))
    if not used.any():
        return None
    before, after, promised = predicted
    checked = Validation(kind, folds, used, before, after, promised, fitted.birge)
    # Readings that do not fit, where they are few, would be all that the root mean square shows.
    sizes = checked.standardised
    if kind == FOLDS:
        sizes[~whole.held_out[whole.row]] = fitted.standardised
    odd: Flags = used & (np.abs(sizes) >= OUTLIER)
    few = odd.sum() <= FEW * used.sum()
    return dataclasses.replace(checked, used=used & ~odd) if few else checked


def _predicted(machine: Machine, rows: Measurements, fitted: Fit) -> Floats:
    """(3, m) of rows that `fitted` did not see, NaN where it leaves open what they read.

    Residuals of the machine as filed and calibrated, and the variance of the latter's prediction.
    """
    # The instruments stand where the fit's own rows put them: its values are relative to that.
    standing = dataclasses.replace(rows, instruments=fitted.measurements.instruments)
    problem = IdentificationProblem(machine, standing, fitted.unknowns)
    slope = problem.jacobian(fitted.values) / rows.uncertainty[:, np.newaxis]
    promised = np.einsum("ij,jk,ik->i", slope, fitted.covariance, slope)
    residuals = np.stack(
        [problem.residual(fitted.as_filed), problem.residual(fitted.values), promised]
    )
    residuals[:, _left_open(rows, fitted, slope)] = np.nan
    return residuals


def _left_open(rows: Measurements, fitted: Fit, slope: Floats) -> Flags:
    """(m,) which readings change with what the fit leaves open of their own instrument."""
    unknowns = fitted.unknowns
    turning = slope * fitted.scale
    along = np.abs(turning @ fitted.null_space.T).max(axis=1, initial=0.0)
    changing = along > OPEN * np.linalg.norm(turning, axis=1)
    open_: Flags = np.asarray((np.abs(fitted.null_space) > OPEN).any(axis=0))
    affected = np.zeros(len(rows.instruments), np.bool_)
    for instrument, own in unknowns.frames.items():
        affected[instrument] = any(number is not None and open_[number] for number in own)
    for (instrument, _, _), number in unknowns.biases.items():
        affected[instrument] |= open_[number]
    # What nothing else says of a part is not found out by leaving out what was measured of it.
    by_itself = is_parameter(rows.observable)
    flags: Flags = changing & (affected[rows.instrument[rows.row]] | by_itself)
    return flags
