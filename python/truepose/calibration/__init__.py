"""Fitting parameters to what was observed, or to what a controller's model can take."""

from __future__ import annotations

from truepose.calibration.least_squares import Solution, Tolerances, covariance, least_squares

__all__ = ["Solution", "Tolerances", "covariance", "least_squares"]
