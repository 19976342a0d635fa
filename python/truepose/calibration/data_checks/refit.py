"""What the data show as well: suppositions under which another machine explains them no worse.

Heights of a bed, all taken at one commanded height, are explained with the wrong sign too, and by
a machine that makes the bed twice as bad. After a fit, the hypotheses about what was read are
therefore fitted as well. One that leaves no larger a sum of squares, and moves the tool beyond what
is stated of it, is named with the row that would settle it. The same hypotheses are tried where no
machine explains the data, or only badly: wide tolerances hide a blunder before the fit, not in it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.calibration.acceptance.observability import covariance_root
from truepose.calibration.acceptance.tool_uncertainty import Tool
from truepose.calibration.data_checks._base import (
    ALLOWED,
    REDUNDANT,
    Hypothesis,
    HypothesisKind,
    Suspicion,
    View,
)
from truepose.calibration.data_checks.expected_residual import expected_residual
from truepose.calibration.identification.fit import Fit, fit
from truepose.calibration.identification.problem import IdentificationProblem, Prior
from truepose.calibration.identification.robust import HUBER
from truepose.calibration.identification.unknowns import Unknowns
from truepose.calibration.measurements import Measurements
from truepose.calibration.measurements.arrays import joined
from truepose.errors import RequestError
from truepose.machine import Machine
from truepose.runs.poses import OK

AS_WELL = 16.0
"""Sums of squares, in those of the noise, that differ by less are alike: four standard deviations,
a likelihood ratio of 3000."""

FEW_ROWS = 24
"""Rows on which hypotheses are looked at first; one that these refute is refuted."""

COVERAGE = 2.0
"""Standard uncertainties of the tool beyond which it would be elsewhere."""

MOST_NAMED = 3
"""Suppositions that are written out."""

MOST_FITTED = 20
"""Hypotheses, those nearest to the data, that are fitted where nothing explains these."""

EXPLAINED = 2.0
"""Residuals, in stated uncertainties, up to which a fit explains what no other does ..."""

BETTER = 3.0
"""... if it leaves so many times less than the data as given."""


@dataclass(frozen=True, eq=False)
class Refit:
    """How the data were fitted, so that others may be: `unknowns`, and whether tolerances count."""

    machine: Machine
    data: Measurements
    unknowns: Unknowns
    use_prior: bool

    def under(self, supposed: _Supposition, data: Measurements | None = None) -> Fit | None:
        """The fit of the data as they would be; None where no machine explains them."""
        changed = supposed.applied(self.data if data is None else data)
        try:
            return fit(self.machine, changed, self.unknowns, use_prior=self.use_prior)
        except RequestError:
            return None


@dataclass(frozen=True, eq=False)
class _Supposition:
    """A hypothesis about the readings of instrument `number`, of which there is a `view`."""

    number: int
    kind: HypothesisKind
    hypothesis: Hypothesis
    view: View

    @property
    def of_all_numbers(self) -> bool:
        """Whether all that was read would be of another sign or size, not only which is which."""
        whole = len(self.hypothesis.where) == len(self.view.columns)
        return whole and self.kind.of_readings == "numbers"

    def applied(self, data: Measurements) -> Measurements:
        """All data as they would be."""
        rows, kept = self.hypothesis.supposed.rows, self.hypothesis.kept
        own = self.view.observations
        taken = own if kept is None else own[kept]
        value, uncertainty = data.value.copy(), data.uncertainty.copy()
        value[taken], uncertainty[taken] = rows.value, rows.uncertainty
        of_instrument = data.instrument == self.number
        joints, placements = data.joints.copy(), data.placements.copy()
        joints[of_instrument], placements[of_instrument] = rows.joints, rows.placements
        stays = np.ones(data.n_observation, np.bool_)
        stays[np.setdiff1d(own, taken)] = False
        return replace(
            data,
            joints=joints,
            placements=placements,
            row=data.row[stays],
            observable=data.observable[stays],
            strut=data.strut[stays],
            value=value[stays],
            uncertainty=uncertainty[stays],
        )


def alternatives(
    refit: Refit,
    fitted: Fit,
    tool: Tool,
    poses: Floats,
    kinds: Sequence[HypothesisKind],
) -> tuple[Suspicion, ...]:
    """Suppositions that the data fit as well as what was supposed; one suspicion an instrument.

    Where the data themselves, whatever is known of the machine, fit one of them better, it is that.

    `tool`: effects of the machine's unknowns at the tool at `poses` (n, n_commanded). `kinds`: the
    registry, of which those of readings are tried.
    """
    n = fitted.unknowns.n_machine
    after = tool.uncertainty(covariance_root(fitted.covariance[:n, :n]), np.zeros((0, n)))
    least = _cost(fitted, fitted.birge) + AS_WELL
    loss = _loss(fitted, fitted.birge) - AS_WELL
    better: dict[int, list[tuple[float, _Supposition]]] = {}
    open_: dict[int, list[tuple[_Supposition, float]]] = {}
    of_readings = [kind for kind in kinds if kind.of_readings]
    for supposed in _plausible(refit, of_readings, readings_only=True):
        other = refit.under(supposed)
        if other is None or _cost(other, fitted.birge) > least:
            continue
        if _loss(other, fitted.birge) < loss:
            better.setdefault(supposed.number, []).append((other.noise, supposed))
        moved, beyond = tool.displacement(other.values - fitted.values, after, COVERAGE)
        if beyond and moved > 0.0:
            open_.setdefault(supposed.number, []).append((supposed, moved))
    suspected = [_explanation(_by_noise(own), fitted) for own in better.values()]
    for number, own in open_.items():
        if number not in better:
            suppositions = [supposed for supposed, _ in own]
            settled_by = _settling_row(refit, fitted, suppositions, poses)
            suspected.append(_open_choice(suppositions, max(m for _, m in own), settled_by))
    return tuple(suspected)


def explained_otherwise(
    refit: Refit, fitted: Fit | None, kinds: Sequence[HypothesisKind]
) -> tuple[Suspicion, ...]:
    """Hypotheses with which a machine explains data that none explains as they are, best first.

    `fitted`: the fit of the data as they are, which explains them badly; None where there is none.
    """
    limit = EXPLAINED if fitted is None else min(EXPLAINED, fitted.birge / BETTER)
    near = sorted(
        _plausible(refit, [kind for kind in kinds if not kind.free]),
        key=lambda supposed: supposed.hypothesis.misfit.size(supposed.hypothesis.trimmed),
    )
    explained: dict[tuple[int, str], list[tuple[float, _Supposition]]] = {}
    for supposed in near[:MOST_FITTED]:
        other = refit.under(supposed)
        if other is not None and other.noise <= limit:
            of_kind = explained.setdefault((supposed.number, supposed.kind.code), [])
            of_kind.append((other.noise, supposed))
    ranked = [_by_noise(of_kind) for of_kind in explained.values()]
    ranked.sort(key=lambda of_kind: of_kind[0][0])
    return tuple(_explanation(of_kind, fitted) for of_kind in ranked)


def _plausible(
    refit: Refit, kinds: Sequence[HypothesisKind], *, readings_only: bool = False
) -> Iterator[_Supposition]:
    """Hypotheses that tolerances do not refute, before any fit of the machine."""
    machine, data = refit.machine, refit.data
    for number in np.unique(data.instrument).tolist():
        rows = np.flatnonzero(data.instrument == number)
        few = rows[np.linspace(0, rows.size - 1, min(FEW_ROWS, rows.size)).round().astype(np.intp)]
        view = replace(_view(machine, data, number, few), readings_only=readings_only)
        supposed = list(_tried(view, number, kinds))
        if few.size < rows.size and supposed:
            words = {one.hypothesis.words for one in supposed}
            view = replace(_view(machine, data, number, rows), readings_only=readings_only)
            supposed = list(_tried(view, number, kinds, words))
        yield from (one for one in supposed if _changes(one.hypothesis, view))


def _view(machine: Machine, data: Measurements, number: int, rows: Indices) -> View:
    """Of some rows of one instrument; all of them: numbered as in the data."""
    if rows.size == int((data.instrument == number).sum()):
        return View.of(machine, data, number, expected_residual(machine, data))
    some = data.select(np.isin(np.arange(data.n_row), rows))
    return View.of(machine, some, number, expected_residual(machine, some))


def _tried(
    view: View, number: int, kinds: Sequence[HypothesisKind], wanted: set[str] | None = None
) -> Iterator[_Supposition]:
    """Of the hypotheses, or of those of `wanted` words, the ones within what is allowed."""
    for kind in kinds:
        for hypothesis in kind.propose(view):
            if hypothesis.partial and view.readings_only:
                continue
            if wanted is not None and hypothesis.words not in wanted:
                continue
            try:
                misfit = hypothesis.misfit
            except RequestError:
                continue
            if misfit.redundancy >= REDUNDANT and misfit.size(hypothesis.trimmed) <= ALLOWED:
                yield _Supposition(number, kind, hypothesis, view)


def _changes(hypothesis: Hypothesis, view: View) -> bool:
    """Whether the readings would be other ones by more than their noise, not only less certain."""
    rows = hypothesis.supposed.rows
    if rows.value.shape != view.own.value.shape:
        return True
    if rows.joints is not view.own.joints:
        return True
    change = np.abs(rows.value - view.own.value)
    changed = change > 0.0
    beyond = change[changed] > view.own.uncertainty[changed]
    return bool(beyond.size and beyond.mean() > 0.5)


def _by_noise(explained: list[tuple[float, _Supposition]]) -> list[tuple[float, _Supposition]]:
    return sorted(explained, key=lambda pair: pair[0])


def _loss(fitted: Fit, noise: float) -> float:
    """Huber's loss of the readings."""
    size = np.abs(fitted.residual) / noise
    return float(np.where(size <= HUBER, size**2, HUBER * (2.0 * size - HUBER)).sum())


