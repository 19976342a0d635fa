"""What a figure draws as CSV: every number of it, and the page's script says the same bytes."""

from __future__ import annotations

import csv
import io
import json
from importlib.resources import files

import numpy as np
import pytest

from checked_figures import checked
from made_how_sure import sure_study
from made_study import hexapod_study, planar_study
from node import run_script
from truepose.reporting.figure_data import figure_data, table_data
from truepose.reporting.figures import DrawnFigure, draw
from truepose.reporting.figures._json import as_json
from truepose.reporting.figures._plot import Plot, grid, trace
from truepose.reporting.figures._text import as_text
from truepose.reporting.table import Table

STUDIES = {"planar": planar_study(), "hexapod": hexapod_study(3)}
DRAWN = {
    f"{machine}: {each.name}": each
    for machine, study in STUDIES.items()
    for each in draw(sure_study(study))
}


def odd() -> Plot:
    """What no figure has today, but one may have: names with marks, matrices of three, no axes."""
    figure = grid(1, 2, titles=["one, two", "x < y & z"])
    rng = np.random.default_rng(1)
    single = (10.0 ** rng.uniform(-9.0, 30.0, 300)).astype(np.float32)
    ties = np.array([2.0**-12, 203143.625, -2614853.25, 2.0**-140, -0.0, np.nan], np.float32)
    double = 10.0 ** rng.uniform(-30.0, 30.0, 300) * rng.choice([-1.0, 1.0], 300)
    figure.add_trace(trace("scatter", x=np.concatenate([single, ties]), y=np.arange(306)), 1, 1)
    figure.add_trace(
        trace("scatter", x=double, y=double.tolist(), name='"a"\nand &lt; b',
              error_y={"array": single, "arrayminus": [1, 2.5, None]}),
        1, 2,
    )  # fmt: skip
    figure.add_trace(
        trace("heatmap", x=["left", "right"], y=[0.0, 1e-7, 1e21],
              z=np.arange(6.0).reshape(3, 2), customdata=np.arange(12.0).reshape(3, 2, 2),
              text=[["a", "b"], ["", None], ["", "f"]],
              colorbar={"title": {"text": "error,\nµm"}}),
        1, 2,
    )  # fmt: skip
    figure.update_xaxes(title={"text": "x, mm"})
    figure.update_yaxes(tickvals=[7, 8], ticktext=["seven", "eight"])
    figure.add_vline(0.1, 1, 2, name="target")
    figure.add_vrect(-1, 1, 1, 1)
    figure.add_annotation(1, 2, x=1.5, y=2, text="worst: 3 µm, here")
    return as_text(figure)


FIGURES = {name: each.figure for name, each in DRAWN.items()} | {"odd": odd()}


def rows_of(figure: Plot) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(figure_data(figure))))


@pytest.fixture(scope="module")
def in_script() -> dict[str, str]:
    """The same of all figures by the script of the page."""
    script = files("truepose.reporting").joinpath("figure_data.js").read_text(encoding="utf-8")
    pages = {name: {"data": one.data, "layout": one.layout} for name, one in FIGURES.items()}
    said = run_script(
        script
        + f"const all = {as_json(pages)};"
        + "for (const name in all) all[name] = figureData(all[name].data, all[name].layout);"
        + "process.stdout.write(JSON.stringify(all));"
    )
    found: dict[str, str] = json.loads(said)
    return found


@pytest.mark.parametrize("name", FIGURES)
def test_the_page_says_the_same_bytes(name: str, in_script: dict[str, str]) -> None:
    mine = figure_data(FIGURES[name])
    assert mine.count("\n") > 1
    assert in_script[name].encode() == mine.encode()


@pytest.mark.parametrize("drawn", DRAWN.values(), ids=DRAWN)
def test_every_number_that_is_drawn_is_there(drawn: DrawnFigure) -> None:
    rows = rows_of(drawn.figure)
    for each in checked(drawn.figure).data:
        wanted = each.z if each.type in ("heatmap", "contour") else each.y
        if wanted is None or np.asarray(wanted).dtype.kind not in "fi":
            continue
        kept = np.asarray(wanted).ravel()
        kept = kept[np.isfinite(kept)]
        column = "value" if each.type in ("heatmap", "contour") else "y"
        at = (each.scene or "scene")[5:] if hasattr(each, "scene") else (each.xaxis or "x")[1:]
        mine = [
            row[column]
            for row in rows
            if row["trace"] == (each.name or each.type).replace("<br>", " ")
            and row["panel"] == (at or "1")
            and row.get(column)
        ]
        found = np.array(mine, np.float64).astype(kept.dtype)
        assert np.isin(kept, found).all(), (drawn.name, each.name)


def test_a_number_is_as_short_as_it_can_be_in_its_precision() -> None:
    x = np.array([0.1, 1e-8, 16777216.0, -2.5], np.float32)
    figure = Plot(trace("scatter", x=x, y=np.array([0.1, 1e22, 1e20, 12345678.9])))
    rows = rows_of(figure)
    assert [row["x"] for row in rows] == ["0.1", "1e-8", "16777216", "-2.5"]
    assert [row["y"] for row in rows] == ["0.1", "1e+22", "100000000000000000000", "12345678.9"]


def test_rows_say_their_panel_their_axes_and_their_names() -> None:
    rows = rows_of(odd())
    assert {row["panel_title"] for row in rows if row["panel"] == "1"} >= {"one, two"}
    named = next(row for row in rows if row["y"] == "7" and row["trace"] == "scatter")
    assert (named["x_axis"], named["y_name"]) == ("x, mm", "seven")
    cell = next(row for row in rows if row["value"] == "5")
    assert (cell["x"], cell["y"], cell["text"]) == ("right", "1e+21", "f")
    assert (cell["value_of"], cell["hover_1"], cell["hover_2"]) == ("error, µm", "10", "11")
    assert [row["x"] for row in rows if row["trace"] == "target"] == ["0.1", "0.1"]
    assert [row["text"] for row in rows if row["trace"] == "note"] == ["worst: 3 µm, here"]
    assert '"a" and &lt; b' in {row["trace"] for row in rows}


def test_a_table_is_as_it_is_shown_with_signs_that_programs_read() -> None:
    table = Table("t", "T", ("of", "mm"), (("a, b", "\N{MINUS SIGN}1.50"), ("c", "–")))
    assert table_data(table) == 'of,mm\n"a, b",-1.50\nc,–\n'
    script = files("truepose.reporting").joinpath("figure_data.js").read_text(encoding="utf-8")
    cells = json.dumps([table.header, table.rows])
    said = run_script(f"{script}process.stdout.write(tableData(...{cells}));")
    assert said == table_data(table)
