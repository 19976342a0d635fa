"""Sanity before fitting: blunders are suspected from the data and named, never repaired.

The nominal machine says what each instrument should have read; tolerances, the other error sources
and noise say how far off it may be. Data that are further off are compared under one hypothesis
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
    HypothesisKind,
    InspectionKind,
    Suspicion,
    View,
)
from truepose.calibration.data_checks.expected_residual import expected_residual
from truepose.calibration.data_checks.nominal import Geometry, Placement, nominal_readings
from truepose.calibration.data_checks.placement import Readings
from truepose.calibration.measurements import Measurements
from truepose.machine import Machine

HYPOTHESES: tuple[HypothesisKind, ...] = (
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
INSPECTIONS: tuple[InspectionKind, ...] = (
    constant_column.CONSTANT,
    constant_column.COMMAND,
    repeats.DOUBLED,
    repeats.DISAGREEING,
    too_few.FEW,
    too_few.UNCERTAINTY,
)
CODES: dict[str, str] = {
    **{hypothesis.code: hypothesis.doc for hypothesis in HYPOTHESES},
    **{inspection.code: inspection.doc for inspection in INSPECTIONS},
    "far-off": "further from the nominal machine than tolerances allow, and nothing explains it",
}
"""Every kind of suspicion and what it says."""

_AS_GOOD = 2.0
"""Hypotheses that leave this many times the least residual are still named."""

_SAME = 1.02
"""Within this factor two of them explain the same, and the earlier in the registry goes first."""


def suspicions(machine: Machine, measurements: Measurements) -> tuple[Suspicion, ...]:
    """Suspicions about the measurements of a machine, the likeliest of each instrument first.

    Empty for data of a machine that is within its tolerances. Raises nothing of its own, and
    `TrueposeError` where a row's condition asks an error source for what the machine does not say.
    """
    geometry = Geometry.of_rows(machine.kernel, measurements)
    allowed = expected_residual(machine, measurements, geometry)
    instrument_of = measurements.instrument[measurements.row]
    suspected: list[Suspicion] = []
    for index, instrument in enumerate(measurements.instruments):
        observations = np.flatnonzero(instrument_of == index)
        if not observations.size:
            continue
        readings = Readings(
            measurements.row[observations],
            measurements.observable[observations],
            measurements.strut[observations],
            measurements.value[observations],
            allowed[observations],
        )
        view = View(machine, measurements, instrument, observations, geometry, readings)
        inspected = [suspicion for kind in INSPECTIONS for suspicion in kind.inspect(view)]
        # What else is off follows from a constant column.
        if all(suspicion.code != "constant-column" for suspicion in inspected):
            suspected += _explained(view)
        suspected += inspected
    return tuple(suspected)


def _explained(view: View) -> list[Suspicion]:
    """Suspicions from the hypotheses that explain the data; far off, where none does."""
    as_given = view.as_given
    if as_given.redundancy < REDUNDANT:
        return list(unexplained.inspect(view)) if as_given.size() > 2.0 * ALLOWED else []
    if not max(as_given.size(), as_given.size(trimmed=False)) > ALLOWED:
        return []
    accepted: list[_Accepted] = []
    for free in (False, True):
        for place, kind in enumerate(HYPOTHESES):
            if kind.free != free:
                continue
            for hypothesis in kind.propose(view):
                misfit = hypothesis.misfit
                size = misfit.size(hypothesis.trimmed)
                before = _size_before(view, hypothesis)
                if misfit.redundancy < REDUNDANT:
                    continue
                if before > ALLOWED and size <= min(ALLOWED, before / LESS):
                    # What shrinks readings or poses shrinks residuals with them: no merit of it.
                    share = size / misfit.reach if misfit.reach > 0.0 else size
                    accepted.append(_Accepted(share, place, kind.code, hypothesis))
        if accepted:
            break
    if not accepted:
        return list(unexplained.inspect(view))
    least = min(candidate.share for candidate in accepted)
    by_code: dict[str, list[_Accepted]] = {}
    # Hypotheses that explain the same stand in the order of the registry.
    for candidate in sorted(accepted, key=lambda a: (a.share > _SAME * least, a.place, a.share)):
        if candidate.share <= _AS_GOOD * least:
            by_code.setdefault(candidate.code, []).append(candidate)
    return [_suspicion(view, code, _ranked(candidates)) for code, candidates in by_code.items()]


@dataclass(frozen=True, eq=False)
class _Accepted:
    """A hypothesis that explains the data; `share`: the residual it leaves, of the motion."""

    share: float
    place: int
    code: str
    hypothesis: Hypothesis


def _ranked(accepted: list[_Accepted]) -> list[Hypothesis]:
    """Readings before commands, where either may be wrong: then the better before the worse."""
    ranked = sorted(accepted, key=lambda a: (a.hypothesis.of_command, a.share))
    return [candidate.hypothesis for candidate in ranked]


def _size_before(view: View, hypothesis: Hypothesis) -> float:
    """How far off the data are as they stand, over the observations that the hypothesis keeps."""
    if hypothesis.kept is None:
        return view.as_given.size(hypothesis.trimmed)
    return view.assess(kept=hypothesis.kept).size(hypothesis.trimmed)


def _suspicion(view: View, code: str, hypotheses: list[Hypothesis]) -> Suspicion:
    first = hypotheses[0]
    unit = next((c.unit for c in view.columns if c.name in first.where), view.columns[0].unit)
    before = view.rms(view.as_given, first, unit)
    after = view.rms(first.misfit, first, unit)
    factor = before / after if after > 0.0 else float("inf")
    # One more of the same side, and one of the other: readings or commands.
    others = [
        next((other for other in hypotheses[1:] if other.of_command == side), None)
        for side in (first.of_command, not first.of_command)
    ]
    either = "".join(f", or {other.words}" for other in others if other is not None)
    return Suspicion(
        code,
        f"{view.instrument.name}: it looks as if {first.words}{either}: as given the readings are "
        f"{view.format(before, unit)} (rms) from where the nominal machine would be, "
        f"with that mended {view.format(after, unit)}",
        view.instrument.name,
        first.where,
        first.rows,
        view.lines(first.rows),
        before,
        after,
        factor,
        unit,
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
