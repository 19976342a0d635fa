"""Columns that cannot be what an instrument read: constant ones, and copies of the command."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from truepose.calibration.data_checks._base import (
    ALLOWED,
    REDUNDANT,
    InspectionKind,
    Suspicion,
    View,
)

FEW = 3
"""Rows below which a constant or a coincidence says nothing."""

EQUAL = 1e-3
"""Of the uncertainty, and of a thousandth of the readings' own spread: readings nearer than this to
the command, all of them, were not measured."""


def inspect_constant(view: View) -> Iterator[Suspicion]:
    """The same number in every row although the machine moved."""
    predicted = view.readings.value - view.as_given.residual
    for column in view.columns:
        value = view.readings.value[column.observations]
        if column.observations.size < FEW or np.ptp(value) > 0.0:
            continue
        # As far as one constant is from all predictions at the best.
        spread = float(predicted[column.observations].std())
        allowed = float(view.readings.scale[column.observations].max())
        if spread > ALLOWED * allowed:
            yield Suspicion(
                "constant-column",
                f"{view.instrument.name}: {column.name} is the same in all "
                f"{column.observations.size} rows, "
                f"where the machine moves it by {view.format(spread, column.unit)} (rms)",
                view.instrument.name,
                (column.name,),
                before=spread,
                unit=column.unit,
            )


def inspect_command(view: View) -> Iterator[Suspicion]:
    """Readings equal to where the controller thinks it is."""
    if view.as_given.redundancy < REDUNDANT:
        return  # any readings agree with an instrument that is put where they fit
    exact = []
    for column in view.columns:
        gap = np.abs(view.as_displayed.residual[column.observations])
        noise = view.measurements.uncertainty[view.observations[column.observations]]
        spread = float(view.readings.value[column.observations].std())
        near = EQUAL * np.minimum(noise, EQUAL * spread)
        if column.observations.size >= FEW and spread > 0.0 and (gap < near).all():
            exact.append(column)
    if exact:
        names = tuple(column.name for column in exact)
        yield Suspicion(
            "copied-command",
            f"{view.instrument.name}: {', '.join(names)} agree with the commanded pose to a "
            "thousandth of the stated uncertainty in every row: the controller's own readout, "
            "not a measurement",
            view.instrument.name,
            names,
            before=float(np.abs(view.as_displayed.residual[exact[0].observations]).max()),
            unit=exact[0].unit,
        )


CONSTANT = InspectionKind(
    "constant-column", "a column does not change although the machine moves", inspect_constant
)
COMMAND = InspectionKind("copied-command", "readings equal to the command", inspect_command)
