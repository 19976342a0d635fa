"""A figure of plotly.js as plain dictionaries: traces, layout, and panels side by side.

Keys are plotly.js's own (https://plotly.com/javascript/reference). plotly's Python classes, which
check every one of them each time, take longer than all else of a report; the tests put every
figure through them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

Keys = dict[str, Any]

TITLE_SIZE = 16


@dataclass(frozen=True)
class Subplot:
    """Part of a plot with axes of its own: `across` and `up` are its ends, shares of the whole.

    `number` counts from 1; `span` is how many columns of a grid it covers.
    """

    number: int
    across: tuple[float, float]
    up: tuple[float, float]
    span: int = 1
    spatial: bool = False

    @property
    def suffix(self) -> str:
        """What stands after the names of its axes."""
        return str(self.number) if self.number > 1 else ""

    @property
    def place(self) -> Keys:
        """What of a trace says that it is in this panel."""
        if self.spatial:
            return {"scene": f"scene{self.suffix}"}
        return {"xaxis": f"x{self.suffix}", "yaxis": f"y{self.suffix}"}

    @property
    def layout(self) -> Keys:
        """Its axes, where they are."""
        across, up = list(self.across), list(self.up)
        if self.spatial:
            return {f"scene{self.suffix}": {"domain": {"x": across, "y": up}}}
        return {
            f"xaxis{self.suffix}": {"anchor": f"y{self.suffix}", "domain": across},
            f"yaxis{self.suffix}": {"anchor": f"x{self.suffix}", "domain": up},
        }


def trace(kind: str, **keys: Any) -> Keys:
    """A trace of plotly.js, such as "scatter" or "bar"; a key that is None is left out."""
    return {"type": kind, **{name: value for name, value in keys.items() if value is not None}}


class Plot:
    """Traces and layout, `data` and `layout` of plotly.js, of one panel or of a `grid` of them.

    Rows and columns count from 1 and from the top left; a plot of one panel has none. An update
    merges dictionaries key by key and replaces all else.
    """

    def __init__(
        self, *traces: Keys, panels: Mapping[tuple[int, int], Subplot] | None = None
    ) -> None:
        self.data: list[Keys] = list(traces)
        self.layout: Keys = {}
        self._panels = dict(panels or {})
        for panel in self._panels.values():
            self.layout |= panel.layout

    def add_trace(self, added: Keys, row: int | None = None, col: int | None = None) -> None:
        """Put a trace on top, into the panel that is said."""
        place = {} if row is None or col is None else self._panels[row, col].place
        self.data.append(added | place)

    def update_layout(self, **keys: Any) -> None:
        """Merge keys into the layout."""
        _merge(self.layout, keys)

    def update_xaxes(self, row: int | None = None, col: int | None = None, **keys: Any) -> None:
        """Merge keys into the horizontal axes of a row, of a column, of a panel or of all."""
        self._update_axes("xaxis", row, col, keys)

    def update_yaxes(self, row: int | None = None, col: int | None = None, **keys: Any) -> None:
        """Merge keys into the vertical axes of a row, of a column, of a panel or of all."""
        self._update_axes("yaxis", row, col, keys)

    def update_scenes(self, **keys: Any) -> None:
        """Merge keys into all spatial panels."""
        for panel in self._panels.values():
            if panel.spatial:
                _merge(self.layout[f"scene{panel.suffix}"], keys)

    def add_vline(self, x: float, row: int, col: int, **look: Any) -> None:
        """A line over the whole height of a panel."""
        self._add_shape({"type": "line", "x0": x, "x1": x, "y0": 0, "y1": 1}, row, col, "y", look)

    def add_hline(self, y: float, row: int, col: int, **look: Any) -> None:
        """A line over the whole width of a panel."""
        self._add_shape({"type": "line", "x0": 0, "x1": 1, "y0": y, "y1": y}, row, col, "x", look)

    def add_vrect(self, x0: float, x1: float, row: int, col: int, **look: Any) -> None:
        """A band over the whole height of a panel."""
        self._add_shape({"type": "rect", "x0": x0, "x1": x1, "y0": 0, "y1": 1}, row, col, "y", look)

    def add_annotation(self, row: int, col: int, **keys: Any) -> None:
        """A text in the coordinates of a panel."""
        place = self._panels[row, col].place
        placed = {"xref": place["xaxis"], "yref": place["yaxis"], **keys}
        self.layout.setdefault("annotations", []).append(placed)

    def panel_axis(self, row: int, col: int) -> str:
        """The name of the horizontal axis of a panel, as other axes refer to it."""
        name: str = self._panels[row, col].place["xaxis"]
        return name

    def _update_axes(self, axis: str, row: int | None, col: int | None, keys: Keys) -> None:
        suffixes = [
            panel.suffix
            for (at_row, at_col), panel in self._panels.items()
            if row in (None, at_row) and col in (None, at_col) and not panel.spatial
        ]
        for suffix in suffixes if self._panels else [""]:
            _merge(self.layout.setdefault(axis + suffix, {}), keys)

    def _add_shape(self, shape: Keys, row: int, col: int, whole: str, look: Keys) -> None:
        """A shape in the coordinates of a panel, over all of it along the axis `whole`."""
        place = self._panels[row, col].place
        shape |= {"xref": place["xaxis"], "yref": place["yaxis"]}
        shape[f"{whole}ref"] += " domain"
        self.layout.setdefault("shapes", []).append(shape | look)


def grid(
    rows: int,
    cols: int,
    *,
    spans: Mapping[tuple[int, int], int] | None = None,
    spatial: bool = False,
    row_heights: Sequence[float] | None = None,
    horizontal_spacing: float = 0.0,
    vertical_spacing: float = 0.0,
    titles: Sequence[str] = (),
    column_titles: Sequence[str] = (),
    shared_xaxes: Literal["columns", "all"] | None = None,
    shared_yaxes: bool = False,
) -> Plot:
    """A plot of empty panels in rows and columns, of three dimensions where it is `spatial`.

    `spans` says of each panel that there is how many columns it covers; without it all are there,
    each over one. Spacings are shares of the whole, `row_heights` (from the top) relative.
    `titles` of the panels, in their order; `column_titles` above those of the first row. With
    `shared_xaxes` the axes below each other ("columns"), or all that cover one column ("all"), go
    together, and the lowest, on the left, has the labels; with `shared_yaxes` those of a row.
    """
    if spans is None:
        spans = {(row, col): 1 for row in range(1, rows + 1) for col in range(1, cols + 1)}
    width = (1.0 - horizontal_spacing * (cols - 1)) / cols
    relative = row_heights or [1.0] * rows
    scale = (1.0 - vertical_spacing * (rows - 1)) / sum(relative)
    panels: dict[tuple[int, int], Subplot] = {}
    for number, (row, col) in enumerate(sorted(spans), start=1):
        span = spans[row, col]
        left = (col - 1) * (width + horizontal_spacing)
        right = left + span * width + (span - 1) * horizontal_spacing
        low = scale * sum(relative[row:]) + (rows - row) * vertical_spacing
        high = low + scale * relative[row - 1]
        panels[row, col] = Subplot(
            number, (left, min(right, 1.0)), (low, min(high, 1.0)), span, spatial
        )
    plot = Plot(panels=panels)
    # From below and from the left.
    order = sorted(panels.items(), key=lambda item: (-item[0][0], item[0][1]))
    single = [(place, panel) for place, panel in order if panel.span == 1]
    if shared_xaxes == "columns":
        _share(plot, "xaxis", ((col, panel) for (_, col), panel in single))
    elif shared_xaxes == "all":
        _share(plot, "xaxis", ((0, panel) for _, panel in single))
    if shared_yaxes:
        _share(plot, "yaxis", ((row, panel) for (row, _), panel in order))
    named = [*zip(panels.values(), titles, strict=False)]
    named += zip((panels[1, col] for col in range(1, cols + 1)), column_titles, strict=False)
    if named:
        plot.layout["annotations"] = [_title(panel, text) for panel, text in named]
    return plot


def _share(plot: Plot, axis: str, panels: Iterable[tuple[int, Subplot]]) -> None:
    """Axes go with the first of their group (a number), which alone has labels."""
    first: dict[int, str] = {}
    for group, panel in panels:
        leader = first.setdefault(group, panel.suffix)
        if leader != panel.suffix:
            matched = {"matches": axis[0] + leader, "showticklabels": False}
            plot.layout[axis + panel.suffix] |= matched


def _title(panel: Subplot, text: str) -> Keys:
    """A text above the middle of a panel."""
    return {
        "text": text,
        "x": sum(panel.across) / 2,
        "xanchor": "center",
        "xref": "paper",
        "y": panel.up[1],
        "yanchor": "bottom",
        "yref": "paper",
        "showarrow": False,
        "font": {"size": TITLE_SIZE},
    }


def _merge(into: Keys, keys: Mapping[str, Any]) -> None:
    for name, value in keys.items():
        if isinstance(value, Mapping):
            _merge(into.setdefault(name, {}), value)
        else:
            into[name] = value
