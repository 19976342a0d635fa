"""The decision: from the evidence to the reasons against a calibration, and to warnings.

Every rule by which a calibration is refused stands here; `docs/calibration_gate.md` has them as a
table. What a rule finds is a `Reason`: a code and values, which are put into words elsewhere.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from truepose.calibration.acceptance.assessment import Case, Outcome
from truepose.calibration.acceptance.reasons import (
    OPEN_CHOICE,
    WRONG_DATA,
    HeldOut,
    Reason,
    ToolSize,
    at_worst_pose,
)

if TYPE_CHECKING:
    from truepose.calibration.data_checks import Suspicion

MARGIN = 0.8
"""What is left of an uncertainty or error must be less than this of what it was."""
LEAST_SHARE = 0.5
"""Of the tool's variance that the data must take away where held-out rows show no gain."""
ABOVE_NOISE = 2.0
"""An error on held-out poses can be made smaller if it is so many times the noise."""
OFF_PRIOR = 4.0
"""Prior standard deviations beyond which a value is off its tolerance ..."""
OFF_OWN = 3.0
"""... if it is so many of its own standard uncertainties, too."""
CONTRADICTED = 5.0
"""Root mean square of the normalised residuals from which the model is refused."""
UNLIKELY = 3.29
"""Standard normal deviate of a chi-square that one data set in a thousand exceeds."""
ROUNDING = 1e-6
"""Relative: an uncertainty that is larger by no more than this is not larger."""
SLIGHT = 1.05
"""If the considered tolerances raise an uncertainty by less than this, there is no warning."""
SOURCE = 0.5
"""Share of the uncertainty from which the considered tolerances are named as its cause."""


def decide(
    case: Case,
    outcome: Outcome,
    suspicions: Sequence[Suspicion],
    failure: str | None = None,
) -> tuple[tuple[Reason, ...], tuple[Reason, ...]]:
    """The reasons against the calibration, none: it may be used; and warnings.

    `failure`: why no machine was found that explains the data.
    """
    of_data = lacking(case, outcome)
    refusing = [suspicion for suspicion in suspicions if suspicion.refuses]
    wrong = _suspected(case, refusing)
    if failure is not None:  # there is nothing else to be judged
        return (*wrong, case.reason("no-fit", failure=failure)), ()
    nowhere = len(case.tool.effects) == 0
    reasons = [
        *wrong,
        *([case.reason("out-of-reach")] if nowhere else []),
        *of_data,
        *_not_confirmed(case),
        *_absurd_value(case, outcome),
        *_contradicts_noise(case),
    ]
    warnings = [
        *_noise(case),
        *([] if of_data else _rests_on_tolerances(case, outcome)),
        *_plain_warnings(case, outcome),
        *([] if of_data else _one_sided(case, outcome)),
        *_considered(case, outcome, of_data),
    ]
    return tuple(reasons), tuple(warnings)


def _suspected(case: Case, refusing: Sequence[Suspicion]) -> list[Reason]:
    """That the data look wrong, and that they could be others."""
    by_code: dict[str, list[str]] = {}
    for suspicion in refusing:
        code = OPEN_CHOICE if suspicion.code == OPEN_CHOICE else WRONG_DATA
        by_code.setdefault(code, []).append(suspicion.sentence)
    return [
        case.reason(code, suspected=tuple(by_code[code]))
        for code in (WRONG_DATA, OPEN_CHOICE)
        if code in by_code
    ]


def lacking(case: Case, outcome: Outcome) -> list[Reason]:
    """What speaks against it for want of knowledge, which further measurements bring."""
    reasons = []
    if len(outcome.moving):
        reasons.append(case.reason("not-determined", **case.open((outcome.moving, False))))
    if not case.use_prior:
        if len(outcome.weak):
            weak = case.open((outcome.weak, outcome.within))
            reasons.append(case.reason("not-told-apart", **weak))
        reasons += _less_than_tolerance(case, outcome)
    if not len(outcome.moving):
        reasons += _no_gain(case, outcome) or _gain_unconfirmed(case, outcome)
    return reasons


