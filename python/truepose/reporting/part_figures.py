"""The pictures of a part: its path with the errors on it, and a strip for every quantity."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from truepose.arrays import Floats
from truepose.language import grouped, say
from truepose.machine import Machine
from truepose.reporting.display import where_highest
from truepose.reporting.figures import DrawnFigure
from truepose.reporting.figures._plot import Keys, Plot, grid, trace
from truepose.reporting.figures._style import (
    AFTER,
    AXIS,
    BEFORE,
    COLOUR_SCALE,
    GRID,
    INK,
    PAPER,
    SHADE_DARKER,
    finish,
    small,
)
from truepose.reporting.figures._text import as_text
from truepose.verdict.states import AFTER as AFTER_STATE
from truepose.verdict.states import BEFORE as BEFORE_STATE
from truepose.workpiece.along import PathErrors
from truepose.workpiece.evaluation import MET, PartEvaluation, QuantityAnswer

MOST_POINTS = 2000
"""Points of the path that are drawn; of a longer one every second is left out, again and again."""

SHARE = 0.06
"""Of the part's size: how long the largest error is drawn."""

MARGIN = 0.08
"""Of what a strip shows: left free at its ends."""

FLAT = 0.25
"""Of the part's largest extent: what each axis in space shows at least, so that none is a line."""

STRIP = 74
"""Pixels of a strip."""


@dataclass
class DrawnPath:
    """Points of the path to be drawn, gathered as it is walked: a `Sink`.

    Memory is bounded: where there are too many, every second one goes.
    """

    machine: Machine
    wants_half: bool = True
    points: list[Floats] = field(default_factory=list)
    _step: int = 1
    _seen: int = 0
    _kept: int = 0

    def add(self, errors: PathErrors) -> None:
        """The next points, of the feeds."""
        assert errors.half is not None
        numbers = self._seen + np.arange(len(errors.half))
        self._seen += len(errors.half)
        chosen = (numbers % self._step == 0) & errors.batch.is_feed
        rows = np.column_stack(
            [errors.points, errors.known, errors.half, errors.batch.line.astype(np.float64)]
        )[chosen]
        self.points.append(rows)
        self._kept += len(rows)
        while self._kept > MOST_POINTS:
            self.points = [np.concatenate(self.points)[::2]]
            self._kept = len(self.points[0])
            self._step *= 2

    @property
    def rows(self) -> Floats:
        """(k, 8): point, known error, half width, m, and the line."""
        return np.concatenate(self.points) if self.points else np.empty((0, 8))


def figures(evaluation: PartEvaluation, path: DrawnPath) -> list[DrawnFigure]:
    """The strips, then the path."""
    drawn = [
        DrawnFigure(
            "strips",
            "Every quantity in its zone",
            _strips_caption(),
            as_text(_strips(evaluation)),
            says=_strips_say(evaluation),
        )
    ]
    if len(path.rows):
        figure, caption = _path(evaluation, path.rows)
        drawn.append(
            DrawnFigure(
                "path",
                "The path and the errors on it",
                caption,
                as_text(figure),
                says=_path_says(evaluation, path.rows),
            )
        )
    return drawn


def _strips_caption() -> str:
    return say(
        "Grey: the tolerance zone of the drawing. Hollow and dashed as commanded, filled after "
        "compensation: the mark is the known value, the thick bar the coverage interval, the thin "
        "line what machines inside the bands reach, the ends of the dotted line what none goes "
        "beyond, where that is proven."
    )


def _strips_say(evaluation: PartEvaluation) -> str:
    """How many quantities are certainly within tolerance."""
    good = {
        answers.state.name: sum(one.verdict == MET for one in answers.answers)
        for answers in evaluation.states
    }
    every = len(evaluation.characteristics)
    if BEFORE_STATE in good and AFTER_STATE in good:
        return say(
            "{before} of {every} quantities are certainly within tolerance as commanded, and "
            "{after} after compensation.",
            before=good[BEFORE_STATE],
            after=good[AFTER_STATE],
            every=every,
        )
    return say(
        "{good} of {every} quantities are certainly within tolerance.",
        good=next(iter(good.values())),
        every=every,
    )


def _path_says(evaluation: PartEvaluation, rows: Floats) -> str:
    """The largest known error, and how much of it only moves the part."""
    known, unit = rows[:, 3:6], evaluation.shown.small_length
    sizes = np.linalg.norm(known, axis=1)
    worst = where_highest(sizes)
    apart = np.linalg.norm(known - known.mean(axis=0), axis=1)
    return say(
        "As commanded the tool is known to be up to {size} off, on line {line}; all points share "
        "{shift} of it, which moves the part and keeps its form, and up to {apart} differ from "
        "point to point.",
        size=unit.text(float(sizes[worst]), 3),
        line=int(rows[worst, 7]),
        apart=unit.text(float(apart.max()), 3),
        shift=unit.text(float(np.linalg.norm(known.mean(axis=0))), 3),
    )


