"""Which unknowns the measurements tell apart only together."""

from __future__ import annotations

import numpy as np

from truepose.language import say
from truepose.reporting.display import number
from truepose.reporting.figures._plot import Keys, Plot, trace
from truepose.reporting.figures._style import BLUE, PAPER, VERMILION, finish, small
from truepose.reporting.study import Study

TITLE = "Correlation"
NEEDS = "calibration"
MOST_DRAWN = 120
MOST_NAMED = 60
STRONG = 0.9
SCALE = [[0.0, BLUE], [0.5, PAPER], [1.0, VERMILION]]
"""Told apart by colour-blind readers too."""


def says(study: Study) -> str:
    """The strongest pair."""
    pair = _strongest(study)
    if pair is None:
        return say("No two unknowns are correlated by {strong} or more.", strong=number(STRONG, 1))
    first, second, value = pair
    return say(
        "Told apart worst are {first} and {second}: their correlation is {value}.",
        first=first,
        second=second,
        value=f"+{number(value, 3)}" if value > 0 else number(value, 3),
    )


def caption(study: Study) -> str:
    """What the colours mean."""
    parts = [
        say(
            "Correlation of the values found. Near +1 or −1 two unknowns are known well together "
            "(their difference, or their sum) and badly by themselves: what such values are worth "
            "shows at the tool only."
        )
    ]
    if study.calibrated.sizes["unknown"] > MOST_DRAWN:
        parts.append(
            say(
                "Drawn: the first {count} unknowns; files for programs have all.",
                count=MOST_DRAWN,
            )
        )
    return " ".join(parts)


def figure(study: Study) -> Plot:
    """A heat map of the correlation matrix."""
    result = study.calibrated
    names = result["unknown_label"].values[:MOST_DRAWN].tolist()
    values = result["correlation"].values[:MOST_DRAWN, :MOST_DRAWN]
    named = len(names) <= MOST_NAMED
    places = list(range(len(names)))
    figure = Plot(
        trace(
            "heatmap",
            x=places,
            y=places,
            z=small(values),
            customdata=np.array([[f"{one}\n{other}" for one in names] for other in names]),
            zmin=-1.0,
            zmax=1.0,
            colorscale=SCALE,
            colorbar={
                "orientation": "h",
                "thickness": 14,
                "len": 0.45,
                "x": 0.0,
                "xanchor": "left",
                "y": 1.02,
                "yanchor": "bottom",
            },
            hovertemplate="%{customdata}\n%{z:.3f}<extra></extra>",
        )
    )
    size = min(max(16 * len(names), 340), 760)
    margin = 175 if named else 60
    finish(
        figure,
        size + min(margin, 140) + 70,
        margin={"l": margin, "r": 20, "t": 70, "b": min(margin, 140)},
    )
    ticks: Keys = {
        "tickmode": "array",
        "tickvals": places,
        "ticktext": names,
        "tickfont": {"size": 11},
    }
    common: Keys = {"showgrid": False, "zeroline": False, "ticks": "", "constrain": "domain"}
    figure.update_xaxes(
        **(ticks if named else {"showticklabels": False}),
        tickangle=-60,
        constraintoward="left",
        **common,
    )
    figure.update_yaxes(
        **(ticks if named else {"showticklabels": False}),
        autorange="reversed",
        scaleanchor="x",
        **common,
    )
    return figure


def _strongest(study: Study) -> tuple[str, str, float] | None:
    """The two unknowns that are correlated most, where that is strong."""
    result = study.calibrated
    values = np.nan_to_num(result["correlation"].values.copy())
    np.fill_diagonal(values, 0.0)
    if not values.size:
        return None
    first, second = np.unravel_index(int(np.argmax(np.abs(values))), values.shape)
    value = float(values[first, second])
    if abs(value) < STRONG:
        return None
    names = result["unknown_label"].values
    return str(names[first]), str(names[second]), value
