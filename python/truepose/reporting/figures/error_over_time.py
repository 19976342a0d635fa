"""The error that measured temperatures make over time, and the temperatures."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from truepose.arrays import Indices
from truepose.reporting.display import pose_text
from truepose.reporting.figures._plot import Plot, grid, trace
from truepose.reporting.figures._style import MOST_DRAWN, finish, small, source_colour
from truepose.reporting.study import Study

TITLE = "Error over time"
NEEDS = "over_time"

PANEL_HEIGHT = 220
SCALES = ((2 * 3600.0, 3600.0, "h"), (300.0, 60.0, "min"), (0.0, 1.0, "s"))
"""(shortest span in s, seconds, unit) of the time axis."""
DASHES = ("solid", "dash", "dot")


def caption(study: Study) -> str:
    """What the lines are."""
    log = study.machine.condition.temperature_log
    name = f" ({log.name})" if log is not None and log.name else ""
    drawn = len(_drawn(study))
    total = study.time["time"].size
    note = "" if drawn == total else f" Drawn: {drawn:,} of {total:,} times; results have all."
    return (
        f"Exact error from the logged temperatures{name} alone, at the pose nearest the middle of "
        "the workspace and, dashed, at the pose where it is largest at the time of the budget; "
        "below, the temperatures of the parts that are logged." + note
    )


def figure(study: Study) -> Plot:
    """One panel for each error component, and one for the temperatures."""
    columns = [components for components in (study.positions, study.rotations) if components]
    rows = max(map(len, columns))
    spans = {
        (row, column): 1
        for column, components in enumerate(columns, start=1)
        for row in range(1, len(components) + 1)
    }
    spans[rows + 1, 1] = len(columns)
    figure = grid(
        rows=rows + 1,
        cols=len(columns),
        spans=spans,
        shared_xaxes="all",
        vertical_spacing=0.28 / (rows + 1),
        horizontal_spacing=0.1,
    )
    drawn = _drawn(study)
    seconds = np.asarray(study.time["time"].values)
    _, per, unit = next(scale for scale in SCALES if np.ptp(seconds) >= scale[0])
    x = small(seconds[drawn] / per)
    _add_errors(figure, study, x, drawn)
    _add_temperatures(figure, study, x, drawn, rows + 1)
    finish(
        figure,
        110 + PANEL_HEIGHT * (rows + 1),
        margin={"l": 80, "r": 20, "t": 70, "b": 50},
        hovermode="x unified",
    )
    for column, components in enumerate(columns, start=1):
        figure.update_xaxes(showticklabels=True, row=len(components), col=column)
    figure.update_xaxes(title={"text": f"time, {unit}"}, showticklabels=True, row=rows + 1)
    return figure


def _add_errors(figure: Plot, study: Study, x: NDArray[np.float32], drawn: Indices) -> None:
    commanded = study.machine.commanded
    errors = np.asarray(study.time["error"].values)[drawn]
    errors = study.shown(errors)
    for pose in range(errors.shape[1]):
        at = [float(study.time[f"pose_{name}"].values[pose]) for name in commanded]
        for column, components in enumerate(filter(None, (study.positions, study.rotations))):
            for row, component in enumerate(components):
                figure.add_trace(
                    trace(
                        "scatter",
                        x=x,
                        y=small(errors[:, pose, component]),
                        name=pose_text(at, commanded, study.units),
                        legendgroup=f"pose {pose}",
                        showlegend=row == column == 0,
                        mode="lines",
                        line={
                            "color": source_colour(0),
                            "dash": DASHES[pose % len(DASHES)],
                            "width": 1.6,
                        },
                        hovertemplate="%{y:.3f}",
                    ),
                    row=row + 1,
                    col=column + 1,
                )
                name = study.components[component]
                figure.update_yaxes(
                    title={"text": f"error in {name}, {study.units.error(name).label}"},
                    row=row + 1,
                    col=column + 1,
                )


def _add_temperatures(
    figure: Plot, study: Study, x: NDArray[np.float32], drawn: Indices, row: int
) -> None:
    parts = [str(part) for part in study.time["part"].values]
    temperatures = np.asarray(study.time["temperature"].values)[drawn]
    temperatures = study.units.temperature(temperatures)
    log = study.machine.condition.temperature_log
    logged = [index for index, part in enumerate(parts) if log is not None and log.names(part)]
    # Parts that go by one column of the log, its default, are one line.
    lines: dict[bytes, list[int]] = {}
    for index in logged:
        lines.setdefault(temperatures[:, index].tobytes(), []).append(index)
    for number, same in enumerate(lines.values()):
        more = f" and {len(same) - 1} more" if len(same) > 1 else ""
        figure.add_trace(
            trace(
                "scatter",
                x=x,
                y=small(temperatures[:, same[0]]),
                name=parts[same[0]] + more,
                mode="lines",
                line={"color": source_colour(number + 1), "width": 1.6},
                hovertemplate=f"%{{y:.2f}} {study.units.degree}",
            ),
            row=row,
            col=1,
        )
    figure.update_yaxes(title={"text": f"temperature, {study.units.degree}"}, row=row, col=1)


def _drawn(study: Study) -> Indices:
    """Numbers of the times that are drawn, the last among them."""
    total = study.time["time"].size
    step = -(-total // MOST_DRAWN)
    return np.union1d(np.arange(0, total, step), [total - 1])
