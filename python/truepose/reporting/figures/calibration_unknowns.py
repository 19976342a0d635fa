"""What was found of each unknown, against its tolerance, and how much measurements say of it."""

from __future__ import annotations

import numpy as np

from truepose.language import grouped, say
from truepose.reporting.calibration import RESTS, signed
from truepose.reporting.display import number
from truepose.reporting.figures._plot import Plot, grid, trace
from truepose.reporting.figures._style import (
    AFTER,
    AXIS,
    BLUE,
    PALE,
    SHADE,
    finish,
    small,
)
from truepose.reporting.study import Study

TITLE = "What was found"
NEEDS = "calibration"
DATA, PRIOR = BLUE, PALE
MOST_DRAWN = 60
ROW_HEIGHT = 19
FURTHEST = 3.0
"""Half bands that the axis shows at most: what is further off stands at its edge."""


def says(study: Study) -> str:
    """How many values come from the measurements, and how many from what was known before."""
    share = np.nan_to_num(study.calibrated["data_share"].values)
    return say(
        "Of {every} unknowns {data} come mostly from the measurements, and {prior} mostly from "
        "what was known before, their tolerances.",
        every=share.size,
        data=int((share >= RESTS).sum()),
        prior=int((share < RESTS).sum()),
    )


def caption(study: Study) -> str:
    """How the two halves are read."""
    parts = [
        say(
            "Left: how much of each value comes from the measurements; the rest is the tolerance, "
            "which the value then only repeats. Right: the change found, in half bands of its "
            "tolerance, with twice its standard uncertainty either side. The grey band is the "
            "tolerance."
        )
    ]
    count = study.calibrated.sizes["unknown"]
    if count > MOST_DRAWN:
        parts.append(
            say(
                "Drawn: the {drawn} of {count} unknowns of which the measurements say most.",
                drawn=MOST_DRAWN,
                count=grouped(count),
            )
        )
    if _beyond(study).any():
        parts.append(
            say(
                "What is further off than {most} half bands stands at the edge.",
                most=number(FURTHEST, 0),
            )
        )
    return " ".join(parts)


def figure(study: Study) -> Plot:
    """One line for each unknown: its bar, and its change."""
    result = study.calibrated
    drawn = _drawn(study)
    names = result["unknown_label"].values[drawn]
    share = np.nan_to_num(result["data_share"].values[drawn])
    figure = grid(rows=1, cols=2, shared_yaxes=True, horizontal_spacing=0.04)
    for values, name, colour in (
        (share, say("from the measurements"), DATA),
        (1.0 - share, say("from the tolerance"), PRIOR),
    ):
        figure.add_trace(
            trace(
                "bar",
                x=small(100.0 * values),
                y=names,
                name=name,
                orientation="h",
                marker={"color": colour},
                hovertemplate="%{y}: %{x:.0f} %<extra>" + name + "</extra>",
            ),
            row=1,
            col=1,
        )
    change, spread = _in_half_bands(study)
    figure.add_trace(
        trace("scatter", x=small(np.clip(change, -FURTHEST, FURTHEST)[drawn]),
            y=names,
            error_x={
                "type": "data", "array": small(2.0 * spread[drawn]), "thickness": 1.2, "width": 3
            },
            text=[
                signed(
                    float(result["value"].values[at]),
                    str(result["unknown_units"].values[at]),
                    study.units,
                )
                for at in drawn
            ],
            name=say("change found"),
            mode="markers",
            marker={"color": AFTER, "size": 7},
            hovertemplate="%{y}: %{text}<extra></extra>",
        ),
        row=1,
        col=2,
    )  # fmt: skip
    figure.add_vrect(-1, 1, fillcolor=SHADE, line={"width": 0}, row=1, col=2, name=say("tolerance"))
    finish(
        figure,
        130 + ROW_HEIGHT * len(drawn),
        barmode="stack",
        legend={"traceorder": "normal"},
        bargap=0.25,
        margin={"l": 20, "r": 20, "t": 60, "b": 55},
    )
    figure.update_yaxes(range=[len(drawn) - 0.5, -0.5], ticks="", showgrid=False, dtick=1)
    figure.update_yaxes(automargin=True, row=1, col=1)
    figure.update_xaxes(nticks=5, tickangle=0)
    figure.update_xaxes(title={"text": say("share of the value, %")}, range=[0, 100], row=1, col=1)
    figure.update_xaxes(
        title={"text": say("change, half bands")}, range=_range(change, spread), zeroline=True,
        zerolinecolor=AXIS, row=1, col=2,
    )  # fmt: skip
    return figure


def _drawn(study: Study) -> np.ndarray:
    """Indices of the unknowns drawn, in their order."""
    share = np.nan_to_num(study.calibrated["data_share"].values)
    return np.sort(np.argsort(-share, kind="stable")[:MOST_DRAWN])


def _in_half_bands(study: Study) -> tuple[np.ndarray, np.ndarray]:
    """(n,) change from the middle of the band and its uncertainty; NaN without a band."""
    result = study.calibrated
    half = result["prior_half"].values
    known = np.where(np.isfinite(half), half, np.nan)
    spread = result["standard_uncertainty"].values
    change = result["value"].values - result["prior_mean"].values
    return change / known, np.where(np.isfinite(spread), spread, np.nan) / known


def _beyond(study: Study) -> np.ndarray:
    flags: np.ndarray = np.abs(_in_half_bands(study)[0]) > FURTHEST
    return flags


def _range(change: np.ndarray, spread: np.ndarray) -> list[float]:
    reach = np.abs(change) + 2.0 * spread
    reach = reach[np.isfinite(reach)]
    most = min(max(float(reach.max(initial=1.0)), 1.1), FURTHEST) * 1.05
    return [-most, most]
