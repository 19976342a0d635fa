"""Tolerances that are not identified, considered: what they leave uncertain at the tool.

Where only some parameters are to be found, the others are not exact: their tolerances move the
readings, which the fit explains by what it may move, and they move the tool. This is the
Schmidt-Kalman consider analysis (S. F. Schmidt, Application of state-space methods to navigation
problems, Advances in Control Systems 3 (1966) 293-340; G. J. Bierman, Factorization methods for
discrete sequential estimation, 1977, chapter 8). With J, J_c the whitened derivatives of the
readings to what was found and to the rest, S, S_c those of the tool, P, P_c what is known
beforehand, C the covariance of the fit and W its weights:

    K = -C J^T W J_c
    after  = S C S^T + (S_c + S K) P_c (S_c + S K)^T        before = S P S^T + S_c P_c S_c^T
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.calibration.acceptance import sentences
from truepose.calibration.acceptance.assessment import ROUNDING, Reason, at_worst_pose, is_kept
from truepose.calibration.acceptance.decision import Gate
from truepose.calibration.acceptance.observability import (
    covariance_root,
    project_out_instruments,
    row_covariance,
)
from truepose.calibration.acceptance.tool_uncertainty import Tool, ToolUncertainty, tool_components
from truepose.calibration.identification.fit import Fit, whitened
from truepose.calibration.identification.problem import IdentificationProblem, Prior
from truepose.calibration.identification.tool_effects import tool_effects
from truepose.calibration.identification.unknowns import Unknowns, unknowns_of
from truepose.errors import RequestError
from truepose.files.shown_units import METRIC, ShownUnits
from truepose.machine import Machine

SLIGHT = 1.05
"""If the considered tolerances raise an uncertainty by less than this, there is no warning."""

SOURCE = 0.5
"""Share of the uncertainty from which tolerances are named as its cause."""

_OF_GAIN = ("not-determined", "not-told-apart", "less-than-tolerance", "no-gain", "not-identified")
"""Codes of the reasons that a remedy is for."""


@dataclass(frozen=True, eq=False)
class Considered:
    """The tool with all tolerances, those that were identified and those that were not.

    `labels` of the latter, and `every` tolerance. `before` is None where something that moves the
    tool has no tolerance; `alone` is `after` if those not identified were exact, `part` is what
    they contribute to it.
    `relative`: without what moves the whole machine in an instrument's unknown frame.
    """

    labels: tuple[str, ...]
    every: tuple[str, ...]
    before: ToolUncertainty | None
    after: ToolUncertainty
    alone: ToolUncertainty
    part: ToolUncertainty
    relative: bool
    shown: ShownUnits = METRIC


def consider_covariance(
    machine: Machine, fitted: Fit, identify: Sequence[str], joints: Floats, placements: Floats
) -> Considered | None:
    """None where every tolerance was identified.

    `identify`: as it was asked; `joints`, `placements`: of the poses at which the tool counts, all
    of them within reach of the calibrated machine.
    """
    every = _with_unidentified(machine, fitted, identify)
    if every is None:
        return None
    count = every.n_machine
    identified = np.array([every.names.index(name) for name in fitted.unknowns.names], np.intp)
    values = np.zeros(every.count)
    values[identified] = fitted.values
    unidentified = np.setdiff1d(np.arange(count), identified)
    problem = IdentificationProblem(machine, fitted.measurements, every)
    rows = np.sqrt(fitted.weights)[:, np.newaxis] * whitened(problem, values) / fitted.birge
    effects, _ = tool_effects(machine, every, values, joints, placements)
    tool = Tool.of(effects, tool_components(machine), placements[:, :3])
    prior = np.asarray(every.prior_covariance, np.float64)[:count, :count]
    sigma: Floats = np.sqrt(np.diagonal(prior))
    relative = False
    if every.count > count:
        gauge = tool.sort(
            row_covariance(project_out_instruments(rows, count, sigma)), with_gauge=True
        ).gauge
        relative, tool = len(gauge) > 0, tool.relative(gauge)
    none = np.zeros((0, count))
    exact = np.zeros((count, fitted.unknowns.n_machine))
    exact[identified[: exact.shape[1]]] = covariance_root(
        fitted.covariance[: exact.shape[1], : exact.shape[1]]
    )
    root, part = _roots(fitted, every, rows, identified, unidentified)
    return Considered(
        tuple(every.labels[at] for at in unidentified),
        every.labels[:count],
        tool.beforehand(prior),
        tool.uncertainty(root, none),
        tool.uncertainty(exact, none),
        tool.uncertainty(part, none),
        relative,
        machine.shown,
    )


def _with_unidentified(machine: Machine, fitted: Fit, identify: Sequence[str]) -> Unknowns | None:
    """What was identified, and all tolerances that were not; None where there are none."""
    if not identify:
        return None
    try:
        every = unknowns_of(machine, fitted.measurements)
    except RequestError:  # no tolerance at all
        return None
    identified = set(fitted.unknowns.names)
    unidentified = [name for name in every.names[: every.n_machine] if name not in identified]
    if not unidentified:
        return None
    return unknowns_of(machine, fitted.measurements, [*identify, *unidentified])


def _roots(
    fitted: Fit, every: Unknowns, rows: Floats, identified: Indices, unidentified: Indices
) -> tuple[Floats, Floats]:
    """Roots (n_machine, k) of the covariance of all errors, and of what the rest makes of it.

    `rows` (m, n) of all unknowns, weighted; `found`: where those of the fit are among them.
    """
    own = fitted.unknowns
    n, count = own.n_machine, every.n_machine
    gain = fitted.covariance @ rows[:, identified].T
    response = -gain @ rows[:, unidentified]
    beforehand = covariance_root(every.prior_covariance[:count, :count])
    known = np.zeros((own.count, beforehand.shape[1]))
    known[:n] = beforehand[identified[:n]]
    held = Prior.of(own, tolerances=fitted.use_prior).rows
    of_instruments = Prior.of(own, tolerances=False).rows
    of_identified = (
        fitted.covariance @ (held.T @ (held @ known)) + response @ beforehand[unidentified]
    )
    # Readings err, and so does what was known of the instruments.
    errors = np.hstack([gain, fitted.covariance @ of_instruments.T])
    noise = np.asarray(np.linalg.qr(errors[:n].T, mode="r"), np.float64).T
    # The fit takes what was not identified for nominal: middles of bands off zero stay in it.
    middle = response[:n] @ every.prior_mean[unidentified]
    of_prior = np.zeros_like(beforehand)
    of_prior[identified[:n]], of_prior[unidentified] = of_identified[:n], beforehand[unidentified]
    of_data = np.zeros((count, noise.shape[1] + 1))
    of_data[identified[:n]] = np.column_stack([noise, middle])
    alone = covariance_root(every.prior_covariance[np.ix_(unidentified, unidentified)])
    part = np.zeros((count, alone.shape[1] + 1))
    part[identified[:n]] = np.column_stack([response[:n] @ alone, middle])
    part[unidentified, :-1] = alone
    return np.hstack([of_prior, of_data]), part


def with_considered(
    gate: Gate, considered: Considered | None, target: tuple[float | None, float | None]
) -> Gate:
    """The gate with the uncertainty that all tolerances leave, and its answer by that.

    `target`: what is asked of the tool, m and rad.
    """
    if considered is None or any(reason.code == "not-determined" for reason in gate.reasons):
        return gate
    reasons = [reason for reason in gate.reasons if reason.code != "no-gain"]
    within = _keeps_target(considered, target)
    reasons += _no_gain(considered, gate.margin, within=within)
    codes = {reason.code for reason in reasons}
    warnings = [
        warning for warning in gate.warnings if warning.code not in ("one-sided", "not-needed")
    ]
    if within and codes not in ({"no-gain"}, {"not-identified"}):
        text = (
            "the machine as filed already keeps the accuracy that is asked: "
            "calibration is not needed"
        )
        warnings.append(Reason("not-needed", text))
    if not codes & set(_OF_GAIN):
        warnings += _one_sided(considered, gate.margin)
    if "not-identified" not in codes:
        warnings += _unidentified_warning(considered)
    remedy = gate.remedy if codes & (set(_OF_GAIN) - {"not-identified"}) else None
    return replace(
        gate,
        accepted=not reasons,
        reasons=tuple(reasons),
        warnings=tuple(warnings),
        remedy=remedy,
        before=considered.before,
        after=considered.after,
        relative=gate.relative or considered.relative,
    )


def _pairs(considered: Considered) -> list[tuple[str, str, float, float]]:
    """(name, unit, after, before) of what had an uncertainty."""
    return [
        (name, unit, size, was)
        for name, unit, size, was in at_worst_pose(considered.after, considered.before)
        if was is not None and (was > 0.0 or size > 0.0)
    ]


def _no_gain(considered: Considered, margin: float, *, within: bool) -> list[Reason]:
    """The tool is not known better than before: the gate's rule, applied to all tolerances."""
    pairs = _pairs(considered)
    worse = [pair for pair in pairs if pair[2] > (1.0 + ROUNDING) * pair[3]]
    gained = any(size <= margin * was for _, _, size, was in pairs)
    if not pairs or (gained and not worse):
        return []
    texts = [
        f"{name} uncertain by {sentences.quantity(size, unit, units=considered.shown)}, against "
        f"{sentences.quantity(was, unit, units=considered.shown)} of the machine as filed"
        for name, unit, size, was in worse or pairs
    ]
    ending = "; but the machine as filed already keeps the accuracy that is asked" if within else ""
    if not _is_source(considered):
        texts[0] = texts[0].replace(" uncertain", " would be uncertain", 1)
        text = f"at the worst pose of the workspace {', and '.join(texts)}{ending}"
        return [Reason("no-gain", text)]
    text = (
        f"the tolerances that were not identified ({_named(considered)}) leave "
        f"{', and '.join(texts)}, at the worst pose of the workspace: identify them too{ending}"
    )
    return [Reason("not-identified", text)]


