"""Rows kept from the fit: which are predicted, what the fit promises for them, odd ones by name."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import truepose as tp
from build_machine import machine_files
from made_measurements import made_measurements, nominal_values, poses_within
from truepose.calibration.acceptance import Gate
from truepose.calibration.calibrate import Calibration, calibrate
from truepose.calibration.identification.validate import fold_numbers
from truepose.calibration.instruments import Frame
from truepose.calibration.measurements import Measurements
from truepose.calibration.measurements.arrays import joined
from truepose.calibration.result.bands import tolerance_covariance
from truepose.machine import Machine

FILES = {path.stem: path for path in machine_files()}
HEXAGLIDE = tp.load(FILES["hexaglide"])
TRICEPT = tp.load(FILES["tricept"])
FAR = Frame(origin=(2.0, -1.3, 0.7), rotation=(0.1, 0.7, 0.7, 0.1))


def made_wrong(machine: Machine, seed: int) -> Machine:
    """The machine with errors drawn from its tolerances."""
    of = tolerance_covariance(machine)
    values, vectors = np.linalg.eigh(of.correlation)
    random = np.random.default_rng(seed).standard_normal(values.size)
    change = of.shift + of.effects @ (vectors @ (np.sqrt(np.maximum(values, 0.0)) * random))
    return machine.replace(
        dict(zip(machine.parameters, (machine.nominal + change).tolist(), strict=True))
    )


def read_of(
    machine: Machine, data: Measurements, seed: int, frame: Frame | None = None, noise: float = 1.0
) -> Measurements:
    """What the machine shows at the joints of the data, seen from a frame, with noise."""
    poses = machine.kernel.forward(data.joints, start=machine.kernel.pose_of(data.placements))
    standing = dataclasses.replace(data, placements=machine.kernel.placement_of(poses))
    if frame is not None:
        (one,) = data.instruments
        standing = dataclasses.replace(
            standing, instruments=(dataclasses.replace(one, frame=frame),)
        )
    random = np.random.default_rng(1000 + seed).standard_normal(data.n_observation)
    return data.with_values(nominal_values(machine, standing) + noise * data.uncertainty * random)


def two_instruments(rows: int, seed: int, held_out: bool = False) -> Measurements:
    """30 poses in the base frame, and `rows` positions by a tracker that stands far away."""
    true = made_wrong(HEXAGLIDE, seed)
    poses = poses_within(HEXAGLIDE, 30, seed=seed)
    near = read_of(true, made_measurements(HEXAGLIDE, "pose", poses, name="near"), seed)
    far = made_measurements(
        HEXAGLIDE,
        "position",
        poses_within(HEXAGLIDE, rows, seed=50 + seed),
        name="far",
        frame="unknown",
        held_out=np.full(rows, held_out),
    )
    return joined(near, read_of(true, far, 7 + seed, FAR))


def codes(gate: Gate) -> list[str]:
    return [reason.code for reason in gate.reasons]


def test_folds_are_equal_in_all_and_of_each_instrument() -> None:
    instrument = np.array([0, 1, 0, 2] * 8 + [1, 1, 0])
    numbers = fold_numbers(instrument, 5, 3)
    for mine in (instrument >= 0, *(instrument == each for each in range(3))):
        sizes = np.bincount(numbers[mine], minlength=5)
        assert sizes.sum() == mine.sum()
        assert np.ptp(sizes) <= 1
    np.testing.assert_array_equal(numbers, fold_numbers(instrument, 5, 3))
    assert (numbers != fold_numbers(instrument, 5, 4)).any()


@pytest.mark.parametrize("rows", [1, 2, 3])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_rows_whose_instrument_may_stand_anywhere_are_not_predicted(rows: int, seed: int) -> None:
    data = two_instruments(rows, seed)
    found = calibrate(HEXAGLIDE, data)
    checked = found.validation
    assert checked is not None
    # Three positions fix a frame: of two at most that are left no third follows.
    far = data.instrument[data.row] == 1
    assert np.isnan(checked.after[far]).all()
    assert np.isnan(checked.promised[far]).all()
    assert not checked.used[far].any()
    assert checked.used[~far].sum() >= 0.7 * (~far).sum()
    assert checked.rms_before > 1.5 * checked.rms_after
    assert 0.85 < checked.rms_after < 1.2
    assert "not-confirmed" not in codes(found.gate)


@pytest.mark.parametrize("seed", range(4))
def test_of_four_positions_three_foretell_the_fourth_and_say_how_well(seed: int) -> None:
    data = two_instruments(4, seed)
    found = calibrate(HEXAGLIDE, data)
    checked = found.validation
    assert checked is not None
    far = data.instrument[data.row] == 1
    assert checked.used[far].all()
    assert checked.promised[far].max() > 3.0 * np.median(checked.promised[~far])
    assert checked.consistent
    assert found.accepted


def test_a_stated_row_of_an_instrument_that_stands_anywhere_confirms_nothing() -> None:
    alone = calibrate(HEXAGLIDE, two_instruments(20, 1, held_out=True))
    assert alone.validation is not None
    assert alone.validation.kind == "folds"
    kept = alone.measurements.held_out[alone.measurements.row]
    np.testing.assert_array_equal(np.isfinite(alone.validation.after), ~kept)
    assert alone.validation.rms_after == pytest.approx(1.0, abs=0.2)
    assert alone.accepted
    data = two_instruments(20, 1, held_out=True)
    data = dataclasses.replace(data, held_out=data.held_out | (np.arange(50) % 10 == 3))
    checked = calibrate(HEXAGLIDE, data).validation
    assert checked is not None
    assert checked.kind == "stated set"
    far = data.instrument[data.row] == 1
    kept = data.held_out[data.row]
    np.testing.assert_array_equal(checked.used, kept & ~far)
    np.testing.assert_array_equal(np.isfinite(checked.after), kept & ~far)
    assert 0.6 < checked.rms_after < 1.5


def test_what_is_promised_is_kept() -> None:
    """Over 40 machines errors on rows not used are, over what is promised for them, about 1."""
    plain, over = [], []
    for seed in range(40):
        poses = poses_within(HEXAGLIDE, 10, seed=seed)
        data = made_measurements(HEXAGLIDE, "distance", poses, frame="unknown", uncertainty=2e-6)
        data = read_of(made_wrong(HEXAGLIDE, seed), data, seed, Frame(origin=(0.9, 0.7, 0.8)))
        found = calibrate(HEXAGLIDE, data)
        assert "not-confirmed" not in codes(found.gate)
        checked = found.validation
        assert checked is not None
        assert checked.consistent
        plain.append(checked.after[checked.used])
        over.append(checked.standardised[checked.used])
    size = float(np.sqrt(np.mean(np.concatenate(over) ** 2)))
    assert size == pytest.approx(1.0, abs=0.15)
    assert np.sqrt(np.mean(np.concatenate(plain) ** 2)) > 1.4 * size


def test_promises_grow_with_the_noise_that_the_fit_finds() -> None:
    poses = poses_within(TRICEPT, 60, seed=3)
    data = made_measurements(TRICEPT, "position", poses, held_out=np.arange(60) % 3 == 2)
    found = calibrate(TRICEPT, read_of(made_wrong(TRICEPT, 1), data, 1, noise=3.0))
    checked = found.validation
    assert checked is not None
    assert checked.noise == found.fit.birge
    assert checked.noise == pytest.approx(3.0, rel=0.15)
    assert checked.rms_after == pytest.approx(3.0, rel=0.25)
    again = checked.standardised[checked.used]
    assert np.sqrt(np.mean(again**2)) == pytest.approx(1.0, abs=0.25)
    assert found.outliers == ()


def with_wrong_check(size: float, wrong: list[int]) -> tuple[Measurements, Calibration]:
    poses = poses_within(TRICEPT, 40, seed=3)
    data = made_measurements(TRICEPT, "position", poses, held_out=np.arange(40) % 4 == 3)
    data = read_of(made_wrong(TRICEPT, 1), data, 1)
    values = data.value.copy()
    values[wrong] += size
    return data, calibrate(TRICEPT, data.with_values(values))


def test_one_odd_reading_of_a_row_kept_from_the_fit_is_named_and_refuses_nothing() -> None:
    _, clean = with_wrong_check(0.0, [])
    assert clean.accepted
    assert clean.outliers == ()
    at = 11 * 3 + 2
    for size in (5e-4, 5e-3):
        _, found = with_wrong_check(size, [at])
        assert found.accepted
        (odd,) = found.outliers
        assert (odd.row, odd.what, odd.held_out) == (11, "z", True)
        assert odd.sigmas == pytest.approx(-size / 10e-6, rel=0.1)
        assert odd.sentence.endswith("sigma off, in a row kept from the fit")
        assert found.validation is not None
        assert clean.validation is not None
        assert not found.validation.used[at]
        assert found.validation.rms_after == pytest.approx(clean.validation.rms_after, rel=0.05)


def test_many_odd_readings_of_rows_kept_from_the_fit_refuse() -> None:
    data, clean = with_wrong_check(0.0, [])
    wrong = np.flatnonzero(data.held_out[data.row] & (np.arange(data.n_observation) % 3 == 2))
    _, found = with_wrong_check(5e-4, wrong.tolist())
    checked = found.validation
    assert checked is not None
    assert clean.validation is not None
    assert checked.used.sum() == clean.validation.used.sum() == 30
    assert checked.rms_after > 20.0
    assert not checked.consistent
    assert codes(found.gate) == ["not-confirmed"]
    assert len(found.outliers) == 10


def test_rows_of_odd_readings_are_counted_in_all_measurements() -> None:
    _, found = with_wrong_check(5e-4, [22 * 3])
    (odd,) = found.outliers
    assert (odd.row, odd.what, odd.held_out) == (22, "x", False)
