"""Every registered figure on every kind of machine: what is drawn is what the Datasets say."""

from __future__ import annotations

from dataclasses import replace
from itertools import chain

import numpy as np
import plotly.graph_objects as go
import pytest

from checked_figures import checked
from made_how_sure import shares, sure_study
from made_study import MADE_UNITS, hexapod_study, planar_study
from sweeps import sweep
from truepose.reporting import figures, variance_shares, within
from truepose.reporting.display import pose_text
from truepose.reporting.figures import (
    FIGURES,
    _style,
    coverage_ellipses,
    distribution,
    draw,
    error_over_time,
    internal_forces,
    machine_drawing,
    ranking,
    tornado,
)
from truepose.reporting.study import Study

STUDIES = {
    "planar": sure_study(planar_study()),
    "hexapod": sure_study(hexapod_study(3)),
    "one pose": sure_study(planar_study(1)),
}
NEEDING = {module.__name__.rpartition(".")[2] for module in FIGURES if hasattr(module, "NEEDS")}


@pytest.fixture(params=STUDIES)
def study(request: pytest.FixtureRequest) -> Study:
    return STUDIES[request.param]


def test_the_registry_holds_every_module_of_the_folder() -> None:
    from importlib.resources import files

    folder = files("truepose.reporting.figures")
    modules = {
        path.name.removesuffix(".py")
        for path in folder.iterdir()
        if path.name.endswith(".py") and not path.name.startswith("_")
    }
    assert {module.__name__.rpartition(".")[2] for module in FIGURES} == modules


def test_every_figure_has_traces_a_title_and_a_caption(study: Study) -> None:
    drawn = list(draw(study))
    assert len(drawn) == len(FIGURES)
    for each in drawn:
        figure = checked(each.figure)
        assert figure.data, each.name
        assert each.title
        assert each.caption.endswith(".")
        assert figure.layout.height > 100


def test_figures_of_results_that_not_every_study_has_need_one(study: Study) -> None:
    names = {each.name for each in draw(Study(study.machine, study.budget))}
    every = {module.__name__.rpartition(".")[2] for module in FIGURES}
    assert names == every - NEEDING
    assert {"before_after", "error_over_time", "internal_forces", "tornado"} <= NEEDING


def trace(figure: go.Figure, name: str, nth: int = 0) -> go.Scatter:
    return [each for each in figure.data if each.name == name][nth]


def test_bars_are_the_highest_with_the_largest_on_top(study: Study) -> None:
    bars = checked(ranking.figure(study)).data[0]
    assert list(bars.y) == ["elastic", "thermal", "tolerance"]
    expected = study.budget["highest"].sel(quantity="position", source=list(bars.y)).values
    np.testing.assert_allclose(bars.x, expected * 1e6, rtol=1e-6)
    largest = study.budget["largest"].sel(quantity="position", source="tolerance")
    where = pose_text(
        study.poses[int(largest.values.argmax())], study.machine.commanded, MADE_UNITS
    )
    share = 100 * expected[2] / expected.sum()
    said = ranking.says(study)
    assert f"tolerance can do most: up to {expected[2] * 1e6:.1f} µm at {where}" in said
    assert f"{share:.0f} %" in said


def test_internal_forces_are_those_of_the_sources_and_of_every_closure(study: Study) -> None:
    figure = checked(internal_forces.figure(study))
    for name, variable in (
        ("with clearances", "highest_force"),
        ("without clearances", "highest_force_rigid"),
    ):
        bars = trace(figure, name)
        assert list(bars.y) == ["thermal", "tolerance"], "the largest on top"
        expected = study.strained[variable].sel(source=list(bars.y)).values
        np.testing.assert_allclose(bars.x, expected, rtol=1e-6)
    for closure in study.strained["closure"].values:
        line = trace(figure, str(closure))
        expected = study.strained["overall_force"].sel(closure=closure).values
        np.testing.assert_allclose(line.y[np.isfinite(line.y)], expected, rtol=1e-6)
    assert "more closures than freedoms" in internal_forces.caption(study)
    force = study.strained["overall_force"].stack(at=("pose", "closure"))
    largest = force[np.abs(force.values).argmax()]
    said = internal_forces.says(study)
    assert f"is {float(largest):.1f} N in {largest['closure'].item()}, at " in said
    assert (
        pose_text(study.poses[largest["pose"].item()], study.machine.commanded, MADE_UNITS) in said
    )