def _strips(evaluation: PartEvaluation) -> Plot:
    characteristics = evaluation.characteristics
    count = len(characteristics)
    figure = grid(count, 1, vertical_spacing=0.42 / count)
    for row, of in enumerate(characteristics, start=1):
        small_unit = evaluation.shown.small(of.quantity.si)
        scale, nominal = small_unit.per_si, of.quantity.nominal
        low, high = (
            (end - nominal) * scale if math.isfinite(end) else None
            for end in (0.0 if of.quantity.is_form else of.quantity.lower, of.quantity.upper)
        )
        ends = [0.0]
        for place, answers in enumerate(evaluation.states):
            answer = answers.answers[row - 1]
            is_after = answers.state.name == AFTER_STATE
            y = 0.28 - 0.56 * place
            for line in _marks(answer, nominal, scale, y, is_after=is_after):
                ends += [x for x in line["x"] if math.isfinite(x)]
                leads = line.pop("leads")
                figure.add_trace(
                    trace(
                        "scatter",
                        showlegend=leads and row == 1,
                        name=say("after compensation") if is_after else say("before compensation"),
                        legendgroup=answers.state.name,
                        text=of.label,
                        hovertemplate=f"%{{text}}: %{{x:.2f}} {small_unit.label}",
                        **line,
                    ),
                    row,
                    1,
                )
        least, most = _range(ends + [end for end in (low, high) if end is not None])
        figure.add_vrect(
            least if low is None else low,
            most if high is None else high,
            row,
            1,
            name=say("tolerance zone"),
            fillcolor=SHADE_DARKER,
            line={"width": 0},
            layer="below",
        )
        figure.update_xaxes(
            row, 1, range=[least, most], title={"text": ""}, ticksuffix=f" {small_unit.label}"
        )
        figure.update_yaxes(
            row,
            1,
            range=[-0.75, 0.75],
            tickvals=[0.0],
            ticktext=[f"{of.label}\n{_words(evaluation, row - 1)}"],
            showgrid=False,
            automargin=True,
        )
    # The last x axis says what is shown.
    figure.update_xaxes(
        count, 1, title={"text": say("deviation from nominal; of a form its value")}
    )
    return finish(figure, STRIP * count + 150, margin={"l": 10, "r": 30, "t": 50, "b": 60})


def _range(ends: list[float]) -> tuple[float, float]:
    """What a strip shows: all of its `ends`, with a margin on both sides."""
    least, most = min(ends), max(ends)
    margin = MARGIN * (most - least) or 1.0
    return least - margin, most + margin


def _words(evaluation: PartEvaluation, at: int) -> str:
    words = [one.answers[at].verdict for one in evaluation.states]
    return words[0] if len(set(words)) == 1 else " → ".join(words)


def _marks(
    answer: QuantityAnswer, nominal: float, scale: float, y: float, *, is_after: bool
) -> list[Keys]:
    """Lines and a mark of one state of a strip: before hollow and dashed, after filled."""
    colour = AFTER if is_after else BEFORE

    def at(*values: float) -> list[float]:
        return [(value - nominal) * scale for value in values]

    marks: list[Keys] = []
    if answer.above.proven:
        marks.append(
            {
                "x": at(answer.above.lower, answer.above.upper),
                "mode": "lines+markers",
                "line": {"color": colour, "width": 1, "dash": "dot"},
                "marker": {"color": colour, "size": 8, "symbol": "line-ns-open"},
            }
        )
    marks += [
        {
            "x": at(answer.search.lower.value, answer.search.upper.value),
            "mode": "lines",
            "line": {"color": colour, "width": 2},
        },
        {
            "x": at(*answer.interval),
            "mode": "lines",
            "line": {
                "color": colour,
                "width": 7 if is_after else 5,
                "dash": "solid" if is_after else "3px,2px",
            },
        },
        {
            "x": at(answer.known),
            "mode": "markers",
            "marker": {
                "color": colour if is_after else PAPER,
                "size": 9,
                "line": {"color": colour, "width": 2},
            },
        },
    ]
    return [
        mark | {"y": [y] * len(mark["x"]), "leads": place == len(marks) - 2}
        for place, mark in enumerate(marks)
    ]


