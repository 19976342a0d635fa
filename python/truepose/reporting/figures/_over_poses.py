"""What the figures over poses share: one panel for each error component.

A few poses are drawn one after the other, as figures 3 and 4 of the founding paper have them. Of
many that would be a bar code: their errors are sorted, the largest first, over the share of poses,
and a panel for each commanded freedom shows what happens along it through the worst pose.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from truepose.arrays import Floats, Indices
from truepose.language import grouped, say
from truepose.reporting.display import pose_text, where_highest
from truepose.reporting.figures._flow import Flow, legend_height
from truepose.reporting.figures._lattice import Lattice, lattice, turns
from truepose.reporting.figures._plot import Keys, Plot, trace
from truepose.reporting.figures._style import QUIET, SHOWN, finish, small
from truepose.reporting.study import Study

FEW_POSES = 50
"""So many are told apart in the width of a page."""

MOST_SORTED = 200
"""Points of a sorted curve; all poses are sorted, and the largest and the least are drawn."""

LEAST_IN_SLICE = 3
"""A slice of fewer poses says nothing."""

MOST_TICKS = 7
"""Of pose numbers, which are whole."""

MARKS = 6
"""Of a sorted curve, which tell the lines apart without their colours."""


@dataclass(frozen=True)
class Curve:
    """Errors (n_pose, n_component), SI, drawn as one line in every panel; `look` of plotly.js.

    Of several `ends` the one that is farther from zero is drawn, which only sorted lines can.
    """

    name: str
    ends: tuple[Floats, ...]
    look: Keys = field(default_factory=dict)


def is_few(study: Study) -> bool:
    """Whether the poses are drawn one after the other."""
    return study.n_pose <= FEW_POSES


def worst_pose(study: Study) -> int:
    """Index of the pose where the linear maximum of all sources is largest."""
    return where_highest(study.largest)


def slices(study: Study) -> dict[int, Indices]:
    """For each coordinate the poses of a line through the worst one, where the poses are a grid."""
    grid: Lattice | None = lattice(study.poses)
    if grid is None:
        return {}
    lines = {at: grid.slice_through(worst_pose(study), at) for at in grid.varying}
    return {at: poses for at, poses in lines.items() if len(poses) >= LEAST_IN_SLICE}


def how_drawn(study: Study, sliced: bool = True) -> str:
    """What a caption says of the axes."""
    if is_few(study):
        return say(
            "Poses are numbered from 1 in the order of the workspace; a line breaks where the grid "
            "turns to a new row, or a pose is left out."
        )
    text = say(
        "The {count} poses are too many to be drawn one after the other: each line is sorted by "
        "itself, the largest first, so that it says what share of the poses has at least that "
        "error, whichever its sign.",
        count=grouped(study.n_pose),
    )
    if not sliced:
        return text
    if slices(study):
        worst = pose_text(study.poses[worst_pose(study)], study.machine.commanded, study.units)
        return " ".join(
            [
                text,
                say(
                    "Below, the length of the same errors along each commanded freedom through "
                    "the worst pose, {pose} (dotted), to one scale.",
                    pose=worst,
                ),
            ]
        )
    return " ".join([text, say("The poses are no grid, so that nothing is drawn along its lines.")])


def largest_of(study: Study, errors: Floats) -> tuple[int, int]:
    """Where errors (n_pose, n_component) are largest, lengths before angles: pose, component."""
    among = study.positions or study.rotations
    sizes = np.abs(errors[:, among])
    flat = where_highest(sizes)
    return flat // len(among), among[flat % len(among)]


def over_poses(study: Study, lines: Sequence[Curve]) -> Plot:
    """The lines in a panel for each component, over the pose number or sorted with slices."""
    return _numbered(study, lines) if is_few(study) else _sorted(study, lines)


def component_titles(study: Study) -> list[str]:
    """Titles of the panels of the error components."""
    return [
        say("error in {axis}, {unit}", axis=name, unit=study.units.error(name).label)
        for name in study.components
    ]


def broken(study: Study) -> Indices:
    """Indices of poses with -1 between those that no line may join."""
    return np.insert(np.arange(study.n_pose), np.flatnonzero(turns(study)) + 1, -1)


def with_gaps(values: ArrayLike, order: Indices) -> Floats:
    """Values (n_pose,) in the order of `broken`, missing in the gaps."""
    return np.where(order < 0, np.nan, np.asarray(values, np.float64)[order])


def sorted_sizes(values: Floats) -> tuple[Floats, Floats]:
    """Share of the poses in percent and the sizes of values (n_pose,), the largest first.

    At most `MOST_SORTED` points; at each so many percent of the poses have at least that size.
    Poses of which a value is missing are last, and not drawn.
    """
    sizes = np.sort(np.abs(values[np.isfinite(values)]))[::-1]
    if not len(sizes):
        return np.zeros(0), np.zeros(0)
    drawn = np.unique(np.linspace(0, len(sizes) - 1, MOST_SORTED).round().astype(np.intp))
    return 100.0 * (drawn + 1) / len(values), sizes[drawn]


def flow_of(titles: Sequence[str], names: Sequence[str]) -> Flow:
    """Three panels a row, two on a small screen, under a legend of these names."""
    return Flow(
        titles,
        columns=3,
        narrow=2,
        top=35 + legend_height(names, 1000),
        narrow_top=35 + legend_height(names, 350),
    )


def label_numbers(figure: Plot, study: Study, flow: Flow) -> None:
    """Axes over the pose number, which go together, and what a pose number stands for."""
    count = len(study.components)
    first, last = int(study.numbers[0]) + 1, int(study.numbers[-1]) + 1
    margin = 0.5 + 0.01 * (last - first + 1)
    figure.update_xaxes(
        title={"text": say("pose number")},
        range=[first - margin, last + margin],
        zeroline=False,
        tick0=0,
        dtick=next((step for step in (1, 2, 5, 10) if last - first < MOST_TICKS * step), None),
    )
    for component in range(1, count):
        figure.update_xaxes(matches="x", **flow.place(component))
    labels = [pose_text(pose, study.machine.commanded, study.units) for pose in study.poses]
    for component in range(count):
        figure.add_trace(
            trace(
                "scatter",
                x=study.numbers + 1,
                y=np.zeros(study.n_pose, dtype=np.float32),
                text=labels,
                mode="lines",
                line={"width": 0},
                hovertemplate="%{text}<extra></extra>",
                showlegend=False,
            ),
            **flow.place(component),
        )


def label_shares(figure: Plot, study: Study, flow: Flow) -> None:
    """Axes over the share of poses; lengths have one scale, angles another."""
    for components in (study.positions, study.rotations):
        for component in components:
            at = flow.place(component)
            leader = components[0] + 1
            matched: Keys = {} if component == components[0] else {"matches": _axis("y", leader)}
            figure.update_yaxes(rangemode="tozero", nticks=5, **matched, **at)
            figure.update_xaxes(
                title={"text": say("share of poses, %")}, range=[0, 100], nticks=5, **at
            )


def finish_panels(figure: Plot, flow: Flow) -> Plot:
    """The common look of these figures."""
    finish(
        figure,
        flow.height,
        margin={"l": 50, "r": 15, "t": flow.top, "b": flow.bottom},
    )
    figure.update_xaxes(title={"font": {"size": 12}, "standoff": 4}, automargin=False)
    figure.update_yaxes(nticks=5)
    return figure


def _axis(name: str, number: int) -> str:
    return f"{name}{number if number > 1 else ''}"


def _numbered(study: Study, lines: Sequence[Curve]) -> Plot:
    flow = flow_of(component_titles(study), [line.name for line in lines])
    figure, order = flow.empty(), broken(study)
    numbers = with_gaps(study.numbers + 1, order)
    for line in lines:
        (end,) = line.ends
        errors = study.shown(end)
        for component in range(len(study.components)):
            figure.add_trace(
                trace(
                    "scatter",
                    x=small(numbers),
                    y=small(with_gaps(errors[:, component], order)),
                    name=line.name,
                    legendgroup=line.name,
                    showlegend=component == 0,
                    mode="lines+markers",
                    hovertemplate=f"%{{y:{SHOWN}}}",
                    **_marked(line.look, 4),
                ),
                **flow.place(component),
            )
    label_numbers(figure, study, flow)
    finish_panels(figure, flow)
    figure.update_layout(hovermode="x unified")
    return figure


def _sorted(study: Study, lines: Sequence[Curve]) -> Plot:
    along = slices(study)
    count = len(study.components)
    quantity = "position" if study.positions else "orientation"
    unit = study.units.error(quantity)
    said = say("position") if study.positions else say("orientation")
    titles = component_titles(study) + [
        say(
            "{quantity} error along {axis}, {unit}",
            quantity=said,
            axis=study.machine.commanded[at],
            unit=unit.label,
        )
        for at in along
    ]
    flow = flow_of(titles, [line.name for line in lines])
    figure = flow.empty()
    length = study.position_norm if study.positions else study.rotation_norm
    for line in lines:
        errors = study.shown(np.max([np.abs(end) for end in line.ends], axis=0))
        for component in range(count):
            shares, sizes = sorted_sizes(errors[:, component])
            figure.add_trace(
                trace(
                    "scatter",
                    x=small(shares),
                    y=small(sizes),
                    name=line.name,
                    legendgroup=line.name,
                    showlegend=component == 0,
                    mode="lines+markers",
                    hovertemplate=f"%{{x:{SHOWN}}} %: %{{y:{SHOWN}}}",
                    **_marked(line.look, 6, MARKS),
                ),
                **flow.place(component),
            )
        lengths = np.max([length(end) for end in line.ends], axis=0) * unit.per_si
        for number, (at, poses) in enumerate(along.items(), start=count):
            name = study.machine.commanded[at]
            figure.add_trace(
                trace(
                    "scatter",
                    x=small(study.poses[poses, at] * study.units.pose(name).per_si),
                    y=small(lengths[poses]),
                    name=line.name,
                    legendgroup=line.name,
                    showlegend=False,
                    mode="lines+markers",
                    hovertemplate=f"{name} %{{x:{SHOWN}}}: %{{y:{SHOWN}}} {unit.label}",
                    **_marked(line.look, 5),
                ),
                **flow.place(number),
            )
    label_shares(figure, study, flow)
    for number, at in enumerate(along, start=count):
        _label_slice(figure, study, flow, number, at, count)
    return finish_panels(figure, flow)


def _label_slice(
    figure: Plot, study: Study, flow: Flow, number: int, coordinate: int, first: int
) -> None:
    """Axes of a slice; all slices have the scale of the first. The worst pose is dotted."""
    name = study.machine.commanded[coordinate]
    unit, place = study.units.pose(name), flow.place(number)
    matched: Keys = {} if number == first else {"matches": _axis("y", first + 1)}
    figure.update_yaxes(rangemode="tozero", **matched, **place)
    figure.update_xaxes(title={"text": f"{name}, {unit.label}"}, zeroline=False, nticks=6, **place)
    figure.add_vline(
        float(study.poses[worst_pose(study), coordinate] * unit.per_si),
        **place,
        line={"color": QUIET, "dash": "dot", "width": 1},
    )


def _marked(given: Keys, size: int, most: int | None = None) -> Keys:
    """The look of a line with its marks so large, and no more of them than `most`."""
    marker = {**given.get("marker", {}), "size": size}
    return {**given, "marker": marker if most is None else {**marker, "maxdisplayed": most}}
