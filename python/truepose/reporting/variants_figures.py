"""The pictures of a study: how the error goes with what is varied, and which variants are best.

All are of the linear maximum, the largest error over the poses that machines inside the bands have
to first order; of variants that are ok.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.files.shown_units import Shown
from truepose.language import grouped, say
from truepose.reporting.display import number
from truepose.reporting.figures import DrawnFigure
from truepose.reporting.figures._plot import Keys, Plot, grid, trace
from truepose.reporting.figures._style import (
    AXIS,
    BLUE,
    INK,
    PALE,
    PALE_BLUE,
    QUIET,
    TARGET,
    finish,
    small,
    source_colour,
    source_symbol,
)
from truepose.reporting.figures._text import NO_BOX, as_text
from truepose.studies.ranking import pareto, ranked

if TYPE_CHECKING:
    import xarray as xr

    from truepose.machine import Machine

MOST_PANELS, COLUMNS = 9, 3
"""Variables whose response is drawn, and how many beside each other."""

MOST_DRAWN, MOST_LINES = 2000, 300
"""Variants that are drawn as marks and as lines, chosen evenly by their size."""

MOST_WORDS = 12
"""Words of an axis that are written."""

BEST_SHARE = 0.1
"""Of the variants drawn as lines: those that are drawn as the best."""

NEEDED = "linear_maximum"

PANEL, HEIGHT = 300, 520


def figures(machine: Machine, dataset: xr.Dataset) -> list[DrawnFigure]:
    """Response curves, parallel coordinates, Pareto front; none where no variant has an error."""
    if NEEDED not in dataset:
        return []
    variants = _Variants(machine, dataset)
    if not variants.order.size:
        return []
    drawn = [
        DrawnFigure(
            "response",
            "How the error goes with each variable",
            say(
                "Each mark is a variant, the large ring the best one; the line is the median of "
                "the variants at a value. Dashed: what is asked for."
            ),
            as_text(_responses(variants)),
            says=_response_says(variants),
        ),
        DrawnFigure(
            "parallel",
            "Variants side by side",
            say(
                "A line is a variant, and goes through its value of each variable and to its "
                "errors on the right. Blue: the best tenth of those drawn, by the position; black: "
                "the best. {lines} of {every} variants are drawn, evenly by their size.",
                lines=grouped(variants.spread(MOST_LINES).size),
                every=grouped(variants.order.size),
            ),
            as_text(_parallel(variants)),
            says=_best_says(variants),
        ),
    ]
    if front := _front(variants):
        drawn.append(front)
    return drawn


@dataclass(frozen=True)
class _Axis:
    """A coordinate of variants: `places` (n,), and `ticks`, the words at some of these."""

    title: str
    places: Floats
    ticks: tuple[tuple[float, str], ...]
    is_number: bool

    def shares(self, places: Floats) -> Floats:
        """(m,) of some places, 0 at its lowest and 1 at its highest; 0 where all are one."""
        return np.asarray((places - self.places.min()) / (float(np.ptp(self.places)) or 1.0))


@dataclass(frozen=True, eq=False)
class _Variants:
    """The variants of a study that are ok, the best first."""

    machine: Machine
    dataset: xr.Dataset

    @cached_property
    def order(self) -> Indices:
        """(n,) their numbers."""
        best = ranked(self.dataset)
        sizes = self.dataset[NEEDED].values[best, 0]
        return np.asarray(best[np.isfinite(sizes)])

    @cached_property
    def kinds(self) -> list[str]:
        return [str(kind) for kind in self.dataset["quantity"].values]

    def unit(self, kind: str) -> Shown:
        return self.machine.shown.error(kind)

    def sizes(self, name: str, kind: str) -> Floats:
        """(n,) a number of each, in the unit for people."""
        values = self.dataset[name].values[self.order, self.kinds.index(kind)]
        return np.asarray(values * self.unit(kind).per_si)

    @cached_property
    def axes(self) -> list[_Axis]:
        """One for each variable that has more than one value."""
        made = []
        for at, key in enumerate(map(str, self.dataset["variable"].values)):
            unit = str(self.dataset["variable_units"].values[at])
            values = self.dataset["value"].values[self.order, at]
            words = self.dataset["setting"].values[self.order, at].astype(str)
            if len(set(words.tolist())) < 2:
                continue
            if np.isfinite(values).all():
                ends = (float(values.min()), float(values.max()))
                ticks = tuple((end, f"{end:.4g}") for end in ends)
                made.append(_Axis(f"{key}, {unit}" if unit else key, values, ticks, True))
            else:
                names = list(dict.fromkeys(sorted(words.tolist())))
                places = np.array([names.index(word) for word in words.tolist()], np.float64)
                ticks = tuple((float(place), name) for place, name in enumerate(names))
                made.append(_Axis(key, places, ticks[:MOST_WORDS], False))
        return made

    @cached_property
    def told(self) -> list[str]:
        """(n,) what each is, in words."""
        return [
            "\n".join([say("variant {number}", number=grouped(int(number))), *self.settings(at)])
            for at, number in enumerate(self.order)
        ]

    def settings(self, at: int) -> list[str]:
        """Of one by its position in `order`: "key = value", numbers with six digits."""
        row = self.order[at]
        of_key = zip(
            self.dataset["variable"].values,
            self.dataset["variable_units"].values,
            self.dataset["value"].values[row].tolist(),
            self.dataset["setting"].values[row],
            strict=True,
        )
        return [
            f"{key} = {f'{value:.6g} {unit}'.rstrip() if np.isfinite(value) else word}"
            for key, unit, value, word in of_key
        ]

    def spread(self, most: int) -> Indices:
        """Positions in `order` of so many of them at most, evenly by their size, the best first."""
        count = self.order.size
        if count <= most:
            return np.arange(count)
        return np.unique(np.linspace(0, count - 1, most).round().astype(np.intp))


def _error_title(variants: _Variants, kind: str) -> str:
    return say("linear maximum, {quantity}, {unit}", quantity=kind, unit=variants.unit(kind).label)


def _responses(variants: _Variants) -> Plot:
    """A panel a variable; the colours are those of the first one that has words."""
    axes = variants.axes[:MOST_PANELS]
    kind = variants.kinds[0]
    sizes = variants.sizes(NEEDED, kind)
    rows, cols = -(-len(axes) // COLUMNS) or 1, min(COLUMNS, len(axes)) or 1
    figure = grid(
        rows, cols, horizontal_spacing=0.09, vertical_spacing=0.28 / rows, shared_yaxes=True
    )
    shown = variants.spread(MOST_DRAWN)
    groups = next((axis for axis in axes if not axis.is_number), None)
    asked = variants.machine.accuracy.target
    for at, axis in enumerate(axes):
        row, col = at // cols + 1, at % cols + 1
        for group, name, chosen in _grouped(groups, shown):
            colour = BLUE if group is None else source_colour(group)
            look: Keys = {
                "color": colour,
                "size": 6,
                "opacity": 0.75,
                "symbol": "circle" if group is None else source_symbol(group),
            }
            figure.add_trace(
                trace(
                    "scatter",
                    x=small(axis.places[chosen]),
                    y=small(sizes[chosen]),
                    mode="markers",
                    marker=look,
                    name=name,
                    legendgroup=name,
                    showlegend=group is not None and at == 0,
                    text=[variants.told[one] for one in chosen.tolist()],
                    hovertemplate=f"%{{y:.4g}}\n%{{text}}{NO_BOX}",
                ),
                row,
                col,
            )
            values, medians = _medians(axis.places[chosen], sizes[chosen])
            if 1 < values.size <= chosen.size / 2:
                figure.add_trace(
                    trace(
                        "scatter",
                        x=small(values),
                        y=small(medians),
                        mode="lines",
                        line={"color": colour, "width": 1.5},
                        showlegend=False,
                        hoverinfo="skip",
                    ),
                    row,
                    col,
                )
        figure.add_trace(_ring(axis.places[0], sizes[0], shows=at == 0), row, col)
        if asked is not None and _is_near(asked * variants.unit(kind).per_si, sizes):
            figure.add_hline(
                asked * variants.unit(kind).per_si, row, col, line={"color": TARGET, "dash": "dash"}
            )
        ticks: Keys = {} if axis.is_number else _word_ticks(axis)
        figure.update_xaxes(row, col, title={"text": axis.title}, automargin=True, **ticks)
        if col == 1:
            figure.update_yaxes(
                row, col, title={"text": _error_title(variants, kind)}, automargin=True
            )
    return finish(figure, PANEL * rows + 90, margin={"l": 70, "r": 20, "t": 60, "b": 60})


def _is_near(asked: float, sizes: Floats) -> bool:
    """Whether a line at what is asked leaves the sizes apart from each other."""
    return bool(asked <= 2.0 * sizes.max())


def _grouped(groups: _Axis | None, shown: Indices) -> list[tuple[int | None, str, Indices]]:
    if groups is None:
        return [(None, "", shown)]
    place = groups.places[shown]
    return [(at, name, shown[place == value]) for at, (value, name) in enumerate(groups.ticks)]


def _medians(places: Floats, sizes: Floats) -> tuple[Floats, Floats]:
    """The median at each value."""
    values = np.unique(places)
    return values, np.array([np.median(sizes[places == value]) for value in values])


def _ring(x: float, y: float, *, shows: bool) -> Keys:
    """About the best variant."""
    return trace(
        "scatter",
        x=[float(x)],
        y=[float(y)],
        mode="markers",
        marker={"symbol": "circle-open", "size": 15, "color": INK, "line": {"width": 2}},
        name=say("the best"),
        legendgroup="the best",
        showlegend=shows,
        hoverinfo="skip",
    )


def _word_ticks(axis: _Axis) -> Keys:
    places, words = zip(*axis.ticks, strict=True)
    return {"tickvals": list(places), "ticktext": list(words), "range": [-0.5, max(places) + 0.5]}


def _response_says(variants: _Variants) -> str:
    """From the best to the worst variant, and which variable moves the medians most."""
    kind = variants.kinds[0]
    sizes, unit = variants.sizes(NEEDED, kind), variants.unit(kind)
    spans = [float(np.ptp(_medians(axis.places, sizes)[1])) for axis in variants.axes]
    told = say(
        "The linear maximum of the {quantity} goes from {low} to {high} {unit}.",
        quantity=kind,
        low=number(float(sizes.min()), unit.decimals),
        high=number(float(sizes.max()), unit.decimals),
        unit=unit.label,
    )
    levels = [np.unique(axis.places).size for axis in variants.axes]
    if len(spans) < 2 or max(levels) > variants.order.size / 2:
        return told
    most = int(np.argmax(spans))
    return " ".join(
        [
            told,
            say(
                "Most of it is {variable}, whose medians differ by {span} {unit}.",
                variable=variants.axes[most].title,
                span=number(spans[most], unit.decimals),
                unit=unit.label,
            ),
        ]
    )


def _best_says(variants: _Variants) -> str:
    kind = variants.kinds[0]
    best, unit = variants.sizes(NEEDED, kind)[0], variants.unit(kind)
    return say(
        "The best is variant {number}, {size} {unit}: {settings}.",
        number=grouped(int(variants.order[0])),
        size=number(float(best), unit.decimals),
        unit=unit.label,
        settings=", ".join(variants.settings(0)),
    )


def _parallel(variants: _Variants) -> Plot:
    """An axis a variable and an error, each from its lowest below to its highest above."""
    errors = []
    for kind in variants.kinds:
        sizes = variants.sizes(NEEDED, kind)
        ticks = tuple(
            (float(end), number(float(end), variants.unit(kind).decimals))
            for end in (sizes.min(), sizes.max())
        )
        errors.append(_Axis(_error_title(variants, kind), sizes, ticks, True))
    axes = [*variants.axes, *errors]
    shown = variants.spread(MOST_LINES)
    figure = Plot()
    heights = np.stack([axis.shares(axis.places) for axis in axes], axis=1)
    best = max(1, round(BEST_SHARE * shown.size))
    for name, chosen, line in (
        (say("others"), shown[best:], {"color": PALE, "width": 1}),
        (say("the best tenth"), shown[1:best], {"color": BLUE, "width": 1.5}),
        (say("the best"), shown[:1], {"color": INK, "width": 3}),
    ):
        if not chosen.size:
            continue
        gap = np.full((chosen.size, 1), np.nan)
        y = np.concatenate([heights[chosen], gap], axis=1).ravel()
        x = np.tile([*range(len(axes)), np.nan], chosen.size)
        told = [variants.told[one] for one in chosen.tolist() for _ in range(len(axes) + 1)]
        figure.add_trace(
            trace(
                "scatter",
                x=small(x),
                y=small(y),
                mode="lines",
                line=line,
                name=name,
                text=told,
                hovertemplate=f"%{{text}}{NO_BOX}",
            )
        )
    notes: list[Keys] = []
    shapes: list[Keys] = []
    for at, axis in enumerate(axes):
        shapes.append(
            {"type": "line", "x0": at, "x1": at, "y0": 0, "y1": 1, "line": {"color": AXIS}}
        )
        ends = axis.shares(np.array([place for place, _ in axis.ticks]))
        for share, (_, word) in zip(ends.tolist(), axis.ticks, strict=True):
            notes.append(
                {
                    "x": at,
                    "y": share,
                    "text": word,
                    "showarrow": False,
                    "xanchor": "left" if at < len(axes) - 1 else "right",
                    "xshift": 5 if at < len(axes) - 1 else -5,
                    "font": {"size": 11, "color": INK},
                    "bgcolor": "rgba(255,255,255,0)",
                }
            )
        notes.append(
            {
                "x": at,
                "y": 1.05 if at % 2 == 0 else 1.13,
                "text": axis.title,
                "showarrow": False,
                "xanchor": "left" if at == 0 else "right" if at == len(axes) - 1 else "center",
                "font": {"size": 12, "color": QUIET},
            }
        )
    hidden: Keys = {"visible": False, "fixedrange": True}
    finish(
        figure,
        HEIGHT,
        margin={"l": 30, "r": 30, "t": 60, "b": 20},
        annotations=notes,
        shapes=shapes,
        hovermode="closest",
    )
    figure.update_xaxes(range=[-0.05, len(axes) - 0.95], **hidden)
    figure.update_yaxes(range=[-0.04, 1.2], **hidden)
    return figure


def _front(variants: _Variants) -> DrawnFigure | None:
    """Position against orientation, or what is known against the linear maximum."""
    kind = variants.kinds[0]
    if len(variants.kinds) > 1:
        titles = [_error_title(variants, one) for one in variants.kinds]
        both = [variants.sizes(NEEDED, one) for one in variants.kinds]
    elif "known" in variants.dataset:
        known = say(
            "known error, {quantity}, {unit}", quantity=kind, unit=variants.unit(kind).label
        )
        titles = [known, _error_title(variants, kind)]
        both = [variants.sizes(name, kind) for name in ("known", NEEDED)]
    else:
        return None
    values = np.stack(both, axis=1)
    front = np.flatnonzero(pareto(values))
    front = front[np.argsort(values[front, 0], kind="stable")]
    others = np.setdiff1d(variants.spread(MOST_DRAWN), front)
    figure = Plot()
    for name, chosen, mode, marker in (
        (say("others"), others, "markers", {"color": PALE_BLUE, "size": 6}),
        (say("Pareto front"), front, "lines+markers", {"color": BLUE, "size": 9}),
    ):
        figure.add_trace(
            trace(
                "scatter",
                x=small(values[chosen, 0]),
                y=small(values[chosen, 1]),
                mode=mode,
                marker=marker,
                line={"color": BLUE, "width": 1.5, "shape": "hv"} if mode != "markers" else None,
                name=name,
                text=[variants.told[one] for one in chosen.tolist()],
                hovertemplate=f"%{{x:.4g}}, %{{y:.4g}}\n%{{text}}{NO_BOX}",
            )
        )
    figure.update_xaxes(title={"text": titles[0]})
    figure.update_yaxes(title={"text": titles[1]})
    finish(figure, HEIGHT, margin={"l": 80, "r": 20, "t": 50, "b": 60}, hovermode="closest")
    return DrawnFigure(
        "pareto",
        "Which variants none other beats in both",
        say("On the front are those variants of which none other is as small in both, or smaller."),
        as_text(figure),
        says=say(
            "{front} of {every} variants are on the front.",
            front=grouped(front.size),
            every=grouped(variants.order.size),
        ),
    )


__all__ = ["figures"]
