"""The gate: whether a calibration may be used, why not, and what to measure so that it may.

Least squares finds a best machine for any measurements, also for those that hundreds of machines
explain equally well. The gate looks at what the measurements determine, at how well the tool is
then known over the whole workspace, and at whether the values found are plausible; its answer is
yes or no, with reasons.
Arrays only; `docs/calibration_gate.md` has formulas, thresholds and references.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from truepose.arrays import Floats
from truepose.calibration.acceptance import sentences
from truepose.calibration.acceptance.assessment import (
    Case,
    Direction,
    Outcome,
    Reason,
    at_worst_pose,
)
from truepose.calibration.acceptance.observability import Observability, share
from truepose.calibration.acceptance.remedy import (
    CALIPER,
    Candidate,
    Remedy,
    cheapest_remedy,
    direct_candidates,
)
from truepose.calibration.acceptance.tool_uncertainty import Tool, ToolUncertainty
from truepose.files.shown_units import METRIC, ShownUnits
from truepose.representation import Facts, Represented

if TYPE_CHECKING:
    from truepose.calibration.identification.unknowns import Unknowns


MARGIN = 0.8
"""What is left of an uncertainty or error must be less than this of what it was."""
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


@dataclass(frozen=True)
class HeldOut:
    """Root mean square of errors at poses that were not fitted, before and after, and its noise.

    All in `unit` ("m", "rad"), or normalised by the uncertainties ("1", noise 1). `consistent`:
    the error after is no larger than the fit promises for these poses, which then say nothing
    against it: where it promises little, what it knows of the tool shows that.
    """

    before: float
    after: float
    noise: float = 1.0
    unit: str = "1"
    consistent: bool = False


@dataclass(frozen=True, eq=False, repr=False)
class Gate(Represented):
    """The verdict with its evidence. Arrays of unknowns (n_machine,) are of the machine's.

    `standard_data`: from the data alone, inf where they leave an unknown open; `standard`: with
    the prior if it was used; both with the data's uncertainties multiplied by `birge`. `share`: how
    much came from the data. `before` and `after`: standard uncertainty at the tool; `before` is
    None where an unknown has no prior. `relative`: without what moves the whole machine in an
    instrument's unknown frame. `rms`: of the normalised residuals, over the degrees of freedom.
    """

    accepted: bool
    margin: float
    reasons: tuple[Reason, ...]
    warnings: tuple[Reason, ...]
    remedy: Remedy | None
    names: tuple[str, ...]
    labels: tuple[str, ...]
    units: tuple[str, ...]
    values: Floats
    standard_data: Floats
    standard: Floats
    standard_prior: Floats
    share: Floats
    observability: Observability
    directions: tuple[Direction, ...]
    sentences: tuple[str, ...]
    before: ToolUncertainty | None
    after: ToolUncertainty
    relative: bool
    rms_before: float
    rms: float
    birge: float
    degrees_of_freedom: float
    held_out: tuple[HeldOut, ...] = ()
    shown: ShownUnits = METRIC

    def _facts(self) -> Facts:
        yield "accepted", self.accepted
        yield "unknowns", len(self.names)
        yield "determined by the data", self.rank
        yield "reasons", [reason.code for reason in self.reasons]
        yield "warnings", [warning.code for warning in self.warnings]
        yield "verdict", self.words

    @property
    def rank(self) -> int:
        """How many of the machine's unknowns the data determine."""
        return self.observability.rank

    @property
    def n_null(self) -> int:
        """How many directions they do not see at all."""
        return self.observability.n_null

    @property
    def words(self) -> str:
        """The verdict in a few sentences."""
        clauses = [reason.sentence for reason in self.reasons]
        if self.accepted:
            clauses = [self._gain()]
        parts = [f"{'Yes' if self.accepted else 'No'}: {'; '.join(clauses)}."]
        if self.remedy is not None:
            parts.append(f"{sentences.sentence(self.remedy.sentence)}.")
        parts += [f"{sentences.sentence(warning.sentence)}." for warning in self.warnings]
        return " ".join(parts)

    def _gain(self) -> str:
        texts = []
        for name, unit, after, before in at_worst_pose(self.after, self.before):
            if after == 0.0 and not before:
                continue
            known = sentences.quantity(after, unit, units=self.shown)
            was = "" if before is None else sentences.quantity(before, unit, units=self.shown)
            texts.append(
                f"{name} becomes known to {known} at the worst pose"
                + (f", against {was} before" if was else "")
            )
        falling = [
            "on poses that were not fitted the error falls from "
            f"{_shown(check, check.before, self.shown)} to {_shown(check, check.after, self.shown)}"
            for check in self.held_out
            if check.before > ABOVE_NOISE * check.noise and check.after < check.before
        ]
        return "; ".join([*(texts or ["the unknowns are determined"]), *falling[:1]])