def test_the_drawing_joins_carriages_and_tool() -> None:
    study = planar_study()
    figure = checked(machine_drawing.figure(study))
    struts = trace(figure, "as commanded")
    known = study.position_norm(study.values("overall_error"))
    x, y = 1e3 * study.poses[int(np.argmax(known))]
    heights = [y + np.sqrt(500**2 - (x - rail) ** 2) for rail in (0, 600)]
    np.testing.assert_allclose(struts.x[[0, 1, 3, 4]], [0, x, 600, x], atol=1e-3)
    np.testing.assert_allclose(struts.y[[0, 1, 3, 4]], [heights[0], y, heights[1], y], rtol=1e-5)
    assert figure.layout.yaxis.scaleanchor == "x", "drawn to scale"
    guideways = trace(figure, "travel of the drives")
    assert (np.nanmin(guideways.y), np.nanmax(guideways.y)) == (0, 900)


def test_the_actual_platform_and_the_arrows_are_so_many_times_their_errors() -> None:
    study = planar_study()
    figure = checked(machine_drawing.figure(study))
    known = study.values("overall_error")[:, study.positions]
    worst = int(np.argmax(study.position_norm(study.values("overall_error"))))
    arrows = next(each for each in figure.data if each.name.startswith("known error, "))
    factor = float(arrows.name.split()[2].replace(",", ""))
    at, to = np.stack([arrows.x, arrows.y], axis=-1).reshape(-1, 3, 2)[:, :2].swapaxes(0, 1)
    for start, end in zip(at, to, strict=True):
        pose = int(np.argmin(np.linalg.norm(study.poses * 1e3 - start, axis=1)))
        np.testing.assert_allclose((end - start) / factor, known[pose] * 1e3, atol=1e-3)
    actual = next(each for each in figure.data if each.name.startswith("as it is"))
    tool = np.array([actual.x[-2], actual.y[-2]])
    np.testing.assert_allclose(tool, 1e3 * (study.poses[worst] + factor * known[worst]), atol=1e-2)
    assert f"{factor:,.0f} times" in machine_drawing.says(study)


def test_the_drawing_of_a_body_has_its_platform_and_frame() -> None:
    study = hexapod_study(3)
    figure = checked(machine_drawing.figure(study))
    for name in ("platform", "frame"):
        outline = trace(figure, name)
        assert len(outline.x) == 7, "six corners, closed"
        x, y = outline.x - outline.x[:6].mean(), outline.y - outline.y[:6].mean()
        radius = np.hypot(x, y)
        assert np.allclose(radius, radius[0], rtol=1e-4)
        turn = np.unwrap(np.arctan2(y, x))
        assert abs(turn[-1] - turn[0]) == pytest.approx(2 * np.pi), "once round, no crossing"
    assert figure.layout.scene.aspectmode == "data"


@sweep
def test_values_are_kept_in_single_precision(study: Study) -> None:
    for each in figures.draw(study):
        for one in checked(each.figure).data:
            for values in (one.y, getattr(one, "z", None)):
                if isinstance(values, np.ndarray) and values.dtype.kind == "f":
                    assert values.dtype == np.float32, (each.name, one.name)


