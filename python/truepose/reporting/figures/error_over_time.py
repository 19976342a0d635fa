"""The error that measured temperatures make over time, and the temperatures."""

from __future__ import annotations

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.language import grouped, say, say_counted
from truepose.reporting.display import decimals_for, number, pose_text, where_highest
from truepose.reporting.figures._over_poses import (
    MARKS,
    component_titles,
    finish_panels,
    flow_of,
)
from truepose.reporting.figures._plot import Plot, trace
from truepose.reporting.figures._style import (
    BLUE,
    MOST_DRAWN,
    SHOWN,
    small,
    source_colour,
    source_symbol,
)
from truepose.reporting.study import Study

TITLE = "Error over time"
NEEDS = "over_time"

SCALES = ((2 * 3600.0, 3600.0, "h"), (300.0, 60.0, "min"), (0.0, 1.0, "s"))
"""(shortest span in s, seconds, unit) of the time axis."""
DASHES = ("solid", "dash", "dot")


def says(study: Study) -> str:
    """The most that the temperatures move the tool, when and where."""
    errors = np.asarray(study.time["error"].values)
    sizes = study.position_norm(errors) if study.positions else study.rotation_norm(errors)
    time, pose = np.unravel_index(where_highest(sizes), sizes.shape)
    unit = study.units.error("position" if study.positions else "orientation")
    size = float(sizes[time, pose]) * unit.per_si
    seconds = np.asarray(study.time["time"].values)
    per, name = _scale(study)
    return say(
        "The logged temperatures alone move the tool by up to {size} {unit}, {time} {time_unit} "
        "after the beginning of the log, at {pose}.",
        size=number(size, decimals_for(size, 4)),
        unit=unit.label,
        time=number(float(seconds[time] - seconds[0]) / per, 1),
        time_unit=name,
        pose=_pose(study, int(pose)),
    )


def caption(study: Study) -> str:
    """What the lines are."""
    log = study.machine.condition.temperature_log
    text = [
        say(
            "Exact error from the logged temperatures alone, at the pose nearest the middle of the "
            "workspace and, dashed, at the pose where it is largest at the time of the budget; "
            "below, the temperatures of the parts that are logged."
        )
    ]
    if log is not None and log.name:
        text.append(say("The log is {name}.", name=log.name))
    drawn, total = len(_drawn(study)), study.time["time"].size
    if drawn != total:
        text.append(
            say(
                "Drawn: {drawn} of {total} times; results have all.",
                drawn=grouped(drawn),
                total=grouped(total),
            )
        )
    return " ".join(text)


def figure(study: Study) -> Plot:
    """One panel for each error component, and one for the temperatures."""
    degree = study.units.degree
    titles = [*component_titles(study), say("temperature, {unit}", unit=degree)]
    names = [_pose(study, pose) for pose in range(study.time.sizes["pose"])]
    lines = _temperatures(study)
    flow = flow_of(titles, [*names, *(name for name, _ in lines)])
    figure = flow.empty()
    drawn = _drawn(study)
    per, unit = _scale(study)
    x = small(np.asarray(study.time["time"].values)[drawn] / per)
    errors = study.shown(np.asarray(study.time["error"].values)[drawn])
    for pose, name in enumerate(names):
        for component in range(len(study.components)):
            figure.add_trace(
                trace(
                    "scatter",
                    x=x,
                    y=small(errors[:, pose, component]),
                    name=name,
                    legendgroup=f"pose {pose}",
                    showlegend=component == 0,
                    mode="lines",
                    line={"color": BLUE, "dash": DASHES[pose % len(DASHES)], "width": 1.6},
                    hovertemplate=f"%{{y:{SHOWN}}}",
                ),
                **flow.place(component),
            )
    for line, (name, temperatures) in enumerate(lines, start=1):
        figure.add_trace(
            trace(
                "scatter",
                x=x,
                y=small(temperatures[drawn]),
                name=name,
                mode="lines+markers",
                line={"color": source_colour(line), "width": 1.6},
                marker={"symbol": source_symbol(line), "size": 6, "maxdisplayed": MARKS},
                hovertemplate=f"%{{y:.2f}} {degree}",
            ),
            **flow.place(len(titles) - 1),
        )
    figure.update_xaxes(title={"text": say("time, {unit}", unit=unit)}, nticks=6)
    for panel in range(1, len(titles)):
        figure.update_xaxes(matches="x", **flow.place(panel))
    finish_panels(figure, flow)
    figure.update_layout(hovermode="x unified")
    return figure


def _scale(study: Study) -> tuple[float, str]:
    """Seconds of the time axis's unit, and the unit."""
    span = np.ptp(np.asarray(study.time["time"].values))
    _, per, unit = next(scale for scale in SCALES if span >= scale[0])
    return per, unit


def _pose(study: Study, pose: int) -> str:
    """One of the poses of the results over time, in words."""
    commanded = study.machine.commanded
    at = [float(study.time[f"pose_{name}"].values[pose]) for name in commanded]
    return pose_text(at, commanded, study.units)


def _temperatures(study: Study) -> list[tuple[str, Floats]]:
    """Names and temperatures (n_time,), for people, of the parts that are logged.

    Parts that go by one column of the log, its default, are one line.
    """
    parts = [str(part) for part in study.time["part"].values]
    temperatures = study.units.temperature(np.asarray(study.time["temperature"].values))
    log = study.machine.condition.temperature_log
    logged = [index for index, part in enumerate(parts) if log is not None and log.names(part)]
    lines: dict[bytes, list[int]] = {}
    for index in logged:
        lines.setdefault(temperatures[:, index].tobytes(), []).append(index)
    return [
        (
            parts[same[0]]
            if len(same) == 1
            else say_counted(
                "{name} and {count} more",
                "{name} and {count} more",
                len(same) - 1,
                name=parts[same[0]],
            ),
            temperatures[:, same[0]],
        )
        for same in lines.values()
    ]


def _drawn(study: Study) -> Indices:
    """Numbers of the times that are drawn, the last among them."""
    total = study.time["time"].size
    step = -(-total // MOST_DRAWN)
    return np.union1d(np.arange(0, total, step), [total - 1])
