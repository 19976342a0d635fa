"""Rows that are there twice, and repeats that do not agree."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from truepose.calibration.data_checks._base import InspectionKind, Suspicion, View

DISAGREE = 6.0
"""Difference of two readings of one pose, in its standard deviation, that is no noise."""

FINE = 10.0
"""A reading whose last digit is this many times below its uncertainty does not repeat by chance."""


def inspect_doubled(view: View) -> Iterator[Suspicion]:
    """The same command and the same readings to the last digit."""
    if not _fine(view) or not view.measurements.posed[view.rows].all():
        return  # a part is measured twice to the same digit, if the gauge has few
    seen: dict[tuple[bytes, ...], int] = {}
    doubled: list[int] = []
    for row in view.rows.tolist():
        of_row = view.readings.row == row
        value = view.readings.value[of_row]
        if not value.any():
            return  # a contact reads zero everywhere
        key = (
            view.measurements.command(row),
            value.tobytes(),
            view.readings.observable[of_row].tobytes(),
        )
        if key in seen:
            doubled += [seen[key], row]
        seen.setdefault(key, row)
    if doubled:
        rows = tuple(dict.fromkeys(doubled))
        yield Suspicion(
            "repeated-rows",
            f"{view.instrument.name}: {view.named_rows(rows)} have the same command and the same "
            "reading to the last digit: copied rows, which would count as measured twice",
            view.instrument.name,
            view.column_names,
            rows,
            view.lines(rows),
        )


def inspect_disagreeing(view: View) -> Iterator[Suspicion]:
    """The same command under the same condition, and readings that differ by more than noise."""
    if not view.measurements.posed[view.rows].all():
        return
    rows: list[int] = []
    largest = 0.0
    for column in view.columns:
        seen: dict[tuple[bytes, int], int] = {}
        for observation in column.observations.tolist():
            row = int(view.readings.row[observation])
            condition = id(view.measurements.conditions[row])
            key = (view.measurements.command(row), condition)
            first = seen.setdefault(key, observation)
            gap = abs(view.readings.value[observation] - view.readings.value[first])
            noise = np.hypot(
                *view.measurements.uncertainty[view.observations[[observation, first]]]
            )
            if first != observation and gap > DISAGREE * noise:
                rows += [int(view.readings.row[first]), row]
                largest = max(largest, float(gap / noise))
    if rows:
        named = tuple(sorted(dict.fromkeys(rows)))
        yield Suspicion(
            "repeats-disagree",
            f"{view.instrument.name}: {view.named_rows(named)} have the same command, but readings "
            f"that differ by up to {largest:.0f} standard uncertainties: the machine or the "
            "instrument moved, or the stated uncertainty is too small",
            view.instrument.name,
            view.column_names,
            named,
            view.lines(named),
            refuses=False,
        )


def _fine(view: View) -> bool:
    """Whether equal readings say something: many in a row, or digits far below the noise."""
    if len(view.columns) >= 3:
        return True
    return all(_digits_below_noise(view, column.observations) for column in view.columns)


def _digits_below_noise(view: View, observations: np.ndarray) -> bool:
    values = np.unique(view.readings.value[observations])
    if values.size < 2:
        return False
    return bool(
        np.diff(values).min() * FINE
        < view.measurements.uncertainty[view.observations[observations]].min()
    )


DOUBLED = InspectionKind("repeated-rows", "a row is there twice", inspect_doubled)
DISAGREEING = InspectionKind(
    "repeats-disagree", "repeats differ by more than noise", inspect_disagreeing
)