def _cost(fitted: Fit, noise: float) -> float:
    """What the fit has made least: the loss of the readings, and the prior's squares."""
    prior = Prior.of(fitted.unknowns, tolerances=fitted.use_prior)
    known = prior.rows @ (fitted.values - prior.mean)
    return _loss(fitted, noise) + float(known @ known)


def _settling_row(
    refit: Refit, fitted: Fit, suppositions: Sequence[_Supposition], poses: Floats
) -> str | None:
    """The one further row, in words, of which the data then refute all of the suppositions.

    Poses that differ from a measured one in one commanded freedom are tried first, then others.
    """
    machine, view = refit.machine, suppositions[0].view
    measured = view.poses[0]
    ends = [poses.min(axis=0), poses.max(axis=0)]
    for freedom, name in enumerate(machine.commanded):
        for end in sorted(ends, key=lambda end: -abs(end[freedom] - measured[freedom])):
            pose = measured.copy()
            pose[freedom] = end[freedom]
            if _refuted_by(refit, fitted, suppositions, pose):
                unit = "m" if name in "xyz" else "rad"
                where = view.format(float(pose[freedom]), unit)
                return f"one row at another commanded {name}, such as {where}, settles it"
    spread = poses[np.linspace(0, len(poses) - 1, 8).round().astype(np.intp)]
    for pose in spread:
        if _refuted_by(refit, fitted, suppositions, pose):
            parts = [
                f"{name} = {view.format(float(value), 'm' if name in 'xyz' else 'rad')}"
                for name, value in zip(machine.commanded, pose, strict=True)
            ]
            return f"one row at {', '.join(parts)} settles it"
    return None


