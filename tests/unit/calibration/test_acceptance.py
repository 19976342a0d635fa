"""The gate: what it refuses, what it accepts, in which words, and what it would measure."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from height_only_delta import (
    HALF,
    HEIGHTS,
    LABELS,
    NOISE,
    P02,
    POSITIONS,
    PROBED,
    ROD,
    TO_FILE,
    TOOL,
    UNITS,
    WORKSPACE,
    Floats,
    codes,
    residual_of,
    rows_of,
    unknowns,
    verdict,
    warned,
)
from truepose.calibration.acceptance import Candidate, Gate, HeldOut, assess
from truepose.calibration.acceptance.observability import (
    observability,
    project_out_instruments,
    row_covariance,
)
from truepose.calibration.identification.unknowns import Unknowns

# --- the published case --------------------------------------------------------------------------


@pytest.mark.parametrize(("kind", "key"), [(HEIGHTS, "height_only"), (POSITIONS, "x_y_z")])
def test_figures_of_the_case(kind: str, key: str) -> None:
    expected = P02["outputs"][key]
    in_file_units = rows_of(kind) * 1e3 / TO_FILE
    rows = project_out_instruments(in_file_units, 9)
    found = observability(rows, len(rows.matrix), np.ones(9))
    assert found.singular == pytest.approx(expected["singular_values"], abs=6e-7)
    assert found.condition == pytest.approx(expected["condition_number"], abs=0.06)
    standard = row_covariance(
        project_out_instruments(in_file_units / P02["inputs"]["noise_mm"], 9)
    ).standard()
    assert standard == pytest.approx(list(expected["standard_uncertainty"].values()), abs=6e-6)
    # And in SI, from the gate.
    gate = verdict(kind)
    assert gate.standard_data * TO_FILE == pytest.approx(standard, rel=1e-9)


def test_heights_alone_are_refused() -> None:
    gate = verdict(HEIGHTS)
    assert not gate.accepted
    assert codes(gate) == {"not-told-apart", "less-than-tolerance", "no-gain"}
    assert gate.words.startswith(
        "No: rod length, endstop and delta radius cannot be told apart by heights alone within "
        "their tolerances, nor can rod length, endstop and tower angle; the measurements "
        "determine rod length a only to 3.7 mm, its tolerance is 0.5 mm (8 more are less certain "
        "than the tolerance, too); at the worst pose of the workspace the tool's position would be "
        "uncertain by 1.1 mm, against 0.85 mm of the machine as filed. "
    )
    assert gate.words.endswith("Measure every rod length (to 0.02 mm), or probe in x and y too.")
    assert (gate.rank, gate.n_null) == (9, 0)
    assert {direction.kind for direction in gate.directions} == {"weak"}
    worst = gate.directions[0]
    assert {"rod.length.a", "endstop.b", "delta.radius"} <= set(worst.members)
    # Along the worst one a quarter of a millimetre moves no probed height by a micrometre.
    effect = PROBED[:, 2] @ worst.effects
    assert np.abs(effect).max() < 1e-6
    assert np.abs(worst.effects[[1, 2, 3, 6, 7, 8]]).min() > 0.2e-3


def test_the_page_quotes_the_gate() -> None:
    page = Path(__file__).parents[3] / "docs" / "calibration_gate.md"
    text = " ".join(page.read_text(encoding="utf-8").replace("\n> ", " ").split())
    assert verdict(HEIGHTS).words in text


def test_without_any_tolerance_heights_are_refused_all_the_same() -> None:
    gate = verdict(HEIGHTS, unknowns=without_tolerance())
    assert codes(gate) == {"not-told-apart"}
    assert gate.words.startswith(
        "No: rod length, endstop and delta radius cannot be told apart by heights alone. "
        "Measure one rod length (to 0.02 mm), or probe in x and y too."
    )


def test_x_y_and_z_are_accepted() -> None:
    gate = verdict(POSITIONS)
    assert gate.accepted
    assert gate.reasons == ()
    assert gate.remedy is None
    assert gate.standard_data[6] == pytest.approx(0.06518e-3, abs=6e-9)
    assert gate.before is not None
    assert gate.after.position_max < 0.05 * gate.before.position_max
    assert gate.words.startswith("Yes: the tool's position becomes known to ")
    assert (gate.share == 1.0).all()


def test_one_rod_is_enough_where_the_probe_is_better() -> None:
    gate = verdict(HEIGHTS, noise=NOISE / 5.0)
    assert codes(gate) == {"not-told-apart", "less-than-tolerance"}
    assert gate.remedy is not None
    assert gate.remedy.helps
    assert gate.remedy.cost == 1.0
    assert gate.words.endswith("Measure one rod length (to 0.02 mm), or probe in x and y too.")
    assert gate.remedy.position < gate.after.position_max


def test_with_tolerances_as_priors_heights_help_and_it_is_said_on_what_they_rest() -> None:
    gate = verdict(HEIGHTS, use_prior=True)
    assert gate.accepted
    assert "rests-on-tolerances" in warned(gate)
    assert "what is stated for these rests on their tolerances" in gate.words
    assert (gate.standard < gate.standard_prior).all()
    assert gate.standard_data * TO_FILE == pytest.approx(
        list(P02["outputs"]["height_only"]["standard_uncertainty"].values()), abs=6e-6
    )
    # Rods rest on their tolerances in part, the radius comes from the data.
    assert (gate.share[6:] < 0.7).all()
    assert gate.share[0] > 0.95
    # The same from the normal equations.
    jacobian = rows_of(HEIGHTS) / NOISE
    normal = jacobian.T @ jacobian + np.diag(4.0 / HALF**2)
    covariance = np.linalg.inv(normal)
    assert gate.standard == pytest.approx(np.sqrt(np.diagonal(covariance)), rel=1e-9)
    at_tool = np.einsum("pci,ij,pcj->pc", TOOL, covariance, TOOL)
    assert gate.after.standard == pytest.approx(np.sqrt(at_tool), rel=1e-9)


def test_less_certain_than_the_tolerance_within_its_band() -> None:
    gate = verdict(HEIGHTS, noise=NOISE / 12.0)
    assert "only to 0.31 mm, its tolerance already to 0.25 mm" in gate.words


def test_priors_alone_are_no_gain() -> None:
    # A probe so poor that nothing is learnt.
    gate = verdict(HEIGHTS, noise=0.1, use_prior=True)
    assert codes(gate) == {"no-gain"}
    assert "of the machine as filed" in gate.words


def test_the_margin_on_both_sides() -> None:
    found = verdict(HEIGHTS, use_prior=True)
    assert found.before is not None
    ratio = found.after.position_max / found.before.position_max
    assert verdict(HEIGHTS, use_prior=True, margin=1.001 * ratio).accepted
    assert not verdict(HEIGHTS, use_prior=True, margin=0.999 * ratio).accepted


# --- what the values claim -----------------------------------------------------------------------


def test_an_absurd_rod_is_refused() -> None:
    values = np.zeros(9)
    values[6:] = 269.6e-3 - ROD
    gate = verdict(POSITIONS, values=values)
    assert codes(gate) == {"absurd-value"}
    assert (
        "rod length a would be 269.6 mm, 18.5 mm off its drawing, 37 times its tolerance; rod "
        "length b and c would be off too" in gate.words
    )
    assert gate.remedy is None


def test_rods_of_swapped_inputs_are_refused() -> None:
    values = np.zeros(9)
    values[6:] = np.array([225e-3, 391e-3, 214e-3]) - ROD
    gate = verdict(POSITIONS, values=values)
    assert (
        "rod length b would be 391.0 mm, 103 mm off its drawing, 210 times its tolerance; rod "
        "length a and c would be off too" in gate.words
    )
    # Its half band is not told: then by standard deviations.
    open_band = replace(unknowns(), half=np.full(9, np.inf))
    gate = verdict(POSITIONS, values=values, unknowns=open_band, nominal=None)
    assert (
        "rod length b would be 103 mm off its drawing, 410 times the standard deviation of its "
        "tolerance" in gate.words
    )


@pytest.mark.parametrize(("off", "refused"), [(0.9e-3, False), (1.1e-3, True)])
def test_a_value_off_by_four_standard_deviations(off: float, refused: bool) -> None:
    values = np.zeros(9)
    values[0] = -off
    assert ("absurd-value" in codes(verdict(POSITIONS, values=values))) == refused


def test_a_value_that_is_uncertain_is_not_called_absurd() -> None:
    values = np.zeros(9)
    values[6] = 3.0 * 3.6e-3
    assert "absurd-value" not in codes(verdict(HEIGHTS, values=values))


def test_the_data_contradict_the_stated_noise() -> None:
    gate = verdict(POSITIONS, noise=NOISE / 10.0, residual=5.2)
    assert codes(gate) == {"contradicts-noise"}
    assert "5.2 times as much as their uncertainties allow" in gate.words
    gate = verdict(POSITIONS, noise=NOISE / 10.0, residual=4.8)
    assert gate.accepted
    assert "noise-too-small" in warned(gate)


def test_the_covariance_is_inflated_by_the_birge_ratio() -> None:
    one, two = verdict(POSITIONS), verdict(POSITIONS, residual=2.0)
    assert two.birge == pytest.approx(2.0)
    assert two.standard == pytest.approx(2.0 * one.standard)
    assert two.after.position_max == pytest.approx(2.0 * one.after.position_max)
    # Smaller residuals than stated make nothing better.
    small = verdict(POSITIONS, residual=0.3)
    assert small.standard == pytest.approx(one.standard)
    assert warned(small) == {"noise-too-large"}
    assert warned(one) == set()


def test_as_many_measurements_as_unknowns_check_no_noise() -> None:
    jacobian = rows_of(POSITIONS)[[0, 4, 8, 9, 13, 17, 18, 22, 26]] / NOISE
    gate = assess(
        unknowns(),
        values=np.zeros(9),
        jacobian=jacobian,
        residual=np.zeros(9),
        before=np.ones(9),
        use_prior=False,
        tool=TOOL,
        components="xyz",
    )
    assert "noise-unchecked" in warned(gate)
    assert np.isnan(gate.rms)
    assert gate.birge == 1.0


def test_held_out_poses_have_to_confirm() -> None:
    gate = verdict(POSITIONS, held_out=[HeldOut(300e-6, 290e-6, 10e-6, "m")])
    assert codes(gate) == {"not-confirmed"}
    assert "falls from 0.30 mm to 0.29 mm only, though the noise is 10 µm" in gate.words
    gate = verdict(POSITIONS, held_out=[HeldOut(4.0, 6.0)])
    assert "does not fall: 4.0 times the noise before, 6.0 times the noise after" in gate.words
    gate = verdict(POSITIONS, held_out=[HeldOut(300e-6, 12e-6, 10e-6, "m")])
    assert gate.accepted
    assert "on poses that were not fitted the error falls from 0.30 mm to 12 µm" in gate.words
    # What is noise already cannot become smaller.
    assert verdict(POSITIONS, held_out=[HeldOut(1.9, 1.8)]).accepted
    assert not verdict(POSITIONS, held_out=[HeldOut(2.1, 1.8)]).accepted


# --- unknowns without a tolerance ----------------------------------------------------------------


def without_tolerance() -> Unknowns:
    return unknowns(half=np.full(9, np.inf))


def test_without_tolerances_errors_measured_before_stand_in() -> None:
    gate = verdict(HEIGHTS, unknowns=without_tolerance(), measured=(0.5e-3, None))
    assert gate.before is None
    assert codes(gate) == {"not-told-apart", "no-gain"}
    assert "cannot be told apart by heights alone;" in gate.words
    assert "against 0.50 mm measured before" in gate.words
    assert gate.observability.scaling == "column"
    gate = verdict(POSITIONS, unknowns=without_tolerance(), measured=(0.5e-3, None))
    assert gate.accepted


def test_with_nothing_to_compare_it_is_said() -> None:
    gate = verdict(POSITIONS, unknowns=without_tolerance())
    assert gate.accepted
    assert warned(gate) == {"nothing-to-compare"}


def test_an_unknown_that_is_not_seen_is_refused_and_named() -> None:
    labels = (*LABELS, "tower lean a")
    half = np.append(HALF, np.inf)
    more = unknowns(labels, half, (*UNITS, "rad"))
    jacobian = np.hstack([rows_of(POSITIONS) / NOISE, np.zeros((33, 1))])
    settings: dict[str, Any] = {
        "values": np.zeros(10),
        "jacobian": jacobian,
        "residual": residual_of(jacobian[:, :9]),
        "before": np.ones(33),
        "components": "xyz",
        "by": [POSITIONS],
    }
    moved = np.concatenate([TOOL, np.ones((len(TOOL), 3, 1))], axis=2)
    gate = assess(more, use_prior=True, tool=moved, **settings)
    assert codes(gate) == {"not-determined"}
    assert "tower lean a cannot be found by positions in x, y and z" in gate.words
    assert np.isinf(gate.after.position).all()
    assert np.isinf(gate.standard[9])
    assert gate.share[9] == 0.0
    assert gate.n_null == 1
    # One that moves nothing does no harm.
    still = np.concatenate([TOOL, np.zeros((len(TOOL), 3, 1))], axis=2)
    gate = assess(more, use_prior=True, tool=still, **settings)
    assert gate.accepted
    assert [each.kind for each in gate.directions] == ["harmless"]


def test_what_is_kept_already_needs_no_calibration() -> None:
    gate = verdict(HEIGHTS, noise=0.1, use_prior=True, target=(2e-3, None))
    assert codes(gate) == {"no-gain"}
    assert "the machine as filed already keeps the accuracy that is asked" in gate.words
    assert gate.remedy is None
    found = verdict(POSITIONS, target=(2e-3, None))
    assert found.accepted
    assert "not-needed" in warned(found)
    assert "not-needed" not in warned(verdict(HEIGHTS, use_prior=True, target=(0.1e-3, None)))


# --- remedies ------------------------------------------------------------------------------------


def test_two_unseen_unknowns_need_two_measurements() -> None:
    gate = _two_unseen(direct={"m": 20e-6})
    assert gate.remedy is not None
    assert gate.remedy.names == ("left foot", "right arm")
    assert gate.words.endswith("Measure left foot (to 0.02 mm) and measure right arm (to 0.02 mm).")
    assert gate.remedy.cost == 6.0


def test_none_of_the_tried_helps() -> None:
    gate = _two_unseen(direct={})
    assert gate.remedy is not None
    assert not gate.remedy.helps
    useless = Candidate("again", 1.0, "measure again", np.eye(3)[[0]] / 1e-5)
    gate = _two_unseen(direct={}, candidates=[useless])
    assert gate.words.endswith("None of the further measurements that were tried helps.")


def _two_unseen(**other: Any) -> Gate:
    jacobian = np.repeat(np.eye(3)[[0]] / 1e-5, 5, axis=0)
    tool = np.ones((4, 1, 3))
    return assess(
        unknowns(("stroke", "left foot", "right arm"), np.full(3, 1e-3), ("m",) * 3),
        values=np.zeros(3),
        jacobian=jacobian,
        residual=residual_of(jacobian),
        before=np.ones(5),
        use_prior=False,
        tool=tool,
        components=("x",),
        **other,
    )


# --- rotations, and the machine as a whole -------------------------------------------------------


def test_what_becomes_worse_is_refused_though_something_else_becomes_better() -> None:
    jacobian = np.diag([1e5, 2e2, 1e5, 2e2])[[0, 1, 0, 1, 0, 1, 2, 3]]
    tool = np.zeros((2, 2, 4))
    tool[:, 0, 0] = tool[:, 1, 1] = 1.0
    bands = np.array([1e-3, 2e-3, 1e-3, 2e-3])
    labels = ("reach", "turn", "rise", "lean")
    settings: dict[str, Any] = {
        "values": np.zeros(4),
        "jacobian": jacobian,
        "residual": residual_of(jacobian),
        "before": np.ones(8),
        "tool": tool,
        "components": ("x", "c"),
    }
    wide = unknowns(labels, bands, ("m", "rad", "m", "rad"))
    gate = assess(wide, use_prior=False, **settings)
    assert "no-gain" in codes(gate)
    assert "of the workspace the tool's rotation would be uncertain by 0.17°" in gate.words
    # With the prior it cannot become worse; that it hardly became better is said.
    gate = assess(wide, use_prior=True, **settings)
    assert gate.accepted
    assert "one-sided" in warned(gate)


def hexapod() -> tuple[Floats, Floats, Floats]:
    """Twist of a hexapod (n, 6, 24) by base joints and lengths, poses' fields (n, 6, 6), points.

    A strut closes as its unit vector times (twist at its platform joint - shift of its base joint)
    less its lengthening.
    """
    below = np.radians([-10.0, 10.0, 110.0, 130.0, 230.0, 250.0])
    above = np.radians([-50.0, 50.0, 70.0, 170.0, 190.0, 290.0])
    base = 0.3 * np.column_stack([np.cos(below), np.sin(below), 0.0 * below])
    tops = 0.15 * np.column_stack([np.cos(above), np.sin(above), 0.0 * above])
    points = np.random.default_rng(5).uniform([-0.1, -0.1, 0.3], [0.1, 0.1, 0.5], (12, 3))
    twists, fields = np.zeros((12, 6, 24)), np.zeros((12, 6, 6))
    for index, point in enumerate(points):
        strut = point + tops - base
        unit = strut / np.linalg.norm(strut, axis=1, keepdims=True)
        along = np.hstack([unit, np.cross(tops, unit)])
        by_unknown = np.zeros((6, 24))
        for n in range(6):
            by_unknown[n, 3 * n : 3 * n + 3] = unit[n]
            by_unknown[n, 18 + n] = 1.0
        twists[index] = np.linalg.solve(along, by_unknown)
        fields[index, :3, :3] = fields[index, 3:, 3:] = np.eye(3)
        fields[index, :3, 3:] = np.cross(np.eye(3), point).T
    return twists, fields, points


def hexapod_verdict(*, use_prior: bool, frame: bool, positions: bool = True) -> Gate:
    twists, fields, points = hexapod()
    noise = np.array([1e-6] * 3 + [1e-5] * 3)[:, np.newaxis]
    jacobian = (np.concatenate([twists, fields], axis=2) / noise).reshape(-1, 30)
    labels = (
        *(f"base joint {axis} of strut {n}" for n in range(1, 7) for axis in "xyz"),
        *(f"length of strut {n}" for n in range(1, 7)),
        *(f"frame of tracker, {what} {axis}" for what in ("origin", "rotation") for axis in "xyz"),
    )
    half = np.array([1e-3] * 24 + [np.inf] * 6)
    kept = slice(None) if frame else slice(24)
    jacobian = jacobian[:, kept]
    return assess(
        unknowns(labels[kept], half[kept], (*["m"] * 27, *["rad"] * 3)[kept], 24),
        values=np.zeros(len(half[kept])),
        jacobian=jacobian,
        residual=residual_of(jacobian),
        before=np.ones(len(jacobian)),
        use_prior=use_prior,
        tool=twists,
        components="xyzabc",
        positions=points if positions else None,
        by=["by poses"],
    )


@pytest.mark.parametrize("use_prior", [False, True])
def test_where_the_machine_stands_is_a_gauge(use_prior: bool) -> None:
    gate = hexapod_verdict(use_prior=use_prior, frame=True)
    assert gate.accepted, gate.words
    assert gate.n_null == 6
    assert [each.kind for each in gate.directions] == ["gauge"] * 6
    assert gate.relative
    assert "gauge" in warned(gate)
    assert "where the machine as a whole stands" in gate.words.lower()
    known = hexapod_verdict(use_prior=use_prior, frame=False)
    assert known.accepted
    assert known.n_null == 0
    assert not known.relative


def test_without_positions_no_gauge_is_recognised() -> None:
    gate = hexapod_verdict(use_prior=False, frame=True, positions=False)
    assert "not-determined" in codes(gate)
    assert "cannot be told apart by poses" in gate.words


# --- inputs --------------------------------------------------------------------------------------


def test_shapes_that_do_not_fit_are_refused() -> None:
    with pytest.raises(ValueError, match=r"values: shape \(8,\), expected \(9,\)"):
        verdict(HEIGHTS, values=np.zeros(8))
    with pytest.raises(ValueError, match="the tool's sensitivity has shape"):
        verdict(HEIGHTS, components="xy")
    with pytest.raises(ValueError, match="the positions have shape"):
        verdict(HEIGHTS, positions=WORKSPACE[:, :2])
    with pytest.raises(ValueError, match="the nominal values have shape"):
        verdict(HEIGHTS, nominal=[1.0])
    with pytest.raises(ValueError, match="the tool's sensitivity: shape"):
        verdict(HEIGHTS, tool=TOOL[:, :, :4])
    with pytest.raises(ValueError, match="the Jacobian: not finite"):
        assess(
            unknowns(),
            values=np.zeros(9),
            jacobian=np.full((11, 9), np.nan),
            residual=np.zeros(11),
            before=np.zeros(11),
            use_prior=True,
            tool=TOOL,
            components="xyz",
        )
    with pytest.raises(ValueError, match="the weights: shape"):
        verdict(HEIGHTS, weights=np.ones(3))


def test_robust_weights_count_as_fewer_measurements() -> None:
    weights = np.ones(33)
    weights[:3] = 0.0
    gate = verdict(POSITIONS, weights=weights)
    fewer = rows_of(POSITIONS)[3:] / NOISE
    expected = np.sqrt(np.diagonal(np.linalg.inv(fewer.T @ fewer)))
    assert gate.standard_data == pytest.approx(gate.birge * expected)
    assert gate.degrees_of_freedom == pytest.approx(21.0)


def test_values_are_about_the_middle_of_the_tolerance() -> None:
    shifted = replace(unknowns(), prior_mean=np.full(9, 2e-3))
    gate = verdict(POSITIONS, unknowns=shifted, values=np.full(9, 2e-3))
    assert "absurd-value" not in codes(gate)