def assess(
    unknowns: Unknowns,
    *,
    values: ArrayLike,
    jacobian: ArrayLike,
    residual: ArrayLike,
    before: ArrayLike,
    use_prior: bool,
    tool: ArrayLike,
    components: Sequence[str],
    positions: ArrayLike | None = None,
    weights: ArrayLike | None = None,
    by: Iterable[str] = (),
    nominal: ArrayLike | None = None,
    measured: tuple[float | None, float | None] = (None, None),
    held_out: Iterable[HeldOut] = (),
    target: tuple[float | None, float | None] = (None, None),
    candidates: Iterable[Candidate] = (),
    direct: Mapping[str, float] = CALIPER,
    margin: float = MARGIN,
    noise: tuple[float, float] | None = None,
) -> Gate:
    """The verdict on fitted `values` (n,).

    `jacobian` (m, n), `residual` (m,) and `before` (m,) are divided by the uncertainties, before
    robust `weights` (m,). `tool` (n_pose, n_component, n_machine): d(error of the tool)/d(unknown)
    over the workspace, at the fitted values, base frame, components among x y z a b c; `positions`
    (n_pose, 3), m, of the tool point, without which moves of the whole machine are not recognised.
    `by`: the instruments' phrases. `nominal` (n_machine,): the parameter that an unknown moves
    most, NaN where it should not be shown. `measured`: root mean square of the tool's errors
    measured before, m and
    rad, which stands in where an unknown has no prior. `target`: what is asked at the tool,
    standard uncertainty in m and rad. `candidates`: measurements that could be added; each unknown
    in a unit of `direct` can also be measured by itself, for `remedy.EASY` or `remedy.HARD`.

    `noise`: scale of the residuals in stated uncertainties, and their degrees of freedom, where
    the fit found them.

    Raises `ValueError` for arrays whose shapes do not fit.
    """
    case = Case.of(
        unknowns,
        values=np.asarray(values, np.float64),
        jacobian=np.asarray(jacobian, np.float64),
        residual=np.asarray(residual, np.float64),
        weights=np.ones(np.shape(residual)) if weights is None else np.asarray(weights, float),
        use_prior=use_prior,
        tool=Tool.of(tool, components, positions),
        by=sentences.by_phrase(by),
        nominal=_or_nan(nominal, unknowns.n_machine),
        measured=measured,
        target=target,
        margin=margin,
        noise=noise,
    )
    outcome = case.outcome()
    held = tuple(held_out)
    reasons = [*outcome.reasons, *_not_confirmed(held, margin, unknowns.shown)]
    reasons += _absurd_values(case, outcome)
    reasons += _contradicts_noise(case)
    warnings = _warnings(case, outcome)
    remedy = None
    if outcome.reasons and not case.lacks_only_gain(outcome):
        remedy = cheapest_remedy(case, [*candidates, *direct_candidates(unknowns, direct)])
    first = np.asarray(before, np.float64)
    return Gate(
        accepted=not reasons,
        margin=margin,
        reasons=tuple(reasons),
        warnings=tuple(warnings),
        remedy=remedy,
        names=unknowns.names[: case.n],
        labels=case.labels,
        units=unknowns.units[: case.n],
        values=case.values[: case.n],
        standard_data=outcome.data.standard(),
        standard=outcome.used.standard(),
        standard_prior=case.sigma,
        share=share(outcome.used.standard(), case.sigma, use_prior=use_prior),
        observability=case.observability,
        directions=outcome.directions,
        sentences=outcome.sentences,
        before=outcome.before,
        after=outcome.after,
        relative=outcome.relative,
        rms_before=float(np.sqrt(np.mean(first**2))) if first.size else float("nan"),
        rms=case.rms,
        birge=case.birge,
        degrees_of_freedom=case.degrees,
        held_out=held,
        shown=unknowns.shown,
    )


def _not_confirmed(held: Iterable[HeldOut], margin: float, units: ShownUnits) -> list[Reason]:
    """(c): poses that were not fitted do not confirm the fit."""
    reasons = []
    for check in held:
        above = check.before > ABOVE_NOISE * check.noise and check.after > margin * check.before
        if above and not check.consistent:
            was, now = (_shown(check, size, units) for size in (check.before, check.after))
            change = f"falls from {was} to {now} only"
            if check.after >= check.before:
                change = f"does not fall: {was} before, {now} after"
            reasons.append(
                Reason(
                    "not-confirmed",
                    f"on poses that were not fitted the error {change}, though "
                    + (
                        "that is above the noise"
                        if check.unit == "1"
                        else f"the noise is {_shown(check, check.noise, units)}"
                    ),
                )
            )
    return reasons


