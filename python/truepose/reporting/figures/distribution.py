"""How far off all machines are at the worst pose, against what is asked."""

from __future__ import annotations

import numpy as np

from truepose.arrays import Floats
from truepose.language import grouped, say
from truepose.reporting.accuracy import AFTER, BEFORE
from truepose.reporting.display import MISSING, number, pose_text
from truepose.reporting.figures import _style
from truepose.reporting.figures._plot import Plot, grid, trace
from truepose.reporting.figures._style import INK, TARGET, finish, small
from truepose.reporting.study import Study
from truepose.reporting.within import shares_within
from truepose.runs.poses import not_assembled_text
from truepose.verdict.answer import Answer

TITLE = "How the error is distributed"
NEEDS = "drawn"

BARS = 48
PANEL_HEIGHT = 280
FARTHEST = 2.5
"""Times the largest error: what is asked and lies farther out is named only."""


def says(study: Study) -> str:
    """How many machines keep what is asked; what 95 of 100 keep where nothing is."""
    shares = shares_within(study)
    if shares:
        quantity = shares[0].quantity
        share = {kept.state: kept.text for kept in shares if kept.quantity == quantity}
        asked = study.machine.accuracy.said(quantity)
        if AFTER not in share:
            return say(
                "At its worst pose {share} of all machines keep the {asked} asked.",
                share=share[BEFORE],
                asked=asked,
            )
        return say(
            "At its worst pose {before} of all machines keep the {asked} asked before "
            "compensation, and {after} after it.",
            before=share[BEFORE],
            after=share[AFTER],
            asked=asked,
        )
    size = {answer.state: _size(study, answer) for answer in _of(study, _quantities(study)[0])}
    if AFTER not in size:
        return say(
            "At its worst pose 95 % of all machines are at most {size} off.", size=size[BEFORE]
        )
    return say(
        "At its worst pose 95 % of all machines are at most {before} off before compensation, and "
        "{after} after it.",
        before=size[BEFORE],
        after=size[AFTER],
    )


def caption(study: Study) -> str:
    """What is drawn how, where, and of how many machines."""
    parts = [
        say(
            "Exact error of machines drawn from all bands together, how many in 100 are how far "
            "off: the dashed outline before compensation, the filled bars after it. The triangles "
            "are what 95 % stay below, the dashed upright line is what is asked."
        )
    ]
    for name in _quantities(study):
        answers = _of(study, name)
        at = [
            pose_text(answer.linear.pose, study.machine.commanded, study.units)
            for answer in answers
        ]
        drawn = grouped(
            max(answer.coverage.draws for answer in answers if answer.coverage is not None)
        )
        if name == "position":
            text = say("Position: {draws} machines at {poses}.", draws=drawn, poses=_listed(at))
        else:
            text = say("Orientation: {draws} machines at {poses}.", draws=drawn, poses=_listed(at))
        parts.append(text)
        for of in (answer.coverage for answer in answers):
            if of is not None and of.failed:
                lost = not_assembled_text(of.failed, of.draws)
                parts.append(say("{lost}: they are in no bar.", lost=lost))
    return " ".join(parts)


def figure(study: Study) -> Plot:
    """A panel for each quantity: machines, % a bar, in either state."""
    names = _quantities(study)
    figure = grid(len(names), 1, vertical_spacing=0.3 if len(names) > 1 else 0.0)
    for row, name in enumerate(names, start=1):
        _draw(figure, study, name, row)
    height = 110 + PANEL_HEIGHT * len(names)
    finish(figure, height, margin={"l": 60, "r": 15, "t": 95, "b": 50}, bargap=0.0)
    figure.update_yaxes(rangemode="tozero", title={"text": say("machines, %")})
    return figure


def _listed(poses: list[str]) -> str:
    """The pose of both states, or those of answer."""
    if len(set(poses)) == 1:
        return poses[0]
    return say("{before}, after compensation at {after}", before=poses[0], after=poses[1])


def _quantities(study: Study) -> list[str]:
    """Names of those that were sampled, in their order."""
    return list(dict.fromkeys(answer.quantity for answer in study.drawn))


def _of(study: Study, quantity: str) -> list[Answer]:
    return [answer for answer in study.drawn if answer.quantity == quantity]


def _size(study: Study, answer: Answer) -> str:
    """What 95 % stay below, for people, as the table of how far off says it."""
    unit, size = study.units.error(answer.quantity), answer.linear.value
    return f"{number(size * unit.per_si, 1)} {unit.label}" if np.isfinite(size) else MISSING


