"""How far a wrong reading that is not named can move the tool.

An error in a reading shows in its residual by its redundancy number r only; below a size of about
7.6 sigma / sqrt(r), the minimal detectable bias, it may go unnoticed. What such an error does to
the result is the external reliability of the measurements (W. Baarda, A testing procedure for use
in geodetic networks, Netherlands Geodetic Commission (1968)): here the largest effect at the tool,
over the workspace, of one in any single reading.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from truepose.arrays import Floats
from truepose.calibration.acceptance.tool_uncertainty import Tool
from truepose.calibration.identification.data_snooping import UNCHECKED
from truepose.calibration.identification.fit import Fit
from truepose.calibration.identification.robust import OUTLIER
from truepose.representation import Facts, Represented

POWER = 3.1
"""Standard deviations by which an error must be beyond the limit to be named in 999 of 1000."""

DETECTED = OUTLIER + POWER
"""Size of an error, in standard deviations of its own residual, that is named."""


@dataclass(frozen=True, eq=False, repr=False)
class ExternalReliability(Represented):
    """Largest effect at the tool of a wrong reading that is not named, base frame.

    `position`, m, and `rotation`, rad: at the worst pose, of the worst reading; infinite where
    something moves the tool that nothing checks, 0 where the machine does not move so.
    `minimal_detectable_bias` (m,): the size of error of each reading that is named, SI; infinite
    where nothing checks it, 0 of those that were given up.
    """

    position: float
    rotation: float
    minimal_detectable_bias: Floats

    def _facts(self) -> Facts:
        yield "position", self.position
        yield "rotation", self.rotation
        yield "readings", len(self.minimal_detectable_bias)


def external_reliability(fit: Fit, tool: Tool) -> ExternalReliability:
    """Of a fit, over the poses of `tool`; to first order, and for one wrong reading at a time."""
    counted = fit.weights > 0.0
    redundancy = fit.redundancy
    checked = counted & (redundancy > UNCHECKED)
    bias = np.where(counted, np.inf, 0.0)
    bias[checked] = DETECTED * fit.birge / np.sqrt(redundancy[checked])
    n_machine = fit.unknowns.n_machine
    gain = fit.covariance[:n_machine] @ (fit.jacobian * fit.weights[:, np.newaxis]).T
    gain /= fit.birge**2
    unchecked = gain[:, counted & ~checked & np.any(gain != 0.0, axis=0)]
    by_error = gain[:, checked] * bias[checked]
    size = {}
    for name, letters in (("position", "xyz"), ("rotation", "abc")):
        of = [number for number, component in enumerate(tool.components) if component in letters]
        largest = 0.0
        for effects in tool.effects[:, of]:  # pose by pose: all at once would be large
            squares = np.square(effects @ by_error).sum(axis=0)
            largest = max(largest, float(np.sqrt(squares.max(initial=0.0))))
            if unchecked.size and np.any(effects @ unchecked):
                largest = np.inf
        size[name] = largest
    return ExternalReliability(
        size["position"], size["rotation"], bias * fit.measurements.uncertainty
    )


__all__ = ["DETECTED", "ExternalReliability", "external_reliability"]