def _refuted_by(
    refit: Refit, fitted: Fit, suppositions: Sequence[_Supposition], pose: Floats
) -> bool:
    """Whether a row at this pose, that reads what the fit predicts, refutes them all."""
    number = suppositions[0].number
    extended = _with_row(refit, fitted, number, pose)
    if extended is None:
        return False
    again = replace(refit, data=extended)
    allowed = expected_residual(refit.machine, extended)
    view = replace(View.of(refit.machine, extended, number, allowed), readings_only=True)
    least = _cost(fitted, fitted.birge) + AS_WELL
    for supposed in suppositions:
        words = supposed.hypothesis.words
        for hypothesis in supposed.kind.propose(view):
            if hypothesis.words != words:
                continue
            if not hypothesis.misfit.size(hypothesis.trimmed) <= ALLOWED:
                continue
            other = again.under(_Supposition(number, supposed.kind, hypothesis, view))
            if other is not None and _cost(other, fitted.birge) <= least:
                return False
    return True


def _with_row(refit: Refit, fitted: Fit, number: int, pose: Floats) -> Measurements | None:
    """The data and a row of the instrument at another pose, reading what the fit predicts of it."""
    data, machine = refit.data, refit.machine
    joints, placements, status = machine.kernel.place(pose[np.newaxis])
    if status[0] != OK:
        return None
    first = int(np.flatnonzero(data.instrument == number)[0])
    row = data.select(np.arange(data.n_row) == first)
    row = replace(row, joints=joints, placements=placements)
    standing = replace(row, instruments=fitted.measurements.instruments)
    predicted = IdentificationProblem(machine, standing, fitted.unknowns).predict(fitted.values)
    if not np.isfinite(predicted).all():
        return None
    return joined(data, row.with_values(predicted))