def gain_is_asked(case: Case, outcome: Outcome) -> bool:
    """Whether more is lacking than a gain that the accuracy asked does without."""
    codes = {reason.code for reason in lacking(case, outcome)}
    only = len(codes) == 1 and codes <= {"no-gain", "gain-unconfirmed", "not-identified"}
    return not (only and case.keeps_target(outcome))


def is_turned_by_measuring(reasons: Iterable[Reason]) -> bool:
    """Whether one of the reasons is what further measurements are for."""
    codes = {
        "not-determined",
        "not-told-apart",
        "less-than-tolerance",
        "no-gain",
        "gain-unconfirmed",
    }
    return any(reason.code in codes for reason in reasons)


def above_noise(held: HeldOut) -> bool:
    """Whether the error at held-out poses could be made smaller."""
    return held.before > ABOVE_NOISE * held.noise


# --- reasons against it ---------------------------------------------------------------------------


def _less_than_tolerance(case: Case, outcome: Outcome) -> list[Reason]:
    """What is found is less certain than what was known of it before."""
    # Without the parts in null directions, of which those that matter are a reason of their
    # own, and without those that do nothing at the tool.
    variance = np.einsum("ij,ij->i", outcome.data.root, outcome.data.root)
    left = np.maximum(variance - (outcome.still**2).sum(axis=0), 0.0)
    own = np.sqrt(np.where(left > ROUNDING * variance, left, 0.0))
    with np.errstate(invalid="ignore"):
        ratio = np.where(np.isfinite(case.sigma), own / case.sigma, 0.0)
    loose = [int(i) for i in np.argsort(-ratio, kind="stable") if ratio[i] > 1.0]
    return [
        case.reason(
            "less-than-tolerance",
            label=case.labels[at],
            unit=case.unknowns.units[at],
            uncertainty=float(own[at]),
            half=float(case.half[at]),
            deviation=float(case.sigma[at]),
            others=len(loose) - 1,
        )
        for at in loose[:1]
    ]


def _no_gain(case: Case, outcome: Outcome) -> list[Reason]:
    """The tool is not known better than before; by which tolerances, where some were left out."""
    sizes = case.sizes(outcome)
    worse = [size for size in sizes if size.after > (1.0 + ROUNDING) * (size.before or 0.0)]
    gained = any(size.after <= case.margin * (size.before or 0.0) for size in sizes)
    if not sizes or (gained and not worse):
        return []
    values = {"sizes": worse or sizes, "kept": case.keeps_target(outcome)}
    left_out = outcome.considered
    if left_out is None:
        return [case.reason("no-gain", measured=outcome.before is None, **values)]
    parts = zip(
        at_worst_pose(left_out.part.worst), at_worst_pose(left_out.after.worst), strict=True
    )
    if not any(whole.after > 0.0 and part.after >= SOURCE * whole.after for part, whole in parts):
        return [case.reason("no-gain", measured=False, **values)]
    return [case.reason("not-identified", labels=left_out.labels, every=left_out.every, **values)]


def _gain_unconfirmed(case: Case, outcome: Outcome) -> list[Reason]:
    """Little is gained in what is commanded, and rows that were not fitted do not show it.

    Of a machine that was good before such rows are explained no better by a good calibration
    either, which then has taken away most of the tool's variance.
    """
    share = case.gained_share(outcome)
    if not case.held_out or any(held.after < held.before for held in case.held_out):
        return []
    if not share < LEAST_SHARE:
        return []
    return [
        case.reason(
            "gain-unconfirmed",
            share=share,
            held_out=case.held_out[0],
            kept=case.keeps_target(outcome),
        )
    ]


def _not_confirmed(case: Case) -> list[Reason]:
    """Poses that were not fitted do not confirm the fit."""
    return [
        case.reason("not-confirmed", held_out=held)
        for held in case.held_out
        if above_noise(held) and held.after > case.margin * held.before and not held.consistent
    ]


