"""The sources compared: how much each could do at its worst pose."""

from __future__ import annotations

from truepose.reporting.figures._plot import Plot, grid, trace
from truepose.reporting.figures._style import VERDICT_COLOURS, finish, small
from truepose.reporting.study import Study

TITLE = "The sources compared"


def caption(study: Study) -> str:
    """What a bar is and what its colour means."""
    asked = study.machine.accuracy.target
    line = "" if asked is None else " The line is the accuracy asked."
    return (
        "The most that each source alone can do to the tool, over all poses: its exact error at "
        "the known shift and its whole band. Dominant: the largest that together make 80 % of "
        "the total. Negligible: below 5 % of the accuracy asked, or of the total where none is "
        "asked." + line
    )


def figure(study: Study) -> Plot:
    """Horizontal bars, the largest on top: position and, where it turns, angle."""
    asked = (study.machine.accuracy.target, study.machine.accuracy.angle_target)
    parts = [("position", study.units.error("position"), study.values("highest")[:, 0], asked[0])]
    if study.rotations:
        unit = study.units.error("orientation")
        parts.append(("orientation", unit, study.values("highest")[:, 1], asked[1]))
    order = study.by_rank[::-1]
    verdicts = [str(study.values("verdict")[index]) for index in order]
    figure = grid(rows=1, cols=len(parts), shared_yaxes=True, horizontal_spacing=0.08)
    for column, (part, unit, highest, target) in enumerate(parts, start=1):
        figure.add_trace(
            trace(
                "bar",
                x=small(highest[order] * unit.per_si),
                y=[study.sources[index] for index in order],
                orientation="h",
                marker={"color": [VERDICT_COLOURS[verdict] for verdict in verdicts]},
                text=[f"{value * unit.per_si:.4g}" for value in highest[order]],
                textposition="auto",
                customdata=verdicts,
                hovertemplate=f"%{{y}}: %{{x:.3f}} {unit.label}, %{{customdata}}<extra></extra>",
                showlegend=False,
            ),
            row=1,
            col=column,
        )
        figure.update_xaxes(
            title={"text": f"highest {part} error, {unit.label}"},
            rangemode="tozero",
            row=1,
            col=column,
        )
        if target is not None:
            figure.add_vline(
                x=target * unit.per_si, line={"color": "#1B2A41", "dash": "dash"}, row=1, col=column
            )
    for verdict in dict.fromkeys(reversed(verdicts)):
        figure.add_trace(
            trace(
                "bar", x=[None], y=[None], name=verdict, marker={"color": VERDICT_COLOURS[verdict]}
            )
        )
    finish(figure, 130 + 46 * len(order), bargap=0.35, margin={"l": 110, "r": 20, "t": 40, "b": 55})
    figure.update_yaxes(ticks="")
    return figure
