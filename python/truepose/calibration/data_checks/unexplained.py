"""Readings that no known blunder explains, and that no machine of these tolerances would give."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from truepose.calibration.data_checks._base import ALLOWED, Suspicion, View

ABSURD = 0.1
"""Residuals beyond this share of what the readings themselves vary by: not a machine that is a
little off, but another one, or other data."""


def inspect(view: View) -> Iterator[Suspicion]:
    """The data are off and no hypothesis of the registry explains them."""
    misfit = view.as_given
    size = misfit.size()
    if not size > ALLOWED:
        return
    worst = int(np.argmax(np.abs(misfit.quotients)))
    unit = next(c.unit for c in view.columns if worst in c.observations)
    same = np.flatnonzero(np.isin(np.arange(misfit.residual.size), _of_unit(view, unit)))
    residual = misfit.residual[same]
    predicted = view.readings.value[same] - residual
    rms = float(np.sqrt(np.mean(residual**2)))
    reach = float(np.sqrt(np.mean((predicted - predicted.mean()) ** 2)))
    reach = max(reach, float(np.abs(predicted.mean())) if unit == "m" and _absolute(view) else 0.0)
    refuses = rms > ABSURD * reach
    far = np.flatnonzero(np.abs(misfit.quotients) > 2.0 * ALLOWED)
    rows = tuple(np.unique(view.readings.row[far]).tolist())
    part = 0 < len(rows) < view.rows.size or view.rows.size == 1
    where = view.named_rows(rows) if part and rows else "all rows"
    if same.size == 1:
        off = (
            f"reads {view.format(float(view.readings.value[worst]), unit)} where the nominal "
            f"machine has {view.format(float(predicted[0]), unit)}"
        )
    else:
        off = f"is {view.format(rms, unit)} (rms) off what the nominal machine would show"
    yield Suspicion(
        "far-off",
        f"{view.instrument.name}: {off}, {size:.0f} times what tolerances and noise allow "
        f"({where}), and no known blunder explains it"
        + (": these are not readings of this machine as described" if refuses else ""),
        view.instrument.name,
        view.column_names,
        rows,
        view.lines(rows),
        before=rms,
        unit=unit,
        refuses=refuses,
    )


def _of_unit(view: View, unit: str) -> np.ndarray:
    return np.concatenate([column.observations for column in view.columns if column.unit == unit])


def _absolute(view: View) -> bool:
    """Whether the readings are lengths that count from zero: distances and struts."""
    return all(column.name == "distance" or column.strut >= 0 for column in view.columns)
