"""Maps of the worst position error over the workspace, one colour scale for all of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray
from plotly.subplots import make_subplots

from truepose.report.display import MICRO, is_position, pose_unit, shown_poses
from truepose.report.figures._style import COLOUR_SCALE, drawn_poses, finish, small, thinning_note
from truepose.report.study import Study

TITLE = "Where in the workspace"

Array = NDArray[np.float64]
# A browser keeps 16 pictures in three dimensions alive; the drawing of the machine needs one too.
MOST_MAPS = 6
PER_ROW = 3
ROW_HEIGHT = {2: 300, 3: 310}
TITLE_MARGIN = 30
"""Pixels that keep the titles of the first row clear of plotly's buttons."""


@dataclass(frozen=True)
class Map:
    """One map: its title and the worst position error at each place, µm (n_place,)."""

    title: str
    worst: Array


@dataclass(frozen=True)
class Places:
    """Where the maps have values: coordinates that vary (2 or 3 of them), shown units.

    `points` (n_place, n_axis). `of_pose` (n_pose,) is the place of each pose: poses that differ
    only in coordinates that no axis shows share a place.
    """

    axes: tuple[str, ...]
    points: Array
    of_pose: NDArray[np.intp]


def caption(study: Study) -> str:
    """What the colour is, and what is not shown."""
    places = _places(study)
    hidden = [
        name
        for index, name in enumerate(study.machine.commanded)
        if name not in places.axes and np.ptp(study.poses[:, index]) > 0
    ]
    text = (
        "Largest position error possible at each pose (the shift and the whole band of the "
        "sources), µm. All maps share one colour scale from zero, so they may be compared."
    )
    if hidden:
        text += f" Over {', '.join(hidden)} the largest is shown."
    left_out = len(study.sources) + 2 - MOST_MAPS
    if left_out > 0 and len(study.sources) + 1 + (study.compensation is not None) > MOST_MAPS:
        text += " Only the sources ranked first are drawn."
    drawn = len(_drawn(study, places))
    return text + thinning_note(drawn, len(places.points))


