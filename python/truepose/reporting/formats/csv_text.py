"""CSV: one row for each pose and source, in the units of the machine file, named in the header.

An error over time has one row for each moment and pose, with the temperatures of the moment; shares
of the variance one for each pose and parameter, then one for each source; bounds over a region one
for each component and magnitude, a calibration one for each unknown, a circular test one for each
quantity and for each angle, an allocation one for each parameter that gets a tolerance, its curve
one for each target.

Where there are sources, a further row of the source "overall" has what all do together. Poses
that cannot be used have one row with their status and nothing else. What is not over poses (the
comparison of the sources) and quantiles at many levels are in the JSON and NetCDF forms.
"""

from __future__ import annotations

import csv
import importlib
import io
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from truepose.reporting.result import Result, Values, in_file_units, pose_si

OVERALL = "overall"
MANY = "level"
"""The dimension that would make more columns than anyone reads."""
ROWS = 4096


@dataclass(frozen=True)
class CsvColumn:
    """One column: its header and its values, (n_pose,), or (n_pose, n_source) where they differ.

    `overall` (n_pose,) stands in the row of all sources together; None leaves that empty.
    """

    header: str
    values: NDArray[np.generic]
    overall: NDArray[np.generic] | None = None


def text(result: Result) -> Iterator[str]:
    """The file in pieces of some thousand rows."""
    sizes = result.dataset.sizes
    if result.command == "allocate":
        yield from _curve(result) if "target" in sizes else _allocated(result)
        return
    if "unknown" in sizes:
        from truepose.reporting import calibration

        yield from calibration.csv_text(result)
        return
    if "test" in result.dataset.attrs:
        from truepose.machine_tests import test_named

        test = test_named(str(result.dataset.attrs["test"]))
        yield from importlib.import_module(test.reporting).csv_text(result)
        return
    for dim, other_form in (
        ("time", _over_time),
        ("parameter", _shares),
        ("reason", _summary),
        ("commanded", _region),
    ):
        if dim in sizes:
            yield from other_form(result)
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
    yield _left_out(result, len(columns) + bool(sources))


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


def _allocated(result: Result) -> Iterator[str]:
    """One row for each parameter that gets a tolerance: its half width, tie, grade and row."""
    half, ties = result.values("half"), result.labels("tie")
    yield _lines([["feature", "half", "unit", "tie", "grade", "tie_of"]])
    grades, rows = result.labels("grade"), result.labels("tie_of")
    for number, (feature, tie) in enumerate(
        zip(result.labels("feature"), result.labels("feature_tie"), strict=True)
    ):
        at = ties.index(tie)
        size = _cell(float(half.array[number]))
        yield _lines([[feature, size, half.unit(number), tie, grades[at], rows[at]]])


def _curve(result: Result) -> Iterator[str]:
    """One row for each target: what the design costs, and what none can undercut."""
    columns = [_single(result, name) for name in ("target", "cost", "lower_bound")]
    yield _lines([[*(column.header for column in columns), "options"]])
    for number, options in enumerate(result.labels("options")):
        cells = [_cell(float(column.values[number])) for column in columns]
        yield _lines([[*cells, options]])


def _interleaved(
    leading: list[tuple[object, ...]], columns: list[CsvColumn], sources: list[str], block: slice
) -> Iterator[list[object]]:
    """Rows of some poses: one for each source and one for all together, or one where none."""
    values = [column.values[block].tolist() for column in columns]
    overall = [
        None if column.overall is None else column.overall[block].tolist() for column in columns
    ]
    for at, lead in enumerate(leading):
        alone = [column[at] for column in values]
        for number, source in enumerate(sources):
            cells = (cell[number] if isinstance(cell, list) else cell for cell in alone)
            yield [*lead, source, *map(_cell, cells)]
        together = (
            "" if isinstance(one, list) and all_ is None else one if all_ is None else all_[at]
            for one, all_ in zip(alone, overall, strict=True)
        )
        yield [*lead, *([OVERALL] if sources else []), *map(_cell, together)]


def _columns(result: Result) -> list[CsvColumn]:
    """Every variable over poses, its last axis spread over columns."""
    columns = []
    names = result.variables()
    for name in names:
        dims = tuple(str(dim) for dim in result.dataset[name].dims)
        if dims[:1] != ("pose",) or (name.startswith("overall_") and _alone(name) in names):
            continue
        if MANY in dims:
            continue
        values = result.values(name)
        together = f"overall_{name}"
        overall = result.values(together).array if together in names else None
        rows = 2 if dims[1:2] == ("source",) else 1
        for index, header in enumerate(_headers(result, name, values, rows)):
            columns.append(
                CsvColumn(
                    header,
                    _spread(values.array, rows)[..., index],
                    None if overall is None else _spread(overall, 1)[..., index],
                )
            )
    return columns


def _headers(result: Result, name: str, values: Values, rows: int) -> Iterator[str]:
    """The header, with its unit, of each column over all axes but the first `rows`."""
    labels = [result.labels(dim) for dim in values.dims[rows:]]
    for index in np.ndindex(*map(len, labels)):
        unit = values.unit(*(index[axis - rows] for axis in values.mixed))
        words = (label[at] for label, at in zip(labels, index, strict=True))
        title = "_".join([name, *words])
        yield title if unit == "1" else f"{title} [{unit}]"


