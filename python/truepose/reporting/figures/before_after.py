"""The overall error before and after compensation, per axis."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.language import say
from truepose.reporting.display import decimals_for, number, pose_text
from truepose.reporting.figures._flow import Flow
from truepose.reporting.figures._over_poses import (
    MARKS,
    broken,
    component_titles,
    finish_panels,
    flow_of,
    how_drawn,
    is_few,
    label_numbers,
    label_shares,
    largest_of,
    sorted_sizes,
    with_gaps,
)
from truepose.reporting.figures._plot import Keys, Plot, trace
from truepose.reporting.figures._style import (
    AFTER,
    AFTER_FILL,
    BEFORE,
    SHOWN,
    small,
)
from truepose.reporting.study import Study

TITLE = "Before and after compensation"

NEEDS = "compensation"


@dataclass(frozen=True)
class ErrorBand:
    """Errors (n_pose, n_component), SI, at the ends of the bands and of what is known."""

    lower: Floats
    upper: Floats
    known: Floats

    @property
    def farther(self) -> Floats:
        """How far the farther end is from zero (n_pose, n_component)."""
        return np.asarray(np.maximum(np.abs(self.lower), np.abs(self.upper)))


def says(study: Study) -> str:
    """The largest error drawn before, where it is, and the largest of the same axis after."""
    before, after = (state.farther for state in _states(study))
    pose, component = largest_of(study, before)
    unit = study.units.error(study.components[component])
    sizes = [
        float(size) * unit.per_si
        for size in (before[pose, component], np.nanmax(after[:, component], initial=0.0))
    ]
    places = decimals_for(sizes, 4)
    return say(
        "The largest error in {axis} goes from {before} {unit} (at {pose}) to {after} {unit}.",
        axis=study.components[component],
        before=number(sizes[0], places),
        after=number(sizes[1], places),
        unit=unit.label,
        pose=pose_text(study.poses[pose], study.machine.commanded, study.units),
    )


def caption(study: Study) -> str:
    """What the bands are."""
    what = say(
        "The error with all toleranced lengths at their lower and with all at their upper ends, "
        "before compensation (dashed, hollow) and after (filled), both by exact simulation of the "
        "actual machine. What is known is gone; what is not known remains, centred on zero."
    )
    drawn = (
        say("Thin lines: the known error.")
        if is_few(study)
        else say("Drawn is the end that is farther from zero.")
    )
    free = [name for name in study.machine.dof if name not in study.machine.commanded]
    parasitic = [
        say("Freedoms that are not commanded ({names}) cannot be corrected.", names=", ".join(free))
    ]
    return " ".join([what, drawn, how_drawn(study, sliced=False), *(parasitic if free else [])])


def figure(study: Study) -> Plot:
    """A panel for each component: before as an outline, after filled."""
    names = say("before"), say("after")
    flow = flow_of(component_titles(study), names)
    figure = flow.empty()
    # What is on top is drawn last: the outline of before is seen over what is left.
    before, after = _states(study)
    draw = _add_bands if is_few(study) else _add_sorted
    draw(figure, study, flow, after, names[1], {"color": AFTER, "width": 1.2}, AFTER_FILL)
    draw(figure, study, flow, before, names[0], {"color": BEFORE, "width": 1.8, "dash": "dash"})
    if is_few(study):
        label_numbers(figure, study, flow)
    else:
        label_shares(figure, study, flow)
    return finish_panels(figure, flow)


def _states(study: Study) -> tuple[ErrorBand, ErrorBand]:
    before = [study.values(f"overall_error{edge}") for edge in ("_lower", "_upper", "")]
    after = [study.compensated(f"residual{edge}") for edge in ("_lower", "_upper", "_middle")]
    return ErrorBand(*before), ErrorBand(*after)


def _add_sorted(
    figure: Plot,
    study: Study,
    flow: Flow,
    state: ErrorBand,
    name: str,
    line: Keys,
    fill: str | None = None,
) -> None:
    """The farther ends, sorted."""
    sizes = study.shown(state.farther)
    for component in range(len(study.components)):
        shares, ordered = sorted_sizes(sizes[:, component])
        figure.add_trace(
            trace(
                "scatter",
                x=small(shares),
                y=small(ordered),
                name=name,
                legendgroup=name,
                showlegend=component == 0,
                mode="lines" if fill else "lines+markers",
                line=line,
                marker=None
                if fill
                else {"symbol": "circle-open", "size": 6, "maxdisplayed": MARKS},
                fill="tozeroy" if fill else None,
                fillcolor=fill,
                hovertemplate=f"%{{x:{SHOWN}}} %: %{{y:{SHOWN}}}",
            ),
            **flow.place(component),
        )


def _add_bands(
    figure: Plot,
    study: Study,
    flow: Flow,
    state: ErrorBand,
    name: str,
    line: Keys,
    fill: str | None = None,
) -> None:
    """From one end to the other at each pose, a band for each row of the grid."""
    order = broken(study)
    numbers = with_gaps(study.numbers + 1, order)
    lower, upper, known = map(study.shown, (state.lower, state.upper, state.known))
    for component in range(len(study.components)):
        at = flow.place(component)
        ends = np.stack([lower[:, component], upper[:, component]])
        x, y = _outlines(numbers, order, ends.min(axis=0), ends.max(axis=0))
        figure.add_trace(
            trace(
                "scatter",
                x=small(x),
                y=small(y),
                name=name,
                legendgroup=name,
                showlegend=component == 0,
                mode="lines",
                line=line,
                fill="toself" if fill else None,
                fillcolor=fill,
                hoverinfo="skip",
            ),
            **at,
        )
        band = np.stack([with_gaps(end, order) for end in ends], axis=-1)
        figure.add_trace(
            trace(
                "scatter",
                x=small(numbers),
                y=small(with_gaps(known[:, component], order)),
                name=say("{state}, known error", state=name),
                legendgroup=name,
                showlegend=False,
                mode="lines",
                line={**line, "width": 1.0, "dash": "dot"},
                customdata=small(band),
                hovertemplate=f"{name}: %{{y:{SHOWN}}}; %{{customdata[0]:{SHOWN}}}"
                f" – %{{customdata[1]:{SHOWN}}}<extra></extra>",
            ),
            **at,
        )


def _outlines(numbers: Floats, order: Indices, low: Floats, high: Floats) -> tuple[Floats, Floats]:
    """Closed outlines of the bands, one for each row of poses, a gap after each."""
    x: list[Floats] = []
    y: list[Floats] = []
    gap = np.array([np.nan])
    for row in np.split(np.arange(len(order)), np.flatnonzero(order < 0)):
        row = row[order[row] >= 0]
        row = row[np.isfinite(low[order[row]])]
        if not len(row):
            continue
        poses = order[row]
        x += [numbers[row], numbers[row][::-1], numbers[row[:1]], gap]
        y += [low[poses], high[poses][::-1], low[poses[:1]], gap]
    return (np.concatenate(x), np.concatenate(y)) if x else (np.zeros(0), np.zeros(0))
