"""What maps over poses share: which coordinates are drawn, points or squares, and their axes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.files.shown_units import ShownUnits
from truepose.reporting.display import is_position
from truepose.reporting.figures._plot import Keys, Plot, trace
from truepose.reporting.figures._style import SCENE, SCENE_GRID, small


@dataclass(frozen=True)
class Places:
    """Where the maps have values: coordinates that vary (2 or 3 of them), shown units.

    `points` (n_place, n_axis). `of_pose` (n_pose,) is the place of each pose: poses that differ
    only in coordinates that no axis shows share a place.
    """

    axes: tuple[str, ...]
    units: tuple[str, ...]
    points: Floats
    of_pose: Indices


def places_of(given: Floats, names: Sequence[str], units: ShownUnits) -> Places:
    """The coordinates that vary of poses (n, n_coordinate), m and rad.

    Positions first, at most three; at least two for a plane.
    """
    labels = [units.pose(name).label for name in names]
    poses = given * np.array([units.pose(name).per_si for name in names])
    varying = [at for at in range(len(names)) if len(poses) and np.ptp(poses[:, at]) > 0]
    positions = [index for index in range(len(names)) if is_position(names[index])]
    moving = [index for index in positions if index in varying]
    # A line of poses, or one pose, is still drawn on a plane.
    spare = [index for index in [*varying, *positions, *range(len(names))] if index not in moving]
    chosen = (moving + list(dict.fromkeys(spare))[: max(0, 2 - len(moving))])[:3]
    points, of_pose = np.unique(poses[:, sorted(chosen)], axis=0, return_inverse=True)
    at = sorted(chosen)
    return Places(
        tuple(names[index] for index in at),
        tuple(labels[index] for index in at),
        points,
        of_pose.reshape(-1),
    )


def map_trace(
    places: Places,
    drawn: Indices,
    sizes: Floats,
    unit: str,
    scale: str = "coloraxis",
) -> Keys:
    """Squares of a full grid in a plane as a heat map, anything else as coloured points.

    `sizes` (n_place,), in `unit`, on the colour axis `scale`.
    """
    points, values = places.points[drawn], sizes[drawn]
    if len(places.axes) == 3:
        first, second, third = places.axes
        return trace(
            "scatter3d",
            x=small(points[:, 0]),
            y=small(points[:, 1]),
            z=small(points[:, 2]),
            mode="markers",
            marker={
                "size": 5 if len(drawn) <= 1000 else 2.5,
                "color": small(values),
                "coloraxis": scale,
            },
            hovertemplate=f"{first} %{{x:.2f}}, {second} %{{y:.2f}}, {third} %{{z:.2f}}"
            f"\n%{{marker.color:.2f}} {unit}<extra></extra>",
            showlegend=False,
        )
    first, second = places.axes
    hover = f"{first} %{{x:.2f}}, {second} %{{y:.2f}}\n"
    across, down = np.unique(points[:, 0]), np.unique(points[:, 1])
    if len(across) > 1 and len(down) > 1 and len(across) * len(down) == len(points):
        # Places are sorted by the first axis, then by the second.
        return trace(
            "heatmap",
            x=small(across),
            y=small(down),
            z=small(values.reshape(len(across), len(down)).T),
            coloraxis=scale,
            hovertemplate=hover + f"%{{z:.2f}} {unit}<extra></extra>",
        )
    return trace(
        "scatter",
        x=small(points[:, 0]),
        y=small(points[:, 1]),
        mode="markers",
        marker={"size": 9, "color": small(values), "coloraxis": scale, "symbol": "square"},
        hovertemplate=hover + f"%{{marker.color:.2f}} {unit}<extra></extra>",
        showlegend=False,
    )


def label_map_axes(figure: Plot, places: Places, n_map: int) -> None:
    """Names and looks of the axes of `n_map` maps, alone in their figure."""
    labels = [f"{name}, {unit}" for name, unit in zip(places.axes, places.units, strict=True)]
    same_unit = len(set(places.units)) == 1
    if len(places.axes) == 2:
        figure.update_xaxes(title={"text": labels[0]}, constrain="domain", showgrid=False)
        figure.update_yaxes(title={"text": labels[1]}, showgrid=False)
        if same_unit:
            for number in range(n_map):
                anchor = "x" if number == 0 else f"x{number + 1}"
                same = {"scaleanchor": anchor, "scaleratio": 1, "constrain": "domain"}
                figure.update_layout(**{f"yaxis{number + 1 if number else ''}": same})
        return
    axis: dict[str, Any] = {
        "gridcolor": SCENE_GRID,
        "backgroundcolor": SCENE,
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
