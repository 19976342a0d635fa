"""The machine drawn to scale in its workspace: guideways, struts, joints, platform."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from truepose.arrays import Floats
from truepose.files.shown_units import Shown
from truepose.reporting.display import nearest_middle, pose_text
from truepose.reporting.figures._outline import Outline, is_planar, outline
from truepose.reporting.figures._plot import Keys, Plot, trace
from truepose.reporting.figures._style import INK, drawn_poses, finish, small
from truepose.reporting.study import Study

TITLE = "The machine in its workspace"

GUIDEWAY, STRUT, PLATFORM, WORKSPACE = "#A8B1C0", "#0072B2", "#D55E00", "#009E73"


def caption(study: Study) -> str:
    """Which pose is drawn."""
    pose = pose_text(study.poses[_shown(study)], study.machine.commanded, study.units)
    return f"Drawn to scale at {pose}, the pose of the workspace nearest its middle."


def figure(study: Study) -> Plot:
    """Guideways, struts, joints, platform and the poses evaluated, equal scale on all axes."""
    machine = study.machine
    shape = outline(machine, study.poses[_shown(study)])
    drawn = drawn_poses(study.largest)
    workspace = machine.kernel.placement_of(study.poses[drawn])[:, :3]
    planar, unit = is_planar(machine), study.units.length.label
    figure = Plot()
    for line in _lines(shape, workspace):
        figure.add_trace(_trace(planar, study.units.length, **line))
    if planar:
        finish(figure, 520)
        figure.update_xaxes(title={"text": f"x, {unit}"}, constrain="domain")
        figure.update_yaxes(title={"text": f"y, {unit}"}, scaleanchor="x", scaleratio=1)
        return figure
    axis = {"gridcolor": "#D5DBE5", "backgroundcolor": "#F6F8FB", "showbackground": True}
    return finish(
        figure,
        620,
        margin={"l": 0, "r": 0, "t": 30, "b": 0},
        scene={
            "aspectmode": "data",
            "xaxis": {"title": {"text": f"x, {unit}"}, **axis},
            "yaxis": {"title": {"text": f"y, {unit}"}, **axis},
            "zaxis": {"title": {"text": f"z, {unit}"}, **axis},
            "camera": {
                "eye": {"x": 1.4, "y": -1.9, "z": 0.75},
                "center": {"x": 0, "y": 0, "z": -0.12},
            },
        },
    )


def _shown(study: Study) -> int:
    """Index of the pose nearest the middle of those evaluated."""
    return int(nearest_middle(study.poses)[0])


def _lines(shape: Outline, workspace: Floats) -> Iterable[dict[str, Any]]:
    """Every part of the drawing: its points, m, and how it looks, from back to front."""
    yield {
        "points": workspace,
        "name": "poses evaluated",
        "mode": "markers",
        "marker": {"color": WORKSPACE, "size": 6, "opacity": 0.7},
    }
    if len(shape.frame):
        yield {
            "points": shape.frame,
            "name": "frame",
            "mode": "lines",
            "line": {"color": GUIDEWAY, "width": 5},
        }
    if shape.paths:
        yield {
            "points": _joined(shape.paths),
            "name": "travel of the drives",
            "mode": "lines",
            "line": {"color": GUIDEWAY, "width": 7},
        }
    if shape.arms:
        yield {
            "points": _joined(shape.arms),
            "name": "arms and carriages",
            "mode": "lines",
            "line": {"color": INK, "width": 5},
        }
    yield {
        "points": _joined(shape.struts),
        "name": "struts",
        "mode": "lines",
        "line": {"color": STRUT, "width": 4},
    }
    if len(shape.platform):
        yield {
            "points": shape.platform,
            "name": "platform",
            "mode": "lines",
            "line": {"color": PLATFORM, "width": 5},
        }
    yield {
        "points": shape.struts.reshape(-1, 3),
        "name": "joint centres",
        "mode": "markers",
        "marker": {"color": "white", "size": 7, "line": {"color": INK, "width": 2}},
    }
    yield {
        "points": shape.tool[None],
        "name": "tool point",
        "mode": "markers",
        "marker": {"color": PLATFORM, "size": 8, "symbol": "diamond"},
    }


def _joined(polylines: Iterable[Floats]) -> Floats:
    """Polylines (n, 3) in one array, a gap of NaN between them."""
    gap = np.full((1, 3), np.nan)
    return np.concatenate([part for line in polylines for part in (np.asarray(line), gap)])


def _trace(planar: bool, unit: Shown, points: Floats, **look: Any) -> Keys:
    x, y, z = small(points * unit.per_si).T
    places = 2 if unit.per_si > 100.0 else 4
    names = "xy" if planar else "xyz"
    hover = ", ".join(f"{n} %{{{n}:.{places}f}} {unit.label}" for n in names)
    if planar:
        return trace("scatter", x=x, y=y, hovertemplate=hover, **look)
    if "marker" in look:  # markers look larger in three dimensions
        look["marker"] = look["marker"] | {"size": max(2, look["marker"]["size"] - 3)}
    return trace("scatter3d", x=x, y=y, z=z, hovertemplate=hover, **look)