def _spread(array: NDArray[np.generic], rows: int) -> NDArray[np.generic]:
    """All axes but the first `rows` as one."""
    return array.reshape(*array.shape[:rows], -1)


def _shares(result: Result) -> Iterator[str]:
    """One row for each pose and parameter, then for each pose and source, then for all together."""
    poses = [_single(result, f"pose_{name}") for name in result.machine.commanded]
    names = result.variables()
    kinds = [name for name in names if result.dataset[name].dims[1:2] == ("parameter",)]
    alone = [name for name in names if "parameter" not in result.dataset[name].dims]
    alone = [name for name in alone if "source" not in result.dataset[name].dims]
    headers = [header for name in kinds for _, header in _each(result, name, 2)]
    others = [header for name in alone for _, header in _each(result, name, 1)]
    leading = ["pose", "status", *(pose.header for pose in poses), "of", "name"]
    yield _lines([[*leading, *headers, *others]])
    for at, number in enumerate(result.dataset["pose"].values.tolist()):
        where = [number, "ok", *(pose.values[at].item() for pose in poses)]
        for of, before in (("parameter", ""), ("source", "source_")):
            cells = [_cells_of(result, before + name, at, of) for name in kinds]
            for row, label in enumerate(result.labels(of)):
                shares = [cell for column in cells for cell in column[row]]
                yield _lines([[*where, of, label, *shares, *[""] * len(others)]])
        values = (value[at].item() for name in alone for value, _ in _each(result, name, 1))
        yield _lines([[*where, "all", "", *[""] * len(headers), *map(_cell, values)]])
    yield _left_out(result, len(headers) + len(others) + 2)


def _left_out(result: Result, blank: int) -> str:
    """The poses that cannot be used, with their status and so many empty cells."""
    names = ("pose", "status", *result.machine.commanded)
    return _lines([[*(row[name] for name in names), *[""] * blank] for row in result.left_out()])


def _each(result: Result, name: str, rows: int) -> Iterator[tuple[NDArray[np.generic], str]]:
    """Values over the first `rows` axes, and header, of each column of a variable."""
    values = result.values(name)
    for index, header in enumerate(_headers(result, name, values, rows)):
        yield _spread(values.array, rows)[..., index], header


def _cells_of(result: Result, name: str, pose: int, of: str) -> list[list[object]]:
    """Rows of cells of one pose; empty ones where the result has no such variable."""
    if name not in result.dataset:
        return [[""] * result.dataset.sizes["component"]] * len(result.labels(of))
    rows: list[list[object]] = result.values(name).array[pose].tolist()
    return [[_cell(cell) for cell in row] for row in rows]


def _summary(result: Result) -> Iterator[str]:
    """One row for each number: the variable, of what it is, and its unit."""
    yield _lines([["name", "of", "value", "unit"]])
    for name in result.variables():
        values = result.values(name)
        labels = [result.labels(dim) for dim in values.dims]
        rows = []
        for at in np.ndindex(values.array.shape):
            of = " ".join(names[number] for names, number in zip(labels, at, strict=True))
            unit = values.unit(*(at[axis] for axis in values.mixed))
            value = values.array[at].item()
            rows.append([name, of, _cell(value) if isinstance(value, float) else value, unit])
        yield _lines(rows)


def _region(result: Result) -> Iterator[str]:
    """One row for each component and magnitude: what is proven, what is reached, and where."""
    machine, dataset = result.machine, result.dataset
    units = [in_file_units(machine, 0.0, pose_si(name))[1] for name in machine.commanded]
    places = [
        f"{where}_{name} [{unit}]"
        for where in ("where_lower", "where")
        for name, unit in zip(machine.commanded, units, strict=True)
    ]
    ends = ["lower", "upper", "reached_lower", "reached_upper"]
    yield _lines([["name", "units", *ends, *places, "status", "boxes"]])
    last = [str(dataset["status"].values), int(dataset["boxes"].values)]
    for dim, kinds, where in (
        ("component", ends, ["where_lower", "where"]),
        ("quantity", ["", "magnitude", "", "reached_magnitude"], ["", "where_magnitude"]),
    ):
        values = {kind: result.values(kind) for kind in (*kinds, *where) if kind}
        nowhere = [""] * len(machine.commanded)
        for row, name in enumerate(result.labels(dim)):
            unit = values[kinds[1]].unit(*[row] * len(values[kinds[1]].mixed))
            cells = [_cell(float(values[kind].array[row])) if kind else "" for kind in kinds]
            at = [values[kind].array[row].tolist() if kind else nowhere for kind in where]
            yield _lines([[name, unit, *cells, *(_cell(c) for place in at for c in place), *last]])


def _alone(overall: str) -> str:
    return overall.removeprefix("overall_")


def _single(result: Result, name: str) -> CsvColumn:
    values = result.values(name)
    return CsvColumn(f"{name} [{values.units[0]}]", values.array)


def _cell(value: object) -> object:
    """Full precision; a missing number is an empty cell."""
    if isinstance(value, float):
        return repr(value) if math.isfinite(value) else ""
    return value


def _lines(rows: Iterator[list[object]] | list[list[object]]) -> str:
    buffer = io.StringIO()
    csv.writer(buffer, lineterminator="\n").writerows(rows)
    return buffer.getvalue()
