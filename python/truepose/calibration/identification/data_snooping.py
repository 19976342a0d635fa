"""Which readings do not belong to the others: data snooping, iterated.

Baarda's test compares the residual of one reading with its own standard deviation, sigma sqrt(r), r
its redundancy number; several wrong ones hide behind each other and behind the scale that they
enlarge, so the worst is left out, everything is worked out anew, and what was left out is taken
back where the others turn out to agree with it (W. Baarda, A testing procedure for use in geodetic
networks, Netherlands Geodetic Commission (1968); J. J. Kok, On data snooping and multiple outlier
testing, NOAA Technical Report NOS NGS 30 (1984)). All to first order about one fit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from truepose.arrays import Flags, Floats
from truepose.calibration.identification.robust import HUBER, LEAST_FREEDOM, OUTLIER

FEW = 0.1
"""Share of the readings up to which they are given up; more are no outliers but something else."""

AT_LEAST = 3
"""So many may be given up where there are few."""

BEYOND = 3
"""So many more are left out on trial than look odd: they may have hidden behind each other."""

UNCHECKED = 1e-6
"""Redundancy numbers below this are rounding: nothing checks the reading."""


@dataclass
class _Adjustment:
    """A linear fit from which one reading after the other is taken, or to which it is given back.

    `residual`, `spread` (m,): of those that take part 1 - spread is the redundancy number; of the
    others the prediction's variance is 1 + spread, both in stated variances.
    """

    slope: Floats
    covariance: Floats
    residual: Floats
    spread: Floats
    used: Flags

    def change(self, at: int) -> None:
        """Leave a reading out, or take it back."""
        sign = 1.0 if self.used[at] else -1.0
        along = self.covariance @ self.slope[at]
        moved = self.slope @ along
        left = 1.0 - sign * self.spread[at]
        self.residual = self.residual + sign * moved * (self.residual[at] / left)
        self.covariance = self.covariance + sign * np.outer(along, along) / left
        self.spread = self.spread + sign * moved**2 / left
        self.used[at] = sign < 0.0

    def sizes(self) -> Floats:
        """(m,) residuals in their own standard deviations; 0 where nothing checks a reading."""
        left = np.where(self.used, 1.0 - self.spread, 1.0 + self.spread)
        checked = left > UNCHECKED
        noise = 1.0
        freedom = float(np.sum(1.0 - self.spread[self.used]))
        if freedom >= LEAST_FREEDOM:
            noise = max(1.0, float(np.sqrt(np.sum(self.residual[self.used] ** 2) / freedom)))
        sizes: Floats = np.abs(self.residual) / (noise * np.sqrt(np.where(checked, left, 1.0)))
        return np.where(checked, sizes, 0.0)


def given_up(slope: Floats, residual: Floats, prior: tuple[Floats, Floats], root: Floats) -> Flags:
    """(m,) readings that do not fit; none where there are too many of them for that.

    `slope` (m, n) and `residual` (m,), predicted less measured, over the stated uncertainties, NaN
    where a reading cannot be predicted, which is then not judged; `prior`: rows (k, n) of what is
    known beforehand, and their residuals (k,). `root` (n, r): directions that readings and prior
    determine, of lengths that make their equations sound: standard uncertainties.
    """
    known = np.isfinite(residual) & np.isfinite(slope).all(axis=1)
    flags = np.zeros(residual.size, np.bool_)
    flags[known] = _given_up(slope[known], residual[known], prior, root)
    return flags


def _given_up(slope: Floats, residual: Floats, prior: tuple[Floats, Floats], root: Floats) -> Flags:
    rows, off = prior
    inside, outside = slope @ root, rows @ root
    normal = inside.T @ inside + outside.T @ outside
    covariance = np.asarray(np.linalg.inv(normal), np.float64)
    step: Floats = -covariance @ (inside.T @ residual + outside.T @ off)
    spread: Floats = np.sum((inside @ covariance) * inside, axis=1)
    used = np.ones(residual.size, np.bool_)
    fit = _Adjustment(inside, covariance, residual + inside @ step, spread, used)
    most = max(AT_LEAST, int(FEW * residual.size))
    beyond = BEYOND
    while True:
        if int((~fit.used).sum()) == most + BEYOND:
            return np.zeros_like(used)
        sizes = np.where(fit.used, fit.sizes(), 0.0)
        worst = int(np.argmax(sizes))
        if sizes[worst] < HUBER:
            beyond -= 1
        if beyond < 0 or sizes[worst] == 0.0:
            break
        fit.change(worst)
    while not fit.used.all():
        sizes = np.where(fit.used, np.inf, fit.sizes())
        least = int(np.argmin(sizes))
        if sizes[least] >= OUTLIER:
            break
        fit.change(least)
    odd = ~fit.used
    return odd if odd.sum() <= most else np.zeros_like(odd)


__all__ = ["given_up"]