def _named(suppositions: Sequence[_Supposition]) -> str:
    words = [supposed.hypothesis.words for supposed in suppositions]
    more = len(words) - MOST_NAMED
    shown = words[:MOST_NAMED] + ([f"if {more} more such suppositions hold"] if more > 0 else [])
    return " or if ".join(shown).replace("or if if", "or if")


def _open_choice(
    suppositions: Sequence[_Supposition], moved: float, settled_by: str | None
) -> Suspicion:
    view = suppositions[0].view
    where = tuple(dict.fromkeys(name for s in suppositions for name in s.hypothesis.where))
    settling = settled_by or "no further row that was tried settles it"
    return Suspicion(
        "open-choice",
        f"{view.instrument.name}: the readings are explained as well if {_named(suppositions)}, "
        f"which puts the tool up to {view.format(moved, 'm')} elsewhere: {settling}",
        view.instrument.name,
        where,
        refuses=any(supposed.of_all_numbers for supposed in suppositions),
    )


def _explanation(explained: Sequence[tuple[float, _Supposition]], fitted: Fit | None) -> Suspicion:
    noise, first = explained[0]
    view, hypothesis = first.view, first.hypothesis
    others = [supposed.hypothesis for _, supposed in explained[1:]]
    either = f", or {others[0].words}" if others else ""
    before = float("inf") if fitted is None else fitted.noise
    as_given = (
        "no machine near the nominal one explains the readings"
        if fitted is None
        else f"the best machine leaves {before:.3g} times the stated uncertainties"
    )
    return Suspicion(
        first.kind.code,
        f"{view.instrument.name}: it looks as if {hypothesis.words}{either}: as given {as_given}, "
        f"with that mended one leaves {noise:.3g} times the stated uncertainties",
        view.instrument.name,
        hypothesis.where,
        view.numbers(hypothesis.rows),
        view.lines(hypothesis.rows),
        before,
        noise,
        before / noise if noise > 0.0 else float("inf"),
        "1",
    )


__all__ = ["Refit", "alternatives", "explained_otherwise"]
