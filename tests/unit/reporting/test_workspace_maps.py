"""Maps of the workspace: every value at its place, slices of space, own scales and one."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go
import pytest

from checked_figures import checked
from made_study import MADE_UNITS, hexapod_study, planar_study
from truepose.arrays import Floats
from truepose.reporting.display import pose_text
from truepose.reporting.figures import _map_panels, workspace_maps
from truepose.reporting.figures._map_panels import chosen_of, contours_between, panels_of
from truepose.reporting.figures._maps import places_of
from truepose.reporting.study import Study

PLANE, SPACE = planar_study(), hexapod_study(5)


def at_poses(study: Study, poses: Floats) -> Study:
    """The study with other coordinates x, y, z of as many of its poses."""
    budget = study.budget.isel(pose=np.arange(len(poses))).copy()
    for name, column in zip("xyz", poses.T, strict=False):
        budget[f"pose_{name}"] = ("pose", column)
    return Study(study.machine, budget)


def maps_of(figure: go.Figure) -> list[go.Contour | go.Scatter]:
    return [each for each in figure.data if each.name != "largest and least"]


def titles(figure: go.Figure) -> list[str]:
    return [note.text for note in figure.layout.annotations if note.xref == "paper"]


def test_a_map_has_each_value_at_its_place() -> None:
    drawn = checked(workspace_maps.figure(PLANE))
    first = drawn.data[0]
    for pose, size in zip(PLANE.poses, PLANE.largest * 1e6, strict=True):
        column = int(np.argmin(np.abs(first.x - pose[0] * 1e3)))
        row = int(np.argmin(np.abs(first.y - pose[1] * 1e3)))
        assert first.z[row, column] == pytest.approx(size, rel=1e-6)
    assert titles(drawn) == ["all sources", "after compensation", "tolerance", "thermal", "elastic"]


def test_each_map_has_its_own_scale_and_a_button_gives_all_one() -> None:
    for study, n_panel in ((PLANE, 1), (SPACE, 3)):
        drawn = checked(workspace_maps.figure(study))
        maps = maps_of(drawn)
        own, one = (button.args for button in drawn.layout.updatemenus[0].buttons)
        assert [each.coloraxis for each in maps] == list(own[0]["coloraxis"])
        assert list(one[0]["coloraxis"]) == ["coloraxis"] * len(maps)
        assert list(own[2]) == list(range(len(maps))), "what is restyled are the maps"
        first = drawn.layout.coloraxis2
        ends = study.largest.min() * 1e6, study.largest.max() * 1e6
        assert (first.cmin, first.cmax) == pytest.approx(ends)
        highest = max(study.largest.max(), study.values("largest")[:, :, 0].max()) * 1e6
        assert (drawn.layout.coloraxis.cmin, drawn.layout.coloraxis.cmax) == (
            0,
            pytest.approx(highest),
        )
        assert len({each.coloraxis for each in maps[:n_panel]}) == 1, "all slices of a map"
        assert {own[1]["coloraxis.showscale"], own[1]["coloraxis2.showscale"]} == {True, False}


def test_space_is_cut_into_slices_with_the_worst_among_them() -> None:
    drawn = checked(workspace_maps.figure(SPACE))
    worst = SPACE.poses[int(SPACE.largest.argmax()), 2]
    shown = [title.partition("\n")[2] for title in titles(drawn)]
    assert shown[0] == "z 500 mm"
    assert shown[2] == "z 700 mm"
    assert f"z {worst * 1e3:.0f} mm" in shown[:3]
    for nth, title in enumerate(shown[:3]):
        level = np.isclose(SPACE.poses[:, 2] * 1e3, float(title.split()[1]))
        grid = maps_of(drawn)[nth].z
        np.testing.assert_allclose(
            np.sort(grid.ravel()), np.sort(SPACE.largest[level] * 1e6), rtol=1e-6
        )
    assert "3 of 5 slices" in workspace_maps.caption(SPACE)
    # Dominant is the tolerance alone: others have no row of slices.
    assert {title.partition("\n")[0] for title in titles(drawn)} == {
        "all sources",
        "after compensation",
        "tolerance",
    }


def test_the_largest_and_the_least_are_written_where_they_are() -> None:
    drawn = checked(workspace_maps.figure(PLANE))
    sizes = PLANE.largest * 1e6
    notes = [each for each in drawn.layout.annotations if each.xref == "x"]
    for note, at in zip(notes, (sizes.argmax(), sizes.argmin()), strict=True):
        assert float(note.text) == pytest.approx(sizes[at], abs=0.5)
        found = np.flatnonzero(np.isclose(PLANE.poses * 1e3, (note.x, note.y)).all(axis=1))
        assert sizes[found] == pytest.approx(sizes[at], rel=1e-9)
        said = workspace_maps.says(PLANE)
        assert f"{sizes[at]:.1f} µm" in said
        assert pose_text(PLANE.poses[found[0]], PLANE.machine.commanded, PLANE.units) in said


def test_poses_that_differ_in_what_is_not_shown_give_the_largest() -> None:
    study = hexapod_study(3)
    budget = study.budget.isel(pose=np.repeat(np.arange(27), 2)).copy(deep=True)
    budget["pose_a"] = ("pose", np.tile([0.0, 0.1], 27))
    budget["linear_maximum"][1::2] *= 2.0
    twice = Study(study.machine, budget)
    drawn = maps_of(checked(workspace_maps.figure(twice)))
    shown = np.concatenate([each.z.ravel() for each in drawn[:3]])
    np.testing.assert_allclose(np.sort(shown), np.sort(2e6 * study.largest), rtol=1e-6)
    assert "Over a the largest is shown." in workspace_maps.caption(twice)


def test_places_that_are_no_grid_are_coloured_points() -> None:
    turn = np.linspace(0.0, 2 * np.pi, 20, endpoint=False)
    ring = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    layers = np.vstack([np.c_[ring, np.full(20, height)] for height in (0.0, 0.5)])
    path = np.c_[ring, np.linspace(0.0, 1.0, 20)]
    for poses, n_panel, seen in ((layers, 2, "z 500 mm"), (path, 2, "seen from the front")):
        study = at_poses(SPACE, poses)
        drawn = checked(workspace_maps.figure(study))
        points = maps_of(drawn)[:n_panel]
        assert all(each.type == "scatter" for each in points)
        assert titles(drawn)[1] == f"all sources\n{seen}"
        colours = np.concatenate([each.marker.color for each in points])
        expected = np.tile(study.largest, 1 if poses is layers else 2) * 1e6
        np.testing.assert_allclose(np.sort(colours), np.sort(expected), rtol=1e-6)
    button = drawn.layout.updatemenus[0].buttons[1]
    assert set(button.args[0]) == {"marker.coloraxis"}


def test_poses_left_out_of_a_grid_are_holes() -> None:
    fewer = Study(PLANE.machine, PLANE.budget.isel(pose=np.arange(1, 25)))
    grid = checked(workspace_maps.figure(fewer)).data[0].z
    assert np.isnan(grid[0, 0])
    assert np.isfinite(grid).sum() == 24


def test_large_grids_keep_their_ends_and_the_worst() -> None:
    assert list(chosen_of(3, 3, 1)) == [0, 1, 2]
    for kept in range(9):
        chosen = chosen_of(9, 3, kept)
        assert (chosen[0], chosen[-1], len(chosen)) == (0, 8, 3)
        assert kept in chosen
    study = planar_study(60)
    grid = checked(workspace_maps.figure(study)).data[0].z
    assert grid.shape == (44, 44), "no more than 2000"
    assert grid.max() == pytest.approx(study.largest.max() * 1e6, rel=1e-4)


@pytest.mark.parametrize(("low", "high"), [(0.0, 683.0), (3957.0, 4138.0), (-3.0, 1e-6)])
def test_contours_are_at_round_numbers(low: float, high: float) -> None:
    found = contours_between(low, high)
    levels = np.arange(found["start"], found["end"], found["size"])
    assert 3 <= len(levels) <= 10
    assert (low < levels).all()
    steps = levels / found["size"]
    np.testing.assert_allclose(steps, steps.round(), atol=1e-9)
    assert f"{found['size']:.0e}"[0] in "125"
    assert contours_between(2.0, 2.0)["size"] > 0


def test_one_pose_and_a_line_of_poses_are_drawn() -> None:
    for count in (1, 5):
        study = Study(PLANE.machine, PLANE.budget.isel(pose=np.arange(count)))
        drawn = checked(workspace_maps.figure(study))
        assert len(maps_of(drawn)[0].x) == count
        low, high = drawn.layout.yaxis.range
        assert low < 100.0 < high
    assert workspace_maps.says(Study(PLANE.machine, PLANE.budget.isel(pose=[0]))).startswith("At x")


def test_a_panel_of_a_plane_has_no_title_of_its_own() -> None:
    places = places_of(PLANE.poses, ("x", "y"), MADE_UNITS)
    (panel,) = panels_of(places, PLANE.largest)
    assert panel.title == ""
    assert _map_panels.slices_left_out(places) is None
