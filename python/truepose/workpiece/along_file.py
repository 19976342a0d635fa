"""Variables along the way as a file: what a witness has that its machine file cannot say.

    point, run, variable, value
    , 0, drive.1.offset, 1
    17, 0, backlash: drive.2.offset, -0.25

A value is in half bands: 1 is where the variable is at the upper end. A row without a point holds
at all points of the part; points are counted from 0 in the order of the path.
"""

from __future__ import annotations

import csv
import dataclasses
import io
from pathlib import Path

import numpy as np

from truepose.arrays import Floats
from truepose.errors import Fault, Problem, RequestError
from truepose.files.data_file import Column, DataTable, cut_short, read_table
from truepose.files.text_file import FileKind, read_text
from truepose.files.wording import did_you_mean
from truepose.probability.domain import Domain
from truepose.runs.displacement import sum_deviations
from truepose.runs.variables import Variables
from truepose.workpiece.states import PartState

COLUMNS = (
    Column("point", "ratio", blank=True),
    Column("run", "ratio"),
    Column("variable", None),
    Column("value", "ratio"),
)

ALONG = FileKind("variables along the way (CSV)", ".csv")

BEYOND = 1e-9
"""By which a value may be outside of its band: rounding."""


def text_of(variables: Variables, t: Floats) -> str:
    """The file of variables that are `t`, (n_variable,) or of each point (n, n_variable)."""
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow([column.name for column in COLUMNS])
    for number, name in enumerate(variables.names):
        values = np.atleast_1d(t[..., number])
        if (values == values[0]).all():
            writer.writerow(["", 0, name, repr(float(values[0]))])
        else:
            writer.writerows(
                [point, 0, name, repr(float(value))] for point, value in enumerate(values)
            )
    return buffer.getvalue()


def read_along(path: Path, state: PartState) -> Floats:
    """(n, n_variable) of a state's variables, from its file.

    Raises `RequestError` with every problem of it: names of no variable, points that are none,
    values beyond their bands, and variables that are missing at a point (bad-along).
    """
    _, text = read_text(path, ALONG)
    read = read_table(str(path), path.name, text, COLUMNS)
    if read.table is None or read.problems:
        raise RequestError(*read.problems)
    table, variables = read.table, state.variables
    values = np.full((state.block.indices.size, len(variables.names)), np.nan)
    problems = [
        problem
        for row in range(table.n_row)
        if (problem := _fill(table, row, variables, values)) is not None
    ]
    missing = np.flatnonzero(np.isnan(values).any(axis=0))
    if missing.size and not problems:
        problems = [_missing(table, variables.names[at], values[:, at]) for at in missing]
    if problems:
        raise RequestError(*cut_short(problems))
    return values


def _fill(table: DataTable, row: int, variables: Variables, values: Floats) -> Problem | None:
    """Write one row into the values, or say what is wrong with it."""
    name, value = table.texts["variable"][row], float(table.numbers["value"][row])
    point = float(table.numbers["point"][row])
    if name not in variables.names:
        return table.problem(
            Fault(
                "bad-along",
                "no variable of the machine is called so",
                found=f'"{name}"',
                expected="a variable that the machine file leaves unknown",
                hint=did_you_mean(name, variables.names) or "the file is for another machine",
            ),
            row=row,
            column="variable",
        )
    number = variables.names.index(name)
    low, high = variables.domain.lower[number], variables.domain.upper[number]
    room = BEYOND * (high - low)
    if not low - room <= value <= high + room:
        return table.problem(
            Fault(
                "bad-along",
                "no machine inside the bands has this value",
                found=f"{value:.9g}",
                expected=f"{low:g} to {high:g}, in half bands",
            ),
            row=row,
            column="value",
        )
    if np.isnan(point):
        values[:, number] = value
        return None
    if not (point.is_integer() and 0 <= point < len(values)):
        return table.problem(
            Fault(
                "bad-along",
                "the part has no such point",
                found=f"{point:g}",
                expected=f"a whole number from 0 to {len(values) - 1}",
                hint="the program and its features are those for which the file was written?",
            ),
            row=row,
            column="point",
        )
    values[int(point), number] = value
    return None


def _missing(table: DataTable, name: str, values: Floats) -> Problem:
    at = int(np.flatnonzero(np.isnan(values))[0])
    return table.problem(
        Fault(
            "bad-along",
            f"the file does not say what {name} is at every point",
            found=f"nothing at point {at}",
            expected="a row without a point, or one for each point",
        )
    )


def fixed(state: PartState, t: Floats) -> PartState:
    """The one machine of a state whose variables are `t` (n, n_variable): nothing is unknown."""
    variables = state.variables
    half = np.broadcast_to(variables.half_width, (len(t), variables.columns.size))
    moved = half * t[:, variables.variable_of]
    nothing = np.empty(0, np.intp)
    return dataclasses.replace(
        state,
        variables=dataclasses.replace(
            variables,
            shift=sum_deviations([variables.shift, (variables.columns, moved)]),
            alone=tuple((nothing, np.empty((1, 0))) for _ in variables.alone),
            columns=nothing,
            variable_of=nothing,
            half_width=np.empty((1, 0)),
            distributions=(),
            variations=(),
            names=(),
            sources=(),
            streams=nothing,
            numbers=nothing,
            correlation=None,
            domain=Domain.of([]),
        ),
    )


__all__ = ["ALONG", "fixed", "read_along", "text_of"]
