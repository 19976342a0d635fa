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
from truepose.calibration.acceptance.assessment import ROUNDING, Reason, both
from truepose.calibration.acceptance.decision import Gate
from truepose.calibration.acceptance.observability import of_machine, prior_root, row_covariance
from truepose.calibration.acceptance.tool_uncertainty import Tool, ToolUncertainty
from truepose.calibration.identification.fit import Fit, whitened
from truepose.calibration.identification.problem import IdentificationProblem, Prior
from truepose.calibration.identification.tool_effects import tool_effects
from truepose.calibration.identification.unknowns import Unknowns, unknowns_of
from truepose.errors import RequestError
from truepose.files.shown_units import METRIC, ShownUnits
from truepose.machine import Machine

SLIGHT = 1.05
"""An uncertainty that the considered tolerances make less than so much larger needs no warning."""

SOURCE = 0.5
"""Of the uncertainty: tolerances that make up so much of it are named as its cause."""

_OF_GAIN = ("not-determined", "not-told-apart", "less-than-tolerance", "no-gain", "not-identified")
"""Codes of the reasons that a remedy is for."""

_ANGLES = {"rx": "a", "ry": "b", "rz": "c"}


@dataclass(frozen=True, eq=False)
class Considered:
    """The tool with all tolerances, those that were identified and those that were not.

    `labels` of the latter, and `every` tolerance. `before` is None where something that moves the
    tool has no tolerance; `alone` is `after` were the others exact, `part` what these make of it.
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
    joint = _with_the_rest(machine, fitted, identify)
    if joint is None:
        return None
    count = joint.n_machine
    found = np.array([joint.names.index(each) for each in fitted.unknowns.names], np.intp)
    values = np.zeros(joint.count)
    values[found] = fitted.values
    rest = np.setdiff1d(np.arange(count), found)
    problem = IdentificationProblem(machine, fitted.measurements, joint)
    rows = np.sqrt(fitted.weights)[:, np.newaxis] * whitened(problem, values) / fitted.birge
    effects, _ = tool_effects(machine, joint, values, joints, placements)
    components = [_ANGLES.get(name, name) for name in machine.components]
    tool = Tool.of(effects, components, placements[:, :3])
    prior = np.asarray(joint.prior_covariance, np.float64)[:count, :count]
    sigma: Floats = np.sqrt(np.diagonal(prior))
    relative = False
    if joint.count > count:
        gauge = tool.sort(row_covariance(of_machine(rows, count, sigma)), with_gauge=True).gauge
        relative, tool = len(gauge) > 0, tool.relative(gauge)
    none = np.zeros((0, count))
    before = None
    if np.isfinite(sigma[tool.moved]).all():
        before = tool.uncertainty(prior_root(prior), none)
    exact = np.zeros((count, fitted.unknowns.n_machine))
    exact[found[: exact.shape[1]]] = _root(fitted.covariance[: exact.shape[1], : exact.shape[1]])
    root, part = _roots(fitted, joint, rows, found, rest)
    return Considered(
        tuple(joint.labels[at] for at in rest),
        joint.labels[:count],
        before,
        tool.uncertainty(root, none),
        tool.uncertainty(exact, none),
        tool.uncertainty(part, none),
        relative,
        machine.shown,
    )


def _with_the_rest(machine: Machine, fitted: Fit, identify: Sequence[str]) -> Unknowns | None:
    """What was identified, and all tolerances that were not; None where there are none."""
    if not identify:
        return None
    try:
        every = unknowns_of(machine, fitted.measurements)
    except RequestError:  # no tolerance at all
        return None
    chosen = set(fitted.unknowns.names)
    left = [name for name in every.names[: every.n_machine] if name not in chosen]
    if not left:
        return None
    return unknowns_of(machine, fitted.measurements, [*identify, *left])


def _root(covariance: Floats) -> Floats:
    """(n, n) with covariance = root root^T."""
    sigma = np.sqrt(np.diagonal(covariance))
    scale = np.where(sigma > 0.0, sigma, 1.0)
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    root: Floats = scale[:, np.newaxis] * vectors * np.sqrt(np.maximum(values, 0.0))
    return root


def _roots(
    fitted: Fit, joint: Unknowns, rows: Floats, found: Indices, rest: Indices
) -> tuple[Floats, Floats]:
    """Roots (n_machine, k) of the covariance of all errors, and of what the rest makes of it.

    `rows` (m, n) of all unknowns, weighted; `found`: where those of the fit are among them.
    """
    own = fitted.unknowns
    n, count = own.n_machine, joint.n_machine
    gain = fitted.covariance @ rows[:, found].T
    follows = -gain @ rows[:, rest]
    beforehand = prior_root(joint.prior_covariance[:count, :count])
    known = np.zeros((own.count, beforehand.shape[1]))
    known[:n] = beforehand[found[:n]]
    held = Prior.of(own).rows if fitted.use_prior else np.zeros((0, own.count))
    moved = fitted.covariance @ (held.T @ (held @ known)) + follows @ beforehand[rest]
    noise = np.asarray(np.linalg.qr(gain[:n].T, mode="r"), np.float64).T
    # The fit takes what was not identified for nominal: middles of bands off zero stay in it.
    middle = follows[:n] @ joint.prior_mean[rest]
    of_prior = np.zeros_like(beforehand)
    of_prior[found[:n]], of_prior[rest] = moved[:n], beforehand[rest]
    of_data = np.zeros((count, noise.shape[1] + 1))
    of_data[found[:n]] = np.column_stack([noise, middle])
    alone = prior_root(joint.prior_covariance[np.ix_(rest, rest)])
    part = np.zeros((count, alone.shape[1] + 1))
    part[found[:n]] = np.column_stack([follows[:n] @ alone, middle])
    part[rest, :-1] = alone
    return np.hstack([of_prior, of_data]), part


def with_considered(
    gate: Gate, found: Considered | None, target: tuple[float | None, float | None]
) -> Gate:
    """The gate with what all tolerances leave uncertain, and its answer by that.

    `target`: what is asked of the tool, m and rad.
    """
    if found is None or any(each.code == "not-determined" for each in gate.reasons):
        return gate
    reasons = [each for each in gate.reasons if each.code != "no-gain"]
    within = _is_within(found, target)
    reasons += _no_gain(found, gate.margin, within=within)
    codes = {each.code for each in reasons}
    warnings = [each for each in gate.warnings if each.code not in ("one-sided", "not-needed")]
    if within and codes not in ({"no-gain"}, {"not-identified"}):
        text = "what is asked of the tool is kept without calibration: it is not needed"
        warnings.append(Reason("not-needed", text))
    if not codes & set(_OF_GAIN):
        warnings += _one_sided(found, gate.margin)
    if "not-identified" not in codes:
        warnings += _heed(found)
    remedy = gate.remedy if codes & (set(_OF_GAIN) - {"not-identified"}) else None
    return replace(
        gate,
        accepted=not reasons,
        reasons=tuple(reasons),
        warnings=tuple(warnings),
        remedy=remedy,
        before=found.before,
        after=found.after,
        relative=gate.relative or found.relative,
    )


def _pairs(found: Considered) -> list[tuple[str, str, float, float]]:
    """(name, unit, after, before) of what had an uncertainty."""
    return [
        (name, unit, size, was)
        for name, unit, size, was in both(found.after, found.before)
        if was is not None and (was > 0.0 or size > 0.0)
    ]


def _no_gain(found: Considered, margin: float, *, within: bool) -> list[Reason]:
    """The tool is not known better than before: the gate's rule, with all tolerances."""
    pairs = _pairs(found)
    worse = [each for each in pairs if each[2] > (1.0 + ROUNDING) * each[3]]
    gained = any(size <= margin * was for _, _, size, was in pairs)
    if not pairs or (gained and not worse):
        return []
    texts = [
        f"{name} uncertain by {sentences.quantity(size, unit, units=found.shown)}, against "
        f"{sentences.quantity(was, unit, units=found.shown)} of the machine as filed"
        for name, unit, size, was in worse or pairs
    ]
    ending = "; but what is asked of the tool is kept without calibration" if within else ""
    if not _is_source(found):
        texts[0] = texts[0].replace(" uncertain", " would be uncertain", 1)
        text = f"at the worst pose of the workspace {', and '.join(texts)}{ending}"
        return [Reason("no-gain", text)]
    text = (
        f"the tolerances that were not identified ({_named(found)}) leave {', and '.join(texts)}, "
        f"at the worst pose of the workspace: identify them too{ending}"
    )
    return [Reason("not-identified", text)]


