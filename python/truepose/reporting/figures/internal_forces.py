"""Internal forces of an over-constrained machine: what clearances leave of each source's."""

from __future__ import annotations

import numpy as np

from truepose.arrays import Floats
from truepose.reporting.figures._plot import Plot, grid, trace
from truepose.reporting.figures._style import (
    AFTER,
    BEFORE,
    drawn_poses,
    finish,
    small,
    source_colour,
    thinning_note,
)
from truepose.reporting.study import Study

TITLE = "Internal forces"
NEEDS = "strain"

BAR, PANEL = 46, 260


def caption(study: Study) -> str:
    """What a bar and a line is."""
    force = _overall(study)
    note = thinning_note(len(_drawn(force)), len(force))
    return (
        "The platform has more closures than freedoms. Above: the highest force that each source "
        "alone, without load, makes inside the structure, had the joints no clearance, and what "
        "their clearances leave of it. Below: the force in each closure with all sources at their "
        "shifts, under all loads; tension is positive." + note
    )


def figure(study: Study) -> Plot:
    """Bars a source and lines a closure, N."""
    result = study.strained
    order = np.argsort(result["highest_force_rigid"].values, kind="stable")
    names = [str(name) for name in result["source"].values[order]]
    bars = BAR * max(len(names), 1) + 40
    figure = grid(rows=2, cols=1, row_heights=[bars, PANEL], vertical_spacing=80 / (bars + PANEL))
    for variable, name, colour in (
        ("highest_force_rigid", "without clearances", BEFORE),
        ("highest_force", "with clearances", AFTER),
    ):
        figure.add_trace(
            trace(
                "bar",
                x=small(result[variable].values[order]),
                y=names,
                orientation="h",
                name=name,
                marker={"color": colour},
                customdata=[str(verdict) for verdict in result["verdict"].values[order]],
                hovertemplate="%{y}: %{x:.3f} N, %{customdata}",
            ),
            row=1,
            col=1,
        )
    force = _overall(study)
    drawn = _drawn(force)
    for index, closure in enumerate(result["closure"].values):
        figure.add_trace(
            trace(
                "scatter",
                x=result["pose"].values[drawn],
                y=small(force[drawn, index]),
                name=str(closure),
                mode="lines",
                line={"color": source_colour(index), "width": 1.6},
                hovertemplate="pose %{x}: %{y:.3f} N",
            ),
            row=2,
            col=1,
        )
    finish(
        figure, 200 + bars + PANEL, margin={"l": 110, "r": 20, "t": 70, "b": 50}, barmode="group"
    )
    figure.update_xaxes(title={"text": "highest force, N"}, rangemode="tozero", row=1, col=1)
    figure.update_xaxes(title={"text": "pose number"}, zeroline=False, row=2, col=1)
    figure.update_yaxes(title={"text": "force, N"}, row=2, col=1)
    return figure


def _overall(study: Study) -> Floats:
    """(n_pose, n_closure) N."""
    return np.asarray(study.strained["overall_force"].values)


def _drawn(force: Floats) -> np.ndarray:
    return drawn_poses(np.abs(force).max(axis=1))
