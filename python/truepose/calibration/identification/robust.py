"""A loss that a few wrong readings do not move, and the names of those readings.

Huber's loss: squared up to `HUBER` standard uncertainties, linear beyond, by weights that are found
anew from the residuals until they stay (P. J. Huber, Robust Estimation of a Location Parameter,
Ann. Math. Statist. 35 (1964) 73-101). Good readings lose next to nothing: of a normal distribution
one in 370 lies beyond three.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from truepose.calibration.observables import OBSERVABLES, OF_STRUTS
from truepose.sources._base import Floats

if TYPE_CHECKING:
    from truepose.calibration.identification.fit import Fit
    from truepose.machine import Machine

HUBER = 3.0
"""Standard uncertainties up to which a residual counts in full."""

OUTLIER = 4.5
"""Standard deviations from which a reading is named: by chance one in 150,000."""

LOSS_ROUNDS = 50
"""Most rounds of weights; five or so do."""


def weights_of(residual: Floats) -> Floats:
    """(m,) weights of squared residuals, 1 up to `HUBER`."""
    size = np.abs(residual)
    weights: Floats = HUBER / np.maximum(size, HUBER)
    return weights


@dataclass(frozen=True)
class Outlier:
    """A reading that does not fit: `row` counts from 0, `line` is the file's (0: none).

    `sigmas`: its residual in standard deviations, with its sign.
    """

    row: int
    line: int
    instrument: str
    what: str
    sigmas: float

    @property
    def sentence(self) -> str:
        """For people."""
        where = f"line {self.line}" if self.line else f"row {self.row}"
        return f"{where}: {self.what} of {self.instrument} is {abs(self.sigmas):.3g} sigma off"


def outliers(machine: Machine, fit: Fit) -> tuple[Outlier, ...]:
    """Readings that are `OUTLIER` standard deviations or more off, the worst first."""
    data = fit.measurements
    # A reading that the fit gives up counts by its distance from what the others say.
    size = fit.standardised
    found = []
    for at in np.flatnonzero(np.abs(size) >= OUTLIER).tolist():
        row = int(data.row[at])
        what = OBSERVABLES[int(data.observable[at])]
        if what in OF_STRUTS:
            what = f"strut.{machine.struts[int(data.strut[at])].name}.{what}"
        name = data.instruments[int(data.instrument[row])].name
        found.append(Outlier(row, int(data.lines[row]), name, what, float(size[at])))
    return tuple(sorted(found, key=lambda each: -abs(each.sigmas)))