def figure(study: Study) -> go.Figure:
    """A map for all sources together, one for each source, one for what compensation leaves."""
    places = _places(study)
    maps = _maps(study, places)
    drawn = _drawn(study, places)
    spatial = len(places.axes) == 3
    columns = min(PER_ROW, len(maps))
    rows = -(-len(maps) // columns)
    figure = make_subplots(
        rows=rows,
        cols=columns,
        subplot_titles=[each.title for each in maps],
        specs=[[{"type": "scene" if spatial else "xy"}] * columns] * rows,
        horizontal_spacing=0.03 if spatial else 0.09,
        vertical_spacing=0.08 if spatial else 0.3 / rows,
    )
    for number, each in enumerate(maps):
        figure.add_trace(
            _trace(places, drawn, each.worst),
            row=number // columns + 1,
            col=number % columns + 1,
        )
    finish(figure, 80 + TITLE_MARGIN + ROW_HEIGHT[len(places.axes)] * rows)
    _label_axes(figure, places, len(maps))
    highest = max(float(np.nanmax(each.worst)) for each in maps)
    figure.update_layout(
        coloraxis={
            "colorscale": COLOUR_SCALE,
            "cmin": 0.0,
            "cmax": highest if highest > 0 else 1.0,
            "colorbar": {"title": {"text": "µm"}, "thickness": 16, "len": 0.9},
        },
        margin={"l": 5, "r": 5, "t": 30 + TITLE_MARGIN, "b": 0}
        if spatial
        else {"l": 70, "t": 40 + TITLE_MARGIN, "b": 55},
    )
    return figure


def _places(study: Study) -> Places:
    """The coordinates that vary, positions first, at most three; at least two for a plane."""
    names = study.machine.commanded
    poses = shown_poses(study.poses, names)
    varying = [index for index in range(len(names)) if np.ptp(poses[:, index]) > 0]
    positions = [index for index in range(len(names)) if is_position(names[index])]
    moving = [index for index in positions if index in varying]
    # A line of poses, or one pose, is still drawn on a plane.
    spare = [index for index in [*varying, *positions, *range(len(names))] if index not in moving]
    chosen = (moving + list(dict.fromkeys(spare))[: max(0, 2 - len(moving))])[:3]
    points, of_pose = np.unique(poses[:, sorted(chosen)], axis=0, return_inverse=True)
    return Places(tuple(names[index] for index in sorted(chosen)), points, of_pose.reshape(-1))


def _maps(study: Study, places: Places) -> list[Map]:
    """All sources together, what remains, then the sources by rank, at most `MOST_MAPS`."""

    def over_places(worst: Array) -> Array:
        highest = np.zeros(len(places.points))
        np.fmax.at(highest, places.of_pose, worst * MICRO)
        return highest

    maps = [Map("all sources", over_places(study.position_norm(study.overall_worst)))]
    if study.compensation is not None:
        remaining = study.position_norm(study.remaining_worst)
        maps.append(Map("after compensation", over_places(remaining)))
    worst = study.position_norm(study.values("worst"))
    maps += [Map(study.sources[index], over_places(worst[:, index])) for index in study.by_rank]
    return maps[:MOST_MAPS]


def _drawn(study: Study, places: Places) -> NDArray[np.intp]:
    """Indices of the places to draw."""
    return drawn_poses(_maps(study, places)[0].worst)


def _trace(places: Places, drawn: NDArray[np.intp], worst: Array) -> go.Scatter | go.Heatmap:
    """Squares of a full grid in a plane as a heat map, anything else as coloured points."""
    points, values = places.points[drawn], worst[drawn]
    if len(places.axes) == 3:
        first, second, third = places.axes
        return go.Scatter3d(
            x=small(points[:, 0]),
            y=small(points[:, 1]),
            z=small(points[:, 2]),
            mode="markers",
            marker={
                "size": 5 if len(drawn) <= 1000 else 2.5,
                "color": small(values),
                "coloraxis": "coloraxis",
            },
            hovertemplate=f"{first} %{{x:.2f}}, {second} %{{y:.2f}}, {third} %{{z:.2f}}"
            "<br>%{marker.color:.2f} µm<extra></extra>",
            showlegend=False,
        )
    first, second = places.axes
    hover = f"{first} %{{x:.2f}}, {second} %{{y:.2f}}<br>"
    across, down = np.unique(points[:, 0]), np.unique(points[:, 1])
    if len(across) > 1 and len(down) > 1 and len(across) * len(down) == len(points):
        # Places are sorted by the first axis, then by the second.
        return go.Heatmap(
            x=small(across),
            y=small(down),
            z=small(values.reshape(len(across), len(down)).T),
            coloraxis="coloraxis",
            hovertemplate=hover + "%{z:.2f} µm<extra></extra>",
        )
    return go.Scatter(
        x=small(points[:, 0]),
        y=small(points[:, 1]),
        mode="markers",
        marker={"size": 9, "color": small(values), "coloraxis": "coloraxis", "symbol": "square"},
        hovertemplate=hover + "%{marker.color:.2f} µm<extra></extra>",
        showlegend=False,
    )


def _label_axes(figure: go.Figure, places: Places, n_map: int) -> None:
    labels = [f"{name}, {pose_unit(name)}" for name in places.axes]
    same_unit = len({pose_unit(name) for name in places.axes}) == 1
    if len(places.axes) == 2:
        figure.update_xaxes(title_text=labels[0], constrain="domain", showgrid=False)
        figure.update_yaxes(title_text=labels[1], showgrid=False)
        if same_unit:
            for number in range(n_map):
                anchor = "x" if number == 0 else f"x{number + 1}"
                figure.layout[f"yaxis{number + 1 if number else ''}"].update(
                    scaleanchor=anchor, scaleratio=1, constrain="domain"
                )
        return
    axis: dict[str, Any] = {
        "gridcolor": "#D5DBE5",
        "backgroundcolor": "#F6F8FB",
        "tickfont": {"size": 10},
        "nticks": 4,
    }
    figure.update_scenes(
        aspectmode="cube",
        camera={"eye": {"x": 1.95, "y": -2.45, "z": 1.3}, "center": {"x": 0, "y": 0, "z": -0.1}},
        xaxis={"title": {"text": labels[0], "font": {"size": 12}}, **axis},
        yaxis={"title": {"text": labels[1], "font": {"size": 12}}, **axis},
        zaxis={"title": {"text": labels[2], "font": {"size": 12}}, **axis},
    )
