"""What a figure draws, and what a table says, as CSV: a row for each point, every number with it.

The page gives the same text, byte for byte: `figure_data.js` says there what stands here, of the
same JSON. A number is written as short as it can be and still be the same one in the precision
that the page has it in.
"""

from __future__ import annotations

import base64
import json
import math
import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from decimal import ROUND_HALF_UP, Context, Decimal
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from truepose.files.writing import replacing, written_together
from truepose.reporting.figures._json import as_json
from truepose.reporting.figures._plot import Keys, Plot
from truepose.reporting.table import Table

if TYPE_CHECKING:
    from truepose.reporting.figures import DrawnFigure

COLUMNS = (
    *("panel", "panel_title", "trace"),
    *("x_axis", "x", "x_name", "x_plus", "x_minus"),
    *("y_axis", "y", "y_name", "y_plus", "y_minus"),
    *("z_axis", "z", "value_of", "value", "size", "base", "width", "text"),
)
"""In their order; then `hover_1` and so on. A column in which nothing stands is left out."""

_MATRIX = ("heatmap", "contour")
_DIGITS = [Context(prec=count, rounding=ROUND_HALF_UP) for count in range(1, 10)]
"""JavaScript's rounding to so many digits: of two that are as near, the larger."""
_MINUS = re.compile("^\N{MINUS SIGN}(?=[0-9])")

Cells = list[str | None]
Row = dict[str, str | None]


def figure_data(figure: Plot) -> str:
    """What a figure draws, as CSV in long form: `x`, `y`, `z` as on the axes that stand beside.

    `value` is what a colour says, `plus` and `minus` how far an error bar goes; lines, bands and
    notes that are drawn over the traces follow with their corners.
    """
    page: dict[str, Any] = json.loads(as_json({"data": figure.data, "layout": figure.layout}))
    rows = [row for one in page["data"] for row in _of_trace(one, page["layout"])]
    rows += _of_shapes(page["layout"])
    rows += _of_notes(page["layout"])
    hovers = max((sum(name.startswith("hover_") for name in row) for row in rows), default=0)
    names = [*COLUMNS, *(f"hover_{number}" for number in range(1, hovers + 1))]
    shown = [name for name in names if any(row.get(name) for row in rows)]
    return _csv([shown, *([row.get(name) or "" for name in shown] for row in rows)])


def table_data(table: Table) -> str:
    """The cells of a table as CSV, as they are shown; a minus sign is a hyphen."""
    header = [table.header] if any(table.header) else []
    return _csv([_MINUS.sub("-", cell) for cell in row] for row in (*header, *table.rows))


def data_files(figures: Iterable[DrawnFigure], tables: Iterable[Table]) -> dict[str, str]:
    """The CSV of each by the name of its file, which has its number on the page."""
    named = {
        _file("figure", number, one.name): figure_data(one.figure)
        for number, one in enumerate(figures, start=1)
    }
    return named | {
        _file("table", number, one.name): table_data(one)
        for number, one in enumerate(tables, start=1)
    }


def _file(kind: str, number: int, name: str) -> str:
    return f"{kind}-{number}-{re.sub('[^a-zA-Z0-9_]+', '_', name)}.csv"


def is_data_file(name: str) -> bool:
    """Whether a file may be one of these, or what is left of one where a run was killed."""
    left = r"\.(figure|table)-\d+-\w*\.[0-9a-f]{8}\.(csv|before)"
    return re.fullmatch(rf"(figure|table)-\d+-\w+\.csv|{left}", name) is not None


def write_data(folder: Path, files: Mapping[str, str]) -> None:
    """Write them into a folder, all or none."""
    with written_together():
        for name, text in files.items():
            with replacing(folder / name) as temporary:
                temporary.write_text(text, encoding="utf-8", newline="")


def remove_others(folder: Path, files: Collection[str]) -> None:
    """Files of another page, with more figures or others, go from a folder that was written."""
    for path in folder.iterdir():
        if is_data_file(path.name) and path.name not in files:
            path.unlink(missing_ok=True)


def _csv(rows: Iterable[Sequence[str]]) -> str:
    return "".join(",".join(map(_quoted, row)) + "\n" for row in rows)


def _quoted(cell: str) -> str:
    return '"' + cell.replace('"', '""') + '"' if re.search('[",\r\n]', cell) else cell


