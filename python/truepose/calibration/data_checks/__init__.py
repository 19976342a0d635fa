"""Sanity before fitting: blunders are suspected from the data and named, never repaired.

The nominal machine says what each instrument should have read; tolerances, the other error sources
and noise say how far off it may be. Data that are further off are looked at under one supposition
after the other (`HYPOTHESES`): one that brings them back is named. Other faults show in the data as
such (`INSPECTIONS`). A kind of blunder is a file and a line here. `docs/calibration_suspicions.md`
has the rules and their thresholds.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from truepose.calibration.data_checks import (
    constant_column,
    frame,
    handedness,
    repeats,
    rotation,
    row_order,
    swapped,
    too_few,
    unexplained,
    unit,
)
from truepose.calibration.data_checks._base import (
    ALLOWED,
    LESS,
    REDUNDANT,
    Hypothesis,
    OfLook,
    OfMend,
    Suspicion,
    View,
)
from truepose.calibration.data_checks.expected_residual import expected_residual
from truepose.calibration.data_checks.nominal import Geometry, Placement, nominal_readings
from truepose.calibration.data_checks.placement import Readings
from truepose.calibration.measurements import Measurements
from truepose.machine import Machine

HYPOTHESES: tuple[OfMend, ...] = (
    swapped.KIND,
    handedness.KIND,
    unit.LENGTH,
    unit.ANGLE,
    rotation.SIGN,
    rotation.ORDER,
    row_order.SHIFTED,
    row_order.EXCHANGED,
    frame.TARGET,
    frame.FRAME,
)
INSPECTIONS: tuple[OfLook, ...] = (
    constant_column.CONSTANT,
    constant_column.COMMAND,
    repeats.DOUBLED,
    repeats.DISAGREEING,
    too_few.FEW,
    too_few.UNCERTAINTY,
)
CODES: dict[str, str] = {
    **{each.code: each.doc for each in HYPOTHESES},
    **{each.code: each.doc for each in INSPECTIONS},
    "far-off": "further from the nominal machine than tolerances allow, and nothing explains it",
}
"""Every kind of suspicion and what it says."""

_AS_GOOD = 2.0
"""Suppositions that leave this many times the least residual are still named."""

_SAME = 1.02
"""Within this factor two of them explain the same, and the earlier in the registry goes first."""


def suspicions(machine: Machine, measurements: Measurements) -> tuple[Suspicion, ...]:
    """What is suspected of measurements of a machine, the likeliest of each instrument first.

    Empty for data that a machine within its tolerances gives. Raises nothing of its own, and
    `TrueposeError` where a row's condition asks an error source for what the machine does not say.
    """
    geometry = Geometry.of(machine, measurements.joints, measurements.placements)
    allowed = expected_residual(machine, measurements, geometry)
    of = measurements.instrument[measurements.row]
    found: list[Suspicion] = []
    for index, instrument in enumerate(measurements.instruments):
        at = np.flatnonzero(of == index)
        if not at.size:
            continue
        readings = Readings(
            measurements.row[at],
            measurements.observable[at],
            measurements.strut[at],
            measurements.value[at],
            allowed[at],
        )
        view = View(machine, measurements, instrument, at, geometry, readings)
        looked = [each for kind in INSPECTIONS for each in kind.look(view)]
        if any(each.code == "constant-column" for each in looked):
            found += looked  # what else is off follows from it
            continue
        found += _supposed(view)
        found += looked
    return tuple(found)


def _supposed(view: View) -> list[Suspicion]:
    """Suspicions from the suppositions that explain the data; far off, where none does."""
    given = view.as_given
    if given.redundancy < REDUNDANT:
        return list(unexplained.inspect(view)) if given.size() > 2.0 * ALLOWED else []
    if not max(given.size(), given.size(trimmed=False)) > ALLOWED:
        return []
    accepted: list[_Accepted] = []
    for free in (False, True):
        for place, kind in enumerate(HYPOTHESES):
            if kind.free != free:
                continue
            for mend in kind.suppose(view):
                size = mend.judged.size(mend.trimmed)
                before = _before(view, mend)
                if mend.judged.redundancy < REDUNDANT:
                    continue
                if before > ALLOWED and size <= min(ALLOWED, before / LESS):
                    # What shrinks readings or poses shrinks residuals with them: no merit of it.
                    share = size / mend.judged.reach if mend.judged.reach > 0.0 else size
                    accepted.append(_Accepted(share, place, kind.code, mend))
        if accepted:
            break
    if not accepted:
        return list(unexplained.inspect(view))
    least = min(each.share for each in accepted)
    by_code: dict[str, list[_Accepted]] = {}
    # Suppositions that explain the same stand in the order of the registry.
    for each in sorted(accepted, key=lambda e: (e.share > _SAME * least, e.place, e.share)):
        if each.share <= _AS_GOOD * least:
            by_code.setdefault(each.code, []).append(each)
    return [_told(view, code, [each.mend for each in _ranked(of)]) for code, of in by_code.items()]


@dataclass(frozen=True, eq=False)
class _Accepted:
    """A mend that brings the data back, the residual that it leaves as a share of the motion."""

    share: float
    place: int
    code: str
    mend: Hypothesis


def _ranked(accepted: list[_Accepted]) -> list[_Accepted]:
    """Readings before commands, where either may be wrong: then the better before the worse."""
    return sorted(accepted, key=lambda each: (each.mend.of_command, each.share))


def _before(view: View, mend: Hypothesis) -> float:
    """How far off the data are as they stand, over the observations that the mend keeps."""
    if mend.kept is None:
        return view.as_given.size(mend.trimmed)
    return view.judge(kept=mend.kept).size(mend.trimmed)


def _told(view: View, code: str, mends: list[Hypothesis]) -> Suspicion:
    first = mends[0]
    unit_of = next((c.unit for c in view.columns if c.name in first.where), view.columns[0].unit)
    before = view.rms(view.as_given, first, unit_of)
    after = view.rms(first.judged, first, unit_of)
    factor = before / after if after > 0.0 else float("inf")
    # One more of the same side, and one of the other: readings or commands.
    others = [
        next((m for m in mends[1:] if m.of_command == side), None)
        for side in (first.of_command, not first.of_command)
    ]
    either = "".join(f", or {mend.words}" for mend in others if mend is not None)
    return Suspicion(
        code,
        f"{view.instrument.name}: it looks as if {first.words}{either}: as given the readings are "
        f"{view.amount(before, unit_of)} (rms) from where the nominal machine would be, "
        f"with that mended {view.amount(after, unit_of)}",
        view.instrument.name,
        first.where,
        first.rows,
        view.lines(first.rows),
        before,
        after,
        factor,
        unit_of,
    )


__all__ = [
    "CODES",
    "HYPOTHESES",
    "INSPECTIONS",
    "Placement",
    "Suspicion",
    "nominal_readings",
    "suspicions",
]