def _path(evaluation: PartEvaluation, rows: Floats) -> tuple[Plot, str]:
    length, unit = evaluation.shown.length, evaluation.shown.small_length
    points, known, half = rows[:, :3], rows[:, 3:6], rows[:, 6]
    sizes = np.linalg.norm(known, axis=1)
    part = float(np.ptp(points, axis=0).max()) or 1.0
    most = float(sizes.max())
    factor = _round(SHARE * part / most) if most > 0.0 else 1.0
    moved = points + factor * known
    apart = known - known.mean(axis=0)
    beyond = np.linalg.norm(apart, axis=1)
    own = _round(SHARE * part / float(beyond.max())) if beyond.max() > 0.0 else factor
    planar = "z" not in evaluation.machine.dof
    figure = Plot()
    text = [
        say(
            "line {line}\nknown {size}, of it not shared {apart}\n95 % ± {half}",
            line=int(line),
            size=unit.text(size, 3),
            apart=unit.text(left, 3),
            half=unit.text(wide, 3),
        )
        for line, size, left, wide in zip(
            rows[:, 7].tolist(), sizes.tolist(), beyond.tolist(), half.tolist(), strict=True
        )
    ]
    common = {"text": text, "hoverinfo": "text", "mode": "markers"}
    bar = {"thickness": 14, "len": 0.75}
    views = (
        (say("known error"), moved, sizes, say("known error, {unit}", unit=unit.label)),
        (
            say("without what all points share"),
            points + own * apart,
            beyond,
            say("known error not shared, {unit}", unit=unit.label),
        ),
        (say("95 % half width"), points, half, say("95 % half width, {unit}", unit=unit.label)),
    )
    figure.add_trace(
        _spatial(
            planar,
            points * length.per_si,
            name=say("programmed"),
            marker={"size": 4 if planar else 2, "color": AXIS},
            **common,
        )
    )
    for at, (name, place, colours, title) in enumerate(views):
        marker: Keys = {
            "size": 4 if planar else 2,
            "color": small(colours * unit.per_si),
            "colorscale": COLOUR_SCALE,
            "colorbar": bar | {"title": {"text": title, "side": "right"}},
            "showscale": True,
        }
        figure.add_trace(
            _spatial(planar, place * length.per_si, name=name, marker=marker, **common)
        )
        figure.data[-1]["visible"] = at == 0
    buttons = [
        {
            "label": name,
            "method": "update",
            "args": [{"visible": [True, *(other == at for other in range(len(views)))]}],
        }
        for at, (name, *_) in enumerate(views)
    ]
    menu = {"buttons": buttons, "x": 0.0, "xanchor": "left", "y": 1.06, "yanchor": "bottom"}
    caption = say(
        "The programmed path in grey; beside it where the tool is known to go as commanded, the "
        "error drawn {factor} times as large, coloured by its size. An error that all points share "
        "moves the whole part and hides what differs from point to point: the second view leaves "
        "it out, {own} times as large. The third colours the path by half the 95 % interval of "
        "the position, to first order. {points} of the path's points.",
        factor=grouped(round(factor)),
        own=grouped(round(own)),
        points=grouped(len(rows)),
    )
    finish(figure, 640, margin={"l": 10, "r": 10, "t": 90, "b": 20}, updatemenus=[menu])
    if planar:
        figure.update_xaxes(title={"text": f"x, {length.label}"})
        figure.update_yaxes(title={"text": f"y, {length.label}"}, scaleanchor="x", scaleratio=1)
    else:
        axis = {"gridcolor": GRID, "color": INK}
        both = np.concatenate([points, moved, points + own * apart]) * length.per_si
        middles = 0.5 * (both.min(axis=0) + both.max(axis=0))
        extents = np.ptp(both, axis=0) * (1.0 + MARGIN)
        extents = np.maximum(extents, FLAT * extents.max())
        figure.update_layout(
            scene={
                "aspectmode": "manual",
                "aspectratio": dict(zip("xyz", (extents / extents.max()).tolist(), strict=True)),
                **{
                    f"{name}axis": {
                        "title": {"text": f"{name}, {length.label}"},
                        "nticks": 4 if extent < 0.5 * extents.max() else 7,
                        "range": [middle - 0.5 * extent, middle + 0.5 * extent],
                        **axis,
                    }
                    for name, middle, extent in zip("xyz", middles, extents, strict=True)
                },
                "camera": {"eye": {"x": 0.75, "y": -1.1, "z": 1.0}, "center": {"z": -0.1}},
            }
        )
    return figure, caption


def _spatial(planar: bool, points: Floats, **look: Any) -> Keys:
    x, y, z = small(points).T
    if planar:
        return trace("scatter", x=x, y=y, **look)
    return trace("scatter3d", x=x, y=y, z=z, **look)


def _round(value: float) -> float:
    """One significant digit of 1, 2 or 5."""
    power = 10.0 ** math.floor(math.log10(value))
    return max(step * power for step in (1.0, 2.0, 5.0) if step * power <= value)


__all__ = ["DrawnPath", "figures"]
