"""Tables and answers against the Datasets that they are made from."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from made_study import hexapod_study, planar_study
from truepose.files.shown_units import METRIC
from truepose.reporting import how_far, inputs, tables
from truepose.reporting.display import LOWER, UPPER, column, number, pose_text, where_highest
from truepose.reporting.study import Study
from truepose.reporting.table import largest_cells
from truepose.verdict.answer import BEFORE

STUDIES = {"planar": planar_study(), "hexapod": hexapod_study(3)}


@pytest.fixture(params=STUDIES)
def study(request: pytest.FixtureRequest) -> Study:
    return STUDIES[request.param]


def cell(text: str) -> float:
    return float(text.replace("\N{MINUS SIGN}", "-"))


def test_every_table_is_rectangular(study: Study) -> None:
    found = [
        tables.ranking(study),
        tables.highest_absolute(study),
        tables.highest_percent(study),
        tables.compensation(study),
        tables.poses_left_out(study),
        tables.answers(study.machine, study.accuracy),
        how_far.table(study),
    ]
    for table in found:
        assert table is not None
        assert table.rows
        assert {len(row) for row in table.rows} == {len(table.header)}


def test_the_ranking_is_by_rank_and_in_micrometres(study: Study) -> None:
    table = tables.ranking(study)
    assert [row[2] for row in table.rows] == ["1", "2", "3"]
    at = table.header.index("highest position, µm")
    for row in table.rows:
        highest = float(study.budget["highest"].sel(source=row[0], quantity="position"))
        assert cell(row[at]) == pytest.approx(highest * 1e6, abs=0.01)
    shares = [cell(row[table.header.index("share, %")]) for row in table.rows]
    assert sum(shares) == pytest.approx(100, abs=0.2)


def test_a_source_with_a_band_has_two_rows_and_one_without_has_one(study: Study) -> None:
    table = tables.highest_absolute(study)
    assert [row[0] for row in table.rows] == [
        f"tolerance, {LOWER}", f"tolerance, {UPPER}", "thermal", "elastic",
        f"overall, {LOWER}", f"overall, {UPPER}",
    ]  # fmt: skip
    upper = study.budget["highest_upper"].sel(source="tolerance")
    for name, text in zip(study.components, table.rows[1][1:], strict=True):
        assert cell(text) == pytest.approx(float(upper.sel(component=name)) * 1e6, abs=0.01)


def test_a_band_that_no_edge_shows_is_still_a_band() -> None:
    study = planar_study()
    for edge in ("lower", "upper"):  # bands of coordinates alone leave the edges at the shift
        study.budget[f"error_{edge}"] = study.budget["error"].copy()
    labels = [row[0] for row in tables.highest_absolute(study).rows]
    assert labels[:3] == [f"tolerance, {LOWER}", f"tolerance, {UPPER}", "thermal"]


def test_percentages_are_of_coordinates_only(study: Study) -> None:
    names = [name.partition(",")[0] for name in tables.highest_percent(study).header[1:]]
    assert names == [name for name in study.components if name in "xyz"]


def test_the_compensation_has_before_and_after(study: Study) -> None:
    rows = {row[0]: row[1:] for row in tables.compensation(study).rows}
    residual = np.abs(study.compensated("residual_upper")).max(axis=0)
    assert [cell(text) for text in rows["after, all at upper ends"][:-1]] == pytest.approx(
        residual * 1e6, abs=0.01
    )
    assert {cell(text) for text in rows["after, known error"]} == {0.0}


def test_all_sources_together_add_their_bands_and_not_their_shifts(study: Study) -> None:
    # The made-up tolerance has no shift, the other two no band.
    shift = study.values("error")[:, 1:].sum(axis=1)
    band = study.values("worst")[:, 0]
    np.testing.assert_allclose(study.overall_worst, np.abs(shift) + band, rtol=1e-12)


def test_an_exact_error_beyond_the_linear_sum_counts_before_compensation_as_after_it() -> None:
    study = planar_study()
    beyond = 2.0 * study.overall_worst
    study.budget["overall_error_lower"] = (("pose", "component"), -beyond)
    fresh = Study(study.machine, study.budget, study.compensation)
    np.testing.assert_array_equal(fresh.overall_worst, beyond)


def test_the_answers_have_the_three_known_numbers(study: Study) -> None:
    table = tables.answers(study.machine, study.accuracy)
    assert table.header[2:5] == ("witness", "linear maximum", "proven bound")
    for row, answer in zip(table.rows, study.accuracy, strict=True):
        assert row[0] == f"{answer.quantity} {answer.state}"
        witness, linear, bound = (cell(text.split()[0]) * 1e-6 for text in row[2:5])
        tenth = 1.0001e-7
        assert witness == pytest.approx(answer.witness.value, abs=tenth / 2)
        assert linear == pytest.approx(answer.linear.value, abs=tenth / 2)
        assert answer.bound.value <= bound < answer.bound.value + tenth, "rounded up"
        assert row[6] == pose_text(answer.told.pose, study.machine.commanded, study.units)


def test_a_pose_that_cannot_be_compensated_is_missing_and_does_not_count() -> None:
    study = planar_study()
    assert study.compensation is not None
    short = Study(study.machine, study.budget, study.compensation.isel(pose=slice(3, None)))
    assert np.isnan(short.compensated("bound")[:3]).all()
    np.testing.assert_array_equal(short.compensated("bound")[3:], study.compensated("bound")[3:])
    most = study.compensation["linear_maximum"].values[3:, 0].max()
    rows = {row[0]: row[1:] for row in tables.compensation(short).rows}
    assert cell(rows["after, worst case"][-1]) == pytest.approx(most * 1e6, abs=0.05)
    assert all("nan" not in text for row in tables.compensation(short).rows for text in row)


def test_how_far_off_is_the_same_over_the_whole_workspace(study: Study) -> None:
    table = how_far.table(study)
    assert table.header[2:7] == ("known", "95 %", "witness", "linear maximum", "proven bound")
    assert [row[1] for row in table.rows] == [answer.state for answer in study.accuracy]
    for row, worst, share in zip(table.rows, study.accuracy, study.sampled, strict=True):
        numbers = (share.linear, worst.witness, worst.linear, worst.bound)
        expected = [number.value * 1e6 for number in numbers]
        known, *others, bound = [cell(text) for text in row[2:7]]
        size = study.position_norm if worst.quantity == "position" else study.rotation_norm
        errors = (
            study.values("overall_error")
            if worst.state == BEFORE
            else study.compensated("residual_middle")
        )
        assert known == pytest.approx(size(errors).max() * 1e6, abs=0.06)
        assert others == pytest.approx(expected[:3], abs=0.06)
        assert expected[3] <= bound < expected[3] + 0.1001, "rounded up"
        assert row[7] == ("µm" if worst.quantity == "position" else "µrad")


def test_a_number_that_there_is_not_is_a_dash() -> None:
    study = planar_study()
    before, after = study.accuracy
    unbounded = replace(before, bound=replace(before.bound, value=np.inf))
    row, _ = how_far.table(replace(study, accuracy=(unbounded, after), sampled=())).rows
    assert (row[3], row[6]) == ("–", "–")
    row, _ = tables.answers(study.machine, (unbounded, after)).rows
    assert row[4] == "–"


def test_numbers() -> None:
    assert number(-0.5, 2) == "\N{MINUS SIGN}0.50"
    assert number(-0.0001, 2) == "0.00"
    assert number(float("nan"), 2) == "–"
    assert column([1234.5678, 0.001]) == ("1234.6", "0.0")
    assert column([0.0]) == ("0.0",)
    assert (
        pose_text([-0.1, 0.2, -0.0], ["x", "z", "c"], METRIC)
        == "x \N{MINUS SIGN}100 mm, z 200 mm, c 0 °"
    )


def test_the_highest_is_the_first_of_equals() -> None:
    assert where_highest([1.0, 2.0 * (1 - 1e-13), 2.0, np.nan]) == 1
    assert where_highest([-3.0, -1.0, -1.0 + 1e-15]) == 1


def test_the_condition_says_all_that_acts() -> None:
    rows = dict(inputs.condition(planar_study().machine).rows)
    assert rows["temperature of strut.1"] == "30 °C"
    assert rows["temperature log"] == "log.csv, its last moment"
    assert rows["temperature gradient of strut.1"] == "4 K/m along it"
    assert rows["temperature gradient of frame"] == "x 0, y 0, z −5 K/m"
    assert rows["further force on the tool"] == "300 N in any direction across x 0, y 0, z 1"
    assert rows["acceleration of the platform"] == "x 0, y 2, z 0 m/s²"


def test_the_largest_of_a_column_is_marked_where_it_is_one() -> None:
    values = np.array([[1.0, 2.0, np.nan], [-3.0, 2.0, np.nan], [np.nan, 2.0, 5.0]])
    assert largest_cells(values, 1) == {(1, 1)}, "equal ones, and one alone, are not compared"


def test_marked_cells_and_sentences_have_the_largest_number_of_their_column(study: Study) -> None:
    ranked, highest = tables.ranking(study), tables.highest_absolute(study)
    for table in (ranked, highest):
        assert table.largest
        for row, at in table.largest:
            assert cell(table.rows[row][at]) == max(cell(other[at]) for other in table.rows)
    assert ranked.says.startswith(f"{ranked.rows[0][0]} can do most: {ranked.rows[0][3]} ")
    lengths = [cell(text) for row in highest.rows for text in row[1 : 1 + len(study.positions)]]
    assert f"The largest is {max(lengths):.10g}" in highest.says.replace(".0 ", " ")
    worst, far = tables.compensation(study), how_far.table(study)
    assert f"from {worst.rows[3][-1]} to {worst.rows[7][-1]} " in worst.says
    assert f" {far.rows[0][4]} {far.rows[0][-1]} off" in far.says
    met = sum(answer.met or False for answer in study.accuracy)
    assert tables.answers(study.machine, study.accuracy).says.startswith(f"{met} of ")
