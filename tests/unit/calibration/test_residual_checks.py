"""Residuals that are not noise are named, with their size."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

import truepose as tp
from build_machine import MACHINES
from made_blunders import column, drawn, elsewhere, good, shown, with_noise
from made_measurements import made_measurements, poses_within
from truepose.calibration.calibrate import Calibration, calibrate
from truepose.calibration.data_checks import Suspicion
from truepose.calibration.measurements import Measurements
from truepose.calibration.observables import OBSERVABLES
from truepose.calibration.residual_checks import CODES, scale
from truepose.calibration.residual_checks._base import Left, ResidualsView
from truepose.machine import Machine
from truepose.probability.f_distribution import f_tail

Floats = NDArray[np.float64]
ROWS, BUMPED_AT = 40, 22
NAMES = ("hexapod", "linear_delta", "3rrr")


@functools.cache
def machine(name: str) -> Machine:
    return tp.load(MACHINES / f"{name}.toml")


def bumped(name: str, kind: str, size: float, seed: int = 1) -> Measurements:
    """Readings of an instrument that was moved by `size`, m, along its frame's x after a row."""
    m = machine(name)
    made = made_measurements(
        m, kind, poses_within(m, ROWS, seed), frame="unknown", values="nominal"
    )
    actual = drawn(m, seed)
    there = elsewhere(made.instruments[0], [size, 0.0, 0.0], [0.0, 0.0, 0.0])
    late = made.row >= BUMPED_AT
    value = np.where(late, shown(m, actual, made, there), shown(m, actual, made))
    return with_noise(made, value, seed)


def patterns(answer: Calibration) -> list[Suspicion]:
    return [each for each in answer.suspicions if each.code in CODES]


@pytest.mark.parametrize("numerator", [1, 3, 6, 9])
@pytest.mark.parametrize("denominator", [4.0, 20.5, 300.0])
def test_the_tail_of_f_is_scipys(numerator: int, denominator: float) -> None:
    for value in (0.1, 1.0, 3.0, 20.0, 80.0):
        expected = stats.f.sf(value, numerator, denominator)
        assert f_tail(value, numerator, denominator) == pytest.approx(expected, rel=1e-9)
    assert f_tail(0.0, numerator, denominator) == 1.0


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("kind", ["pose", "position", "distance"])
def test_an_instrument_that_was_moved_is_named_with_its_row(name: str, kind: str) -> None:
    answer = calibrate(machine(name), bumped(name, kind, 0.3e-3))
    named = [each for each in patterns(answer) if each.code == "step"]
    assert [each.rows for each in named] == [(BUMPED_AT,)]
    assert f"between rows {BUMPED_AT} and {BUMPED_AT + 1}" in named[0].sentence
    assert not (answer.accepted and named[0].refuses)
    # It refuses where it is why the residuals are far off; below that the noise has grown with it.
    assert named[0].refuses or answer.fit.birge <= 5.0


def test_the_row_is_that_of_all_rows_where_some_are_kept_from_the_fit() -> None:
    data = bumped("hexapod", "position", 0.3e-3)
    held_out = np.zeros(ROWS, np.bool_)
    held_out[[1, 3, 8, 30]] = True
    answer = calibrate(machine("hexapod"), dataclasses.replace(data, held_out=held_out))
    (named,) = [each for each in patterns(answer) if each.code == "step"]
    assert named.rows == (BUMPED_AT,)
    assert f"between rows {BUMPED_AT} and {BUMPED_AT + 1}" in named.sentence


@pytest.mark.parametrize("name", NAMES)
def test_its_size_is_that_of_the_move(name: str) -> None:
    """Against the estimate by the whole equations, with the step as one more unknown."""
    data = bumped(name, "position", 0.3e-3)
    fitted = calibrate(machine(name), data).fit
    view = a_view(name, fitted_from=calibrate(machine(name), data))
    columns = np.where((data.row >= BUMPED_AT)[:, np.newaxis], view.by_frame, 0.0)
    pattern = view.pattern(columns)
    assert pattern is not None
    factor = np.sqrt(fitted.weights)[:, np.newaxis]
    prior = fitted.birge * np.sqrt(1.0 / np.diagonal(fitted.unknowns.prior_covariance))
    prior[~np.isfinite(prior)] = 0.0
    extra = columns[:, np.abs(columns).max(axis=0) > 0.0]
    n = fitted.unknowns.count
    equations = np.vstack(
        [
            np.hstack([factor * fitted.jacobian, factor * extra]),
            np.hstack([np.diag(prior), np.zeros((n, extra.shape[1]))]),
        ]
    )
    off = fitted.values - fitted.unknowns.prior_mean
    right = np.concatenate([-factor[:, 0] * fitted.residual, -prior * off])
    whole = np.linalg.lstsq(equations, right, rcond=1e-13)[0]
    own = pattern.sizes[np.abs(columns).max(axis=0) > 0.0]
    # A step d of the frame is what was read d farther on: the residuals' own sign.
    np.testing.assert_allclose(own, whole[n:], atol=2e-6)
    assert own[0] == pytest.approx(0.3e-3, abs=0.1e-3)


