"""A yes needs a gain: in what is commanded, or at poses that were not fitted."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import truepose as tp
from build_machine import MACHINES
from height_only_delta import (
    HALF,
    HEIGHTS,
    NOISE,
    TOOL,
    codes,
    rows_of,
    verdict,
    warned,
)
from made_measurements import Floats, made_measurements, poses_within
from truepose.calibration.acceptance import HeldOut
from truepose.calibration.calibrate import Calibration, calibrate
from truepose.calibration.identification.problem import IdentificationProblem
from truepose.calibration.identification.unknowns import unknowns_of

SHOWN_NO_GAIN, SHOWN_A_GAIN = HeldOut(9.22, 9.29, noise=8.0), HeldOut(9.29, 9.22, noise=8.0)


def share_taken(noise: float) -> float:
    """1 - trace after / trace before, each at its worst pose, from the normal equations."""
    jacobian = rows_of(HEIGHTS) / noise
    prior = np.diag((HALF / 2.0) ** 2)
    after = np.linalg.inv(jacobian.T @ jacobian + np.linalg.inv(prior))
    traces = [np.einsum("pci,ij,pcj->p", TOOL, each, TOOL).max() for each in (after, prior)]
    return float(1.0 - traces[0] / traces[1])


@cache
def noise_for(share: float) -> float:
    """The noise of the heights with which they take away so much, by bisection."""
    low, high = np.log(NOISE), np.log(0.1)
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if share_taken(np.exp(middle)) > share else (low, middle)
    return float(np.exp(low))


def test_little_taken_away_and_no_gain_shown_is_no() -> None:
    noise = noise_for(0.42)
    gate = verdict(HEIGHTS, noise=noise, use_prior=True, held_out=[SHOWN_NO_GAIN])
    assert codes(gate) == {"gain-unconfirmed"}
    assert gate.answer == (
        "No: of the variance of what is commanded the measurements take away only 42 %, at the "
        "worst pose, and poses that were not fitted show no gain: 9.22 times the noise before, "
        "9.29 times the noise after."
    )
    assert gate.remedy is not None
    assert gate.remedy.helps
    assert verdict(HEIGHTS, noise=noise, use_prior=True, held_out=[SHOWN_A_GAIN]).accepted
    # Nothing held back shows nothing, and refuses nothing.
    assert verdict(HEIGHTS, noise=noise, use_prior=True).accepted


@pytest.mark.parametrize(("share", "accepted"), [(0.49, False), (0.51, True)])
def test_half_of_the_variance_on_both_sides(share: float, accepted: bool) -> None:
    gate = verdict(HEIGHTS, noise=noise_for(share), use_prior=True, held_out=[SHOWN_NO_GAIN])
    assert gate.accepted == accepted


def test_what_no_command_corrects_is_no_gain() -> None:
    """Heights see z far better than x and y: where z is not commanded, that is no gain."""
    settings = {"noise": noise_for(0.42), "use_prior": True, "held_out": [SHOWN_NO_GAIN]}
    assert verdict(HEIGHTS, commanded="z", **settings).accepted
    assert codes(verdict(HEIGHTS, commanded="xy", **settings)) == {"gain-unconfirmed"}


def test_it_is_not_said_beside_a_missing_gain_and_not_where_none_is_asked() -> None:
    gate = verdict(HEIGHTS, noise=0.1, use_prior=True, held_out=[SHOWN_NO_GAIN])
    assert codes(gate) == {"no-gain"}
    noise = noise_for(0.42)
    kept = verdict(
        HEIGHTS, noise=noise, use_prior=True, held_out=[SHOWN_NO_GAIN], target=(2e-3, None)
    )
    assert codes(kept) == {"gain-unconfirmed"}
    assert kept.answer.endswith(
        "; but the machine as filed already keeps the accuracy that is asked."
    )
    assert kept.remedy is None
    assert "not-needed" not in warned(kept)


def bed(machine: tp.Machine) -> Floats:
    """Nineteen points of a bed: the middle, and two rings."""
    rings = [(0.036, 6), (0.072, 12)]
    points = [(0.0, 0.0)]
    for radius, count in rings:
        angles = np.arange(count) * 2.0 * np.pi / count
        points += [(radius * np.cos(angle), radius * np.sin(angle)) for angle in angles]
    return np.array([(x, y, 0.1) for x, y in points])


def heights(band: str, uncertainty: float, seed: int) -> Calibration:
    """A delta with tolerances of `band`, on a bed that stands anywhere."""
    machine = tp.load(MACHINES / "linear_delta.toml")
    data = made_measurements(
        machine,
        "coordinate",
        bed(machine),
        observables=["z"],
        uncertainty=uncertainty,
        frame="unknown",
    )
    names = unknowns_of(machine, data).names
    identify = [f"{name}={band}" for name in names if name.split(".")[0] in ("strut", "drive")]
    return calibrated(machine, data, identify, 1.0, seed)


def calibrated(
    machine: tp.Machine, data: object, identify: list[str], times: float, seed: int
) -> Calibration:
    """Measured by chance, the machine `times` its tolerances off at random."""
    unknowns = unknowns_of(machine, data, identify)  # type: ignore[arg-type]
    n, rng = unknowns.n_machine, np.random.default_rng(seed)
    true = np.zeros(unknowns.count)
    sigma = np.sqrt(np.diagonal(unknowns.prior_covariance)[:n])
    true[:n] = times * sigma * rng.standard_normal(n)
    read = IdentificationProblem(machine, data, unknowns).predict(true)  # type: ignore[arg-type]
    read = read + data.uncertainty * rng.standard_normal(read.size)  # type: ignore[attr-defined]
    return calibrate(machine, data.with_values(read), identify=identify)  # type: ignore[attr-defined]


def test_nineteen_heights_of_a_bed_are_no() -> None:
    found = heights("0.05 mm", 3.5e-6, 1)
    (check,) = found.gate.held_out
    assert check.after >= check.before
    assert (found.gate.share < 0.5).all()
    assert found.gate.share.size == 45
    # The parasitic tilt gained enough by itself.
    assert found.gate.before is not None
    assert found.gate.after.rotation_max < 0.8 * found.gate.before.rotation_max
    assert found.gate.after.position_max > 0.8 * found.gate.before.position_max
    assert codes(found.gate) == {"gain-unconfirmed"}


def test_a_machine_that_was_good_before_may_be_calibrated() -> None:
    machine = tp.load(MACHINES / "five_bar.toml")
    data = made_measurements(machine, "position", poses_within(machine, 40))
    found = [calibrated(machine, data, [], 0.02, seed) for seed in range(12)]
    not_better = [
        each for each in found if each.gate.held_out[0].after >= each.gate.held_out[0].before
    ]
    assert len(not_better) >= 6
    assert all(each.accepted for each in found)