def _is_source(found: Considered) -> bool:
    """Whether the tolerances that were not identified are what makes the tool uncertain."""
    pairs = zip(both(found.part, None), both(found.after, None), strict=True)
    return any(size > 0.0 and part >= SOURCE * size for (*_, part, _), (*_, size, _) in pairs)


def _one_sided(found: Considered, margin: float) -> list[Reason]:
    sizes = (
        (name, sentences.quantity(size, unit, units=found.shown))
        for name, unit, size, was in _pairs(found)
        if was > 0.0 and size > margin * was
    )
    return [
        Reason("one-sided", f"{name} is not known better than before, {size}")
        for name, size in sizes
    ]


def _heed(found: Considered) -> list[Reason]:
    """What the tolerances that were not identified add, where it is more than slight."""
    pairs = list(zip(both(found.after, None), both(found.alone, None), strict=True))
    more = [
        f"{name} would be known to {sentences.quantity(less, unit, units=found.shown)} in place of "
        f"{sentences.quantity(size, unit, units=found.shown)}"
        for (name, unit, size, _), (*_, less, _) in pairs
        if size > SLIGHT * less
    ]
    if not more:
        return []
    text = (
        f"{_named(found)} were not identified and count with their tolerances: "
        f"were they exact, {' and '.join(more)}; identify them too if that is too much"
    )
    return [Reason("not-identified", text)]


def _named(found: Considered) -> str:
    return sentences.listed(sentences.collapsed(found.labels, found.every))


def _is_within(found: Considered, target: tuple[float | None, float | None]) -> bool:
    """Whether the machine as filed keeps what is asked."""
    before = found.before
    was = (None, None) if before is None else (before.position_max, before.rotation_max)
    pairs = [(asked, size) for asked, size in zip(target, was, strict=True) if asked is not None]
    return bool(pairs) and all(size is not None and size <= asked for asked, size in pairs)


__all__ = ["Considered", "consider_covariance", "with_considered"]
