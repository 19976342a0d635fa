"""What was found of each unknown, against its tolerance, and how much measurements say of it."""

from __future__ import annotations

import numpy as np

from truepose.reporting.calibration import signed
from truepose.reporting.figures._plot import Plot, grid, trace
from truepose.reporting.figures._style import AFTER, AXIS, SOURCE_COLOURS, finish, small
from truepose.reporting.study import Study

TITLE = "What was found"
NEEDS = "calibration"
DATA, PRIOR = SOURCE_COLOURS[0], "#D5DBE5"
MOST_DRAWN = 60
ROW_HEIGHT = 19
FURTHEST = 3.0
"""Half bands that the axis shows at most: what is further off stands at its edge."""


def caption(study: Study) -> str:
    """How the two halves are read."""
    text = (
        "Left: how much of each value comes from the measurements; the rest is the tolerance, "
        "which the value then only repeats. Right: the change found, in half bands of its "
        "tolerance, with twice its standard uncertainty either side. The grey band is the "
        "tolerance."
    )
    count = study.calibrated.sizes["unknown"]
    if count > MOST_DRAWN:
        text += f" Drawn: the {MOST_DRAWN} of {count} unknowns of which the measurements say most."
    if _beyond(study).any():
        text += f" What is further off than {FURTHEST:g} half bands stands at the edge."
    return text


def figure(study: Study) -> Plot:
    """One line for each unknown: its bar, and its change."""
    result = study.calibrated
    drawn = _drawn(study)
    names = result["unknown_label"].values[drawn]
    share = np.nan_to_num(result["data_share"].values[drawn])
    figure = grid(rows=1, cols=2, shared_yaxes=True, horizontal_spacing=0.04)
    for values, name, colour in (
        (share, "from the measurements", DATA),
        (1.0 - share, "from the tolerance", PRIOR),
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
            name="change found",
            mode="markers",
            marker={"color": AFTER, "size": 7},
            hovertemplate="%{y}: %{text}<extra></extra>",
        ),
        row=1,
        col=2,
    )  # fmt: skip
    figure.add_vrect(-1, 1, fillcolor="rgba(27,42,65,0.08)", line={"width": 0}, row=1, col=2)
    finish(
        figure,
        130 + ROW_HEIGHT * len(drawn),
        barmode="stack",
        legend={"traceorder": "normal"},
        bargap=0.25,
        margin={"l": 190, "r": 20, "t": 45, "b": 55},
    )
    figure.update_yaxes(range=[len(drawn) - 0.5, -0.5], ticks="", showgrid=False, dtick=1)
    figure.update_xaxes(title={"text": "share of the value, %"}, range=[0, 100], row=1, col=1)
    figure.update_xaxes(
        title={"text": "change, half bands"}, range=_range(change, spread), zeroline=True,
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
