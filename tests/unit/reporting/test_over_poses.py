"""Errors over poses: one after the other where they are few, sorted where they are many."""

from __future__ import annotations

import itertools

import numpy as np
import plotly.graph_objects as go
import pytest

from checked_figures import checked
from made_study import hexapod_study, planar_study
from truepose.reporting.display import pose_text
from truepose.reporting.figures import _over_poses, before_after, overall_error, source_errors
from truepose.reporting.figures._flow import Flow
from truepose.reporting.figures._lattice import lattice, turns
from truepose.reporting.study import Study

FEW, MANY = planar_study(), hexapod_study(4)


def lines(figure: go.Figure, name: str) -> list[go.Scatter]:
    """The traces of this name, in the order of their panels."""
    return [each for each in figure.data if each.name == name]


def test_few_poses_are_drawn_one_after_the_other_in_micrometres() -> None:
    names = {"all at upper ends": "overall_error_upper", "all at lower ends": "overall_error_lower"}
    found = checked(overall_error.figure(FEW))
    alone = checked(source_errors.figure(FEW))
    for name, variable in names.items():
        for component in range(2):
            line = lines(found, name)[component]
            kept = np.isfinite(line.y)
            expected = FEW.budget[variable].values[:, component] * 1e6
            np.testing.assert_allclose(line.y[kept], expected, rtol=1e-6)
            np.testing.assert_array_equal(line.x[kept], np.arange(1, 26))
            of_tolerance = lines(alone, f"tolerance, {name}")[component]
            variable_alone = variable.removeprefix("overall_")
            expected = FEW.budget[variable_alone].sel(source="tolerance").values[:, component]
            np.testing.assert_allclose(of_tolerance.y[kept], expected * 1e6, rtol=1e-6)


def test_lines_break_where_the_grid_turns_and_where_poses_are_left_out() -> None:
    line = lines(checked(overall_error.figure(FEW)), "known error")[0]
    assert list(np.flatnonzero(np.isnan(line.y))) == [5, 11, 17, 23], "between rows of five"
    fewer = Study(FEW.machine, FEW.budget.isel(pose=[0, 1, 3, 4, 5, 6]))
    assert list(turns(fewer)) == [False, True, False, True, False]
    line = lines(checked(overall_error.figure(fewer)), "known error")[0]
    assert [int(x) for x in line.x[np.isfinite(line.x)]] == [1, 2, 4, 5, 6, 7]


def test_poses_of_a_disc_or_of_a_path_are_no_grid() -> None:
    turn = np.linspace(0.0, 2 * np.pi, 40, endpoint=False)
    disc = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    assert lattice(disc) is None
    assert lattice(disc[:0]) is None
    grid = np.array(list(itertools.product([0.0, 0.1, 0.3], [5.0], [1.0, 2.0])))
    found = lattice(grid[1:])
    assert found is not None
    assert found.varying == [0, 2]
    for coordinate, values in enumerate(found.values):
        np.testing.assert_array_equal(values[found.steps[:, coordinate]], grid[1:, coordinate])


def test_many_poses_are_sorted_so_that_a_share_has_at_least_that_error() -> None:
    assert MANY.n_pose == 64
    found = checked(overall_error.figure(MANY))
    for component in range(6):
        line = lines(found, "known error")[component]
        sizes = np.abs(MANY.budget["overall_error"].values[:, component]) * 1e6
        for share, size in zip(line.x, line.y, strict=True):
            larger, at_least = ((sizes > size * factor).sum() for factor in (1 + 1e-6, 1 - 1e-6))
            assert larger < round(share * 0.64, 3) <= at_least, "of equal ones any"
    tolerance = lines(checked(source_errors.figure(MANY)), "tolerance")[0]
    ends = [MANY.budget[f"error_{end}"].sel(source="tolerance") for end in ("upper", "lower")]
    largest = max(float(np.abs(end.values[:, 0]).max()) for end in ends)
    assert tolerance.y[0] == pytest.approx(largest * 1e6, rel=1e-6)
    assert "64 poses are too many" in source_errors.caption(MANY)


def test_a_sorted_line_has_few_points_of_all_poses() -> None:
    values = np.random.default_rng(0).normal(size=5000)
    values[17] = np.nan
    shares, sizes = _over_poses.sorted_sizes(values)
    assert len(shares) == _over_poses.MOST_SORTED
    assert sizes[0] == np.nanmax(np.abs(values))
    assert sizes[-1] == np.nanmin(np.abs(values))
    assert shares[-1] == pytest.approx(100 * 4999 / 5000), "one is missing"
    assert (np.diff(sizes) <= 0).all()


