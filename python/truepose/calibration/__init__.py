"""From measurements to a machine that may be used, or a reason why not; and least squares."""

from __future__ import annotations

from truepose.calibration.instruments import Frame, Instrument
from truepose.calibration.least_squares import Solution, Tolerances, covariance, least_squares
from truepose.calibration.measurements import Measurements
from truepose.calibration.measurements.arrays import joined, measurements_of
from truepose.calibration.measurements.read_csv import read_measurements
from truepose.calibration.measurements.write_csv import write_measurements

__all__ = [
    "Frame",
    "Instrument",
    "Measurements",
    "Solution",
    "Tolerances",
    "covariance",
    "joined",
    "least_squares",
    "measurements_of",
    "read_measurements",
    "write_measurements",
]
