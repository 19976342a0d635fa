"""Laws of calibration, for every machine and every kind of instrument."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import truepose as tp
from build_machine import machine_files
from calibration_under_test import CalibrationUnderTest, kinds_for
from made_measurements import nominal_values
from sweeps import one_a_machine, thinned
from truepose.calibration.identification.problem import IdentificationProblem, Prior
from truepose.sources import DimensionalTolerance

MACHINES = {path.stem: tp.load(path) for path in machine_files()}
CASES = [(name, kind) for name, machine in MACHINES.items() for kind in kinds_for(machine)]


@pytest.fixture(
    params=thinned(CASES, one_a_machine(CASES)), ids=lambda case: f"{case[0]}-{case[1]}"
)
def case(request: pytest.FixtureRequest) -> CalibrationUnderTest:
    """A machine and an instrument."""
    name, kind = request.param
    return CalibrationUnderTest(MACHINES[name], kind)


def test_the_machine_as_filed_reads_what_plain_numpy_says(case: CalibrationUnderTest) -> None:
    """Two roads to every reading: the kernel's, and NumPy's from placements and joint centres."""
    # Cold and unloaded: without the sources that know better than the geometry.
    tolerances = tuple(
        each for each in case.machine.sources if isinstance(each, DimensionalTolerance)
    )
    plain = dataclasses.replace(case.machine, sources=tolerances)
    problem = IdentificationProblem(plain, case.problem.measurements, case.unknowns)
    expected = nominal_values(plain, case.problem.measurements)
    assert np.abs(problem.predict(np.zeros(case.unknowns.count)) - expected).max() < 1e-11


def test_derivatives_equal_central_differences(case: CalibrationUnderTest) -> None:
    random = np.random.default_rng(case.seed)
    problem, unknowns = case.problem, case.unknowns
    values = case.truth(random, 0.5)
    jacobian = problem.jacobian(values)
    # Where parts are strained, how they share a misfit out changes with it: second order, left out.
    within = 1e-3 if case.machine.kernel.overconstrained else 2e-6
    for number in random.permutation(unknowns.count)[:12].tolist():
        step = np.zeros(unknowns.count)
        step[number] = 1e-5
        ahead, behind = problem.predict(values + step), problem.predict(values - step)
        slope = (ahead - behind) / 2e-5
        scale = 1.0 + np.abs(jacobian[:, number]).max()
        assert np.abs(slope - jacobian[:, number]).max() < within * scale, unknowns.names[number]


def test_without_noise_the_truth_comes_back(case: CalibrationUnderTest) -> None:
    """All that the readings determine, to 3e-9 of the machine's size; nothing else moves.

    The weakest direction that they see takes rounding of 1e-16 m to 1.7e-9 in the linear algebra of
    some processors, to 0.8e-9 in that of others.
    """
    random = np.random.default_rng(case.seed)
    problem, unknowns = case.problem, case.unknowns
    equations = case.equations(use_prior=False)
    # Machines that the gauge rule picks: nothing along what no reading sees.
    away = (case.truth(random) - unknowns.prior_mean) / equations.scale
    away -= equations.null_space.T @ (equations.null_space @ away)
    truth = unknowns.prior_mean + equations.scale * away
    prior = Prior(equations.gauge_rows(), unknowns.prior_mean)
    solved = problem.solve(problem.predict(truth), prior=prior)
    # Tolerances are some ten micrometres wide: this is some millionths of them, or less.
    size = np.where(np.array(unknowns.units) == "m", case.machine.characteristic_length, 1.0)
    assert (np.abs(solved.values[0] - truth) < 3e-9 * size).all()
    misfit = problem.predict(solved.values[0]) - problem.predict(truth)
    assert np.abs(misfit / problem.measurements.uncertainty).max() < 1e-8
