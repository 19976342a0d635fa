"""Residuals that are not noise: what is left after the fit, and what it looks like.

A tracker that was bumped, drifts or has a wrong scale makes a fit with residuals that are small
enough, and a machine that is wrong. Each kind of pattern is a file and a line of `KINDS`;
`docs/calibration_suspicions.md` has the rules, and what they detect.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from truepose.calibration.acceptance.decision import CONTRADICTED
from truepose.calibration.acceptance.observability import covariance_root
from truepose.calibration.acceptance.tool_uncertainty import Tool
from truepose.calibration.data_checks import Suspicion
from truepose.calibration.identification.fit import Fit
from truepose.calibration.residual_checks import drift, scale, step, target_offset, workspace
from truepose.calibration.residual_checks._base import (
    ALARM,
    Finding,
    Left,
    PatternKind,
    ResidualsView,
)
from truepose.calibration.residual_checks.sizes import length_words
from truepose.machine import Machine

KINDS: tuple[PatternKind, ...] = (
    step.KIND,
    drift.KIND,
    scale.KIND,
    target_offset.KIND,
    workspace.KIND,
)
RESTS_ON_TARGET = "rests-on-target"
CODES: dict[str, str] = {
    **{kind.code: kind.doc for kind in KINDS},
    RESTS_ON_TARGET: "an error of the target would move the tool, and would not show",
}
"""Every code and what it says."""

LIKELY_TARGET = 0.2e-3
"""m by which a target is easily off."""


def residual_patterns(machine: Machine, fitted: Fit, tool: Tool) -> tuple[Suspicion, ...]:
    """The likeliest pattern of each instrument's residuals, and what cannot show in them.

    `tool`: effects of the machine's unknowns at the tool. A pattern refuses where it moves the tool
    by more than its standard uncertainty, or is why the residuals are far larger than the noise.
    """
    n = fitted.unknowns.n_machine
    after = tool.uncertainty(covariance_root(fitted.covariance[:n, :n]), np.zeros((0, n)))
    suspected: list[Suspicion] = []
    posed = fitted.measurements.posed
    for number in np.unique(fitted.measurements.instrument[posed]).tolist():
        view = ResidualsView(machine, fitted, tool, after, number, Left.of(fitted))
        likeliest = _of_given_up(view) or _likeliest(view)
        suspected += [] if likeliest is None else [_said(view, *likeliest)]
        suspected += _rests_on_target(view)
    return tuple(suspected)


def _likeliest(view: ResidualsView) -> tuple[str, Finding] | None:
    """What is least likely by chance, with its code."""
    best: tuple[str, Finding] | None = None
    for kind in KINDS:
        finding = kind.inspect(view)
        if finding is None or finding.pattern.probability > ALARM:
            continue
        if best is None or finding.pattern.probability < best[1].pattern.probability:
            best = kind.code, finding
    return best


def _of_given_up(view: ResidualsView) -> tuple[str, Finding] | None:
    """What explains the readings that the fit gave up, if anything does."""
    left = Left.with_given_up(view.fitted, view.number)
    if left is None:
        return None
    restored = replace(view, left=left)
    best = _likeliest(restored)
    explained = best is not None and restored.explains_given_up(best[1].pattern, best[1].columns)
    return best if explained else None


def _said(view: ResidualsView, code: str, finding: Finding) -> Suspicion:
    pattern = finding.pattern
    moved = f"which puts the tool up to {length_words(view, pattern.moved)} off"
    if not pattern.beyond:
        moved += ", within what is stated of it"
    lines = tuple(int(view.data.lines[row]) for row in finding.rows)
    return Suspicion(
        code,
        f"{view.instrument.name}: {finding.words}, {moved}",
        view.instrument.name,
        rows=tuple(view.data.row_numbers[list(finding.rows)].tolist()),
        lines=lines if all(lines) else (),
        refuses=pattern.beyond or view.fitted.birge > CONTRADICTED,
    )


def _rests_on_target(view: ResidualsView) -> list[Suspicion]:
    """Where an error of the target would move the tool by much of the stated, and not be seen."""
    instrument = view.instrument
    if instrument.target_unknown or any(instrument.target_uncertainty):
        return []
    moved, beyond = view.hidden(view.by_target, LIKELY_TARGET)
    if not beyond:
        return []
    error = length_words(view, LIKELY_TARGET)
    return [
        Suspicion(
            RESTS_ON_TARGET,
            f"{instrument.name}: its target is taken as exact; if it is off by {error}, the tool "
            f"is off by up to {length_words(view, moved)}, and these readings would not show it",
            instrument.name,
            refuses=False,
        )
    ]


__all__ = ["CODES", "KINDS", "residual_patterns"]
