"""One to three readings that are wrong: named, given up, and the machine found as without them."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from numpy.typing import NDArray

import truepose as tp
from build_machine import machine_files
from made_blunders import good
from made_measurements import made_measurements, poses_within
from sweeps import thinned
from truepose.calibration.acceptance.tool_uncertainty import Tool, tool_components
from truepose.calibration.identification.fit import fit
from truepose.calibration.identification.problem import IdentificationProblem
from truepose.calibration.identification.reliability import DETECTED, external_reliability
from truepose.calibration.identification.robust import outliers
from truepose.calibration.identification.tool_effects import tool_effects
from truepose.calibration.identification.unknowns import Unknowns, unknowns_of
from truepose.calibration.measurements import Measurements
from truepose.machine import Machine

Floats = NDArray[np.float64]
FILES = {path.stem: path for path in machine_files()}
WIDE = 5e-3

CASES = [
    ("hexapod", "position"),
    ("linear_delta", "position"),
    ("linear_delta", "pose"),
    ("3prs", "position"),
    ("3prs", "pose"),
    ("hexaglide", "position"),
    ("orthoglide", "position"),
    ("orthoglide", "pose"),
    ("five_bar", "position"),
    ("tricept", "position"),
]


def widened(unknowns: Unknowns, half: float = WIDE) -> Unknowns:
    """Every tolerance of a length +-5 mm, whatever the drawing says."""
    lengths = unknowns.has_prior & (np.array(unknowns.units) == "m")
    variances = np.diagonal(unknowns.prior_covariance).copy()
    variances[lengths] = half**2 / 3.0
    return dataclasses.replace(
        unknowns,
        half=np.where(lengths, half, unknowns.half),
        prior_covariance=np.diag(variances),
    )


def drawn(
    name: str, kind: str, random: np.random.Generator
) -> tuple[Machine, Measurements, Unknowns, Floats]:
    """Thirty readings, with noise, of a machine drawn within its wide tolerances."""
    machine = tp.load(FILES[name])
    data = made_measurements(machine, kind, poses_within(machine, 30, seed=3), values="nominal")
    unknowns = widened(unknowns_of(machine, data))
    problem = IdentificationProblem(machine, data, unknowns)
    for _ in range(50):
        truth = np.where(unknowns.has_prior, unknowns.half, 0.0)
        truth = truth * random.uniform(-1.0, 1.0, unknowns.count)
        read = problem.predict(truth)
        if np.isfinite(read).all():
            break
    read += data.uncertainty * random.standard_normal(read.size)
    return machine, data.with_values(read), unknowns, truth


def redundancy_numbers(data: Measurements, unknowns: Unknowns, slope: Floats) -> Floats:
    """Diagonal of I less the hat matrix, of readings over uncertainties with the tolerances."""
    rows = slope / data.uncertainty[:, np.newaxis]
    prior = np.diag(1.0 / np.sqrt(np.diagonal(unknowns.prior_covariance)))
    left = np.linalg.qr(np.vstack([rows, prior]))[0][: len(rows)]
    redundancy: Floats = 1.0 - np.square(left).sum(axis=1)
    return redundancy


@pytest.mark.parametrize("seed", thinned(range(6), quick={0, 1}))
@pytest.mark.parametrize(("name", "kind"), CASES)
def test_one_reading_off_by_10_mm_moves_nothing(name: str, kind: str, seed: int) -> None:
    random = np.random.default_rng(seed)
    machine, good, unknowns, _ = drawn(name, kind, random)
    at = int(random.choice(np.flatnonzero(good.observable < 3)))
    values = good.value.copy()
    values[at] += 10e-3 * random.choice([-1.0, 1.0])
    bad = good.with_values(values)
    found, clean = fit(machine, bad, unknowns), fit(machine, good, unknowns)
    (odd,) = outliers(machine, found)
    assert (odd.row, odd.what) == (int(bad.row[at]), "xyz"[bad.observable[at]])
    assert np.flatnonzero(found.weights == 0.0).tolist() == [at]
    # As if the reading were not there: of far less weight it gives the same machine, but that it
    # then counts as one more by which the noise is judged.
    faint = good.uncertainty.copy()
    faint[at] *= 1e6
    without = fit(machine, good.with_values(good.value, faint), unknowns)
    np.testing.assert_allclose(
        found.values / without.deviations, without.values / without.deviations, atol=5e-2
    )
    assert np.abs((found.values - clean.values) / clean.deviations).max() < 4.0


@pytest.mark.parametrize("sets", [pytest.param(6, id="few"), *thinned([60], quick=set())])
@pytest.mark.parametrize(
    ("name", "kind"), [("orthoglide", "position"), ("3prs", "position"), ("five_bar", "position")]
)
def test_one_to_three_wrong_readings_are_named_and_no_other(
    name: str, kind: str, sets: int
) -> None:
    """Each off by 7.6 of what its own residual scatters by: none hides another."""
    random = np.random.default_rng(17)
    missed, wrongly = 0, 0
    for number in range(sets):
        machine, good, unknowns, truth = drawn(name, kind, random)
        slope = IdentificationProblem(machine, good, unknowns).jacobian(truth)
        redundancy = redundancy_numbers(good, unknowns, slope)
        checked = np.flatnonzero(redundancy > 1e-3)
        wrong = random.choice(checked, 1 + number % 3, replace=False)
        values = good.value.copy()
        off = DETECTED * good.uncertainty[wrong] / np.sqrt(redundancy[wrong])
        values[wrong] += off * random.choice([-1.0, 1.0], wrong.size)
        found = fit(machine, good.with_values(values), unknowns)
        named = np.flatnonzero(found.weights == 0.0)
        missed += not np.isin(wrong, named).all()
        wrongly += not np.isin(named, wrong).all()
    assert missed <= 0.01 * sets + 3.0 * np.sqrt(0.01 * 0.99 * sets)
    assert wrongly <= 0.01 * sets + 3.0 * np.sqrt(0.01 * 0.99 * sets)


def test_the_fit_states_the_redundancy_number_of_each_reading() -> None:
    machine, good, unknowns, _ = drawn("orthoglide", "position", np.random.default_rng(2))
    found = fit(machine, good, unknowns)
    slope = found.problem.jacobian(found.values) / found.birge
    expected = redundancy_numbers(good, unknowns, slope)
    np.testing.assert_allclose(found.redundancy, expected, rtol=1e-4)
    # And of a reading that was given up what it would have, did it count.
    values = good.value.copy()
    values[4] += 10e-3
    odd = fit(machine, good.with_values(values), unknowns)
    assert odd.weights[4] == 0.0
    np.testing.assert_allclose(odd.redundancy[4], expected[4], rtol=0.05)


def test_many_readings_that_do_not_fit_are_not_given_up() -> None:
    """A fifth of them off is no handful of slips: it is said by the size of the residuals."""
    random = np.random.default_rng(4)
    machine, good, unknowns, _ = drawn("hexaglide", "pose", random)
    values = good.value.copy()
    wrong = random.choice(values.size, values.size // 4, replace=False)
    values[wrong] += 30.0 * good.uncertainty[wrong] * random.standard_normal(wrong.size)
    found = fit(machine, good.with_values(values), unknowns)
    assert (found.weights > 0.0).all()
    assert found.noise > 1.5


def test_a_row_that_cannot_be_placed_loses_its_weight_and_is_named() -> None:
    """Typed joints at the end of the five-bar's reach; its rods are shorter than drawn."""
    machine = tp.load(FILES["five_bar"])
    data = made_measurements(machine, "position", poses_within(machine, 25, seed=3))
    low, high = 0.0, 0.0
    start, turned = data.joints[7], np.array([1.0, 0.0])
    for step in np.linspace(0.0, 2.0, 400):
        if machine.kernel.forward(start + step * turned, status=True)[1] != 0:
            high = step
            break
        low = step
    for _ in range(40):
        middle = 0.5 * (low + high)
        reached = machine.kernel.forward(start + middle * turned, status=True)[1] == 0
        low, high = (middle, high) if reached else (low, middle)
    joints = data.joints.copy()
    joints[7] += (low - 1e-6) * turned
    pose = machine.kernel.forward(joints[7:8])
    placements = data.placements.copy()
    placements[7] = machine.kernel.placement_of(pose)[0]
    typed = dataclasses.replace(data, joints=joints, placements=placements)
    unknowns = widened(unknowns_of(machine, data))
    truth = np.zeros(unknowns.count)
    lengths = [number for number, name in enumerate(unknowns.names) if name.endswith(".length")]
    truth[lengths] = -2e-3
    read = IdentificationProblem(machine, data, unknowns).predict(truth)
    read += data.uncertainty * np.random.default_rng(3).standard_normal(read.size)
    assert IdentificationProblem(machine, typed, unknowns).status(truth)[7] != 0
    bad, good = typed.with_values(read), data.with_values(read)
    found = fit(machine, bad, unknowns)
    assert np.flatnonzero(found.unplaced).tolist() == [7]
    named = outliers(machine, found)
    assert {one.row for one in named} == {7}
    assert all("cannot be assembled" in one.sentence for one in named)
    others = fit(machine, good.select(np.arange(25) != 7), unknowns)
    np.testing.assert_allclose(found.values, others.values, atol=0.05 * others.deviations.min())


