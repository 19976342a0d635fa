"""The variants of a study as tables for people, and as text for programs."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from truepose.arrays import Indices
from truepose.reporting.display import column
from truepose.reporting.result import Result
from truepose.reporting.table import Table
from truepose.studies.block import FAILED, INFEASIBLE, NOT_COMPUTED, OK
from truepose.studies.ranking import causes, objective_of, ranked

if TYPE_CHECKING:
    import xarray as xr

    from truepose.machine import Machine

MOST_SHOWN = 10
"""Variants that are listed, and reasons."""

_STATUS = ("variant", "status", "reach", "poses_lost", "first_lost", "code", "reason", "done")
"""Of every study, and no result of one."""


def tables(machine: Machine, dataset: xr.Dataset) -> list[Table]:
    """How many variants there are of each status, the best of them, and why others are not ok."""
    shown = [_counts(dataset)]
    best = ranked(dataset)[:MOST_SHOWN]
    if best.size:
        shown.append(_best(machine, dataset, best))
    if reasons := causes(dataset)[:MOST_SHOWN]:
        shown.append(
            Table(
                "reasons",
                "Not ok",
                ("status", "variants", "first", "why"),
                tuple(
                    (one.status, f"{one.count:,}", str(one.first), one.reason) for one in reasons
                ),
                words=1,
                note="Of each cause the first variant, and what is said of it.",
            )
        )
    return shown


def _counts(dataset: xr.Dataset) -> Table:
    status = dataset["status"].values
    rows = [("variants", f"{status.size:,}")]
    for word in (OK, INFEASIBLE, FAILED, NOT_COMPUTED):
        count = int((status == word).sum())
        if count or word == OK:
            rows.append((word, f"{count:,}"))
    return Table("study", "Study", ("", ""), tuple(rows))


def _best(machine: Machine, dataset: xr.Dataset, best: Indices) -> Table:
    header = ["variant", *map(str, dataset["variable"].values)]
    columns = [[str(number) for number in best.tolist()]]
    columns += [list(map(str, row)) for row in dataset["setting"].values[best].T]
    words = len(columns)
    if "answer" in dataset:
        for at, state in enumerate(dataset["state"].values):
            answers = dataset["answer"].values[best, at]
            header.append(str(state))
            columns.append([" / ".join(word or "not asked" for word in row) for row in answers])
            words += 1
    for name, title in (("known", "known"), ("linear_maximum", "linear maximum")):
        if name in dataset:
            for at, kind in enumerate(dataset["quantity"].values):
                unit = machine.shown.error(str(kind))
                header.append(f"{title}, {kind} [{unit.label}]")
                values = dataset[name].values[best, at] * unit.per_si
                columns.append(list(column(values, unit.decimals)))
    if "conditioning" in dataset:
        header += ["conditioning", "travel left [%]"]
        columns.append(list(column(dataset["conditioning"].values[best], 4)))
        columns.append(list(column(100.0 * dataset["travel_left"].values[best], 1)))
    if (reach := dataset["reach"].values[best]).min() < 1.0:
        header.append("reach [%]")
        columns.append(list(column(100.0 * reach, 2)))
    objective = objective_of(dataset)
    how = f"of the smallest {objective.title}" if objective.variable in dataset else "the first"
    every = int((dataset["status"].values == OK).sum())
    note = f"{best.size} of {every:,} variants that are ok, {how}." if every > best.size else ""
    rows = tuple(zip(*columns, strict=True))
    return Table("variants", "Variants", tuple(header), rows, words=words, note=note)


def csv_text(machine: Machine, dataset: xr.Dataset) -> Iterator[str]:
    """One row a variant: what is varied, its status, and every number, in the file's units."""
    result = Result("study", machine, dataset)
    headers = [
        f"{key} [{unit}]" if unit else str(key)
        for key, unit in zip(
            dataset["variable"].values, dataset["variable_units"].values, strict=True
        )
    ]
    values, texts = dataset["value"].values, dataset["setting"].values
    of_variant: list[list[object]] = [
        [text if np.isnan(value) else float(value) for value, text in zip(*row, strict=True)]
        for row in zip(values, texts, strict=True)
    ]
    columns: list[list[object]] = []
    names = [*_STATUS, *(name for name in map(str, dataset.data_vars) if name not in _STATUS)]
    for name in names:
        told = result.values(name)
        labels = [result.labels(dim) for dim in told.dims[1:]]
        for index in np.ndindex(*map(len, labels)):
            unit = told.unit(*(index[axis - 1] for axis in told.mixed))
            words = [label[at] for label, at in zip(labels, index, strict=True)]
            title = "_".join([name, *words]).replace(" ", "_")
            headers.append(title if unit == "1" else f"{title} [{unit}]")
            columns.append([_cell(value) for value in told.array[(slice(None), *index)].tolist()])
    yield _line(headers)
    for settings, row in zip(of_variant, zip(*columns, strict=True), strict=True):
        yield _line([*settings, *row])


def _cell(value: object) -> object:
    """Full precision; a missing number is an empty cell."""
    return "" if isinstance(value, float) and np.isnan(value) else value


def _line(cells: list[object] | list[str]) -> str:
    buffer = io.StringIO()
    csv.writer(buffer, lineterminator="\n").writerow(cells)
    return buffer.getvalue()


__all__ = ["csv_text", "tables"]
