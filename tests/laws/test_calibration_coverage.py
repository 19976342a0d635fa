"""Stated uncertainties are true: 1000 calibrations of 1000 machines, with every instrument.

Each time another machine within the tolerances is measured with fresh noise. The 95 % intervals
must hold the truth in 95 % of them, within what chance allows, and the residuals must have the
variance that was stated. The seeds are the machines' and instruments' own.
"""

from __future__ import annotations

import numpy as np
import pytest

import truepose as tp
from build_machine import machine_files
from calibration_under_test import CalibrationUnderTest, kinds_for
from sweeps import long_member, one_a_machine, thinned
from truepose.calibration.identification.equations import SETTLED
from truepose.calibration.identification.problem import Prior

SETS = 1000
LEVEL, QUANTILE = 0.95, 1.959963984540054
CHANCE = 5.0
"""Standard deviations: some 7000 intervals are looked at, of which chance lets 0.004 be farther."""

MACHINES = {path.stem: tp.load(path) for path in machine_files()}
CASES = [(name, kind) for name, machine in MACHINES.items() for kind in kinds_for(machine)]


QUICK = one_a_machine(CASES)
OFTEN = [case for at, case in enumerate(CASES) if case in QUICK or at % 5 == 0]
"""Every kind of instrument on several machines, every machine with several."""
OTHERS = [long_member(case) for case in CASES if case not in OFTEN]


@pytest.mark.parametrize("machine_and_kind", [*thinned(OFTEN, QUICK), *OTHERS], ids="-".join)
def test_intervals_hold_the_truth_as_often_as_they_say(machine_and_kind: tuple[str, str]) -> None:
    name, kind = machine_and_kind
    case = CalibrationUnderTest(MACHINES[name], kind, rows=8)
    random = np.random.default_rng(case.seed)
    problem, unknowns = case.problem, case.unknowns
    equations = case.equations(use_prior=True)
    assert len(equations.null_space) == 0
    truth = np.array([case.truth(random) for _ in range(SETS)])
    read = np.array([problem.predict(values) for values in truth])
    sigma = problem.measurements.uncertainty
    read += sigma * random.standard_normal(read.shape)

    solved = problem.solve(read)

    assert set(solved.ending) <= set(SETTLED)
    deviations = np.sqrt(np.diagonal(equations.covariance))
    inside = np.abs(solved.values - truth) <= QUANTILE * deviations
    limit = CHANCE * np.sqrt(LEVEL * (1.0 - LEVEL) / SETS)
    assert np.abs(inside.mean(axis=0) - LEVEL).max() < limit

    # All equations less all unknowns are left over: of the readings, and of what was known.
    freedom = read.shape[1] + int(unknowns.has_prior.sum()) - unknowns.count
    if freedom:
        assert abs(solved.cost.mean() / freedom - 1.0) < CHANCE * np.sqrt(2.0 / freedom / SETS)

    slope = problem.jacobian(unknowns.prior_mean) / sigma[:, np.newaxis]
    leverage = np.einsum("ij,jk,ik->i", slope, equations.covariance, slope)
    residual = np.array([problem.predict(values) for values in solved.values]) - read
    free = leverage < 0.99  # a reading that alone determines something has no residual
    variance = np.mean((residual / sigma) ** 2, axis=0)[free] / (1.0 - leverage[free])
    assert np.abs(variance - 1.0).max(initial=0.0) < CHANCE * np.sqrt(2.0 / SETS)


def test_intervals_without_priors_hold_the_truth_as_often_as_they_say() -> None:
    """The readings alone: what they determine, of a planar machine seen by a tracker."""
    case = CalibrationUnderTest(MACHINES["planar_crossed"], "position", rows=20)
    random = np.random.default_rng(case.seed)
    problem, unknowns = case.problem, case.unknowns
    equations = case.equations(use_prior=False)
    away = np.array([case.truth(random) for _ in range(SETS)]) - unknowns.prior_mean
    away /= equations.scale
    away -= away @ equations.null_space.T @ equations.null_space
    truth = unknowns.prior_mean + equations.scale * away
    read = np.array([problem.predict(values) for values in truth])
    read += problem.measurements.uncertainty * random.standard_normal(read.shape)
    prior = Prior(equations.gauge_rows(), unknowns.prior_mean)
    solved = problem.solve(read, prior=prior)
    deviations = np.sqrt(np.diagonal(equations.covariance))
    seen = deviations > 1e-6 * equations.scale
    inside = (np.abs(solved.values - truth) <= QUANTILE * deviations)[:, seen]
    limit = CHANCE * np.sqrt(LEVEL * (1.0 - LEVEL) / SETS)
    assert np.abs(inside.mean(axis=0) - LEVEL).max() < limit