def tool_of(machine: Machine, unknowns: Unknowns, values: Floats) -> tuple[Tool, Floats]:
    """The tool's sensitivity at 25 poses, and the positions there."""
    poses = poses_within(machine, 25, seed=9)
    at = tool_effects(machine, unknowns, values, poses)
    return Tool.of(at.effects, tool_components(machine), at.positions), at.effects


def test_external_reliability_is_the_largest_effect_of_an_error_not_named() -> None:
    """By linear least squares in NumPy, one reading after the other moved by what is detected."""
    machine, good, unknowns, _ = drawn("orthoglide", "position", np.random.default_rng(5))
    found = fit(machine, good, unknowns)
    tool, effects = tool_of(machine, unknowns, found.values)
    stated = external_reliability(found, tool)
    noise = found.birge * good.uncertainty
    rows = found.problem.jacobian(found.values) / noise[:, np.newaxis]
    prior = np.diag(1.0 / np.sqrt(np.diagonal(unknowns.prior_covariance)))
    weights = np.sqrt(found.weights)
    every = np.vstack([weights[:, np.newaxis] * rows, prior])
    inverse = np.linalg.pinv(every)
    redundancy = 1.0 - np.diagonal(every @ inverse)[: len(rows)]
    largest = 0.0
    for at in range(len(rows)):
        off = np.zeros(len(every))
        off[at] = weights[at] * DETECTED / np.sqrt(redundancy[at])
        largest = max(largest, np.linalg.norm(effects[:, :3] @ (inverse @ off), axis=1).max())
    np.testing.assert_allclose(stated.position, largest, rtol=1e-3)
    bias = DETECTED * noise / np.sqrt(redundancy)
    np.testing.assert_allclose(stated.minimal_detectable_bias, bias, rtol=1e-3)