def _absurd_values(case: Case, outcome: Outcome) -> list[Reason]:
    """(d): values far outside of the tolerances."""
    n = case.n
    off = case.values[:n] - np.asarray(case.unknowns.prior_mean, np.float64)[:n]
    own = outcome.used.standard()
    off = np.where(np.isfinite(off), off, 0.0)
    band = np.where(np.isfinite(case.half), case.half, 0.0)
    size = np.abs(off)
    beyond = (size > OFF_PRIOR * case.sigma) & (size > OFF_OWN * own) & (size > band)
    ratio = size / np.where(np.isfinite(case.sigma), case.sigma, 1.0)
    at = [int(i) for i in np.argsort(-ratio, kind="stable") if beyond[i]]
    if not at:
        return []
    text = _absurd_sentence(case, at[0], float(off[at[0]]))
    more = sentences.collapsed([case.labels[i] for i in sorted(at[1:])], case.labels)
    if more:
        text += f"; {sentences.listed(more)} would be off too"
    return [Reason("absurd-value", text)]


def _absurd_sentence(case: Case, at: int, off: float) -> str:
    unit, units = case.unknowns.units[at], case.unknowns.shown
    nominal, half = float(case.nominal[at]), float(case.half[at])
    would = ""
    if np.isfinite(nominal):
        would = f"{sentences.quantity(nominal + float(case.values[at]), unit, 4, units)}, "
    times = abs(off) / (half if np.isfinite(half) else float(case.sigma[at]))
    what = "its tolerance" if np.isfinite(half) else "the standard deviation of its tolerance"
    return (
        f"{case.labels[at]} would be {would}{sentences.quantity(abs(off), unit, 3, units)} off its "
        f"drawing, {sentences.times(times)} times {what}"
    )


def _contradicts_noise(case: Case) -> list[Reason]:
    if not case.rms > CONTRADICTED:
        return []
    return [
        Reason(
            "contradicts-noise",
            "the measurements differ from the calibrated machine "
            f"{sentences.times(case.rms)} times as much as their uncertainties "
            "allow: the model, the data or the uncertainties are wrong",
        )
    ]


def _warnings(case: Case, outcome: Outcome) -> list[Reason]:
    warnings = []
    if case.degrees < 0.5:
        text = (
            "there are no more readings than unknowns, so the stated uncertainties cannot be "
            "checked"
        )
        warnings.append(Reason("noise-unchecked", text))
    elif case.rms <= CONTRADICTED and _unlikely(case) > UNLIKELY:
        text = (
            f"the residuals are {sentences.times(case.rms)} times as large as the stated "
            "uncertainties, which have been multiplied by this factor"
        )
        warnings.append(Reason("noise-too-small", text))
    elif _unlikely(case) < -UNLIKELY:
        text = (
            f"the residuals are only {sentences.times(case.rms)} times the stated uncertainties, "
            "which seem too large"
        )
        warnings.append(Reason("noise-too-large", text))
    if case.use_prior and outcome.sentences and not outcome.reasons:
        text = (
            f"{'; '.join(outcome.sentences)}: what is stated for these rests on their tolerances, "
            "not on the measurements"
        )
        warnings.append(Reason("rests-on-tolerances", text))
    gauge = [direction for direction in outcome.directions if direction.kind == "gauge"]
    if gauge:
        text = (
            "where the machine as a whole stands in the instrument's frame is not determined, "
            "which does not affect its accuracy: the uncertainties at the tool leave it out"
        )
        warnings.append(Reason("gauge", text))
    if outcome.before is None and case.measured[0] is None and case.measured[1] is None:
        text = (
            "not every unknown has a tolerance, and no error was measured before: "
            "nothing shows that the machine becomes better"
        )
        warnings.append(Reason("nothing-to-compare", text))
    if case.keeps_target(outcome.before) and not case.lacks_only_gain(outcome):
        text = (
            "the machine as filed already keeps the accuracy that is asked: "
            "calibration is not needed"
        )
        warnings.append(Reason("not-needed", text))
    if not outcome.reasons:
        pairs = zip(at_worst_pose(outcome.after, None), case.reference(outcome.before), strict=True)
        units = case.unknowns.shown
        for (name, unit, size, _), was in pairs:
            if was is not None and was > 0.0 and size > case.margin * was:
                known = sentences.quantity(size, unit, units=units)
                text = f"{name} is not known better than before, {known}"
                warnings.append(Reason("one-sided", text))
    return warnings


def _unlikely(case: Case) -> float:
    """Standard normal deviate of the chi-square of the residuals (Wilson & Hilferty 1931)."""
    if case.degrees < 0.5:
        return 0.0
    part = 2.0 / (9.0 * case.degrees)
    return float((np.cbrt(case.rms**2) - (1.0 - part)) / np.sqrt(part))


def _shown(held: HeldOut, value: float, units: ShownUnits) -> str:
    if held.unit == "1":
        return f"{sentences.times(value)} times the noise"
    return sentences.quantity(value, held.unit, units=units)


def _or_nan(values: ArrayLike | None, n: int) -> Floats:
    if values is None:
        return np.full(n, np.nan)
    array = np.asarray(values, np.float64)
    if array.shape != (n,):
        raise ValueError(f"the nominal values have shape {array.shape}, expected ({n},)")
    return array


__all__ = ["Candidate", "Gate", "HeldOut", "Reason", "Remedy", "assess"]