def a_view(name: str, fitted_from: Calibration) -> ResidualsView:
    from truepose.calibration.acceptance.tool_uncertainty import Tool, tool_components

    m, n = machine(name), fitted_from.fit.unknowns.n_machine
    tool = Tool.of(np.zeros((1, len(m.components), n)), tool_components(m), np.zeros((1, 3)))
    after = tool.uncertainty(np.zeros((n, 1)), np.zeros((0, n)))
    return ResidualsView(m, fitted_from.fit, tool, after, 0, Left.of(fitted_from.fit))


@pytest.mark.parametrize("name", NAMES)
def test_a_drift_is_named_with_its_size(name: str) -> None:
    data = good(machine(name), "position", seed=2, frame="unknown", count=ROWS)
    drift = np.where(data.observable == 0, 0.3e-3 * data.row / (ROWS - 1), 0.0)
    answer = calibrate(machine(name), data.with_values(data.value + drift))
    assert [each.code for each in patterns(answer)] == ["drift"]
    assert "from the first row to the last" in patterns(answer)[0].sentence


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("share", [2e-3, -2e-3])
def test_a_scale_is_named_with_its_sign(name: str, share: float) -> None:
    data = good(machine(name), "position", seed=2, frame="unknown", count=ROWS)
    answer = calibrate(machine(name), data.with_values(data.value * (1.0 + share)))
    named = [each for each in answer.suspicions if each.code == "scale"]
    assert len(named) == 1
    assert ("too long" if share > 0.0 else "too short") in named[0].sentence


@pytest.mark.parametrize("kind", ["pose", "position"])
def test_a_scale_that_the_unknowns_nearly_take_up_has_its_size(kind: str) -> None:
    """From 20 m away frame and machine take up all of a scale but a thousandth."""
    m = machine("linear_delta")
    made = made_measurements(m, kind, poses_within(m, ROWS, 3), frame="unknown", values="nominal")
    far = elsewhere(made.instruments[0], [20.0, 8.0, 3.0], [0.0, 0.0, 0.0])
    read = with_noise(made, shown(m, drawn(m, 3), made, far), 3)
    lengths = made.observable <= OBSERVABLES.index("z")
    answer = calibrate(m, read.with_values(np.where(lengths, read.value * 1.002, read.value)))
    view = a_view("linear_delta", fitted_from=answer)
    finding = scale.inspect(view)
    assert finding is not None
    assert [each.code for each in patterns(answer)] == ["scale"]
    assert finding.pattern.sizes[0] == pytest.approx(2e-3, rel=0.1)


def test_a_dependence_on_the_place_is_named() -> None:
    data = good(machine("hexapod"), "position", seed=2, count=ROWS)
    x = data.placements[:, 0] / np.abs(data.placements[:, 0]).max()
    value = data.value.copy()
    value[column(data, "z")] += 0.2e-3 * x**2
    answer = calibrate(machine("hexapod"), data.with_values(value))
    assert "workspace-pattern" in [each.code for each in patterns(answer)]


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("kind", ["pose", "position", "strut-length"])
def test_good_data_have_no_pattern(name: str, kind: str) -> None:
    for seed in range(4):
        answer = calibrate(machine(name), good(machine(name), kind, seed=seed, count=ROWS))
        assert not [each for each in patterns(answer) if each.code != "rests-on-target"]


def test_a_few_outliers_are_no_step() -> None:
    data = good(machine("hexapod"), "position", seed=3, count=ROWS)
    value = data.value.copy()
    value[[30, 60, 61]] += 1e-3
    answer = calibrate(machine("hexapod"), data.with_values(value))
    assert not [each for each in patterns(answer) if each.code in ("step", "drift")]
    assert len(answer.outliers) >= 3


def test_a_target_that_is_not_seen_is_what_the_answer_rests_on() -> None:
    """With the target 0.2 mm off nothing shows, and the tool is off by what is said."""
    m = machine("planar_two_slider")
    data = good(m, "coordinate", seed=3, count=ROWS)
    answer = calibrate(m, data)
    (said,) = patterns(answer)
    assert (said.code, said.refuses) == ("rests-on-target", False)
    assert "if it is off by 0.20 mm, the tool is off by up to 0.20 mm" in said.sentence
    poses = m.poses()
    joints, placements, _ = m.kernel.place(poses)
    right = answer.calibrated().kernel.forward(joints, m.kernel.pose_of(placements))
    made = data.instruments[0]
    moved = []
    for axis in np.eye(3):
        there = elsewhere(made, np.zeros(3), np.zeros(3), np.add(made.target, 0.2e-3 * axis))
        other = calibrate(m, with_noise(data, shown(m, drawn(m, 3), data, there), 3))
        assert [each.code for each in patterns(other)] == ["rests-on-target"]
        reached = other.calibrated().kernel.forward(joints, m.kernel.pose_of(placements))
        moved.append(np.linalg.norm((reached - right)[:, : len(m.dof)], axis=1).max())
    assert max(moved) == pytest.approx(0.2e-3, rel=0.1)
