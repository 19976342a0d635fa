"""The part, evaluated: every quantity of its features, in both states, against its limits."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

import numpy as np

from truepose.arrays import Flags, Floats, Indices
from truepose.cluster.evaluator import TaskEvaluator
from truepose.files.units import FileUnit
from truepose.machine import Condition, Machine
from truepose.runs.displacement import displacement
from truepose.runs.poses import Progress
from truepose.sources import Source
from truepose.verdict.states import BEFORE
from truepose.workpiece.alignment import Alignment
from truepose.workpiece.along import Walked
from truepose.workpiece.features import Feature, Forms, Quantity
from truepose.workpiece.part_values import PartValues, places
from truepose.workpiece.reached import FeatureSearch, Search
from truepose.workpiece.samples import SampledParts, SampledState, sampled
from truepose.workpiece.states import PartState, in_space
from truepose.workpiece.worst import Interval, PointBounds, from_above

Rule = Literal["worst-case", "iso-14253"]

MET, NOT_MET, UNDECIDED = "met", "NOT met", "undecided"

SOURCE_SAMPLES = 500
"""Samples of each source alone, at most."""


@dataclass(frozen=True, eq=False)
class Characteristic:
    """One quantity of one feature, the `number`-th of its own; `place` of the points it is of."""

    feature: Feature
    number: int
    parts: tuple[Indices, ...]

    @property
    def quantity(self) -> Quantity:
        """What is toleranced."""
        return self.feature.quantities[self.number]

    @property
    def label(self) -> str:
        """Such as "bore A: diameter"."""
        return f"{self.feature.name}: {self.quantity.name}"

    @property
    def members(self) -> Indices:
        """(m,) points of the part that the quantity is of, those of datums last."""
        return np.concatenate(self.parts)

    @cached_property
    def forms(self) -> Forms:
        """The linear forms of the quantity."""
        return self.feature.forms()[self.number]

    def breaks(self, value: float) -> bool:
        """Whether a value is outside the limits."""
        return not self.quantity.lower <= value <= self.quantity.upper


@dataclass(frozen=True, eq=False)
class QuantityAnswer:
    """What is said of one characteristic in one state; lengths m, angles rad.

    `known`: at the sources' shifts; `uncertainty`: standard, NaN where it is `is_form` or nothing
    spreads; `interval`: of the probability asked; `above`: between what it lies, and `search` what
    machines reach; `out`: probability out of tolerance; `verdict` of three values, and `why`.
    """

    known: float
    uncertainty: float
    interval: tuple[float, float]
    above: Interval
    search: Search
    out: float
    verdict: str
    why: str


@dataclass(frozen=True, eq=False)
class SourceAlone:
    """Of one source alone, in one state: `known` (c,) what it adds to each characteristic's value.

    `half` (c,): half the 95 % interval that its unknown part makes alone; `first` (c,): the name of
    its variable that does most of it alone, empty where it has none.
    """

    source: str
    known: Floats
    half: Floats
    first: tuple[str, ...]


@dataclass
class StateAnswers:
    """All answers in one state, and what was found on the way."""

    state: PartState
    bounds: PointBounds
    answers: tuple[QuantityAnswer, ...]
    sampled: SampledParts
    blame: tuple[SourceAlone, ...]
    programmed: Floats = field(default_factory=lambda: np.empty(0))


class PartEvaluation:
    """The part of one program on one machine.

    `units`, by dimension, and `shown`: in what it is told, as the drawing has it, else the machine.
    `evaluator`: who draws the samples.
    """

    def __init__(
        self,
        machine: Machine,
        condition: Condition,
        sources: Sequence[Source],
        states: Sequence[PartState],
        features: Sequence[Feature],
        alignment: Alignment,
        walked: Walked,
        units: Mapping[str, FileUnit],
        *,
        samples: int,
        seed: int,
        probability: float,
        rule: Rule,
        exact: bool | None,
        evaluator: TaskEvaluator,
        progress: Progress | None,
    ) -> None:
        self.machine, self.condition, self.sources = machine, condition, tuple(sources)
        self.features, self.alignment, self.walked = tuple(features), alignment, walked
        self.samples, self.seed, self.probability, self.rule = samples, seed, probability, rule
        self._exact, self._progress, self._evaluator = exact, progress, evaluator
        self.units = {**machine.file_units, **units}
        self.shown = machine.shown.declaring(units)
        self._done = 0
        self.characteristics = tuple(
            Characteristic(feature, number, places(feature))
            for feature in self.features
            for number in range(len(feature.quantities))
        )
        self.values = PartValues(self.features, alignment)
        """(s, c) of all characteristics of parts whose points are (s, n, 3)."""
        self.states = tuple(self._answered(state) for state in states)

    @property
    def of_bands(self) -> bool:
        """Whether machines inside of bands are evaluated, and not one that is given."""
        return len(self.states) > 1

    def before(self) -> StateAnswers:
        """The state as commanded."""
        return next(one for one in self.states if one.state.name == BEFORE)

    # --- inside

    def _account(self, done: int) -> None:
        if self._progress is not None:
            self._progress(self._done + done, 2 * self.samples)

    def _answered(self, state: PartState) -> StateAnswers:
        drawn = sampled(
            SampledState(state, self.values, self.seed),
            self.samples,
            self._evaluator,
            self._exact,
            self._account,
        )
        self._done += self.samples
        bounds = PointBounds(state)
        programmed = self.values(state.points[np.newaxis])[0]
        known = self.values((state.points + state.known_error)[np.newaxis])[0]
        varying = state.varying(self.seed)
        farthest = _farthest(drawn.values)
        searches = [
            search
            for feature in self.features
            for search in FeatureSearch(
                state, self.alignment, feature, places(feature), varying, farthest
            ).search()
        ]
        answers = tuple(
            self._answer(state, bounds, at, float(known[at]), drawn, search)
            for at, search in enumerate(searches)
        )
        return StateAnswers(state, bounds, answers, drawn, self._blame(state, known), programmed)

    def _answer(
        self,
        state: PartState,
        bounds: PointBounds,
        at: int,
        known: float,
        drawn: SampledParts,
        search: Search,
    ) -> QuantityAnswer:
        of = self.characteristics[at]
        values = drawn.values[:, at]
        interval = self._interval(values, one_sided=of.quantity.is_form)
        spread = float(np.nanstd(values)) if np.isfinite(values).any() else math.nan
        outside = ~((values >= of.quantity.lower) & (values <= of.quantity.upper))
        above = from_above(state, bounds, self.alignment, of.forms, of.members)
        verdict, why = self._verdict(of, interval, above, search, drawn)
        return QuantityAnswer(
            known,
            math.nan if of.quantity.is_form else spread,
            interval,
            above,
            search,
            float(np.mean(outside)),
            verdict,
            why,
        )

    def _interval(self, values: Floats, *, one_sided: bool) -> tuple[float, float]:
        """Symmetric in probability; of a form from its least. Failed samples are beyond both."""
        filled = np.where(np.isfinite(values), values, np.inf)
        if one_sided:
            return float(filled.min()), float(np.quantile(filled, self.probability))
        tail = 0.5 * (1.0 - self.probability)
        low = np.where(np.isfinite(values), values, -np.inf)
        return float(np.quantile(low, tail)), float(np.quantile(filled, 1.0 - tail))

    def _verdict(
        self,
        of: Characteristic,
        interval: tuple[float, float],
        above: Interval,
        search: Search,
        drawn: SampledParts,
    ) -> tuple[str, str]:
        quantity = of.quantity
        if self.rule == "iso-14253":
            low, high = interval
            if quantity.lower <= low and high <= quantity.upper:
                return MET, "the coverage interval is within the limits"
            if high < quantity.lower or low > quantity.upper:
                return NOT_MET, "the coverage interval is outside the limits"
            return UNDECIDED, "a limit lies within the coverage interval"
        if of.breaks(search.lower.value) or of.breaks(search.upper.value):
            return NOT_MET, "a machine inside the bands makes it out of tolerance"
        if drawn.failed:
            return NOT_MET, "a machine inside the bands cannot be assembled"
        if not (of.breaks(above.lower) or of.breaks(above.upper)):
            if above.proven:
                return MET, "all machines inside the bands make it within tolerance: proven"
            return UNDECIDED, above.why
        return UNDECIDED, "no machine was found that breaks a limit, nor a proof that none does"

    def _blame(self, state: PartState, known: Floats) -> tuple[SourceAlone, ...]:
        """Each source alone: what it is known to do as commanded, and how far it spreads."""
        varying = state.varying(self.seed)
        rows = np.asarray(varying.rows(0, min(SOURCE_SAMPLES, self.samples)))
        of_variable = np.array(state.variables.sources, dtype=np.str_)
        programmed = self.values(state.points[np.newaxis])[0]
        single = self._single(state)
        blamed = []
        for source, alone in zip(self.sources, state.variables.alone, strict=True):
            added = np.zeros(len(self.characteristics))
            if state.name == BEFORE and alone[1].any():
                parameters, shift = alone
                error, _ = displacement(
                    self.machine,
                    state.block.joints,
                    state.block.placements,
                    (parameters, np.ascontiguousarray(shift)),
                )
                moved = state.points + in_space(self.machine, error)
                added = self.values(moved[np.newaxis])[0] - programmed
            chosen: Flags = of_variable == source.name
            half = np.zeros(len(self.characteristics))
            first = ("",) * len(self.characteristics)
            if chosen.any():
                half = self._alone(state, rows, chosen)
                most = np.where(chosen[:, np.newaxis], single, -1.0).argmax(axis=0)
                first = tuple(state.variables.names[at] for at in most.tolist())
            blamed.append(SourceAlone(source.name, added, half, first))
        return tuple(blamed)

    def _single(self, state: PartState) -> Floats:
        """(v, c) how far each variable alone moves each characteristic, to first order.

        What varies along the path is taken at the end of its band at every point.
        """
        if not state.variables.names:
            return np.empty((0, len(self.characteristics)))
        around = np.concatenate([sign * state.effects for sign in (1.0, -1.0)], axis=2)
        errors = state.known_error + np.moveaxis(around, 2, 0)
        known = self.values((state.points + state.known_error)[np.newaxis])
        off = np.abs(self.values(state.points + errors) - known)
        return np.asarray(off.reshape(2, -1, off.shape[1]).max(axis=0))

    def _alone(self, state: PartState, rows: Floats, chosen: Flags) -> Floats:
        """(c,) half the 95 % interval where only the chosen variables are unknown."""
        varying = state.varying(self.seed)
        parts = []
        at_once = max(1, (1 << 21) // max(1, state.points.size))
        for first in range(0, len(rows), at_once):
            part = rows[first : first + at_once]
            errors = state.linear_of(varying, part, first, chosen)
            parts.append(self.values(state.points + errors))
        values = np.concatenate(parts)
        high, low = np.quantile(values, [0.975, 0.025], axis=0)
        return np.asarray(0.5 * (high - low))


def _farthest(values: Floats) -> list[int]:
    """Numbers of the samples (s, c) with the least and the largest value of each quantity."""
    lost = ~np.isfinite(values)
    least = np.where(lost, np.inf, values).argmin(axis=0)
    return [*least.tolist(), *np.where(lost, -np.inf, values).argmax(axis=0).tolist()]
