"""Too few data, and uncertainties that do not go with the readings."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from truepose.calibration.data_checks._base import InspectionKind, MeasuredColumn, Suspicion, View

BELOW_DIGIT = 20.0
"""A standard uncertainty this many times below the last digit is absurd: rounding has 0.29."""

OVERSTATED = 0.1
"""Residuals, nothing fitted, below this share of the stated uncertainty: chance gives about 1."""

SOME = 8
"""Readings from which a scatter or a last digit can be told."""


def inspect_few(view: View) -> Iterator[Suspicion]:
    """Readings that say where the instrument stands, and nothing else."""
    count, placement = view.observations.size, view.as_given.placement
    if count > placement.rank:
        return
    unknown = placement.unknowns.count
    yield Suspicion(
        "too-few-data",
        f"{view.instrument.name}: {count} readings, and {unknown} unknowns of the instrument "
        f"itself, of which they determine {placement.rank}: none is left to say anything of the "
        "machine, measure more rows",
        view.instrument.name,
        view.column_names,
    )


def inspect_uncertainty(view: View) -> Iterator[Suspicion]:
    """Uncertainties far below the last digit, or far above the scatter."""
    for column in view.columns:
        yield from _below_digit(view, column)
        yield from _overstated(view, column)


def _below_digit(view: View, column: MeasuredColumn) -> Iterator[Suspicion]:
    digit = last_digit(view.readings.value[column.observations], column.unit)
    noise = float(np.median(view.measurements.uncertainty[view.observations[column.observations]]))
    if digit is not None and digit > BELOW_DIGIT * noise:
        yield Suspicion(
            "absurd-uncertainty",
            f"{view.instrument.name}: {column.name} is given to {view.format(digit, column.unit)}, "
            f"its standard uncertainty as {view.format(noise, column.unit)}: rounding alone is "
            f"{digit / noise / 12**0.5:.0f} times that",
            view.instrument.name,
            (column.name,),
            before=noise,
            unit=column.unit,
            refuses=False,
        )


def _overstated(view: View, column: MeasuredColumn) -> Iterator[Suspicion]:
    noise = view.measurements.uncertainty[view.observations[column.observations]]
    if column.observations.size < SOME or view.as_given.redundancy < SOME:
        return
    if not view.readings.value[column.observations].any():
        return
    ratio = float(np.sqrt(np.mean((view.as_given.residual[column.observations] / noise) ** 2)))
    if 0.0 < ratio < OVERSTATED:
        yield Suspicion(
            "absurd-uncertainty",
            f"{view.instrument.name}: {column.name} scatters {1.0 / ratio:.0f} times less about "
            "the nominal machine than its stated uncertainty allows: too large a uncertainty, or "
            "another unit",
            view.instrument.name,
            (column.name,),
            before=ratio * float(np.median(noise)),
            unit=column.unit,
            refuses=False,
        )


def last_digit(values: np.ndarray, unit: str) -> float | None:
    """The largest decimal step, SI, of which all values are multiples; None where there is none.

    In metres, inches, radians and degrees, down to 1e-9 of them.
    """
    if values.size < SOME or np.unique(values).size < SOME:
        return None
    bases = {"m": (1.0, 0.0254), "rad": (1.0, np.pi / 180.0), "1": (1.0,)}[unit]
    steps = sorted((base * 10.0**-k for base in bases for k in range(1, 9)), reverse=True)
    for step in steps:
        counts = values / step
        if (np.abs(counts - np.round(counts)) < 1e-5).all():
            return float(step)
    return None


FEW = InspectionKind(
    "too-few-data", "no reading is left that says anything of the machine", inspect_few
)
UNCERTAINTY = InspectionKind(
    "absurd-uncertainty", "an uncertainty far off the scatter", inspect_uncertainty
)
