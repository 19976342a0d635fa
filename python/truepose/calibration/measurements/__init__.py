"""Measurements: their form, reading and writing their files, making them from arrays."""

from truepose.calibration.measurements.measurements import Measurements

__all__ = ["Measurements"]
