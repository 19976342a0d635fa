"""How far off the tool can be at the worst pose: sampled, linear, exact corner, guaranteed."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from truepose.report.display import is_length
from truepose.report.figures._style import INK, finish, small
from truepose.report.how_sure import ANSWERS, Answers, answers, lacking
from truepose.report.study import Study

TITLE = "How far off can the tool be?"
NEEDS = "worst_case"

COLOURS = {
    "sampled": "#56B4E9",
    "farthest": "#0072B2",
    "linear": "#E69F00",
    "exact": "#D55E00",
    "bound": "#1B2A41",
}
PANEL = 330


def caption(study: Study) -> str:
    """What each answer is, and why one is missing."""
    found = answers(study)
    return (
        f"The same question asked in {len(_there(found))} ways at {found.at}, the worst of the "
        "poses looked at; without regard to the sign. Sampled: the exact error of random samples "
        "of all bands, the coverage interval's farther end (of a magnitude what as many lie below) "
        "and the farthest sample. Linear: first "
        "order, all bands at their unkindest. Exact corner: the same, driven through the exact "
        "machine. Bound: proven for every deviation inside the bands, rounding included. "
        "The more deviations there are that know nothing of each other, the farther samples stay "
        "below the worst case." + "".join(f" {each}" for each in lacking(study))
    )


def figure(study: Study) -> go.Figure:
    """Grouped bars, one group for each component and magnitude."""
    found = answers(study)
    sides = [
        [at for at, name in enumerate(found.names) if is_length(name) == length]
        for length in (True, False)
    ]
    sides = [side for side in sides if side]
    figure = make_subplots(rows=1, cols=len(sides), horizontal_spacing=0.09)
    for column, side in enumerate(sides, start=1):
        names = [_label(found.names[at]) for at in side]
        unit = study.units.error(found.names[side[0]])
        for kind in _there(found):
            sizes = found.sizes[kind][side] * unit.per_si
            figure.add_trace(
                go.Bar(
                    x=names,
                    y=small(sizes),
                    name=ANSWERS[kind].format(percent=found.percent),
                    legendgroup=kind,
                    showlegend=column == 1,
                    marker={"color": COLOURS[kind]},
                    hovertemplate="%{x}: %{y:.3f} " + unit.label,
                ),
                row=1,
                col=column,
            )
        figure.update_yaxes(
            title_text=f"at most, {unit.label}",
            rangemode="tozero",
            row=1,
            col=column,
        )
    asked = study.machine.accuracy.target
    if asked is not None and is_length(found.names[sides[0][0]]):
        line = {"color": INK, "dash": "dash", "width": 1.5}
        figure.add_hline(y=asked * study.units.small_length.per_si, line=line, row=1, col=1)
        # Named in the legend: beside the line its name would hide bars.
        name = f"accuracy asked, {study.machine.accuracy.said('position')}"
        figure.add_trace(go.Scatter(x=[None], y=[None], mode="lines", line=line, name=name))
    finish(
        figure,
        PANEL + 110,
        barmode="group",
        bargap=0.25,
        margin={"l": 75, "r": 20, "t": 45, "b": 45},
    )
    figure.update_xaxes(ticks="")
    return figure


def _there(found: Answers) -> list[str]:
    """The answers that say anything."""
    return [kind for kind in ANSWERS if np.isfinite(found.sizes[kind]).any()]


def _label(name: str) -> str:
    return f"|{name}|" if name in ("position", "orientation") else name