@pytest.mark.parametrize("sets", [pytest.param(12, id="few"), *thinned([150], quick=set())])
@pytest.mark.parametrize("name", ["orthoglide", "five_bar"])
def test_the_tool_is_within_what_is_stated_and_what_a_reading_may_do_unnamed(
    name: str, sets: int
) -> None:
    """One reading off, by anything up to half as much again as is detected, named or not."""
    random = np.random.default_rng(23)
    outside = 0.0
    for _ in range(sets):
        machine, good, unknowns, truth = drawn(name, "position", random)
        slope = IdentificationProblem(machine, good, unknowns).jacobian(truth)
        redundancy = redundancy_numbers(good, unknowns, slope)
        at = int(random.choice(np.flatnonzero(redundancy > 1e-3)))
        values = good.value.copy()
        off = DETECTED * good.uncertainty[at] / np.sqrt(redundancy[at])
        values[at] += random.uniform(-1.5, 1.5) * off
        found = fit(machine, good.with_values(values), unknowns)
        tool, effects = tool_of(machine, unknowns, found.values)
        of_position = [tool.components.index(axis) for axis in "xyz" if axis in tool.components]
        effects = effects[:, of_position]
        # Where the tool really is, not to first order.
        at_poses = made_measurements(machine, "position", poses_within(machine, 25, seed=9))
        shown = IdentificationProblem(machine, at_poses, unknowns)
        error = shown.predict(found.values) - shown.predict(truth)
        error = np.linalg.norm(error.reshape(25, -1), axis=1)
        assert len(effects) == 25
        root = np.linalg.cholesky(found.covariance + 1e-18 * np.eye(unknowns.count))
        scatter = effects @ root @ random.standard_normal((unknowns.count, 2000))
        stated = np.quantile(np.linalg.norm(scatter, axis=1), 0.95, axis=1)
        further = external_reliability(found, tool).position
        outside += float(np.mean(error > stated + further))
    assert outside <= 0.05 * sets + 3.0 * np.sqrt(0.05 * 0.95 * sets)


@pytest.mark.parametrize("name", ["hexapod", "rotary_delta"])
def test_without_tolerances_gross_errors_do_not_raise_the_scale_until_they_are_none(
    name: str,
) -> None:
    """Six of 120 readings off by 0.3 to 10 mm; what is left scatters as it is stated to."""
    m = tp.load(FILES[name])
    frame = "base" if name == "hexapod" else "unknown"
    data = good(m, "position", seed=3, count=40, frame=frame)
    random = np.random.default_rng(0)
    at = random.choice(data.n_observation, 6, replace=False)
    value = data.value.copy()
    value[at] += random.choice([-1, 1], 6) * random.uniform(0.3e-3, 10e-3, 6)
    spoilt = data.with_values(value)
    fitted = fit(m, spoilt, unknowns_of(m, spoilt), use_prior=False)
    assert np.flatnonzero(fitted.weights == 0.0).tolist() == sorted(at.tolist())
    assert fitted.noise < 1.5
