"""Internal forces of an over-constrained machine: what clearances leave of each source's."""

from __future__ import annotations

import numpy as np

from truepose.arrays import Floats
from truepose.language import say
from truepose.reporting.display import decimals_for, number, pose_text, where_highest
from truepose.reporting.figures._flow import legend_height
from truepose.reporting.figures._over_poses import (
    MARKS,
    broken,
    how_drawn,
    is_few,
    sorted_sizes,
    with_gaps,
)
from truepose.reporting.figures._plot import Plot, grid, trace
from truepose.reporting.figures._style import (
    AFTER,
    BEFORE,
    BEFORE_FILL,
    SHOWN,
    finish,
    small,
    source_colour,
    source_symbol,
)
from truepose.reporting.study import Study

TITLE = "Internal forces"
NEEDS = "strain"

BAR, PANEL = 40, 200


def says(study: Study) -> str:
    """The largest force inside the structure, in which closure and where."""
    force = _overall(study)
    pose, closure = np.unravel_index(where_highest(np.abs(force)), force.shape)
    size = float(force[pose, closure])
    commanded = study.machine.commanded
    at = [float(study.strained[f"pose_{name}"].values[pose]) for name in commanded]
    return say(
        "The largest force in a closure, with all sources and loads, is {size} N in {closure}, at "
        "{pose}.",
        size=number(size, decimals_for(size, 4)),
        closure=str(study.strained["closure"].values[closure]),
        pose=pose_text(at, commanded, study.units),
    )


def caption(study: Study) -> str:
    """What a bar and a line is."""
    return " ".join(
        [
            say(
                "The platform has more closures than freedoms. Above: the highest force that each "
                "source alone, without load, makes inside the structure, had the joints no "
                "clearance (hollow), and what their clearances leave of it (filled). Below: the "
                "force in each closure with all sources at their shifts, under all loads; tension "
                "is positive."
            ),
            how_drawn(study, sliced=False),
        ]
    )


def figure(study: Study) -> Plot:
    """Bars a source and lines a closure, N."""
    result = study.strained
    order = np.argsort(result["highest_force_rigid"].values, kind="stable")
    names = [str(name) for name in result["source"].values[order]]
    closures = [str(name) for name in result["closure"].values]
    legend = [say("without clearances"), say("with clearances"), *closures]
    bars = BAR * max(len(names), 1) + 40
    top = 25 + legend_height(legend, 1000)
    figure = grid(rows=2, cols=1, row_heights=[bars, PANEL], vertical_spacing=80 / (bars + PANEL))
    looks = (
        ("highest_force_rigid", legend[0], BEFORE_FILL, {"color": BEFORE, "width": 1.6}),
        ("highest_force", legend[1], AFTER, {"width": 0}),
    )
    for variable, name, colour, line in looks:
        figure.add_trace(
            trace(
                "bar",
                x=small(result[variable].values[order]),
                y=names,
                orientation="h",
                name=name,
                marker={"color": colour, "line": line},
                customdata=[str(verdict) for verdict in result["verdict"].values[order]],
                hovertemplate=f"%{{y}}: %{{x:{SHOWN}}} N, %{{customdata}}",
            ),
            row=1,
            col=1,
        )
    _add_closures(figure, study, closures)
    inside = bars + PANEL + 80
    finish(
        figure,
        top + inside + 45,
        margin={"l": 110, "r": 20, "t": top, "b": 45},
        barmode="group",
    )
    # Under the bars of a small screen there is less room, above them more names below each other.
    narrow_top = 25 + legend_height(legend, 350)
    figure.update_layout(
        meta={"narrow": {"margin.t": narrow_top, "height": narrow_top + inside + 45}}
    )
    figure.update_xaxes(
        title={"text": say("highest force, N")}, rangemode="tozero", nticks=6, row=1, col=1
    )
    return figure


def _add_closures(figure: Plot, study: Study, closures: list[str]) -> None:
    """A line for each closure: over the pose number, or sorted."""
    force = _overall(study)
    # The forces may be known at other poses than the errors.
    few = is_few(study) and len(force) == study.n_pose
    order = broken(study) if few else np.zeros(0, np.intp)
    for index, closure in enumerate(closures):
        if few:
            x, y = with_gaps(study.numbers + 1, order), with_gaps(force[:, index], order)
        else:
            x, y = sorted_sizes(force[:, index])
        figure.add_trace(
            trace(
                "scatter",
                x=small(x),
                y=small(y),
                name=closure,
                mode="lines+markers",
                line={"color": source_colour(index), "width": 1.6},
                marker={
                    "symbol": source_symbol(index),
                    "size": 5,
                    "maxdisplayed": 0 if few else MARKS,
                },
                hovertemplate=f"%{{x:{SHOWN}}}: %{{y:{SHOWN}}} N",
            ),
            row=2,
            col=1,
        )
    over = say("pose number") if few else say("share of poses, %")
    figure.update_xaxes(title={"text": over}, zeroline=False, nticks=6, row=2, col=1)
    said = say("force, N") if few else say("size of the force, N")
    figure.update_yaxes(title={"text": said}, row=2, col=1)


def _overall(study: Study) -> Floats:
    """(n_pose, n_closure) N."""
    return np.asarray(study.strained["overall_force"].values)
