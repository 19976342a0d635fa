"""Coverage ellipses of the position error over the workspace, in planar projections."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from truepose.arrays import Floats
from truepose.files.shown_units import ShownUnits
from truepose.reporting.display import is_position
from truepose.reporting.figures._plot import Plot, grid, trace
from truepose.reporting.figures._style import INK, finish, small, source_colour
from truepose.reporting.reading import percent_text
from truepose.reporting.study import Study

if TYPE_CHECKING:
    import xarray as xr

TITLE = "Coverage ellipses over the workspace"
NEEDS = "ellipses"

POINTS = 49
FILL = "rgba(0,114,178,0.18)"
HEIGHT = {1: 520, 3: 400}
SAME_PLACE = 0.02
"""Places nearer than this, in the width of the panel, are one."""
STEPS = (8.0, 6.0, 5.0, 4.0, 3.0, 2.0, 1.5, 1.0)
FILLED = 0.5
"""Part of the distance between two places that the largest ellipse and its offset may take."""


@dataclass(frozen=True)
class Panel:
    """Ellipses in the plane of two axes, numbered among those of the result.

    `poses` are the indices of those drawn, `places` (n, 2) where they are, m.
    """

    axes: tuple[int, int]
    poses: list[int]
    places: Floats


def caption(study: Study) -> str:
    """What an ellipse holds, and how much larger it is drawn."""
    result = study.ellipses
    assert result is not None
    percent = percent_text(float(result.attrs["probability"]))
    spatial = result.sizes["axis"] > 2
    shadow = (
        f" Each is the shadow of an ellipsoid that holds {percent} of the samples, and so holds "
        "somewhat more; the panels show poses of the middle planes."
        if spatial
        else ""
    )
    return (
        f"Where the tool really is: the ellipse holds {percent} of the samples of the position "
        f"error, drawn {_magnified(study):,.0f} times as large as the workspace; the line leads "
        "from the commanded place to the mean. A long ellipse is a direction in which the machine "
        f"is unsure. {int((result['samples'] + result['failed']).values[0]):,} samples a pose."
        + shadow
        + _lost(result)
    )


def _lost(result: xr.Dataset) -> str:
    """How many samples could not be assembled, where any could not."""
    lost = str(result.attrs.get("not_assembled", "none"))
    if lost == "none":
        return ""
    return f" Of all samples {lost}; where too many failed, no ellipse is drawn."


def figure(study: Study) -> Plot:
    """One panel for each pair of axes, equal scale on both."""
    result = study.ellipses
    assert result is not None
    names = [str(name) for name in result["axis"].values]
    panels = _panels(study)
    times = _magnified(study)
    figure = grid(rows=1, cols=len(panels), horizontal_spacing=0.09)
    for at, panel in enumerate(panels, start=1):
        drawn = [panel.places]
        for nth, pose in enumerate(panel.poses):
            centre, outline = ellipse(result, pose, panel.axes)
            place = panel.places[nth]
            first = at == 1 and nth == 0
            _draw(figure, place, centre, outline, times, at, study.units, first=first)
            drawn.append(place + times * (centre + outline))
        ranges = _ranges(np.concatenate(drawn), study.units)
        where = {"row": 1, "col": at}
        figure.update_xaxes(
            title={"text": f"{names[panel.axes[0]]}, {study.units.length.label}"},
            range=ranges[0],
            zeroline=False,
            constrain="domain",
            nticks=5,
            tickangle=0,
            **where,
        )
        figure.update_yaxes(
            title={"text": f"{names[panel.axes[1]]}, {study.units.length.label}"},
            range=ranges[1],
            zeroline=False,
            scaleanchor=f"x{at if at > 1 else ''}",
            scaleratio=1,
            constrain="domain",
            **where,
        )
    height = HEIGHT[3] if len(panels) > 1 else HEIGHT[1]
    finish(figure, height, margin={"l": 70, "r": 20, "t": 45, "b": 55})
    return figure


def _ranges(points: Floats, units: ShownUnits) -> list[list[float]]:
    """Ends of both axes, for people, that leave some room about all points (n, 2), m."""
    low, high = (end(axis=0) * units.length.per_si for end in (points.min, points.max))
    room = 0.05 * float((high - low).max()) or 1.0
    return [[float(a - room), float(b + room)] for a, b in zip(low, high, strict=True)]


def ellipse(result: xr.Dataset, pose: int, axes: tuple[int, int]) -> tuple[Floats, Floats]:
    """Centre (2,) and outline (n, 2) about it, m, of one pose's ellipse in the plane of two axes.

    The shadow of {e : (e - c)^T E^-1 (e - c) <= 1} on a plane has that part of E: points are
    c + L (cos, sin) with L L^T = E.
    """
    pair = list(axes)
    centre = np.asarray(result["ellipse_centre"].values)[pose, pair]
    shape = np.asarray(result["ellipse"].values)[pose][np.ix_(pair, pair)]
    # An ellipse may be a line: the square root of what is not negative, never Cholesky's.
    sizes, directions = np.linalg.eigh(shape)
    root = directions * np.sqrt(np.maximum(sizes, 0.0))
    turn = np.linspace(0.0, 2.0 * np.pi, POINTS)
    return centre, np.stack([np.cos(turn), np.sin(turn)], axis=-1) @ root.T


def _panels(study: Study) -> list[Panel]:
    """The planes of two axes, each with the poses nearest to the middle of what it hides."""
    result = study.ellipses
    assert result is not None
    names = [str(name) for name in result["axis"].values]
    every = np.stack([result[f"pose_{name}"].values for name in names], axis=-1)
    others = [name for name in study.machine.commanded if not is_position(name)]
    turned = [result[f"pose_{name}"].values for name in others]
    panels = []
    for pair in combinations(range(len(names)), 2):
        hidden = [every[:, at] for at in range(len(names)) if at not in pair] + turned
        panels.append(_panel(pair, every[:, list(pair)], hidden))
    return panels


def _panel(pair: tuple[int, ...], places: Floats, hidden: list[Floats]) -> Panel:
    off = np.zeros(len(places))
    for values in hidden:
        span = np.ptp(values)
        if span > 0:
            off += ((values - (values.max() + values.min()) / 2) / span) ** 2
    width = float(np.ptp(places, axis=0).max())
    kept: list[int] = []
    for pose in np.argsort(off.round(9), kind="stable"):
        apart = np.linalg.norm(places[kept] - places[pose], axis=1)
        if not (apart <= SAME_PLACE * width).any():
            kept.append(int(pose))
    # Poses off the middle stand in only where the middle has none near.
    nearest = float(off[kept].min())
    middle = [pose for pose in kept if off[pose] <= nearest + 1e-6]
    chosen = middle if len(middle) > 1 else kept
    return Panel((pair[0], pair[1]), chosen, places[chosen])


def _magnified(study: Study) -> float:
    """How many times larger than the workspace ellipses are drawn, a round number.

    As large as they can be without touching their neighbours.
    """
    result = study.ellipses
    assert result is not None
    most = np.inf
    for panel in _panels(study):
        reach = 0.0
        for pose in panel.poses:
            centre, outline = ellipse(result, pose, panel.axes)
            reach = max(reach, float(np.linalg.norm(outline, axis=1).max()))
            reach = max(reach, float(np.linalg.norm(centre + outline, axis=1).max()) / 2)
        gap = _gap(panel.places)
        if reach > 0:
            most = min(most, FILLED * gap / reach)
    if not np.isfinite(most):
        return 1.0
    power = 10.0 ** np.floor(np.log10(most))
    return float(next(step for step in STEPS if step * power <= most) * power)


def _gap(places: Floats) -> float:
    """Distance (m) between the two places that are nearest to each other."""
    if len(places) < 2:
        return 0.1
    apart = np.linalg.norm(places[:, None] - places[None], axis=-1)
    return float(apart[~np.eye(len(places), dtype=bool)].min())


def _draw(
    figure: Plot,
    place: Floats,
    centre: Floats,
    outline: Floats,
    times: float,
    column: int,
    units: ShownUnits,
    *,
    first: bool,
) -> None:
    """One ellipse about its centre, and the line to it from the commanded place."""
    panel = {"row": 1, "col": column}
    mean = place + times * centre
    coarse, fine = units.length.per_si, units.small_length
    around = (mean + times * outline) * coarse
    size = np.linalg.norm(outline, axis=1).max() * fine.per_si
    off = np.linalg.norm(centre) * fine.per_si
    figure.add_trace(
        trace(
            "scatter",
            x=small(around[:, 0]),
            y=small(around[:, 1]),
            mode="lines",
            fill="toself",
            fillcolor=FILL,
            line={"color": source_colour(0), "width": 1.5},
            name="coverage ellipse",
            legendgroup="ellipse",
            showlegend=first,
            hoveron="fills",
            text=f"half length {size:.3g} {fine.label}, centre {off:.3g} {fine.label} off",
            hoverinfo="text",
        ),
        **panel,
    )
    figure.add_trace(
        trace(
            "scatter",
            x=small(np.array([place[0], mean[0]]) * coarse),
            y=small(np.array([place[1], mean[1]]) * coarse),
            mode="lines+markers",
            line={"color": source_colour(1), "width": 1.5},
            marker={"color": [INK, source_colour(1)], "size": [6, 4]},
            name="from the commanded place to the mean",
            legendgroup="mean",
            showlegend=first,
            hoverinfo="skip",
        ),
        **panel,
    )
