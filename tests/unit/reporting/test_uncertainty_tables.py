"""Tables of samples, bounds, worst cases and shares: what they say is what the Datasets say."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import made_how_sure as made
from made_study import hexapod_study, planar_study
from truepose.reporting import page, reading, uncertainty_tables, variance_shares
from truepose.reporting.study import Study

STUDIES = {"planar": planar_study(), "hexapod": hexapod_study(3)}


@pytest.fixture(params=STUDIES)
def study(request: pytest.FixtureRequest) -> Study:
    return made.sure_study(STUDIES[request.param])


def rows(table: Any) -> dict[str, list[float]]:
    """First cell -> the numbers of the row; what is missing is NaN."""

    def number(cell: str) -> float:
        return np.nan if cell == "–" else float(cell.replace("\N{MINUS SIGN}", "-"))

    return {row[0]: [number(cell) for cell in row[table.words :]] for row in table.rows}


def test_sampled_at_the_worst_pose(study: Study) -> None:
    found = study.monte_carlo
    pose = int(found["magnitude_upper"].values[:, 0].argmax())
    table, over = uncertainty_tables.sampled(study.machine, found)
    shown = rows(table)
    at = found.isel(pose=pose)
    for index, name in enumerate(found["component"].values):
        unit = "µm" if name in "xyz" else "µrad"
        kinds = ["mean", "standard_deviation", "lower", "upper", "shortest_lower", "shortest_upper"]
        expected = [float(at[kind][index]) * 1e6 for kind in (*kinds, "minimum", "maximum")]
        assert shown[f"{name}, {unit}"] == pytest.approx(expected, abs=0.06)
    assert shown["position, µm"][3] == pytest.approx(at["magnitude_upper"].values[0] * 1e6, abs=0.1)
    assert "95 % coverage" in table.title
    assert "4,000 samples, seed 7." in table.note
    assert reading.at_text(study.machine, found, pose) in table.note
    assert rows(over)["position, µm"][1] == shown["position, µm"][3]


def test_the_note_says_how_samples_were_drawn_and_which_failed(study: Study) -> None:
    found = study.monte_carlo.copy()
    found.attrs |= {"sampling": "sobol", "digits": 2, "interrupted": 1}
    found["failed"] = ("pose", np.array([12, 12]))
    note = uncertainty_tables.sampled(study.machine, found)[0].note
    assert "4,000 scrambled Sobol points" in note
    assert "2 digits of the standard deviation stable" in note
    assert "12 of 4,012 could not be assembled" in note
    assert "Interrupted" in note


def test_one_pose_has_no_table_over_poses(study: Study) -> None:
    found = made.monte_carlo(study.machine, study.poses[:1])
    assert [table.name for table in uncertainty_tables.sampled(study.machine, found)] == ["sampled"]


def test_bounds_at_poses_enclose_what_is_reached(study: Study) -> None:
    (table,) = uncertainty_tables.bounds(study.machine, study.bounds)
    for name, (below, reached, most, above, linear) in rows(table).items():
        if name.startswith(("position", "orientation")):
            assert most < above
            continue
        assert below < reached < most < above
        assert linear == pytest.approx(max(abs(reached), abs(most)), abs=0.02)


def test_poses_without_a_proof_are_named(study: Study) -> None:
    found = made.bounds(study.machine, study.poses[:2], status="box_too_wide")
    table, lost = uncertainty_tables.bounds(study.machine, found)
    assert np.isfinite(rows(table)["x, µm"]).all(), "the pose that has a proof is shown"
    assert lost.title == "Poses without a proof: 1 of 2"
    assert lost.rows[0][1] == "the bands are too wide for a proof"
    nowhere = found.isel(pose=[0])
    table, lost = uncertainty_tables.bounds(study.machine, nowhere)
    assert np.isnan(rows(table)["x, µm"][0])
    assert lost.title == "Poses without a proof: 1 of 1"


def test_a_region_is_answered_in_words_and_in_a_table(study: Study) -> None:
    found = made.region(study.machine)
    (table,) = uncertainty_tables.bounds(study.machine, found)
    shown = rows(table)
    assert shown["position, µm"][2] == pytest.approx(4.0, abs=0.05), "the gap"
    assert "321 boxes" in table.note
    said = uncertainty_tables.sentence(study.machine, found)
    assert said.startswith("Nowhere in this region does the tool deviate more than ")
    most = found["magnitude"].values[0] * 1e6
    assert f"{np.ceil(most * 100) / 100:.2f}" in said, "a bound is rounded up"
    assert "is reached at x " in said
    low, high = (abs(float(found[end].values[0])) for end in ("lower", "upper"))
    assert shown["x, µm"][0] == pytest.approx(max(low, high) * 1e6, abs=0.06)
    assert "was not reached" not in table.note
    found.attrs["gap"] = 0.01
    (table,) = uncertainty_tables.bounds(study.machine, found)
    assert "The gap asked, 1 %, was not reached." in table.note


def test_a_bound_is_never_rounded_down() -> None:
    values = np.array([-1.00001, -1.00001, 2.00001, 2.00001, np.nan])
    shown = uncertainty_tables.rounded(values, (-1, 1, -1, 1, 1))
    assert shown == ("−1.0001", "−1.0000", "2.0000", "2.0001", "–")
    assert uncertainty_tables.rounded(np.array([3.0, 2.5]), (1, 0)) == ("3.0000", "2.5000")


def test_a_region_without_a_proof_says_so(study: Study) -> None:
    found = made.region(study.machine, status="near_singular")
    assert "too near a singularity for a proof at x " in uncertainty_tables.sentence(
        study.machine, found
    )
    (table,) = uncertainty_tables.bounds(study.machine, found)
    assert table.note.startswith("Not proven: too near a singularity")


def test_what_is_missing_is_said_with_its_reason(study: Study) -> None:
    because = "a normal distribution has no ends (length of strut 1)."
    without = replace(study, bounds=None, missing={"bounds": because})
    last = uncertainty_tables.tables(without)[-1]
    assert (last.name, last.rows) == ("lacking", (("proven bound", because),))
    assert uncertainty_tables.in_short(without)[-1] == last
    text = page.render(without)
    assert because in text
    assert 'id="table-bounds"' not in text
    assert "lacking" not in [table.name for table in uncertainty_tables.tables(study)]


@pytest.mark.parametrize("of", ["parameter", "source"])
def test_blame_is_shared_by_variance(study: Study, of: str) -> None:
    found = study.shares
    who = variance_shares.blame(found, 0, of)
    _, effects = made.shift_and_effects(study.machine, study.poses[[study.n_pose // 2]])
    within = [at for at, name in enumerate(study.components) if name in "xyz"]
    variance = (effects[0, within] ** 2).sum(axis=0)
    expected = dict.fromkeys(who.names, 0.0)
    labels = made.PARAMETERS if of == "parameter" else made.SOURCES
    for name, value in zip(labels, variance / variance.sum(), strict=True):
        expected[name] += value
    assert list(who.names) == sorted(expected, key=expected.get, reverse=True)
    for name, first, total, half in zip(
        who.names, who.kinds["first"], who.kinds["total"], who.confidence["first"], strict=True
    ):
        assert first == pytest.approx(expected[name])
        assert total == pytest.approx(1.01 * expected[name])
        assert half == pytest.approx(0.02)


def test_a_component_that_does_not_vary_takes_no_part(study: Study) -> None:
    found = study.shares.copy(deep=True)
    found["standard_deviation"].values[:, 0] = 0.0
    for name in ("first", "total", "linear", "first_confidence", "total_confidence"):
        found[name].values[..., 0] = np.nan
    who = variance_shares.blame(found, 0)
    assert np.isfinite(who.kinds["first"]).all()
    assert who.kinds["linear"].sum() == pytest.approx(1.0)


def test_the_shares_name_what_to_tighten_first(study: Study) -> None:
    tables = variance_shares.shares(study.machine, study.shares)
    parts = ["position", "orientation"] if study.rotations else ["position"]
    names = [f"shares_{of}_{part}" for of in ("parameter", "source") for part in parts]
    assert [table.name for table in tables] == names
    first = tables[0]
    assert f"To be tightened first: {first.rows[0][0]}." in first.note
    assert "Over all 2 poses together: strut.1.length, " in first.note
    shown = [numbers[0] for numbers in rows(first).values()]
    assert shown == sorted(shown, reverse=True)
    # What makes less than 1 % has no row, and is told together.
    (rest,) = re.findall(r"([\d.]+) %(?: together)?\.$", first.note)[:1] or ["0"]
    left = float(rest) if "together" in first.note else 0.0
    assert all(share >= 1.0 for share in shown)
    assert 99.0 <= sum(shown) + left <= 100.5
    assert "Shapley" not in "".join(first.header)


def test_correlated_parameters_have_shapley_shares(study: Study) -> None:
    found = made.shares(study.machine, study.poses[:2], correlated=True)
    table, *_ = variance_shares.shares(study.machine, found)
    assert "Shapley, %" in table.header


@pytest.mark.parametrize(
    ("poses", "axes", "count"),
    [
        (planar_study(9).poses, [0, 1], 25),
        (planar_study(2).poses, [0, 1], 4),
        (hexapod_study(5).poses, [0, 1, 2], 19),
        (planar_study(1).poses, [0, 1], 1),
        (np.empty((0, 2)), [0, 1], 0),
        (planar_study(3).poses, [], 1),
    ],
)
def test_ellipses_are_spread_over_the_middle_planes(
    poses: Any, axes: list[int], count: int
) -> None:
    chosen = uncertainty_tables.spread_over(poses, axes)
    assert len(chosen) == len(set(chosen)) == count
    if len(axes) == 3:
        middle = (poses.max(axis=0) + poses.min(axis=0)) / 2
        off = ~np.isclose(poses[chosen][:, :3], middle[:3])
        assert (off.sum(axis=1) < 3).all(), "each lies in a plane through the middle"