def test_the_error_over_time_is_drawn_at_each_pose_and_over_the_temperatures(study: Study) -> None:
    drawn = checked(error_over_time.figure(study))
    errors = study.time["error"].values * 1e6
    lines = [each for each in drawn.data if each.line.color == _style.source_colour(0)]
    assert len(lines) == errors.shape[1] * errors.shape[2]
    assert np.allclose(lines[0].y, errors[:, 0, 0], atol=5e-5), (
        "to what is drawn of ten micrometres"
    )
    assert np.allclose(lines[0].x, study.time["time"].values / 60.0, atol=5e-4)
    assert lines[0].line.dash != lines[-1].line.dash
    others = [each for each in drawn.data if each.line.color != _style.source_colour(0)]
    # Strut 2 and frame go by one temperature, the tool is not in the log.
    assert [each.name for each in others] == ["strut.1", "strut.2 and 1 more"]
    temperatures = study.time["temperature"].values[:, 0] - 273.15
    assert np.allclose(others[0].y, temperatures, atol=5e-4)
    titles = {note.text for note in drawn.layout.annotations}
    assert {"error in x, µm", "temperature, °C"} <= titles
    assert "time, min" in {axis.title.text for axis in drawn.select_xaxes()}
    assert "log.csv" in error_over_time.caption(study)
    size = np.linalg.norm(errors[..., study.positions], axis=-1).max()
    said = error_over_time.says(study)
    assert f"up to {size:.4g} µm" in said
    assert "60.0 min after" in said


def test_many_times_are_thinned_and_the_last_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    study = STUDIES["planar"]
    monkeypatch.setattr(error_over_time, "MOST_DRAWN", 50)
    x = np.asarray(checked(error_over_time.figure(study)).data[0].x)
    assert len(x) <= 51
    assert x[-1] == pytest.approx(60.0)
    assert "of 361 times" in error_over_time.caption(study)


def test_the_distribution_is_of_the_machines_that_were_drawn(study: Study) -> None:
    figure = checked(distribution.figure(study))
    kinds = ["position", "orientation"][: 2 if study.rotations else 1]
    for nth, kind in enumerate(kinds):
        before, after = (each for each in study.sampled if each.quantity == kind)
        bars = trace(figure, "after compensation", nth)
        assert np.sum(bars.y) == pytest.approx(100.0)
        # Of squares that are uniform the share up to an edge is its square.
        upper = np.asarray(bars.x) + 0.5 * bars.width
        share = 0.95 * (upper / (after.linear.value * 1e6)) ** 2
        np.testing.assert_allclose(np.cumsum(bars.y) / 100.0, np.minimum(share, 1.0), atol=1e-3)
        outline = trace(figure, "before compensation", nth)
        edges, heights = np.asarray(outline.x)[1:-1:2], np.asarray(outline.y)[1:-1:2]
        assert np.sum(heights) == pytest.approx(100.0)
        assert len(edges) == len(heights) == distribution.BARS
        marks = [each.x[0] for each in figure.data if len(each.x) == 1]
        wanted = [before.linear.value * 1e6, after.linear.value * 1e6]
        assert marks[2 * nth : 2 * nth + 2] == pytest.approx(wanted, rel=1e-6)