def _is_source(considered: Considered) -> bool:
    """Whether the tolerances that were not identified are what makes the tool uncertain."""
    pairs = zip(
        at_worst_pose(considered.part, None),
        at_worst_pose(considered.after, None),
        strict=True,
    )
    return any(size > 0.0 and part >= SOURCE * size for (*_, part, _), (*_, size, _) in pairs)


def _one_sided(considered: Considered, margin: float) -> list[Reason]:
    sizes = (
        (name, sentences.quantity(size, unit, units=considered.shown))
        for name, unit, size, was in _pairs(considered)
        if was > 0.0 and size > margin * was
    )
    return [
        Reason("one-sided", f"{name} is not known better than before, {size}")
        for name, size in sizes
    ]


def _unidentified_warning(considered: Considered) -> list[Reason]:
    """What the tolerances that were not identified add, where it is more than slight."""
    pairs = list(
        zip(
            at_worst_pose(considered.after, None),
            at_worst_pose(considered.alone, None),
            strict=True,
        )
    )
    more = [
        f"{name} would be known to {sentences.quantity(less, unit, units=considered.shown)} "
        f"instead of {sentences.quantity(size, unit, units=considered.shown)}"
        for (name, unit, size, _), (*_, less, _) in pairs
        if size > SLIGHT * less
    ]
    if not more:
        return []
    text = (
        f"{_named(considered)} were not identified and count with their tolerances: "
        f"if they were exact, {' and '.join(more)}; identify them too if this is too uncertain"
    )
    return [Reason("not-identified", text)]


def _named(considered: Considered) -> str:
    return sentences.listed(sentences.collapsed(considered.labels, considered.every))


def _keeps_target(considered: Considered, target: tuple[float | None, float | None]) -> bool:
    """Whether the machine as filed keeps what is asked."""
    before = considered.before
    return is_kept(target, (None, None) if before is None else before.worst)


__all__ = ["Considered", "consider_covariance", "with_considered"]
