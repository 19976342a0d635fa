"""The pictures of an allocation: what the error is made of, where it binds, what it costs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from truepose.language import say
from truepose.reporting.display import column, pose_text
from truepose.reporting.figures import DrawnFigure
from truepose.reporting.figures._plot import Keys, Plot, grid, trace
from truepose.reporting.figures._style import BLUE, INK, PALE_BLUE, TARGET, finish, small
from truepose.reporting.figures._text import NO_BOX, as_text
from truepose.reporting.result_words import word

if TYPE_CHECKING:
    from truepose.design.cost_curve import CostCurve
    from truepose.design.result import Allocation, Contribution

ROW, ROOM = 26, 110
"""Pixels of a bar or mark, and of what stands around all of them."""

MOST_MARKS = 24
"""Poses at which the design errs most, as many as are drawn."""

HEIGHT = 420


def figures(result: Allocation) -> list[DrawnFigure]:
    """What the largest error is made of, as filed and designed, and where it binds."""
    drawn = []
    if result.contributions:
        drawn.append(_made_of(result))
    if result.worst_poses:
        drawn.append(_binding(result))
    return drawn


def _made_of(result: Allocation) -> DrawnFigure:
    """Bars of each part, a panel a quantity."""
    kinds = list(dict.fromkeys(one.quantity for one in result.contributions))
    names = list(dict.fromkeys(one.name for one in result.contributions))
    figure = grid(1, len(kinds), horizontal_spacing=0.12, vertical_spacing=0.2, shared_yaxes=True)
    for col, kind in enumerate(kinds, start=1):
        unit = result.machine.shown.error(kind)
        of = {one.name: one for one in result.contributions if one.quantity == kind}
        for name, colour, values in (
            (say("as filed"), PALE_BLUE, [_before(of.get(part)) for part in names]),
            (say("designed"), BLUE, [_after(of.get(part)) for part in names]),
        ):
            bars: Keys = trace(
                "bar",
                x=small([value * unit.per_si for value in values]),
                y=names,
                orientation="h",
                marker={"color": colour},
                name=name,
                legendgroup=name,
                showlegend=col == 1,
                hovertemplate=f"%{{x:.4g}} {unit.label}{NO_BOX}",
            )
            figure.add_trace(bars, 1, col)
        figure.update_xaxes(
            1, col, title={"text": f"{word(kind)}, {unit.label}"}, automargin=True, zeroline=True
        )
        figure.update_yaxes(1, col, autorange="reversed", automargin=True)
    finish(
        figure,
        2 * ROW * len(names) + ROOM,
        margin={"l": 90, "r": 20, "t": 50, "b": 60},
        barmode="group",
    )
    return DrawnFigure(
        "made_of",
        say("What the largest error is made of, as filed and designed"),
        say(
            "Each part along the largest error, to first order, at the worst pose of the machine "
            "as filed and at that of the design."
        )
        if result.kept is None
        else say(
            "What the mean error does, and of the rest the parts of the variance, at the worst "
            "pose of the machine as filed and at that of the design."
        ),
        as_text(figure),
        says=_made_of_says(result, kinds[0]),
    )


def _before(one: Contribution | None) -> float:
    return 0.0 if one is None else one.before


def _after(one: Contribution | None) -> float:
    return 0.0 if one is None else one.after


def _made_of_says(result: Allocation, kind: str) -> str:
    unit = result.machine.shown.error(kind)
    own = [one for one in result.contributions if one.quantity == kind]
    most = max(own, key=lambda one: abs(one.after))
    cells = column([most.after * unit.per_si, most.before * unit.per_si])
    return say(
        "Most of it in the design is {part}: {after} {unit} of {quantity}, and {before} as filed.",
        part=most.name,
        after=cells[0],
        before=cells[1],
        unit=unit.label,
        quantity=word(kind),
    )


def _binding(result: Allocation) -> DrawnFigure:
    """The largest errors found over their limits, the worst first, a mark a pose."""
    shown = result.worst_poses[:MOST_MARKS]
    units = result.machine.shown
    kinds = list(dict.fromkeys(one.quantity for one in shown))
    names = [f"{number}" for number in range(1, len(shown) + 1)]
    figure = grid(1, 1)
    for kind, colour in zip(kinds, (BLUE, INK), strict=False):
        unit = units.error(kind)
        rows = [at for at, one in enumerate(shown) if one.quantity == kind]
        figure.add_trace(
            trace(
                "scatter",
                x=small([100.0 * shown[at].error / shown[at].limit for at in rows]),
                y=[names[at] for at in rows],
                mode="markers",
                marker={"color": colour, "size": 10},
                name=word(kind),
                text=[
                    f"{shown[at].error * unit.per_si:.4g} {unit.label}\n{shown[at].case}\n"
                    + pose_text(shown[at].pose, result.machine.commanded, units)
                    for at in rows
                ],
                hovertemplate=f"%{{x:.4g}} %\n%{{text}}{NO_BOX}",
            ),
            1,
            1,
        )
    title = {"text": say("largest error, % of its limit")}
    figure.update_xaxes(1, 1, title=title, rangemode="tozero")
    figure.update_yaxes(
        1,
        1,
        title={"text": say("pose, the worst first")},
        type="category",
        categoryorder="array",
        categoryarray=names,
        autorange="reversed",
        automargin=True,
    )
    figure.add_vline(100.0, 1, 1, line={"color": TARGET, "dash": "dash"})
    finish(
        figure,
        ROW * len(shown) + ROOM,
        margin={"l": 70, "r": 20, "t": 40, "b": 60},
        hovermode="closest",
        showlegend=len(kinds) > 1,
    )
    worst = shown[0]
    return DrawnFigure(
        "binding",
        say("Where it binds"),
        say(
            "A mark is a pose at which the design errs most, in its condition: the largest error "
            "found there, solved exactly, over the target less the reserve (dashed)."
        )
        if result.kept is None
        else say(
            "A mark is a pose at which the design errs most, in its condition: what the share of "
            "machines asked is within there, over the target less the reserve (dashed)."
        ),
        as_text(figure),
        says=say(
            "Nearest to its limit is the {quantity} at {pose}: {share} % of it.",
            quantity=word(worst.quantity),
            pose=pose_text(worst.pose, result.machine.commanded, units),
            share=f"{100.0 * worst.error / worst.limit:.4g}",
        ),
    )


def curve_figures(result: CostCurve) -> list[DrawnFigure]:
    """What the machine costs against its target; none where no target can be kept."""
    assert result.machine.costs is not None
    unit, money = result.machine.shown.error("position"), result.machine.costs.unit
    points = [one for one in result.points if one.cost < float("inf")]
    if not points:
        return []
    targets = [one.target * unit.per_si for one in points]
    figure = Plot()
    bounds = [one.lower_bound for one in points]
    if np.isfinite(bounds).all():  # of a share of machines none is claimed
        figure.add_trace(_line(targets, bounds, say("at least"), PALE_BLUE, "lines"))
    costs = [one.cost for one in points]
    figure.add_trace(_line(targets, costs, say("cost"), BLUE, "lines+markers"))
    figure.update_xaxes(title={"text": say("position target, {unit}", unit=unit.label)})
    figure.update_yaxes(
        title={"text": f"{say('cost')}, {money}" if money else say("cost")}, rangemode="tozero"
    )
    finish(figure, HEIGHT, margin={"l": 70, "r": 20, "t": 50, "b": 60}, hovermode="closest")
    tight, wide = min(points, key=lambda one: one.target), max(points, key=lambda one: one.target)
    return [
        DrawnFigure(
            "curve",
            say("Cost against target"),
            say(
                "Each mark is the cheapest design found for a position target; below the pale "
                "line there is none by the linear model. All else is as the file has it."
            ),
            as_text(figure),
            says=say(
                "From {wide} to {tight} {unit} the cost goes from {low} to {high}.",
                wide=f"{wide.target * unit.per_si:.6g}",
                tight=f"{tight.target * unit.per_si:.6g}",
                unit=unit.label,
                low=f"{wide.cost:.4g}",
                high=f"{tight.cost:.4g} {money}".rstrip(),
            ),
        )
    ]


def _line(x: Sequence[float], y: Sequence[float], name: str, colour: str, mode: str) -> Keys:
    return trace(
        "scatter",
        x=small(x),
        y=small(y),
        mode=mode,
        line={"color": colour, "width": 2},
        marker={"color": colour, "size": 8},
        name=name,
        hovertemplate=f"%{{x:.4g}}: %{{y:.4g}}{NO_BOX}",
    )


__all__ = ["curve_figures", "figures"]
