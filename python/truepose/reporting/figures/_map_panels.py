"""One map as flat panels: the plane as it is, space as slices in z, points from above and in front.

Where the places of a panel are a grid it is coloured in between, with contours; else they are
coloured points. The largest and the least are written where they are.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.language import say
from truepose.reporting.display import decimals_for, number, where_highest
from truepose.reporting.figures._flow import Flow
from truepose.reporting.figures._lattice import lattice
from truepose.reporting.figures._maps import Places
from truepose.reporting.figures._plot import Keys, Plot, trace
from truepose.reporting.figures._style import BEHIND_MAP_TEXT, ON_MAP, SHOWN, drawn_poses, small

MOST_SLICES = 3
LEAST_IN_SLICE = 4
"""A slice of fewer places shows nothing."""

MOST_ACROSS = {2: 44, 3: 25}
"""Values along a side of a grid that are drawn, by the number of axes: of a plane, or of the
slices of space together, no more than 2000 places."""

CONTOURS = 6
"""About so many between the ends of the scale."""


@dataclass(frozen=True)
class MapPanel:
    """A flat part of the map: its `title`, which two of the axes, and which places, lie in it."""

    title: str
    axes: tuple[int, int]
    places: Indices


def panels_of(places: Places, sizes: Floats) -> list[MapPanel]:
    """The panels that show `sizes` (n_place,), missing ones NaN, where they vary."""
    everything = np.arange(len(places.points))
    if len(places.axes) == 2:
        return [MapPanel("", (0, 1), everything)]
    levels = _levels(places)
    if levels is None:
        return [
            MapPanel(say("seen from above"), (0, 1), everything),
            MapPanel(say("seen from the front"), (0, 2), everything),
        ]
    level, heights = levels
    chosen = chosen_of(len(heights), MOST_SLICES, int(level[where_highest(sizes)]))
    return [
        MapPanel(
            say(
                "{axis} {value} {unit}",
                axis=places.axes[2],
                value=number(heights[at], decimals_for(heights, 4)).rstrip("0").rstrip(".,"),
                unit=places.units[2],
            ),
            (0, 1),
            np.flatnonzero(level == at),
        )
        for at in chosen
    ]


def slices_left_out(places: Places) -> tuple[int, int] | None:
    """Slices drawn and slices there are, where not all are drawn."""
    levels = _levels(places) if len(places.axes) == 3 else None
    if levels is None or len(levels[1]) <= MOST_SLICES:
        return None
    return MOST_SLICES, len(levels[1])


def chosen_of(count: int, most: int, kept: int) -> Indices:
    """At most `most` (3 or more) of `count`, evenly: the first, the last and the one `kept`."""
    if count <= most:
        return np.arange(count)
    chosen = np.unique(np.linspace(0, count - 1, most).round().astype(np.intp))
    if kept not in chosen:
        inner = chosen[1:-1]
        chosen[1 + int(np.argmin(np.abs(inner - kept)))] = kept
    return chosen


def add_panel(
    figure: Plot,
    flow: Flow,
    number: int,
    panel: MapPanel,
    places: Places,
    sizes: Floats,
    unit: str,
    name: str,
    contours: Keys,
    scale: str,
) -> bool:
    """Draw one panel of a map; returns whether it is a grid, whose contours are these."""
    at = flow.place(number)
    points, values = places.points[panel.places][:, panel.axes], sizes[panel.places]
    names = [places.axes[axis] for axis in panel.axes]
    hover = f"{names[0]} %{{x:{SHOWN}}}, {names[1]} %{{y:{SHOWN}}}\n"
    matrix = _matrix(points, values, MOST_ACROSS[len(places.axes)])
    if matrix is not None:
        across, up, grid = matrix
        added = trace(
            "contour",
            x=small(across),
            y=small(up),
            z=small(grid),
            name=name,
            coloraxis=scale,
            autocontour=False,
            contours=contours
            | {
                "coloring": "heatmap",
                "showlabels": len(places.axes) == 2,
                "labelfont": {"color": ON_MAP, "size": 10},
            },
            line={"color": ON_MAP, "width": 0.7},
            hoverongaps=False,
            hovertemplate=hover + f"%{{z:{SHOWN}}} {unit}<extra></extra>",
        )
    else:
        drawn = drawn_poses(values)
        # The largest are on top of what they hide.
        drawn = drawn[np.argsort(values[drawn], kind="stable")]
        added = trace(
            "scatter",
            x=small(points[drawn, 0]),
            y=small(points[drawn, 1]),
            name=name,
            mode="markers",
            marker={"size": 7, "color": small(values[drawn]), "coloraxis": scale},
            hovertemplate=hover + f"%{{marker.color:{SHOWN}}} {unit}<extra></extra>",
            showlegend=False,
        )
    figure.add_trace(added, **at)
    _label(figure, flow, number, places, panel.axes, matrix is not None)
    return matrix is not None


def add_ends(
    figure: Plot, flow: Flow, at: int, panel: MapPanel, places: Places, sizes: Floats
) -> None:
    """The largest and the least of a panel, marked and written where they are."""
    points, values = places.points[panel.places][:, panel.axes], sizes[panel.places]
    if not np.isfinite(values).any():
        return
    place = flow.place(at)
    ends = [where_highest(values), where_highest(-values)]
    if ends[0] == ends[1]:
        ends = ends[:1]
    figure.add_trace(
        trace(
            "scatter",
            x=small(points[ends, 0]),
            y=small(points[ends, 1]),
            name=say("largest and least"),
            mode="markers",
            marker={
                "symbol": ["triangle-up", "triangle-down"][: len(ends)],
                "size": 8,
                "color": ON_MAP,
                "line": {"color": BEHIND_MAP_TEXT, "width": 1},
            },
            cliponaxis=False,
            hoverinfo="skip",
            showlegend=False,
        ),
        **place,
    )
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    digits = decimals_for(values[ends[0]], 3) if abs(values[ends[0]]) < 100 else 0
    for end in ends:
        right, above = points[end] > middle
        figure.add_annotation(
            **place,
            x=float(points[end, 0]),
            y=float(points[end, 1]),
            text=number(float(values[end]), digits),
            showarrow=False,
            xanchor="right" if right else "left",
            yanchor="top" if above else "bottom",
            xshift=-6 if right else 6,
            yshift=-5 if above else 5,
            font={"color": ON_MAP, "size": 11},
            bgcolor=BEHIND_MAP_TEXT,
            borderpad=1,
        )


def contours_between(low: float, high: float) -> Keys:
    """`contours` of plotly.js from `low` to `high`: steps of 1, 2 or 5 times a power of ten."""
    span = high - low
    if not span > 0.0:
        return {"start": low, "end": low, "size": 1.0}
    power = 10.0 ** np.floor(np.log10(span / CONTOURS))
    step = min(
        (factor * power for factor in (1, 2, 5, 10)),
        key=lambda size: abs(np.log(span / size / CONTOURS)),
    )
    first = step * (np.floor(low / step) + 1)
    return {"start": float(first), "end": float(high), "size": float(step)}


def _levels(places: Places) -> tuple[Indices, Floats] | None:
    """Which height each place is at, and the heights, where the places stand in flat layers."""
    layers = lattice(places.points[:, 2:])
    if layers is None:
        return None
    level, heights = layers.steps[:, 0], layers.values[0]
    full = np.bincount(level) >= LEAST_IN_SLICE
    return (level, heights) if full.all() else None


def _matrix(points: Floats, values: Floats, most: int) -> tuple[Floats, Floats, Floats] | None:
    """Values along both sides of a grid and those in it (n_y, n_x); None where there is none."""
    lines = lattice(points)
    if lines is None or len(lines.varying) < 2:
        return None
    across, up = lines.values
    grid = np.full((len(up), len(across)), np.nan)
    grid[lines.steps[:, 1], lines.steps[:, 0]] = values
    worst = lines.steps[where_highest(values)]
    x, y = (
        chosen_of(len(side), most, int(kept))
        for side, kept in zip((across, up), worst, strict=True)
    )
    return across[x], up[y], grid[np.ix_(y, x)]


def _label(
    figure: Plot, flow: Flow, number: int, places: Places, axes: tuple[int, int], grid: bool
) -> None:
    """Axes of a panel, drawn to scale where both are lengths or both are angles.

    Where a map has panels of its own in a row, the lowest and the leftmost name their axes.
    """
    at = flow.place(number)
    low, high = places.points.min(axis=0), places.points.max(axis=0)
    span = high - low
    same_unit = places.units[axes[0]] == places.units[axes[1]]
    # A line of places, or one, is in the middle of a plane.
    wide = span[list(axes)].max() / 2 if same_unit and span[list(axes)].any() else 1.0
    margin = np.where(span > 0, (0.0 if grid else 0.04) * span, wide)
    alone = flow.columns != flow.narrow
    named = (
        alone or number + flow.columns >= len(flow.titles),
        alone or number % flow.columns == 0 or axes[1] != 1,
    )
    for update, axis, name in zip(
        (figure.update_xaxes, figure.update_yaxes), axes, named, strict=True
    ):
        update(
            **at,
            title={
                "text": f"{places.axes[axis]}, {places.units[axis]}" if name else "",
                "standoff": 3,
            },
            range=[float(low[axis] - margin[axis]), float(high[axis] + margin[axis])],
            showgrid=False,
            zeroline=False,
            constrain="domain",
            nticks=5,
        )
    if same_unit:
        figure.update_yaxes(scaleanchor=figure.panel_axis(**at), scaleratio=1, **at)
