"""The machine drawn to scale in its workspace: guideways, struts, joints, platform."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from truepose.arrays import Floats
from truepose.files.shown_units import Shown
from truepose.language import grouped, say
from truepose.reporting.display import number, pose_text
from truepose.reporting.figures._magnified import Magnified, magnified, worst
from truepose.reporting.figures._outline import Outline, is_planar, outline
from truepose.reporting.figures._plot import Keys, Plot, trace
from truepose.reporting.figures._style import (
    BEFORE,
    BLUE,
    GREEN,
    GREY,
    INK,
    PAPER,
    SCENE,
    SCENE_GRID,
    drawn_poses,
    finish,
    small,
)
from truepose.reporting.study import Study

TITLE = "The machine in its workspace"

GUIDEWAY, STRUT, PLATFORM, WORKSPACE = GREY, BLUE, INK, GREEN
ACTUAL = KNOWN = BEFORE
HEIGHT = 430


def says(study: Study) -> str:
    """How far off the worst machine is that is drawn."""
    shape = outline(study.machine, worst(study)[0])
    error = magnified(study, _extent(shape))
    unit = study.units.error("position")
    size = error.size * unit.per_si
    return say(
        "At {pose} the tool can be {size} {unit} off as commanded; errors are drawn {factor} times "
        "larger than they are.",
        pose=pose_text(error.pose, study.machine.commanded, study.units),
        size=number(size, unit.decimals),
        unit=unit.label,
        factor=grouped(round(error.factor)),
    )


def caption(study: Study) -> str:
    """What is drawn how."""
    known = np.linalg.norm(study.values("overall_error")[:, study.positions], axis=1)
    arrows = (
        say("Arrows: the known error at poses of the workspace, commanded as filed.")
        if known.any()
        else say("No error is known: there are no arrows.")
    )
    drawn = say(
        "The machine is drawn to scale as it is commanded, at the pose where the tool can be "
        "farthest off; dashed, where it really is: one machine inside the bands, solved exactly, "
        "the displacement of its platform magnified."
    )
    return f"{drawn} {arrows}"


def figure(study: Study) -> Plot:
    """The machine as commanded and as it is, and the poses evaluated, equal scale on all axes."""
    machine = study.machine
    shape = outline(machine, worst(study)[0])
    error = magnified(study, _extent(shape))
    drawn = drawn_poses(study.largest)
    workspace = machine.kernel.placement_of(study.poses[drawn])[:, :3]
    planar, unit = is_planar(machine), study.units.length.label
    figure = Plot()
    for line in [*_lines(shape, workspace), *_errors(shape, error)]:
        figure.add_trace(_trace(planar, study.units.length, **line))
    if planar:
        finish(figure, HEIGHT, margin={"l": 55, "r": 10, "t": 45, "b": 45})
        figure.update_xaxes(title={"text": f"x, {unit}"}, constrain="domain")
        figure.update_yaxes(title={"text": f"y, {unit}"}, scaleanchor="x", scaleratio=1)
        return figure
    axis = {"gridcolor": SCENE_GRID, "backgroundcolor": SCENE, "showbackground": True}
    return finish(
        figure,
        HEIGHT,
        margin={"l": 0, "r": 0, "t": 45, "b": 0},
        scene={
            "aspectmode": "data",
            "xaxis": {"title": {"text": f"x, {unit}"}, **axis},
            "yaxis": {"title": {"text": f"y, {unit}"}, **axis},
            "zaxis": {"title": {"text": f"z, {unit}"}, **axis},
            "camera": {
                "eye": {"x": 1.3, "y": -1.75, "z": 0.7},
                "center": {"x": 0, "y": 0, "z": -0.12},
            },
        },
    )


def _extent(shape: Outline) -> float:
    """How large the machine is, m."""
    points = np.concatenate([shape.struts.reshape(-1, 3), *shape.paths, shape.tool[None]])
    return float(np.linalg.norm(np.ptp(points, axis=0)))


def _errors(shape: Outline, error: Magnified) -> Iterable[dict[str, Any]]:
    """Where the platform really is, and the arrows over the workspace."""
    dashed = {"color": ACTUAL, "width": 3, "dash": "dash"}
    bases, ends = shape.struts[:, 0], error.actual(shape.struts[:, 1], shape.tool)
    tool = error.actual(shape.tool, shape.tool)
    actual = [np.stack([base, end]) for base, end in zip(bases, ends, strict=True)]
    if len(shape.platform):
        actual.append(error.actual(shape.platform, shape.tool))
    actual.append(np.stack([shape.tool, tool]))
    yield {
        "points": _joined(actual),
        "name": say("as it is, {factor} ×", factor=grouped(round(error.factor))),
        "mode": "lines",
        "line": dashed,
    }
    yield {
        "points": tool[None],
        "name": say("tool as it is"),
        "mode": "markers",
        "marker": {"color": ACTUAL, "size": 9, "symbol": "x"},
        "showlegend": False,
    }
    if error.known.any():
        arrows = np.stack([error.poses, error.tips], axis=1)
        yield {
            "points": _joined(arrows),
            "name": say("known error, {factor} ×", factor=grouped(round(error.factor))),
            "mode": "lines",
            "line": {"color": KNOWN, "width": 2},
            "legendgroup": "known",
        }
        yield {
            "points": error.tips,
            "name": say("known error"),
            "mode": "markers",
            "marker": {"color": KNOWN, "size": 5},
            "legendgroup": "known",
            "showlegend": False,
        }


def _lines(shape: Outline, workspace: Floats) -> Iterable[dict[str, Any]]:
    """Every part of the drawing: its points, m, and how it looks, from back to front."""
    yield {
        "points": workspace,
        "name": say("poses evaluated"),
        "mode": "markers",
        "marker": {"color": WORKSPACE, "size": 4, "opacity": 0.5},
    }
    if len(shape.frame):
        yield {
            "points": shape.frame,
            "name": say("frame"),
            "showlegend": False,
            "mode": "lines",
            "line": {"color": GUIDEWAY, "width": 5},
        }
    if shape.paths:
        yield {
            "points": _joined(shape.paths),
            "name": say("travel of the drives"),
            "showlegend": False,
            "mode": "lines",
            "line": {"color": GUIDEWAY, "width": 7},
        }
    if shape.arms:
        yield {
            "points": _joined(shape.arms),
            "name": say("arms and carriages"),
            "showlegend": False,
            "mode": "lines",
            "line": {"color": INK, "width": 5},
        }
    yield {
        "points": _joined(shape.struts),
        "name": say("as commanded"),
        "mode": "lines",
        "line": {"color": STRUT, "width": 4},
    }
    if len(shape.platform):
        yield {
            "points": shape.platform,
            "name": say("platform"),
            "showlegend": False,
            "mode": "lines",
            "line": {"color": PLATFORM, "width": 5},
        }
    yield {
        "points": shape.struts.reshape(-1, 3),
        "name": say("joint centres"),
        "showlegend": False,
        "mode": "markers",
        "marker": {"color": PAPER, "size": 7, "line": {"color": INK, "width": 2}},
    }
    yield {
        "points": shape.tool[None],
        "name": say("tool point"),
        "showlegend": False,
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
        look["marker"] = look["marker"] | {"size": max(1.5, look["marker"]["size"] - 3)}
    return trace("scatter3d", x=x, y=y, z=z, hovertemplate=hover, **look)
