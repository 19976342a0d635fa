"""The sources compared: how much each could do at its worst pose."""

from __future__ import annotations

from truepose.language import say
from truepose.reporting.display import ROUNDING, decimals_for, number, pose_text, where_highest
from truepose.reporting.figures._flow import Flow
from truepose.reporting.figures._plot import Keys, Plot, trace
from truepose.reporting.figures._style import SHOWN, TARGET, VERDICT_COLOURS, finish, small
from truepose.reporting.figures._text import NO_BOX
from truepose.reporting.study import Study

TITLE = "The sources compared"

BAR = 40
"""Pixels of a source."""

INSIDE = 0.7
"""Of the longest: the number of a bar that is longer stands in it."""

PATTERNS = {"dominant": "", "relevant": "/", "negligible": "."}
"""Of the bars, so that their colour is never alone."""


def says(study: Study) -> str:
    """The source that can do most, how much and where, and how large its share is."""
    first = study.by_rank[0]
    highest = study.values("highest")[:, 0]
    unit = study.units.error("position" if study.positions else "orientation")
    pose = where_highest(study.values("largest")[:, first, 0])
    size = float(highest[first]) * unit.per_si
    total = float(highest.sum())
    return say(
        "Of the sources {source} can do most: up to {size} {unit} at {pose}, {share} % of what "
        "they can do one by one.",
        source=study.sources[first],
        size=number(size, decimals_for(size, 4)),
        unit=unit.label,
        pose=pose_text(study.poses[pose], study.machine.commanded, study.units),
        share=number(100.0 * float(highest[first]) / total if total > 0.0 else 0.0, 0),
    )


def caption(study: Study) -> str:
    """What a bar is and what its colour means."""
    text = [
        say(
            "The most that each source alone can do to the tool, over all poses: its exact error "
            "at the known shift and its whole band. Dominant: the largest that together make 80 % "
            "of the total. Negligible: below 5 % of the accuracy asked, or of the total where none "
            "is asked."
        )
    ]
    if study.machine.accuracy.asks:
        text.append(say("The dashed line is the accuracy asked."))
    return " ".join(text)


def figure(study: Study) -> Plot:
    """Horizontal bars, the largest on top: position and, where it turns, angle."""
    accuracy = study.machine.accuracy
    asked = {
        "position": (say("position"), accuracy.target),
        "orientation": (say("orientation"), accuracy.angle_target),
    }
    parts = [(str(name), *asked[str(name)]) for name in study.budget["quantity"].values]
    order = study.by_rank[::-1]
    verdicts = [str(study.values("verdict")[index]) for index in order]
    names = {
        "dominant": say("dominant"),
        "relevant": say("relevant"),
        "negligible": say("negligible"),
    }
    flow = Flow(
        [
            say(
                "highest {quantity} error, {unit}",
                quantity=said,
                unit=study.units.error(part).label,
            )
            for part, said, _ in parts
        ],
        columns=len(parts),
        narrow=1,
        panel=BAR * len(order),
        narrow_panel=BAR * len(order),
        gap=55,
        top=55,
        narrow_top=55,
        apart=(0.04, 0.0),
    )
    figure = flow.empty()
    finish(
        figure,
        flow.height,
        bargap=0.35,
        margin={"l": 110, "r": 20, "t": flow.top, "b": flow.bottom},
    )
    for column, (part, _, target) in enumerate(parts):
        unit, at = study.units.error(part), flow.place(column)
        highest = study.values("highest")[order, column] * unit.per_si
        longest = max(float(highest.max()), (target or 0.0) * unit.per_si)
        figure.add_trace(
            trace(
                "bar",
                x=small(highest),
                y=[study.sources[index] for index in order],
                orientation="h",
                marker=_bars(
                    [VERDICT_COLOURS[verdict] for verdict in verdicts],
                    [PATTERNS[verdict] for verdict in verdicts],
                ),
                text=[
                    # What is but the rounding of nothing is nothing.
                    number(size, decimals_for(size, 4) if size > ROUNDING * longest else 0)
                    for size in highest.tolist()
                ],
                textposition=[
                    "inside" if size > INSIDE * longest else "outside" for size in highest.tolist()
                ],
                insidetextanchor="start",
                textfont={"size": 12},
                customdata=[names[verdict] for verdict in verdicts],
                hovertemplate=f"%{{y}}: %{{x:{SHOWN}}} {unit.label}, %{{customdata}}{NO_BOX}",
                showlegend=False,
            ),
            **at,
        )
        figure.update_xaxes(rangemode="tozero", nticks=6, **at)
        if target is not None:
            figure.add_vline(target * unit.per_si, line={"color": TARGET, "dash": "dash"}, **at)
    for verdict in dict.fromkeys(reversed(verdicts)):
        figure.add_trace(
            trace(
                "bar",
                x=[None],
                y=[None],
                name=names[verdict],
                marker=_bars(VERDICT_COLOURS[verdict], PATTERNS[verdict]),
            )
        )
    figure.update_yaxes(ticks="")
    if len(parts) > 1:
        # Beside each other the first has the names, below each other both.
        figure.update_yaxes(showticklabels=False, **flow.place(1))
        figure.layout["meta"]["narrow"]["yaxis2.showticklabels"] = True
    return figure


def _bars(colour: str | list[str], shape: str | list[str]) -> Keys:
    """The look of bars: filled, or with an outline and a pattern of their colour."""
    # What overlays would be warned of by plotly.js, which wants one colour under it.
    pattern = {"shape": shape, "fillmode": "replace", "size": 6, "solidity": 0.35}
    return {"color": colour, "line": {"color": colour, "width": 1}, "pattern": pattern}
