"""A loss that a few wrong readings do not move, and the names of those readings.

Huber's loss: squared up to `HUBER` standard uncertainties, linear beyond, by weights that are found
anew from the residuals until they stay (P. J. Huber, Robust Estimation of a Location Parameter,
Ann. Math. Statist. 35 (1964) 73-101). Good readings keep almost all their weight: of a normal
distribution one in 370 lies beyond three.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from truepose.arrays import Floats
from truepose.calibration.observables import column_name

if TYPE_CHECKING:
    from truepose.calibration.identification.fit import Fit
    from truepose.calibration.identification.validate import Validation
    from truepose.calibration.measurements import Measurements
    from truepose.machine import Machine

HUBER = 3.0
"""Standard uncertainties up to which a residual counts in full."""

OUTLIER = 4.5
"""Standard deviations from which a reading is named: by chance one in 150,000."""

LEAST_FREEDOM = 0.5
"""Of readings less what they determine: below it nothing checks the stated noise."""

LOSS_ROUNDS = 50
"""Most rounds of weights; five or so do."""


def weights_of(residual: Floats) -> Floats:
    """(m,) weights of squared residuals, 1 up to `HUBER`."""
    size = np.abs(residual)
    weights: Floats = HUBER / np.maximum(size, HUBER)
    return weights


def noise_of(residual: Floats, freedom: float) -> float:
    """Scale of residuals (m,), in which those beyond `HUBER` count as that; NaN without freedom.

    `residual`: multiplied by its weights. Huber's proposal 2: one reading, however wrong, adds no
    more than `HUBER` squared (P. J. Huber, Robust Statistics (1981), 6.4).
    """
    if freedom < LEAST_FREEDOM:
        return float("nan")
    return float(np.sqrt(np.sum(residual**2) / freedom))


@dataclass(frozen=True)
class Outlier:
    """A reading that does not fit: `row` counts from 0, `line` is the file's (0: none).

    `sigmas`: its residual in standard deviations, with its sign. `held_out`: of a row that was kept
    from the fit, whose prediction adds to them. `unplaced`: of a row at whose joints the machine
    found cannot be assembled, which therefore has no residual: `sigmas` is 0.
    """

    row: int
    line: int
    instrument: str
    what: str
    sigmas: float
    held_out: bool = False
    unplaced: bool = False

    @property
    def sentence(self) -> str:
        """For people."""
        where = f"line {self.line}" if self.line else f"row {self.row}"
        if self.unplaced:
            return (
                f"{where}: {self.what} of {self.instrument} was left out, because the machine "
                "cannot be assembled where it was commanded to: look at the command"
            )
        kept = ", in a row kept from the fit" if self.held_out else ""
        size = f"{abs(self.sigmas):.3g} sigma off"
        return f"{where}: {self.what} of {self.instrument} is {size}{kept}"


def outliers(
    machine: Machine,
    fit: Fit,
    whole: Measurements | None = None,
    checked: Validation | None = None,
) -> tuple[Outlier, ...]:
    """Readings that are `OUTLIER` standard deviations or more off, the worst first.

    Before them those of rows that cannot be placed.

    `whole`: all measurements, in which rows are counted; of those kept from the fit, `checked` says
    how far they are off.
    """
    data = fit.measurements if whole is None else whole
    # A reading that the fit gives up counts by its distance from what the others say.
    kept = data.held_out[data.row] if whole is not None else np.zeros(data.n_observation, np.bool_)
    size = np.full(data.n_observation, np.nan)
    size[~kept] = fit.standardised
    if checked is not None:
        size[kept] = checked.standardised[kept]
    odd = []
    unplaced = np.zeros(data.n_observation, np.bool_)
    unplaced[~kept] = fit.unplaced[fit.measurements.row]
    for at in np.flatnonzero(unplaced | (np.abs(size) >= OUTLIER)).tolist():
        row = int(data.row[at])
        what = column_name(machine, int(data.observable[at]), int(data.strut[at]))
        name = data.instruments[int(data.instrument[row])].name
        line, sigmas = int(data.lines[row]), float(size[at])
        odd.append(Outlier(row, line, name, what, sigmas, bool(kept[at]), bool(unplaced[at])))
    return tuple(sorted(odd, key=lambda one: (not one.unplaced, -abs(one.sigmas))))
