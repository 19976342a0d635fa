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
from truepose.calibration.acceptance.assessment import Case, Direction
from truepose.calibration.acceptance.decision import (
    MARGIN,
    above_noise,
    decide,
    gain_is_asked,
    is_turned_by_measuring,
    lacking,
)
from truepose.calibration.acceptance.observability import Observability, share
from truepose.calibration.acceptance.reasons import (
    WRONG_DATA,
    HeldOut,
    Reason,
    at_worst_pose,
    gain_sentence,
    left_out_of,
    open_clauses,
    verdict_sentences,
)
from truepose.calibration.acceptance.remedy import (
    CALIPER,
    Candidate,
    Remedy,
    cheapest_remedy,
    direct_candidates,
)
from truepose.calibration.acceptance.tool_uncertainty import Considered, Tool, ToolUncertainty
from truepose.files.shown_units import METRIC, ShownUnits
from truepose.representation import Facts, Represented

if TYPE_CHECKING:
    from truepose.calibration.data_checks import Suspicion
    from truepose.calibration.identification.unknowns import Unknowns


@dataclass(frozen=True, eq=False, repr=False)
class Gate(Represented):
    """The verdict with its evidence. Arrays of unknowns (n_machine,) are of the machine's.

    `standard_data`: from the data alone, inf where they leave an unknown open; `standard`: with
    the prior if it was used; both with the data's uncertainties multiplied by `birge`. `share`: how
    much came from the data. `before` and `after`: standard uncertainty at the tool; `before` is
    None where an unknown has no prior. `relative`: without what moves the whole machine in an
    instrument's unknown frame. `rms`: of the normalised residuals, over the degrees of freedom.
    """

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
    def accepted(self) -> bool:
        """Whether the calibration may be used: nothing speaks against it."""
        return not self.reasons

    @property
    def answer(self) -> str:
        """Yes with what is gained, or no with the reasons."""
        before = (None, None) if self.before is None else self.before.within
        falling = (held for held in self.held_out if above_noise(held) and held.after < held.before)
        gain = gain_sentence(
            at_worst_pose(self.after.within, before),
            left_out_of(self.after, self.relative),
            next(falling, None),
            self.shown,
        )
        return verdict_sentences(self.reasons, gain)

    @property
    def words(self) -> str:
        """The verdict in a few sentences: the answer, the remedy, the warnings."""
        parts = [self.answer]
        if all(reason.code != WRONG_DATA for reason in self.reasons):
            if self.remedy is not None:
                parts.append(f"{sentences.sentence(self.remedy.sentence)}.")
            parts += [f"{sentences.sentence(warning.sentence)}." for warning in self.warnings]
        return " ".join(parts)


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
    commanded: Sequence[str] | None = None,
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
    considered: Considered | None = None,
    suspicions: Iterable[Suspicion] = (),
    failure: str | None = None,
) -> Gate:
    """The verdict on fitted `values` (n,).

    `jacobian` (m, n), `residual` (m,) and `before` (m,) are divided by the uncertainties, before
    robust `weights` (m,). `tool` (n_pose, n_component, n_machine): d(error of the tool)/d(unknown)
    over the workspace, where the fitted machine is commanded to, base frame, components among
    x y z a b c, of which those `commanded` (default all) are promised; `positions` (n_pose, 3), m,
    of the tool point, without which moves of the whole machine are not recognised.
    `by`: the instruments' phrases. `nominal` (n_machine,): the parameter that an unknown moves
    most, NaN where it should not be shown. `measured`: root mean square of the tool's errors
    measured before, m and
    rad, which stands in where an unknown has no prior. `target`: what is asked at the tool,
    standard uncertainty in m and rad. `candidates`: measurements that could be added; each unknown
    in a unit of `direct` can also be measured by itself, for `remedy.EASY` or `remedy.HARD`.

    `noise`: scale of the residuals in stated uncertainties, and their degrees of freedom, where
    the fit found them. `considered`: the tool with the tolerances that were not identified.
    `suspicions`: mistakes that the measurements look like. `failure`: why no fit was found, if none
    was; the values are then those of the machine as filed.

    Raises `ValueError` for arrays whose shapes do not fit.
    """
    case = Case.of(
        unknowns,
        values=np.asarray(values, np.float64),
        jacobian=np.asarray(jacobian, np.float64),
        residual=np.asarray(residual, np.float64),
        weights=np.ones(np.shape(residual)) if weights is None else np.asarray(weights, float),
        use_prior=use_prior,
        tool=Tool.of(tool, components, positions, commanded),
        by=sentences.by_phrase(by),
        nominal=_or_nan(nominal, unknowns.n_machine),
        measured=measured,
        target=target,
        margin=margin,
        held_out=tuple(held_out),
        noise=noise,
    )
    alone = case.outcome()
    outcome = alone.with_considered(considered)
    reasons, warnings = decide(case, outcome, tuple(suspicions), failure)
    remedy = None
    if lacking(case, alone) and is_turned_by_measuring(reasons) and gain_is_asked(case, outcome):
        remedy = cheapest_remedy(case, [*candidates, *direct_candidates(unknowns, direct)])
    first = np.asarray(before, np.float64)
    return Gate(
        margin=margin,
        reasons=reasons,
        warnings=warnings,
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
        sentences=tuple(open_clauses(case.open(*outcome.open))),
        before=outcome.before,
        after=outcome.after,
        relative=outcome.relative,
        rms_before=float(np.sqrt(np.mean(first**2))) if first.size else float("nan"),
        rms=case.rms,
        birge=case.birge,
        degrees_of_freedom=case.degrees,
        held_out=case.held_out,
        shown=unknowns.shown,
    )


def _or_nan(values: ArrayLike | None, n: int) -> Floats:
    if values is None:
        return np.full(n, np.nan)
    array = np.asarray(values, np.float64)
    if array.shape != (n,):
        raise ValueError(f"the nominal values have shape {array.shape}, expected ({n},)")
    return array


__all__ = ["Gate", "assess"]
