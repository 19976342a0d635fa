"""Coverage ellipses of the position error over the workspace, in planar projections."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from truepose.arrays import Floats
from truepose.files.shown_units import ShownUnits
from truepose.language import grouped, say
from truepose.reporting.display import is_position, where_highest
from truepose.reporting.figures._plot import Plot, grid, trace
from truepose.reporting.figures._style import (
    BLUE,
    BLUE_FILL,
    INK,
    TARGET,
    VERMILION,
    finish,
    small,
)
from truepose.reporting.reading import at_text, percent_text
from truepose.reporting.study import Study

if TYPE_CHECKING:
    import xarray as xr

TITLE = "Coverage ellipses over the workspace"
NEEDS = "ellipses"

POINTS = 49
HEIGHT = {1: 520, 3: 400}
SAME_PLACE = 0.02
"""Places nearer than this, in the width of the panel, are one."""
STEPS = (8.0, 6.0, 5.0, 4.0, 3.0, 2.0, 1.5, 1.0)
LARGEST = 4.0
"""Times the reach of the largest ellipse: a larger circle of what is asked is not drawn."""
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


def says(study: Study) -> str:
    """At how many poses 95 of 100 machines keep what is asked, and where the longest ellipse is."""
    result = study.ellipses
    assert result is not None
    panels = _panels(study)
    drawn = [pose for panel in panels for pose in panel.poses]
    halves = np.concatenate([_half_lengths(result, panel) for panel in panels])
    longest = where_highest(halves)
    size = study.units.small_length.text(halves[longest], 3)
    at = at_text(study.machine, result, drawn[longest])
    asked = study.machine.accuracy.target
    if asked is None:
        return say(
            "The longest ellipse, at {pose}, reaches {size} from its middle.", pose=at, size=size
        )
    return say(
        "Before compensation {percent} of all machines keep the {asked} asked at {good} of {every} "
        "poses; the longest ellipse, at {pose}, reaches {size} from its middle.",
        percent=percent_text(float(result.attrs["probability"])),
        asked=study.machine.accuracy.said("position"),
        good=int((result["magnitude_upper"].values[:, 0] <= asked).sum()),
        every=result.sizes["pose"],
        pose=at,
        size=size,
    )


def caption(study: Study) -> str:
    """What an ellipse holds, and how much larger it is drawn."""
    result = study.ellipses
    assert result is not None
    percent = percent_text(float(result.attrs["probability"]))
    parts = [
        say(
            "Where the tool really is before compensation: the ellipse holds {percent} of all "
            "machines, drawn {times} times as large as the workspace; the line leads from the "
            "commanded place to the mean. A long ellipse is a direction in which the machine is "
            "unsure. {samples} samples a pose.",
            percent=percent,
            times=grouped(round(magnified(study))),
            samples=grouped(int((result["samples"] + result["failed"]).values[0])),
        )
    ]
    if _has_circle(study):
        parts.append(
            say(
                "The dashed circle is what is asked, as many times as large: what is inside keeps "
                "it."
            )
        )
    elif study.machine.accuracy.target is not None:
        parts.append(
            say(
                "The circle of what is asked, {asked}, would be so much larger that it is not "
                "drawn.",
                asked=study.machine.accuracy.said("position"),
            )
        )
    if result.sizes["axis"] > 2:
        parts.append(
            say(
                "Each is the shadow of an ellipsoid that holds {percent} of the samples, and so "
                "holds somewhat more; the panels show poses of the middle planes.",
                percent=percent,
            )
        )
    lost = str(result.attrs.get("not_assembled", "none"))
    if lost != "none":
        parts.append(
            say(
                "Of all samples {lost}; where too many failed, no ellipse is drawn.",
                lost=lost,
            )
        )
    return " ".join(parts)


def figure(study: Study) -> Plot:
    """One panel for each pair of axes, equal scale on both."""
    result = study.ellipses
    assert result is not None
    names = [str(name) for name in result["axis"].values]
    panels = _panels(study)
    times, circle = magnified(study), _has_circle(study)
    figure = grid(rows=1, cols=len(panels), horizontal_spacing=0.09)
    for at, panel in enumerate(panels, start=1):
        drawn = [panel.places]
        for nth, pose in enumerate(panel.poses):
            centre, outline = ellipse(result, pose, panel.axes)
            place = panel.places[nth]
            first = at == 1 and nth == 0
            if circle:
                drawn.append(_draw_asked(figure, study, place, times, at, first=first))
            _draw(figure, study, pose, panel, nth, times, at, first=first)
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


def _half_lengths(result: xr.Dataset, panel: Panel) -> Floats:
    """(n_pose,) half the length of each ellipse of a panel, m.

    The root of the larger eigenvalue of its matrix.
    """
    pair = list(panel.axes)
    shapes = np.asarray(result["ellipse"].values)[panel.poses][:, pair][:, :, pair]
    return np.asarray(np.sqrt(np.maximum(np.linalg.eigvalsh(shapes)[:, -1], 0.0)))


def _reach(study: Study, panel: Panel) -> float:
    """Half of the room that the largest ellipse and its offset take at most, m."""
    result = study.ellipses
    assert result is not None
    half = _half_lengths(result, panel)
    centres = np.asarray(result["ellipse_centre"].values)[panel.poses][:, list(panel.axes)]
    offset = np.linalg.norm(centres, axis=1)
    return float(np.maximum(half, 0.5 * (offset + half)).max())


def _has_circle(study: Study) -> bool:
    """Whether what is asked is drawn: where it is so large that ellipses were dots, it is not."""
    asked = study.machine.accuracy.target
    if asked is None:
        return False
    return asked <= LARGEST * max(_reach(study, panel) for panel in _panels(study))


def magnified(study: Study) -> float:
    """How many times larger than the workspace ellipses are drawn, a round number.

    As large as they can be without touching their neighbours, nor the circles of what is asked.
    """
    asked = study.machine.accuracy.target if _has_circle(study) else None
    most = np.inf
    for panel in _panels(study):
        reach = max(_reach(study, panel), asked or 0.0)
        if reach > 0:
            most = min(most, FILLED * _gap(panel.places) / reach)
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


def _draw_asked(
    figure: Plot, study: Study, place: Floats, times: float, column: int, *, first: bool
) -> Floats:
    """The circle of what is asked about a commanded place; returns its points (n, 2), m."""
    asked = study.machine.accuracy.target
    assert asked is not None
    turn = np.linspace(0.0, 2.0 * np.pi, POINTS)
    points = place + times * asked * np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    shown = points * study.units.length.per_si
    figure.add_trace(
        trace(
            "scatter",
            x=small(shown[:, 0]),
            y=small(shown[:, 1]),
            mode="lines",
            line={"color": TARGET, "width": 1, "dash": "4px,3px"},
            name=say("asked: {asked}", asked=study.machine.accuracy.said("position")),
            legendgroup="asked",
            showlegend=first,
            hoverinfo="skip",
        ),
        row=1,
        col=column,
    )
    return points


def _draw(
    figure: Plot,
    study: Study,
    pose: int,
    panel: Panel,
    nth: int,
    times: float,
    column: int,
    *,
    first: bool,
) -> None:
    """One ellipse about its centre, and the line to it from the commanded place."""
    result, units, place = study.ellipses, study.units, panel.places[nth]
    assert result is not None
    centre, outline = ellipse(result, pose, panel.axes)
    mean = place + times * centre
    coarse, fine = units.length.per_si, units.small_length
    around = (mean + times * outline) * coarse
    percent = percent_text(float(result.attrs["probability"]))
    figure.add_trace(
        trace(
            "scatter",
            x=small(around[:, 0]),
            y=small(around[:, 1]),
            mode="lines",
            fill="toself",
            fillcolor=BLUE_FILL,
            line={"color": BLUE, "width": 1.5},
            name=say(
                "{percent} of machines, {times} ×",
                percent=percent,
                times=grouped(round(times)),
            ),
            legendgroup="ellipse",
            showlegend=first,
            hoveron="fills",
            text=say(
                "reaches {size} from its middle, which is {off} off",
                size=fine.text(float(_half_lengths(result, panel)[nth]), 3),
                off=fine.text(float(np.linalg.norm(centre)), 3),
            ),
            hoverinfo="text",
        ),
        row=1,
        col=column,
    )
    figure.add_trace(
        trace(
            "scatter",
            x=small(np.array([place[0], mean[0]]) * coarse),
            y=small(np.array([place[1], mean[1]]) * coarse),
            mode="lines+markers",
            line={"color": VERMILION, "width": 1.5},
            marker={"color": [INK, VERMILION], "size": [6, 4]},
            name=say("from the commanded place to the mean"),
            legendgroup="mean",
            showlegend=first,
            hoverinfo="skip",
        ),
        row=1,
        col=column,
    )