def _absurd_value(case: Case, outcome: Outcome) -> list[Reason]:
    """Values far outside of the tolerances."""
    off = case.values[: case.n] - np.asarray(case.unknowns.prior_mean, np.float64)[: case.n]
    off = np.where(np.isfinite(off), off, 0.0)
    own, size = outcome.used.standard(), np.abs(off)
    band = np.where(np.isfinite(case.half), case.half, 0.0)
    beyond = (size > OFF_PRIOR * case.sigma) & (size > OFF_OWN * own) & (size > band)
    ratio = size / np.where(np.isfinite(case.sigma), case.sigma, 1.0)
    absurd = [int(i) for i in np.argsort(-ratio, kind="stable") if beyond[i]]
    return [
        case.reason(
            "absurd-value",
            label=case.labels[at],
            unit=case.unknowns.units[at],
            value=float(case.nominal[at] + case.values[at]),
            off=float(off[at]),
            half=float(case.half[at]),
            deviation=float(case.sigma[at]),
            others=[case.labels[i] for i in sorted(absurd[1:])],
            every=case.labels,
        )
        for at in absurd[:1]
    ]


def _contradicts_noise(case: Case) -> list[Reason]:
    return [case.reason("contradicts-noise", rms=case.rms)] if case.rms > CONTRADICTED else []


# --- warnings -------------------------------------------------------------------------------------


def _noise(case: Case) -> list[Reason]:
    """What the residuals say of the stated uncertainties."""
    if case.degrees < 0.5:
        return [case.reason("noise-unchecked")]
    unlikely = _unlikely(case)
    if case.rms <= CONTRADICTED and unlikely > UNLIKELY:
        return [case.reason("noise-too-small", rms=case.rms)]
    return [case.reason("noise-too-large", rms=case.rms)] if unlikely < -UNLIKELY else []


def _unlikely(case: Case) -> float:
    """Standard normal deviate of the chi-square of the residuals (Wilson & Hilferty 1931)."""
    part = 2.0 / (9.0 * case.degrees)
    return float((np.cbrt(case.rms**2) - (1.0 - part)) / np.sqrt(part))


def _rests_on_tolerances(case: Case, outcome: Outcome) -> list[Reason]:
    if not (case.use_prior and (len(outcome.unseen) or len(outcome.weak))):
        return []
    return [case.reason("rests-on-tolerances", **case.open(*outcome.open))]


def _plain_warnings(case: Case, outcome: Outcome) -> list[Reason]:
    known = outcome.before is not None or any(size is not None for size in case.measured)
    flags = {
        "gauge": any(direction.kind == "gauge" for direction in outcome.directions),
        "nothing-to-compare": not known,
        "not-needed": case.keeps_target(outcome) and gain_is_asked(case, outcome),
    }
    return [case.reason(code) for code, warned in flags.items() if warned]


def _one_sided(case: Case, outcome: Outcome) -> list[Reason]:
    """Position or rotation is known no better."""
    return [
        case.reason("one-sided", size=size)
        for size in case.sizes(outcome)
        if size.before and size.after > case.margin * size.before
    ]


def _considered(case: Case, outcome: Outcome, of_data: Sequence[Reason]) -> list[Reason]:
    """What the tolerances that were not identified add, where it is more than slight."""
    left_out = outcome.considered
    if left_out is None or any(reason.code == "not-identified" for reason in of_data):
        return []
    exact = [
        ToolSize(alone.quantity, alone.unit, alone.after, whole.after)
        for alone, whole in zip(
            at_worst_pose(left_out.alone.worst), at_worst_pose(left_out.after.worst), strict=True
        )
        if whole.after > SLIGHT * alone.after
    ]
    if not exact:
        return []
    return [
        case.reason("not-identified", labels=left_out.labels, every=left_out.every, exact=exact)
    ]


__all__ = ["MARGIN", "decide", "lacking"]