def _draw(figure: Plot, study: Study, name: str, row: int) -> None:
    unit, answers = study.units.error(name), _of(study, name)
    sizes = {answer.state: _finite(answer) * unit.per_si for answer in answers}
    largest = max(float(values[-1]) for values in sizes.values())
    asked = next((kept.asked for kept in shares_within(study) if kept.quantity == name), None)
    limit = None if asked is None else asked * unit.per_si
    top = largest if limit is None or limit > FARTHEST * largest else max(largest, limit)
    edges = np.linspace(0.0, 1.02 * top or 1.0, BARS + 1)
    first = row == 1
    for answer in answers:
        assert answer.coverage is not None
        count, _ = np.histogram(sizes[answer.state], edges)
        share = 100.0 * count / answer.coverage.draws
        _histogram(figure, edges, share, answer.state, first, row)
        _mark(figure, answer, unit.per_si, first, row)
    title = say("position error, {unit}", unit=unit.label)
    if name != "position":
        title = say("orientation error, {unit}", unit=unit.label)
    figure.update_xaxes(row, 1, title={"text": title}, range=[0.0, float(edges[-1])])
    if limit is not None:
        _asked(figure, study, name, limit, float(edges[-1]), row)


def _finite(answer: Answer) -> Floats:
    assert answer.coverage is not None
    sizes = answer.coverage.sizes
    return sizes[np.isfinite(sizes)]


def _histogram(
    figure: Plot, edges: Floats, share: Floats, state: str, legend: bool, row: int
) -> None:
    """After as filled bars, before as the outline of some."""
    if state == AFTER:
        figure.add_trace(
            trace(
                "bar",
                x=small(0.5 * (edges[1:] + edges[:-1])),
                y=small(share),
                width=float(edges[1] - edges[0]),
                name=say("after compensation"),
                legendgroup=state,
                showlegend=legend,
                marker={"color": _style.AFTER_FILL, "line": {"width": 0}},
                hovertemplate="%{x:.4r}: %{y:.2f} %<extra></extra>",
            ),
            row,
            1,
        )
        return
    figure.add_trace(
        trace(
            "scatter",
            x=small(np.repeat(edges, 2)),
            y=small(np.concatenate([[0.0], np.repeat(share, 2), [0.0]])),
            mode="lines",
            name=say("before compensation"),
            legendgroup=state,
            showlegend=legend,
            line={"color": _style.BEFORE, "width": 2, "dash": "6px,2px"},
            hovertemplate="%{x:.4r}: %{y:.2f} %<extra></extra>",
        ),
        row,
        1,
    )


def _mark(figure: Plot, answer: Answer, per_si: float, legend: bool, row: int) -> None:
    """What 95 % stay below, on the axis."""
    size = answer.linear.value * per_si
    if not np.isfinite(size):
        return
    before = answer.state == BEFORE
    figure.add_trace(
        trace(
            "scatter",
            x=small([size]),
            y=small([0.0]),
            mode="markers",
            name=say("95 % before") if before else say("95 % after"),
            showlegend=legend,
            cliponaxis=False,
            marker={
                "symbol": "triangle-up-open" if before else "triangle-up",
                "size": 12,
                "color": _style.BEFORE if before else _style.AFTER,
                "line": {"width": 2, "color": _style.BEFORE if before else _style.AFTER},
            },
            hovertemplate="%{x:.4r}<extra></extra>",
        ),
        row,
        1,
    )


def _asked(figure: Plot, study: Study, name: str, limit: float, top: float, row: int) -> None:
    """The line of what is asked, and above it how many keep it."""
    said = study.machine.accuracy.said(name)
    share = {kept.state: kept.short for kept in shares_within(study) if kept.quantity == name}
    text = say("asked: {asked}", asked=said)
    if BEFORE in share and AFTER in share:
        text += "\n" + say(
            "kept by {before} before, {after} after", before=share[BEFORE], after=share[AFTER]
        )
    elif BEFORE in share:
        text += "\n" + say("kept by {share}", share=share[BEFORE])
    here = min(limit, top)
    if limit <= top:
        line = {"color": TARGET, "width": 2, "dash": "dash"}
        figure.add_vline(limit, row, 1, name=say("asked"), line=line)
    else:
        text = "→ " + text
    middle = here / top
    figure.add_annotation(
        row,
        1,
        x=here,
        y=1.0,
        yref=f"y{row if row > 1 else ''} domain",
        yanchor="bottom",
        xanchor="left" if middle < 0.35 else "right" if middle > 0.65 else "center",
        text=text,
        showarrow=False,
        align="left" if middle < 0.35 else "right" if middle > 0.65 else "center",
        font={"size": 12, "color": INK},
    )