def _of_trace(drawn: Keys, layout: Keys) -> Iterator[Row]:
    spatial = drawn["type"].endswith("3d")
    if spatial:
        number = drawn.get("scene", "scene")[5:] or "1"
        panel: Keys = layout.get(drawn.get("scene", "scene"), {})
        axes = {name: panel.get(f"{name}axis", {}) for name in "xyz"}
        domain = panel.get("domain", {})
        ends = domain.get("x"), domain.get("y")
    else:
        number = drawn.get("xaxis", "x")[1:] or "1"
        axes = {name: _axis(layout, drawn.get(f"{name}axis", name)) for name in "xy"}
        ends = axes["x"].get("domain"), axes["y"].get("domain")
    common: Row = {
        "panel": number,
        "panel_title": _panel_title(layout, *ends),
        "trace": _line(drawn.get("name")) or drawn["type"],
        **{f"{name}_axis": _title(axis) for name, axis in axes.items()},
    }
    marker: Keys = drawn.get("marker", {})
    columns: dict[str, Cells | str | None] = {name: _cells(drawn.get(name)) for name in "xyz"}
    values, bar = columns["z"], drawn
    if spatial or drawn["type"] not in _MATRIX:
        values, bar = _numbers(marker.get("color")), marker
    if values is not None:
        shared = layout.get(bar.get("coloraxis", ""), {})
        common["value_of"] = _title(bar.get("colorbar") or shared.get("colorbar") or {})
    columns |= {
        "value": values,
        "size": _numbers(marker.get("size")),
        "base": _numbers(drawn.get("base")),
        "width": _numbers(drawn.get("width")),
        "text": _cells(drawn["text"] if "text" in drawn else drawn.get("hovertext")),
    }
    for name in "xyz":
        error: Keys = drawn.get(f"error_{name}", {})
        columns[f"{name}_plus"] = _cells(error.get("array"))
        columns[f"{name}_minus"] = _cells(error.get("arrayminus"))
    matrix = drawn["type"] in _MATRIX
    count = max(len(columns[name] or ()) for name in ("z" if matrix else "xyz"))
    columns |= _hovers(_cells(drawn.get("customdata")), count)
    if matrix:
        yield from _of_matrix(common, columns, axes)
        return
    places = [name for name in "xyz" if columns[name] is not None]
    for at in range(count):
        row = common | {name: _at(cells, at) for name, cells in columns.items()}
        if all(row[name] is not None for name in places):
            yield _named(row, axes)


