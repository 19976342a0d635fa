"""CSV: one row for each pose and source, in the units of the machine file, named in the header.

An error over time has one row for each moment and pose, with the temperatures of the moment.

Where there are sources, a further row of the source "overall" has what all do together. Poses
that cannot be used have one row with their status and nothing else. What is not over poses (the
comparison of the sources) is in the JSON and NetCDF forms.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from truepose.report.result import Result

OVERALL = "overall"
ROWS = 4096


@dataclass(frozen=True)
class Column:
    """One column: its header and its values, (n_pose,), or (n_pose, n_source) where they differ.

    `overall` (n_pose,) stands in the row of all sources together; None leaves that empty.
    """

    header: str
    values: NDArray[np.generic]
    overall: NDArray[np.generic] | None = None


def text(result: Result) -> Iterator[str]:
    """The file in pieces of some thousand rows."""
    if "time" in result.dataset.sizes:
        yield from _over_time(result)
        return
    columns = _columns(result)
    poses = [_single(result, f"pose_{name}") for name in result.machine.commanded]
    sources = result.labels("source") if "source" in result.dataset.sizes else []
    numbers = result.dataset["pose"].values
    header = ["pose", "status", *(pose.header for pose in poses)]
    yield _lines([[*header, *(["source"] if sources else []), *(c.header for c in columns)]])
    for start in range(0, len(numbers), ROWS):
        block = slice(start, start + ROWS)
        leading = list(
            zip(
                numbers[block].tolist(),
                ["ok"] * len(numbers[block]),
                *(pose.values[block].tolist() for pose in poses),
                strict=True,
            )
        )
        yield _lines(_interleaved(leading, columns, sources, block))
    blank = [""] * (len(columns) + bool(sources))
    yield _lines(
        [
            [*(each[name] for name in ("pose", "status", *result.machine.commanded)), *blank]
            for each in result.left_out()
        ]
    )


def write(result: Result, path: Path) -> None:
    """Write the file to `path`."""
    with path.open("w", encoding="utf-8", newline="") as file:
        file.writelines(text(result))


def _over_time(result: Result) -> Iterator[str]:
    """One row for each moment and pose: error of every component, temperature of every part."""
    poses = [_single(result, f"pose_{name}") for name in result.machine.commanded]
    error, heat = result.values("error"), result.values("temperature")
    moments = _single(result, "time")
    yield _lines(
        [
            [
                moments.header,
                "pose",
                *(pose.header for pose in poses),
                *(
                    f"error_{label} [{error.unit(index)}]"
                    for index, label in enumerate(result.labels("component"))
                ),
                *(f"temperature_{part} [{heat.unit()}]" for part in result.labels("part")),
            ]
        ]
    )
    numbers = result.dataset["pose"].values.tolist()
    at = list(zip(numbers, *(pose.values.tolist() for pose in poses), strict=True))
    for moment, errors, temperatures in zip(
        moments.values.tolist(), error.array, heat.array.tolist(), strict=True
    ):
        yield _lines(
            [
                [moment, *where, *map(_cell, row), *temperatures]
                for where, row in zip(at, errors.tolist(), strict=True)
            ]
        )


def _interleaved(
    leading: list[tuple[object, ...]], columns: list[Column], sources: list[str], block: slice
) -> Iterator[list[object]]:
    """Rows of some poses: one for each source and one for all together, or one where none."""
    values = [column.values[block].tolist() for column in columns]
    overall = [
        None if column.overall is None else column.overall[block].tolist() for column in columns
    ]
    for at, lead in enumerate(leading):
        alone = [each[at] for each in values]
        for number, source in enumerate(sources):
            cells = (each[number] if isinstance(each, list) else each for each in alone)
            yield [*lead, source, *map(_cell, cells)]
        together = (
            "" if isinstance(one, list) and all_ is None else one if all_ is None else all_[at]
            for one, all_ in zip(alone, overall, strict=True)
        )
        yield [*lead, *([OVERALL] if sources else []), *map(_cell, together)]


def _columns(result: Result) -> list[Column]:
    """Every variable over poses, its last axis spread over columns."""
    columns = []
    names = result.variables()
    for name in names:
        dims = tuple(str(dim) for dim in result.dataset[name].dims)
        if dims[:1] != ("pose",) or (name.startswith("overall_") and _alone(name) in names):
            continue
        values = result.values(name)
        labels = [""] if dims in (("pose",), ("pose", "source")) else result.labels(dims[-1])
        together = f"overall_{name}"
        overall = result.values(together).array if together in names else None
        for index, label in enumerate(labels):
            unit = values.unit(index)
            title = f"{name}_{label}" if label else name
            columns.append(
                Column(
                    title if unit == "1" else f"{title} [{unit}]",
                    values.array[..., index] if label else values.array,
                    None if overall is None else overall[..., index] if label else overall,
                )
            )
    return columns


def _alone(overall: str) -> str:
    return overall.removeprefix("overall_")


def _single(result: Result, name: str) -> Column:
    values = result.values(name)
    return Column(f"{name} [{values.units[0]}]", values.array)


def _cell(value: object) -> object:
    """Full precision; a missing number is an empty cell."""
    if isinstance(value, float):
        return repr(value) if math.isfinite(value) else ""
    return value


def _lines(rows: Iterator[list[object]] | list[list[object]]) -> str:
    buffer = io.StringIO()
    csv.writer(buffer, lineterminator="\n").writerows(rows)
    return buffer.getvalue()
