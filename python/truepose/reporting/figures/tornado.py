"""Whose fault the spread is: shares of the variance, the largest parameters on top."""

from __future__ import annotations

from collections.abc import Sequence

from truepose.reporting.figures._plot import Plot, grid, trace
from truepose.reporting.figures._style import finish, small
from truepose.reporting.reading import at_text
from truepose.reporting.study import Study
from truepose.reporting.variance_shares import Blame, blame, spread_pose

TITLE = "Which dimension to tighten first"
NEEDS = "shares"

MOST_BARS = 16
BAR = 26
LOOKS = {
    "first": ("first order", "#0072B2"),
    "total": ("total", "#9FC5DF"),
    "shapley": ("Shapley", "#009E73"),
}
LINEAR = "#D55E00"
LETTER, PAGE = 7.2, 1000.0
"""Width of a letter and of the figure, in pixels."""
FRONT, BACK = 0.38, 0.72
"""Width of a bar, in rows."""


def caption(study: Study) -> str:
    """What a share is, and what is not drawn."""
    result = study.shares
    assert result is not None
    pose = at_text(study.machine, result, spread_pose(result))
    count = result.sizes["parameter"]
    left = f" The {MOST_BARS} largest of {count} are drawn." if count > MOST_BARS else ""
    shapley = (
        " Some are correlated, so that first and total need not add up: Shapley shares do."
        if "shapley" in result
        else ""
    )
    return (
        f"Shares of the variance of the tool's error at {pose}, where it spreads most. First "
        "order: what would go if this parameter were known exactly; total: what would stay if all "
        "others were; the marks are the linear shares, the whiskers 95 % confidence. Tightening "
        "what is on top gains most." + shapley + left
    )


def figure(study: Study) -> Plot:
    """Horizontal bars, %, of position and, where the platform turns, of orientation."""
    result = study.shares
    assert result is not None
    pose = spread_pose(result)
    parts = [
        part
        for part, there in (("position", study.positions), ("orientation", study.rotations))
        if there
    ]
    shared = [blame(result, pose, "parameter", part) for part in parts]
    # The names of the right panel stand between both.
    longest = max(map(len, _shortened(shared[-1].names[:MOST_BARS])))
    figure = grid(rows=1, cols=len(parts), horizontal_spacing=0.04 + longest * LETTER / PAGE)
    rows = min(len(shared[0].names), MOST_BARS)
    for at, (part, who) in enumerate(zip(parts, shared, strict=True), start=1):
        _draw(figure, who, at)
        figure.update_xaxes(
            title={"text": f"share of the {part}'s variance, %"}, rangemode="tozero", row=1, col=at
        )
    finish(
        figure,
        150 + BAR * max(rows, 3),
        barmode="overlay",
        bargap=0.3,
        margin={"l": 20, "r": 20, "t": 45, "b": 55},
    )
    figure.update_yaxes(ticks="", automargin=True)
    return figure


def _draw(figure: Plot, who: Blame, column: int) -> None:
    drawn = slice(0, MOST_BARS)
    names = _shortened(who.names[drawn])[::-1]
    kinds = ["shapley"] if "shapley" in who.kinds else ["total", "first"]
    for kind in kinds:
        name, colour = LOOKS[kind]
        half = who.confidence.get(kind)
        figure.add_trace(
            trace(
                "bar",
                x=small(100.0 * who.kinds[kind][drawn][::-1]),
                y=names,
                orientation="h",
                name=name,
                legendgroup=kind,
                showlegend=column == 1,
                # Narrower in front: where both are alike, both are seen.
                marker={"color": colour},
                width=FRONT if kind == "first" else BACK,
                error_x=None
                if half is None
                else {
                    "array": small(100.0 * half[drawn][::-1]),
                    "thickness": 1,
                    "width": 3,
                    "color": "#5B6779",
                },
                hovertemplate=f"%{{y}}: %{{x:.2f}} %<extra>{name}</extra>",
            ),
            row=1,
            col=column,
        )
    figure.add_trace(
        trace(
            "scatter",
            x=small(100.0 * who.kinds["linear"][drawn][::-1]),
            y=names,
            mode="markers",
            name="linear",
            legendgroup="linear",
            showlegend=column == 1,
            marker={"color": LINEAR, "symbol": "diamond", "size": 8},
            hovertemplate="%{y}: %{x:.2f} %<extra>linear</extra>",
        ),
        row=1,
        col=column,
    )


def _shortened(names: Sequence[str], longest: int = 34) -> list[str]:
    """Names that leave room for the bars; still told apart."""
    short = [name if len(name) <= longest else f"{name[: longest - 1]}…" for name in names]
    return list(names) if len(set(short)) < len(short) else short
