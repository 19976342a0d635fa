"""How far off the tool can be over the whole workspace, before and after compensation."""

from __future__ import annotations

import numpy as np

from truepose.reporting.accuracy import SI
from truepose.reporting.figures._plot import Plot, grid, trace
from truepose.reporting.figures._style import INK, finish, small
from truepose.reporting.how_far import NUMBERS, how_far, share_note
from truepose.reporting.study import Study

TITLE = "How far off can the tool be?"
NEEDS = "accuracy"

COLOURS = {
    "sampled": "#56B4E9",
    "witness": "#0072B2",
    "linear": "#E69F00",
    "bound": "#7F8AA3",
}
PANEL = 330


def caption(study: Study) -> str:
    """What each number is."""
    shown = {name for row in how_far(study) for name, size in row.sizes.items() if size == size}
    said = {
        "sampled": share_note(study),
        "witness": "Witness: the largest error found of one machine, solved exactly.",
        "linear": "Linear maximum: of all machines inside the bands, to first order.",
        "bound": "Proven bound: no machine inside the bands exceeds it.",
    }
    return " ".join(
        [
            "The largest error over all poses of the workspace.",
            *(said[name] for name in NUMBERS if name in shown),
            "The more deviations there are that know nothing of each other, the farther 95 % "
            "stay below the worst case.",
        ]
    )


def figure(study: Study) -> Plot:
    """Grouped bars, a panel for each quantity, a group for each state."""
    rows = how_far(study)
    kinds = list(dict.fromkeys(row.quantity for row in rows))
    figure = grid(rows=1, cols=len(kinds), horizontal_spacing=0.09)
    for column, kind in enumerate(kinds, start=1):
        unit = study.units.error(kind)
        shown = [row for row in rows if row.quantity == kind]
        for name in NUMBERS:
            sizes = np.array([row.sizes[name] for row in shown])
            if not np.isfinite(sizes).any():
                continue
            figure.add_trace(
                trace(
                    "bar",
                    x=[row.state for row in shown],
                    y=small(np.where(np.isfinite(sizes), sizes, np.nan) * unit.per_si),
                    name=NUMBERS[name],
                    legendgroup=name,
                    showlegend=column == 1,
                    marker={"color": COLOURS[name]},
                    hovertemplate="%{x}: %{y:.3f} " + unit.label,
                ),
                row=1,
                col=column,
            )
        figure.update_yaxes(
            title={"text": f"largest {kind} error, {unit.label}"},
            rangemode="tozero",
            row=1,
            col=column,
        )
        _asked(figure, study, kind, column)
    finish(
        figure,
        PANEL + 110,
        barmode="group",
        bargap=0.25,
        margin={"l": 75, "r": 20, "t": 45, "b": 45},
    )
    figure.update_xaxes(ticks="")
    return figure


def _asked(figure: Plot, study: Study, kind: str, column: int) -> None:
    """The accuracy asked, as a line named in the legend: beside it its name would hide bars."""
    accuracy = study.machine.accuracy
    asked = accuracy.target if SI[kind] == "m" else accuracy.angle_target
    if asked is None:
        return
    line = {"color": INK, "dash": "dash", "width": 1.5}
    figure.add_hline(y=asked * study.units.error(kind).per_si, line=line, row=1, col=column)
    name = f"{kind} asked, {accuracy.said(kind)}"
    figure.add_trace(trace("scatter", x=[None], y=[None], mode="lines", line=line, name=name))