def _of_matrix(
    common: Row, columns: dict[str, Cells | str | None], axes: dict[str, Keys]
) -> Iterator[Row]:
    """A row for each cell that has a value: those of x go to the right, those of y upwards."""
    across, width = columns["x"] or [], len(columns["x"] or [])
    for at, value in enumerate(columns["value"] or []):
        if value is None:
            continue
        row = common | {"x": across[at % width], "y": _at(columns["y"], at // width)}
        row |= {name: _at(columns[name], at) for name in columns if name not in "xyz"}
        yield _named(row, axes)


def _named(row: Row, axes: dict[str, Keys]) -> Row:
    """The row, with the names that axes give to places on them."""
    for name in "xy":
        names = axes[name].get("ticktext")
        there = _cells(axes[name].get("tickvals"))
        if names and isinstance(there, list) and row[name] in there:
            row[f"{name}_name"] = _line(names[there.index(row[name])])
    return row


def _of_shapes(layout: Keys) -> Iterator[Row]:
    """Both ends of lines, and two corners of bands: coordinates on axes, none on the paper."""
    for shape in layout.get("shapes", []):
        names = [name for name in "xy" if _on_axis(shape.get(f"{name}ref", "paper"))]
        if not names:
            continue
        axes = {name: _axis(layout, shape[f"{name}ref"].split(" ")[0]) for name in "xy"}
        for end in "01":
            yield {
                "panel": shape["xref"].split(" ")[0][1:] or "1",
                "panel_title": _panel_title(
                    layout, axes["x"].get("domain"), axes["y"].get("domain")
                ),
                "trace": _line(shape.get("name")) or shape["type"],
                **{f"{name}_axis": _title(axes[name]) for name in names},
                **{name: _cell(shape.get(name + end)) for name in names},
                "text": _said(shape.get("label", {}).get("text")),
            }


def _of_notes(layout: Keys) -> Iterator[Row]:
    """What is written into the figure, but for the titles of its panels."""
    titles = {_panel_note(layout, *ends) for ends in _domains(layout)}
    for at, note in enumerate(layout.get("annotations", [])):
        if at in titles:
            continue
        names = [name for name in "xy" if _on_axis(note.get(f"{name}ref", name))]
        axes = {name: _axis(layout, note.get(f"{name}ref", name)) for name in names}
        yield {
            "panel": (note.get("xref", "x")[1:] or "1") if "x" in names else "",
            "trace": "note",
            **{f"{name}_axis": _title(axis) for name, axis in axes.items()},
            **{name: _cell(note.get(name)) for name in names},
            "text": _said(note.get("text")),
        }


def _on_axis(reference: str) -> bool:
    return reference != "paper" and not reference.endswith("domain")


def _axis(layout: Keys, name: str) -> Keys:
    """The axis that a trace calls x2."""
    axis: Keys = layout.get(f"{name[0]}axis{name[1:]}", {})
    return axis


def _title(of: Keys) -> str:
    return _line(of.get("title", {}).get("text"))


def _domains(layout: Keys) -> Iterator[tuple[Any, Any]]:
    """Where the panels are, across and up."""
    for name, axis in layout.items():
        if re.fullmatch("scene[0-9]*", name):
            yield axis.get("domain", {}).get("x"), axis.get("domain", {}).get("y")
        elif re.fullmatch("xaxis[0-9]*", name):
            other = layout.get("y" + name[1:], {})
            yield axis.get("domain"), other.get("domain")


def _panel_note(layout: Keys, across: Any, up: Any) -> int | None:
    """Index of the note that stands above the middle of a panel: its title."""
    if not across or not up:
        return None
    for at, note in enumerate(layout.get("annotations", [])):
        on_paper = note.get("xref") == "paper" and note.get("yref") == "paper"
        if on_paper and note["x"] == (across[0] + across[1]) / 2 and note["y"] == up[1]:
            return at
    return None


def _panel_title(layout: Keys, across: Any, up: Any) -> str:
    at = _panel_note(layout, across, up)
    return "" if at is None else _line(layout["annotations"][at].get("text"))


def _cells(values: Any) -> Cells | str | None:
    """An array as texts, rows of a matrix one after the other; one value of all as a text."""
    if values is None:
        return None
    if isinstance(values, dict):
        return _decoded(values)
    if not isinstance(values, list):
        return _cell(values)
    flat: Cells = []
    for value in values:
        if isinstance(value, list | dict):
            inner = _cells(value)
            assert isinstance(inner, list)
            flat += inner
        else:
            flat.append(_cell(value))
    return flat


def _decoded(spec: Keys) -> Cells:
    """The texts of plotly.js's typed array."""
    values = np.frombuffer(base64.b64decode(spec["bdata"]), np.dtype("<" + spec["dtype"]))
    single = spec["dtype"] == "f4"
    return [_number(value, single=single) for value in values.astype(np.float64).tolist()]


def _numbers(values: Any) -> Cells | None:
    """The same of numbers only: none where colours stand, or one size of all."""
    cells = _cells(values)
    is_text = isinstance(values, list) and any(isinstance(value, str) for value in values)
    return cells if isinstance(cells, list) and not is_text else None


def _hovers(cells: Cells | str | None, count: int) -> dict[str, Cells | str | None]:
    """Columns of what is shown only when one points at one of `count` places."""
    width = len(cells) // count if count and isinstance(cells, list) else 0
    return {f"hover_{at + 1}": (cells or [])[at::width] for at in range(width)}


def _at(cells: Cells | str | None, at: int) -> str | None:
    if isinstance(cells, list):
        return cells[at] if at < len(cells) else None
    return cells


def _cell(value: Any) -> str | None:
    if value is None:
        return None
    return _said(value) if isinstance(value, str) else _number(float(value))


def _number(value: float, *, single: bool = False) -> str | None:
    """As JavaScript writes it; of `single` precision with as many digits as that has."""
    if not math.isfinite(value):
        return None
    if single:
        # The fewest digits that are this number again.
        exact = Decimal(value)
        for digits in _DIGITS:
            rounded = float(digits.plus(exact))
            if np.float32(rounded) == value:
                break
        value = rounded
    mantissa, _, exponent = repr(value + 0.0).partition("e")  # no minus before 0
    if not exponent:
        return mantissa.removesuffix(".0")
    power, figures = int(exponent), mantissa.lstrip("-").replace(".", "")
    sign = "-" if mantissa.startswith("-") else ""
    if 0 <= power < 21:
        return sign + figures.ljust(power + 1, "0")
    if -7 < power < 0:
        return f"{sign}0.{'0' * (-power - 1)}{figures}"
    return f"{mantissa}e{power:+d}"


def _said(text: str | None) -> str:
    """Text without plotly's marks; where a line ends, a semicolon."""
    return _plain(text, "; ")


def _line(text: str | None) -> str:
    """The same of a name or a title, which are one line."""
    return _plain(text, " ")


def _plain(text: str | None, end: str) -> str:
    plain = (text or "").replace("<br>", end)
    for mark, letter in (("&lt;", "<"), ("&gt;", ">"), ("&amp;", "&")):
        plain = plain.replace(mark, letter)
    return plain


__all__ = [
    "data_files",
    "figure_data",
    "is_data_file",
    "remove_others",
    "table_data",
    "write_data",
]