def test_how_many_keep_what_is_asked_is_one_number(study: Study) -> None:
    before, after = within.shares_within(study)
    for found, answer in zip(
        (before, after), study.sampled[:: len(study.sampled) // 2], strict=True
    ):
        exact = min(0.95 * (found.asked / answer.linear.value) ** 2, 1.0)
        assert found.share == pytest.approx(exact, abs=1.0 / found.draws)
        assert found.text in distribution.says(study)
        assert found.text in within.within_note(study)
    (line,) = checked(distribution.figure(study)).layout.shapes or [None]
    (note,) = distribution.figure(study).layout["annotations"]
    assert f"kept by {before.short} before, {after.short} after" in note["text"]
    if line is not None:
        assert line.x0 == pytest.approx(500.0)


@pytest.mark.parametrize(
    ("share", "text", "short"),
    [
        (1.0, "more than 99.92 %", "> 99.92 %"),
        (0.99975, "99.97 %", "99.97 %"),
        (0.98996, "98.9 %", "98.9 %"),
        (0.0, "0.0 %", "0.0 %"),
    ],
)
def test_a_share_is_never_rounded_up(share: float, text: str, short: str) -> None:
    found = within.Within("position", "before compensation", 5e-4, share, 4000)
    assert (found.text, found.short) == (text, short)


def test_the_tornado_has_the_largest_on_top(study: Study) -> None:
    assert study.shares is not None
    who = variance_shares.blame(study.shares, variance_shares.spread_pose(study.shares))
    large = [at for at, share in enumerate(who.kinds["total"]) if share >= 0.01]
    drawn = checked(tornado.figure(study))
    names = [name.partition(" + ")[0] for name in trace(drawn, "total").y]
    assert names == [who.names[at] for at in large if who.names[at] in names][::-1]
    for kind, name in (("first", "first order"), ("total", "total"), ("linear", "linear")):
        bars = trace(drawn, name)
        groups = [text.split(", ") for text in trace(drawn, "total").text]
        assert sorted(chain(*groups)) == sorted(who.names[at] for at in large)
        share = dict(zip(who.names, who.kinds[kind], strict=True))
        wanted = [100 * np.mean([share[each] for each in group]) for group in groups]
        np.testing.assert_allclose(bars.x, wanted, rtol=1e-6)
    correlated = replace(study, shares=shares(study.machine, study.poses[:1], correlated=True))
    kinds = {each.name for each in checked(tornado.figure(correlated)).data}
    assert kinds == {"Shapley", "linear"}
    assert "Shapley shares do" in tornado.caption(correlated)


def test_an_ellipse_holds_what_it_says(study: Study) -> None:
    found = study.ellipses
    assert found is not None
    centre, outline = coverage_ellipses.ellipse(found, 0, (0, 1))
    matrix = found["ellipse"].values[0][:2, :2]
    squared = np.einsum("ni,ij,nj->n", outline, np.linalg.inv(matrix), outline)
    np.testing.assert_allclose(squared, 1.0, rtol=1e-9)
    np.testing.assert_array_equal(centre, found["ellipse_centre"].values[0, :2])
    flat = found.copy(deep=True)
    flat["ellipse"].values[:] = 0.0
    flat["ellipse"].values[:, 0, 0] = 1e-10
    _, line = coverage_ellipses.ellipse(flat, 0, (0, 1))
    assert (line[:, 0].max(), abs(line[:, 1]).max()) == (pytest.approx(1e-5), 0.0)


def test_ellipses_do_not_touch_and_are_to_one_scale(study: Study) -> None:
    drawn = checked(coverage_ellipses.figure(study))
    outlines = [each for each in drawn.data if each.legendgroup == "ellipse"]
    circles = [each for each in drawn.data if each.legendgroup == "asked"]
    assert study.ellipses is not None
    assert len(circles) == len(outlines), "what is asked about every pose"
    times = coverage_ellipses.magnified(study)
    assert np.ptp(circles[0].x) == pytest.approx(2 * 0.5 * times, rel=1e-5), "0.5 mm"
    sizes = study.ellipses["magnitude_upper"].values[:, 0]
    assert f"at {(sizes <= 5e-4).sum()} of {len(sizes)} poses" in coverage_ellipses.says(study)
    spatial = study.ellipses.sizes["axis"] == 3
    assert len(outlines) == (27 if spatial else study.ellipses.sizes["pose"])
    first, second = outlines[0], outlines[min(1, len(outlines) - 1)]
    if first is not second and first.xaxis == second.xaxis:
        apart = np.hypot(*(np.mean(first[a]) - np.mean(second[a]) for a in "xy"))
        assert apart > max(np.ptp(first.x), np.ptp(first.y))
    assert drawn.layout.yaxis.scaleanchor == "x"
    assert "times as large as the workspace" in coverage_ellipses.caption(study)
