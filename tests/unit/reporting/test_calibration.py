"""Tables and figures of a calibration against the Dataset that they are made from."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

from checked_figures import checked
from made_calibration import UNKNOWNS, calibration
from made_study import MADE_UNITS, hexapod_study, planar_study
from truepose.reporting import calibration as told
from truepose.reporting import page
from truepose.reporting.figures import (
    calibration_correlation,
    calibration_map,
    calibration_residuals,
    calibration_tool,
    calibration_unknowns,
)
from truepose.reporting.result import Result
from truepose.reporting.study import Study
from truepose.reporting.table import Table

FIGURES = (
    calibration_residuals,
    calibration_map,
    calibration_unknowns,
    calibration_correlation,
    calibration_tool,
)
STUDIES = {"planar": planar_study(), "hexapod": hexapod_study(3)}


@pytest.fixture(params=STUDIES)
def study(request: pytest.FixtureRequest) -> Study:
    made = STUDIES[request.param]
    return replace(made, calibration=calibration(made.machine, made.poses, accepted=False))


def named(found: xr.Dataset) -> dict[str, Table]:
    return {table.name: table for table in told.tables(found, MADE_UNITS)}


def test_every_table_is_rectangular(study: Study) -> None:
    for table in (
        *told.tables(study.calibrated, MADE_UNITS),
        *told.of_page(study.calibrated, MADE_UNITS),
    ):
        assert table.rows
        assert {len(row) for row in table.rows} == {len(table.header)}


def test_a_refusal_has_every_table_and_the_terminal_ends_with_what_to_do(study: Study) -> None:
    names = list(named(study.calibrated))
    assert names == [
        "suspicions", "outliers", "unknowns", "instruments", "undetermined", "residuals", "tool",
        "heed", "next",
    ]  # fmt: skip
    page_names = [table.name for table in told.of_page(study.calibrated, MADE_UNITS)]
    assert sorted(page_names) == sorted(names)
    assert page_names[:3] == ["suspicions", "undetermined", "next"]


def test_an_acceptance_has_no_empty_table(study: Study) -> None:
    found = calibration(study.machine, study.poses)
    assert list(named(found)) == [
        "outliers",
        "unknowns",
        "instruments",
        "residuals",
        "tool",
        "heed",
    ]


def test_unknowns_say_what_they_rest_on(study: Study) -> None:
    table = named(study.calibrated)["unknowns"]
    assert [row[0] for row in table.rows] == [label for label, _ in UNKNOWNS.values()]
    assert [row[1] for row in table.rows] == ["off tolerance", "", "mostly tolerance", "open"]
    for word in ("Off tolerance: ", "Mostly tolerance: ", "Open: "):
        assert word in table.note
    first, tilt, expansion = table.rows[0], table.rows[2], table.rows[3]
    assert first[2:7] == ("500.0000 mm", "500.2000 mm", "+0.200 mm", "58 µm", "10 µm")
    assert first[7].startswith("██████████")
    assert (tilt[2], tilt[3]) == ("–", "–")
    assert expansion[6] == "open"
    assert expansion[7] == "░░░░░░░░░░    0"


def test_unknowns_that_rest_on_their_tolerances_are_one_row(study: Study) -> None:
    found = study.calibrated.copy(deep=True)
    found["value"].values[0] = 0.0  # within its tolerance, as the second and third
    found["data_share"].values[:] = [0.049, 0.05, 0.001, 0.0]
    for table in (
        told.unknowns(found, MADE_UNITS),
        told.unknowns(found, MADE_UNITS, bars=False),
    ):
        labels = [row[0] for row in table.rows]
        # The last is open, which is worse than resting on a tolerance; the second has 5 %.
        assert labels == [
            "length of strut 2",
            "expansion of strut 1",
            "2 others rest on their tolerances",
        ]
        assert table.rows[-1][-1] == "less than 5"
        assert "more are in the files" not in table.note
    (text,) = told.csv_text(Result("calibrate", study.machine, found))
    assert all(name in text for name in UNKNOWNS)


def test_what_is_off_its_tolerance_or_alone_is_not_folded(study: Study) -> None:
    found = study.calibrated.copy(deep=True)
    found["data_share"].values[:] = 0.01
    rows = told.unknowns(found, MADE_UNITS).rows
    # The first is off its tolerance, the last open: a row each. The other two are folded.
    assert [row[1] for row in rows] == ["off tolerance", "open", ""]
    found["data_share"].values[1] = 0.5
    assert len(told.unknowns(found, MADE_UNITS).rows) == len(UNKNOWNS)


def test_where_nothing_was_learnt_there_is_the_one_row(study: Study) -> None:
    found = study.calibrated.isel(unknown=[1, 2])
    found["data_share"].values[:] = 0.0
    rows = told.unknowns(found, MADE_UNITS).rows
    assert [row[0] for row in rows] == ["2 unknowns rest on their tolerances"]


def test_what_is_less_certain_than_its_tolerance_is_told(study: Study) -> None:
    found = study.calibrated.copy(deep=True)
    found["standard_uncertainty"].values[1] = 1e-3
    assert named(found)["unknowns"].rows[1][1] == "less certain"


def test_residuals_are_by_instrument_and_unit(study: Study) -> None:
    found = study.calibrated
    table = named(found)["residuals"]
    assert [row[:3] for row in table.rows] == [
        ("tracker", "x, µm", "7"),
        ("tracker", "c, µrad", "7"),
    ]
    after = found["residual_after"].values[::2]
    assert float(table.rows[0][5]) == pytest.approx(1e6 * np.sqrt(np.mean(after**2)), abs=0.06)
    assert "5 folds" in table.note


def test_readings_that_do_not_fit_are_not_in_the_residuals(study: Study) -> None:
    found = study.calibrated.copy(deep=True)
    for name in ("residual_after", "normalised_after", "standardised"):
        found[name].values[0] = 100.0
    table = named(found)["residuals"]
    assert table.rows[0][2] == "6"
    assert float(table.rows[0][5]) < 100.0
    assert "Without the readings named" in table.note


def test_where_most_readings_do_not_fit_none_is_odd(study: Study) -> None:
    found = study.calibrated.copy(deep=True)
    found["standardised"].values[:] = 50.0
    tables = named(found)
    assert "wrong as a whole" in tables["outliers"].note
    assert tables["residuals"].rows[0][2] == "7"
    found.attrs["outliers"] = json.dumps(25 * json.loads(found.attrs["outliers"]))
    assert len(named(found)["outliers"].rows) == 20
    assert "5 more" in named(found)["outliers"].note


def test_the_tool_is_in_micrometres(study: Study) -> None:
    found = study.calibrated
    table = named(found)["tool"]
    assert table.rows[0][0] == "position, µm"
    highest = 1e6 * found["tool_size_after"].values[:, 0].max()
    assert float(table.rows[0][2]) == pytest.approx(highest, rel=1e-3)
    assert table.rows[0][5] == "0.50"
    assert "as a whole" in table.note


def test_a_tool_that_nothing_limits_is_open_and_one_without_a_before_has_a_dash(
    study: Study,
) -> None:
    found = study.calibrated.copy(deep=True)
    found["tool_size_after"].values[0] = np.inf
    found["tool_size_before"].values[:] = np.nan
    row = named(found)["tool"].rows[0]
    assert row[1:] == ("–", "open", "–", "open", "–")
    drawn = replace(study, calibration=found)
    assert "no before" in calibration_tool.caption(drawn)
    assert "nothing limits" in calibration_tool.caption(drawn)
    assert len(checked(calibration_tool.figure(drawn)).data) == 1


def test_suspicions_outliers_and_what_to_measure(study: Study) -> None:
    tables = named(study.calibrated)
    assert tables["suspicions"].rows == (
        ("swapped-columns", "yes", "tracker: it looks as if x and y were exchanged"),
    )
    assert tables["outliers"].rows == (("tracker", "x", "11", "−12.3"),)
    assert tables["next"].rows == (("Probe in x and y too.",),)
    assert "position known to 12 µm" in tables["next"].note


def test_a_large_machine_is_cut(study: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(told, "MOST_UNKNOWNS", 2)
    table = named(study.calibrated)["unknowns"]
    assert len(table.rows) == 2
    assert "2 more are in the files" in table.note
    monkeypatch.setattr(calibration_unknowns, "MOST_DRAWN", 3)
    assert "the 3 of 4 unknowns" in calibration_unknowns.caption(study)
    assert len(checked(calibration_unknowns.figure(study)).data[0].y) == 3
    monkeypatch.setattr(calibration_correlation, "MOST_DRAWN", 2)
    assert "the first 2 unknowns" in calibration_correlation.caption(study)


@pytest.mark.parametrize("figure", FIGURES)
def test_figures_show_the_dataset(figure: object, study: Study) -> None:
    drawn = checked(figure.figure(study))  # type: ignore[attr-defined]
    assert drawn.data
    assert figure.caption(study).endswith(".")  # type: ignore[attr-defined]


def test_residuals_are_drawn_in_micrometres_by_line(study: Study) -> None:
    drawn = checked(calibration_residuals.figure(study))
    before = next(each for each in drawn.data if each.name == "before")
    np.testing.assert_allclose(
        before.y, 1e6 * study.calibrated["residual_before"].values[::2], rtol=1e-6
    )
    np.testing.assert_array_equal(before.x, np.arange(7) + 9)
    assert drawn.layout.xaxis3.title.text == "line of the file"


def test_one_wrong_reading_does_not_flatten_the_others(study: Study) -> None:
    found = study.calibrated.copy(deep=True)
    for name in ("residual_after", "normalised_after", "standardised", "held_out_after"):
        found[name].values[0] = 1e3
    shown = replace(study, calibration=found)
    low, high = checked(calibration_residuals.figure(shown)).layout.yaxis2.range
    assert -100 < low < high < 100
    assert "further out" in calibration_residuals.caption(shown)


def test_changes_are_in_half_bands(study: Study) -> None:
    drawn = checked(calibration_unknowns.figure(study))
    change = drawn.data[-1]
    np.testing.assert_allclose(change.x, [2.0, -0.5, 0.5, np.nan])
    assert change.text[0] == "+0.200 mm"
    shares = [each.x for each in drawn.data[:2]]
    np.testing.assert_allclose(shares[0] + shares[1], 100.0)


def test_the_strongest_correlation_is_named(study: Study) -> None:
    said = calibration_correlation.says(study)
    assert (
        "length of strut 1 and length of strut 2: their correlation is \N{MINUS SIGN}0.970" in said
    )


def test_figures_say_what_the_tables_say(study: Study) -> None:
    found = study.calibrated
    (name, what, _, stated, before, after, *_), *_ = told.residuals(found, MADE_UNITS).rows
    said = calibration_residuals.says(study)
    assert f"residuals of {name} fall from {before} to {after}" in said
    assert f"stated were {stated} {what.rpartition(', ')[2]}" in said
    worst = told.tool(found, MADE_UNITS).rows[0]
    assert f"at most {worst[2]}" in calibration_tool.says(study)
    assert f"up to {worst[1]}" in calibration_tool.says(study)
    assert "Of 4 unknowns 2 come mostly from the measurements" in calibration_unknowns.says(study)
    shown = calibration_map.says(study)
    normalised = found["normalised_after"].values.reshape(-1, 2)
    largest = np.sqrt(np.nanmean(normalised**2, axis=1)).max()
    assert f"{largest:.2f} times their stated" in shown


def test_the_page_begins_with_it(study: Study) -> None:
    text = page.render(study)
    first, second = "May the calibrated machine be used?", "Is the machine as filed good enough?"
    assert text.index(first) < text.index(second) < text.index('id="calibration"')
    assert "Calibration and positioning error report" in text
    without = page.render(replace(study, calibration=None))
    assert 'id="calibration"' not in without
    assert "calibration_tool" not in without


def test_a_row_without_a_pose_is_at_no_place_of_the_map(study: Study) -> None:
    """The map is that of the other rows, with all their axes."""
    found = study.calibrated
    names = [f"row_{name}" for name in study.machine.dof]
    poses = {name: found[name].values.astype(float) for name in names}
    for values in poses.values():
        values[-1] = np.nan
    without = found.assign_coords({name: ("row", values) for name, values in poses.items()})
    last = found["observation_row"].values == len(found["row"]) - 1
    fewer = found.isel(row=slice(-1), observation=~last)
    drawn, expected = (
        checked(calibration_map.figure(replace(study, calibration=each))).to_json()
        for each in (without, fewer)
    )
    assert drawn == expected
    nowhere = {name: ("row", np.full(len(found["row"]), np.nan)) for name in names}
    empty = checked(
        calibration_map.figure(replace(study, calibration=found.assign_coords(nowhere)))
    )
    assert not len(empty.data[0].x)


def test_sentences_have_the_numbers_of_their_rows(study: Study) -> None:
    known = told.tool(study.calibrated, MADE_UNITS)
    left = told.residuals(study.calibrated, MADE_UNITS)
    assert f"({known.rows[0][0]}) goes from {known.rows[0][1]} to {known.rows[0][2]}." in known.says
    name, what, *_, before, after = left.rows[0][:6]
    assert left.says == f"{name}: the residuals go from {before} to {after} ({what})."