def test_slices_go_through_the_worst_pose_along_each_freedom() -> None:
    found = checked(overall_error.figure(MANY))
    panels = lines(found, "known error")[6:]
    worst = MANY.poses[int(MANY.largest.argmax())]
    assert len(panels) == 3, "a, b and c do not move"
    for axis, line in enumerate(panels):
        along = [
            at
            for at, pose in enumerate(MANY.poses)
            if np.allclose(np.delete(pose, axis), np.delete(worst, axis))
        ]
        np.testing.assert_allclose(line.x, MANY.poses[along, axis] * 1e3, rtol=1e-6)
        errors = MANY.budget["overall_error"].values[along, :3]
        np.testing.assert_allclose(line.y, np.linalg.norm(errors, axis=1) * 1e6, rtol=1e-6)
    dotted = [shape.x0 for shape in found.layout.shapes]
    np.testing.assert_allclose(dotted, worst[:3] * 1e3)
    assert pose_text(worst, MANY.machine.commanded, MANY.units) in overall_error.caption(MANY)


def test_before_is_an_outline_and_after_is_filled() -> None:
    for study in (FEW, MANY):
        found = checked(before_after.figure(study))
        (before, after) = (lines(found, name)[0] for name in ("before", "after"))
        assert before.line.dash == "dash"
        assert before.fill is None
        assert after.fill == ("toself" if study is FEW else "tozeroy")
        ends = [np.abs(study.compensated(f"residual_{end}")[:, 0]) for end in ("lower", "upper")]
        np.testing.assert_allclose(np.nanmax(np.abs(after.y)), np.max(ends) * 1e6, rtol=1e-6)
    rows = lines(checked(before_after.figure(FEW)), "after")[0].y
    assert np.isnan(rows).sum() == 5, "an outline for each row of the grid"


def test_each_says_the_largest_of_what_it_draws() -> None:
    for study in (FEW, MANY):
        for figure, variable in ((source_errors, "error"), (overall_error, "overall_error")):
            errors = np.stack(
                [study.budget[f"{variable}_{end}"].values for end in ("lower", "upper")]
            ).reshape(2, study.n_pose, -1, len(study.components))[..., study.positions]
            size = np.abs(errors).max()
            _, pose, source, axis = np.argwhere(np.abs(errors) >= size * (1 - 1e-9))[0]
            said = figure.says(study)
            assert f"{size * 1e6:.1f} µm in {study.components[axis]}" in said
            assert pose_text(study.poses[pose], study.machine.commanded, study.units) in said
            assert (study.sources[source] in said) == (figure is source_errors)
        worst = np.abs(errors).max(axis=(0, 1, 2))
        axis = int(worst.argmax())
        left = max(
            np.abs(study.compensated(f"residual_{end}")[:, axis]).max()
            for end in ("lower", "upper")
        )
        said = before_after.says(study)
        assert f"in {study.components[axis]} goes from {worst[axis] * 1e6:.1f} µm" in said
        assert said.endswith(f"to {left * 1e6:.1f} µm.")


def test_more_sources_than_colours_are_not_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(source_errors, "SOURCE_COLOURS", ("#000000",) * 2)
    drawn = checked(source_errors.figure(MANY))
    assert {each.name for each in drawn.data} == {MANY.sources[at] for at in MANY.by_rank[:2]}
    assert "2 of 3 sources" in source_errors.caption(MANY)


def test_a_small_screen_has_the_panels_below_each_other() -> None:
    flow = Flow(list("abcde"), columns=3, narrow=2)
    plot = flow.empty()
    narrow = plot.layout["meta"]["narrow"]
    other = Flow(list("abcde"), columns=2, narrow=2, panel=flow.narrow_panel, apart=(0.14, 0.14))
    expected = other.empty().layout
    assert narrow["height"] == expected["height"] == other.height
    for number in range(5):
        for axis in "xy":
            name = f"{axis}axis{number + 1 if number else ''}"
            assert narrow[f"{name}.domain"] == expected[name]["domain"]
            title = expected["annotations"][number]
            assert narrow[f"annotations[{number}].{axis}"] == title[axis]
    assert [flow.place(at) for at in (0, 2, 3)] == [
        {"row": 1, "col": 1},
        {"row": 1, "col": 3},
        {"row": 2, "col": 1},
    ]
