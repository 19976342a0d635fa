"""The grid of a figure is plotly's own, and its numbers reach plotly.js as they are."""

from __future__ import annotations

import base64
import json
from typing import Any

import numpy as np
import plotly.colors
import plotly.graph_objects as go
import pytest
from plotly.subplots import make_subplots

from truepose.reporting.figures._json import as_json
from truepose.reporting.figures._plot import Plot, grid, trace
from truepose.reporting.figures._style import COLOUR_SCALE

GRIDS: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "one": ({}, {}),
    "titles": (
        {"rows": 2, "cols": 3, "titles": list("abcdef"), "column_titles": ["u", "v"]},
        {"subplot_titles": list("abcdef"), "column_titles": ["u", "v"]},
    ),
    "spatial": (
        {"rows": 2, "cols": 2, "spatial": True, "horizontal_spacing": 0.03},
        {"specs": [[{"type": "scene"}] * 2] * 2},
    ),
    "columns shared": (
        {
            "rows": 3,
            "cols": 2,
            "spans": {(1, 1): 1, (2, 1): 1, (3, 1): 1, (1, 2): 1},
            "shared_xaxes": "columns",
            "vertical_spacing": 0.07,
        },
        {"specs": [[{}, {}], [{}, None], [{}, None]]},
    ),
    "all shared": (
        {
            "rows": 2,
            "cols": 2,
            "spans": {(1, 1): 1, (1, 2): 1, (2, 1): 2},
            "shared_xaxes": "all",
            "horizontal_spacing": 0.1,
            "vertical_spacing": 0.2,
        },
        {"specs": [[{}, {}], [{"colspan": 2}, None]]},
    ),
    "rows shared": ({"rows": 2, "cols": 2, "shared_yaxes": True}, {}),
    "heights": ({"rows": 2, "cols": 1, "row_heights": [86, 260], "vertical_spacing": 0.2}, {}),
}


@pytest.mark.parametrize("name", GRIDS)
def test_a_grid_is_that_of_plotly(name: str) -> None:
    given, other = GRIDS[name]
    asked = {"rows": 1, "cols": 1, "horizontal_spacing": 0.0, "vertical_spacing": 0.0, **given}
    ours = grid(**asked)
    same = {
        key: value
        for key, value in asked.items()
        if key not in ("spans", "spatial", "titles", "column_titles")
    }
    if "shared_xaxes" in same and other["specs"][-1][0].get("colspan", 1) == 1:
        same["shared_xaxes"] = True
    plotlys = make_subplots(**same, **other)
    found = json.loads(as_json(ours.layout))
    expected = json.loads(plotlys.to_json())["layout"]
    expected.pop("template")
    assert_near(found, expected)
    for row, col in asked.get("spans", {(1, 1): 1}):
        at = {"row": row, "col": col}
        point = {"x": [1], "y": [2]} | ({"z": [3]} if asked.get("spatial") else {})
        kind = "scatter3d" if asked.get("spatial") else "scatter"
        ours.add_trace(trace(kind, **point), **at)
        plotlys.add_trace(trace(kind, **point), **at)
        if not asked.get("spatial"):
            ours.add_vline(1.5, **at, line={"dash": "dot"})
            plotlys.add_vline(1.5, **at, line={"dash": "dot"})
            ours.add_hline(2.5, **at, line={"width": 2})
            plotlys.add_hline(2.5, **at, line={"width": 2})
            ours.add_vrect(-1, 1, **at, fillcolor="red")
            plotlys.add_vrect(-1, 1, **at, fillcolor="red")
            ours.add_annotation(text="none", x=0.5, y=0.5, **at)
            plotlys.add_annotation(text="none", x=0.5, y=0.5, **at)
    drawn = json.loads(plotlys.to_json())
    assert json.loads(as_json(ours.data)) == drawn["data"]
    for what in ("shapes", "annotations"):
        assert_near(ours.layout.get(what, []), drawn["layout"].get(what, []))


def assert_near(found: Any, expected: Any) -> None:
    """Equal, numbers to rounding."""
    if isinstance(expected, dict):
        assert found.keys() == expected.keys()
        for key in expected:
            assert_near(found[key], expected[key])
    elif isinstance(expected, list):
        assert len(found) == len(expected)
        for one, other in zip(found, expected, strict=True):
            assert_near(one, other)
    else:
        assert found == (pytest.approx(expected) if isinstance(expected, float) else expected)


def test_an_update_merges_what_is_nested_and_replaces_the_rest() -> None:
    plot = grid(rows=2, cols=2)
    plot.update_xaxes(title={"text": "x"}, range=[0, 1])
    plot.update_xaxes(title={"font": {"size": 9}}, range=[2, 3], row=2)
    plot.update_yaxes(showgrid=False, row=1, col=2)
    assert plot.layout["xaxis"]["title"] == {"text": "x"}
    for axis in ("xaxis3", "xaxis4"):
        assert plot.layout[axis]["title"] == {"text": "x", "font": {"size": 9}}
        assert plot.layout[axis]["range"] == [2, 3]
    assert [name for name in plot.layout if "showgrid" in plot.layout[name]] == ["yaxis2"]


def test_what_is_given_is_not_changed_by_later_updates() -> None:
    title = {"text": "x"}
    plot = Plot()
    plot.update_xaxes(title=title)
    plot.update_xaxes(title={"text": "y"})
    assert title == {"text": "x"}


@pytest.mark.parametrize(
    "values",
    [
        np.array([1.5, np.nan, -2.0], np.float32),
        np.array([[1.0, 2.0, 3.0], [4.0, 5.0, np.inf]]),
        np.array([[1, 2], [3, 4]])[:, ::-1],
        np.array([1, 300]),
        np.array([-1, 70_000]),
        np.array([0, 2**40]),
        np.array([], np.float64),
        np.array(["a", "b"]),
        np.array([["a", "</script>"]], object),
        np.arange(4, dtype=np.float32)[::2],
    ],
    ids=str,
)
def test_arrays_are_written_as_plotly_writes_them(values: np.ndarray) -> None:
    expected = json.loads(go.Figure(go.Scatter(customdata=values)).to_json())["data"][0]
    found = json.loads(as_json(values))
    assert found == expected["customdata"]
    if isinstance(found, dict):
        read = np.frombuffer(base64.b64decode(found["bdata"]), f"<{found['dtype']}")
        np.testing.assert_array_equal(read, values.ravel())


def test_numbers_and_texts_are_those_of_a_script() -> None:
    text = as_json({"a": [1, 2.5, float("nan"), float("-inf"), None, True], "b": np.float32(0.5)})
    assert text == '{"a":[1,2.5,null,null,null,true],"b":0.5}'
    hostile = "</script><!-- \u2028 µm"
    assert "<" not in as_json(hostile)
    assert "\u2028" not in as_json(hostile)
    assert json.loads(as_json(hostile)) == hostile


def test_the_colour_scale_is_viridis() -> None:
    assert [colour for _, colour in COLOUR_SCALE] == plotly.colors.sequential.Viridis
    np.testing.assert_allclose([at for at, _ in COLOUR_SCALE], np.linspace(0.0, 1.0, 10))
