"""Whose fault the spread is: shares of the variance, the largest parameters on top."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from truepose.language import say
from truepose.reporting.alike import Alike, alike, first_text, rest_text
from truepose.reporting.figures._plot import Plot, grid, trace
from truepose.reporting.figures._style import (
    BLUE,
    GREEN,
    PALE_BLUE,
    QUIET,
    VERMILION,
    finish,
    small,
)
from truepose.reporting.reading import at_text
from truepose.reporting.study import Study
from truepose.reporting.variance_shares import Blame, blame, parts_of, spread_pose

TITLE = "Which dimension to tighten first"
NEEDS = "shares"

MOST_BARS = 16
BAR = 26
COLOURS = {"first": BLUE, "total": PALE_BLUE, "shapley": GREEN}
LINEAR = VERMILION
FRONT, BACK = 0.38, 0.72
"""Width of a bar, in rows."""
LONGEST = 32
"""Letters of a name that leave room for the bars."""


def says(study: Study) -> str:
    """What makes most of the spread, or what does alike."""
    result = study.shares
    assert result is not None
    pose, part = spread_pose(result), parts_of(result)[0]
    who = blame(result, pose, "parameter", part)
    return first_text(who, part, at_text(study.machine, result, pose))


def caption(study: Study) -> str:
    """What a share is, and what is not drawn."""
    result = study.shares
    assert result is not None
    parts = [
        say(
            "Shares of the variance of the tool's error at {pose}, where it spreads most. First "
            "order: what would go if this parameter were known exactly; total: what would stay if "
            "all others were; the diamonds are the linear shares, the whiskers 95 % confidence. "
            "Alike are those that these cannot tell apart; the bar is of each of them. Tightening "
            "what is on top gains most.",
            pose=at_text(study.machine, result, spread_pose(result)),
        )
    ]
    if "shapley" in result:
        parts.append(
            say("Some are correlated, so that first and total need not add up: Shapley shares do.")
        )
    shared = _shared(study)
    if any(len(alike(who)) > MOST_BARS for who in shared.values()):
        parts.append(say("The {count} largest are drawn.", count=MOST_BARS))
    for part, who in shared.items():
        rest = rest_text(who)
        if rest and part == "position":
            parts.append(say("Position: {rest}", rest=rest))
        elif rest:
            parts.append(say("Orientation: {rest}", rest=rest))
    return " ".join(parts)


def figure(study: Study) -> Plot:
    """Horizontal bars, %, of position and, where the platform turns, of orientation below it."""
    shared = _shared(study)
    rows = {part: max(len(_drawn(who)), 2) for part, who in shared.items()}
    # Title and numbers of an axis have the same height in every figure.
    height = 110 + BAR * sum(rows.values()) + 75 * len(rows)
    figure = grid(
        len(shared),
        1,
        row_heights=list(rows.values()),
        vertical_spacing=75 / height if len(shared) > 1 else 0.0,
    )
    for row, (part, who) in enumerate(shared.items(), start=1):
        _draw(figure, who, row)
        title = say("of the position's variance, %")
        if part != "position":
            title = say("of the orientation's variance, %")
        figure.update_xaxes(row, 1, title={"text": title}, rangemode="tozero")
    finish(
        figure,
        height,
        barmode="overlay",
        bargap=0.3,
        margin={"l": 20, "r": 20, "t": 60, "b": 50},
    )
    figure.update_yaxes(ticks="", automargin=True, tickfont={"size": 11})
    return figure


def _shared(study: Study) -> dict[str, Blame]:
    """Who makes how much of position and orientation, those that there are."""
    result = study.shares
    assert result is not None
    pose = spread_pose(result)
    return {part: blame(result, pose, "parameter", part) for part in parts_of(result)}


def _drawn(who: Blame) -> list[Alike]:
    """Those with a bar, the lowest first: the axis goes upwards."""
    return alike(who)[:MOST_BARS][::-1]


def _draw(figure: Plot, who: Blame, row: int) -> None:
    groups = _drawn(who)
    names = _shortened([group.label for group in groups])
    titles = {"first": say("first order"), "total": say("total"), "shapley": say("Shapley")}
    for kind in ["shapley"] if "shapley" in who.kinds else ["total", "first"]:
        mean, plus, minus = _ends(who, kind, groups)
        has_interval = kind in who.confidence
        figure.add_trace(
            trace(
                "bar",
                x=small(mean),
                y=names,
                orientation="h",
                name=titles[kind],
                legendgroup=kind,
                showlegend=row == 1,
                # Narrower in front: where both are alike, both are seen.
                marker={"color": COLOURS[kind]},
                width=FRONT if kind == "first" else BACK,
                error_x={
                    "array": small(plus),
                    "arrayminus": small(minus),
                    "symmetric": False,
                    "thickness": 1,
                    "width": 3,
                    "color": QUIET,
                }
                if has_interval
                else None,
                text=[", ".join(group.names) for group in groups],
                textposition="none",
                hovertemplate="%{text}: %{x:.2f} %<extra>" + titles[kind] + "</extra>",
            ),
            row,
            1,
        )
    linear = [100.0 * float(who.kinds["linear"][group.at].mean()) for group in groups]
    figure.add_trace(
        trace(
            "scatter",
            x=small(linear),
            y=names,
            mode="markers",
            name=say("linear"),
            legendgroup="linear",
            showlegend=row == 1,
            marker={"color": LINEAR, "symbol": "diamond", "size": 8},
            hovertemplate="%{y}: %{x:.2f} %<extra>" + say("linear") + "</extra>",
        ),
        row,
        1,
    )


def _ends(
    who: Blame, kind: str, groups: Sequence[Alike]
) -> tuple[list[float], list[float], list[float]]:
    """The mean share of each group, %, and how far above and below it any of it can be."""
    share = 100.0 * who.kinds[kind]
    half = 100.0 * who.confidence.get(kind, np.zeros(len(share)))
    mean = [float(share[group.at].mean()) for group in groups]
    above = [float((share + half)[group.at].max()) for group in groups]
    below = [float((share - half)[group.at].min()) for group in groups]
    plus = [most - middle for most, middle in zip(above, mean, strict=True)]
    return mean, plus, [middle - least for middle, least in zip(mean, below, strict=True)]


def _shortened(names: Sequence[str]) -> list[str]:
    """Names that leave room for the bars; still told apart."""
    short = [name if len(name) <= LONGEST else f"{name[: LONGEST - 1]}…" for name in names]
    return list(names) if len(set(short)) < len(short) else short
