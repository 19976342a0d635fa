"""SciPy's `least_squares` finds the same optimum of the same calibration.

SciPy's Levenberg-Marquardt (MINPACK) gets the residuals, of readings and of what was known
beforehand, and their derivatives, which tests/laws/test_calibration.py holds against differences;
and once more the residuals alone, of which it then takes three-point differences.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import least_squares

import truepose as tp
from build_machine import machine_files
from calibration_under_test import CalibrationUnderTest
from truepose.calibration.identification.problem import Prior

MACHINES = {path.stem: path for path in machine_files()}
CASES = (
    ("hexapod", "pose"),
    ("linear_delta", "position"),
    ("hexaglide", "distance"),
    ("tricept", "strut-length"),
    ("3rrr", "joint-angle"),
)


@pytest.mark.parametrize(("name", "kind"), CASES)
def test_scipy_finds_the_same_optimum(name: str, kind: str) -> None:
    case = CalibrationUnderTest(tp.load(MACHINES[name]), kind, rows=15)
    random = np.random.default_rng(case.seed)
    problem, unknowns = case.problem, case.unknowns
    sigma = problem.measurements.uncertainty
    read = problem.predict(case.truth(random)) + sigma * random.standard_normal(sigma.size)
    prior = Prior.of(unknowns)
    ours = problem.solve(read).values[0]
    # In standard deviations, as one would hand it to a solver that knows nothing of units.
    scale = case.equations(use_prior=True).scale

    def residual(scaled: np.ndarray) -> np.ndarray:
        values = prior.mean + scale * scaled
        return np.concatenate(
            [(problem.predict(values) - read) / sigma, prior.rows @ (values - prior.mean)]
        )

    def slope(scaled: np.ndarray) -> np.ndarray:
        values = prior.mean + scale * scaled
        return np.vstack([problem.jacobian(values) / sigma[:, np.newaxis], prior.rows]) * scale

    theirs = least_squares(
        residual, np.zeros(unknowns.count), slope, method="lm", xtol=1e-15, ftol=1e-15, gtol=1e-15
    ).x
    found = (ours - prior.mean) / scale
    # The parameters themselves, relative to the machine; frames relative to a metre, a radian.
    size = np.where(np.array(unknowns.units) == "m", case.machine.characteristic_length, 1.0)
    assert (np.abs(ours - prior.mean - scale * theirs) < 1e-9 * size).all()
    # Where readings leave much open SciPy stops earlier, when the sum of squares no longer falls;
    # one more linear step, not judged by that sum, and it is where we are.
    last = np.linalg.lstsq(slope(theirs), -residual(theirs), rcond=None)[0]
    assert np.abs(last).max() < 1e-5
    assert np.abs(found - theirs - last).max() < 1e-9 * np.abs(found).max()
    # No worse a point with derivatives that SciPy works out itself.
    alone = least_squares(residual, np.zeros(unknowns.count), "3-point")
    assert residual(found) @ residual(found) <= 2.0 * alone.cost * (1.0 + 1e-9)
