"""The search for the cheapest design of which a share of all machines keeps the targets.

Each place where the share is kept least (`statistical_judge`) is a cut: variances of grades add up
to at most what the law of its quantile allows. A programme gives the cheapest grades within all
cuts, the judge draws machines of that design and corrects the laws there, and so on until none is
beyond its limit. Then machines of other seeds at other poses have to show the share; what they do
not show is a cut too. No bound is made of these cuts: they follow the machines drawn.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.design.allocated_bands import AllocatedBands, allocated_bands
from truepose.design.error_model import ErrorModel
from truepose.design.judge import Findings
from truepose.design.judged_poses import JudgedPoses
from truepose.design.option_combination import FIRST_GAP, GradedDesign
from truepose.design.options import machine_of
from truepose.design.programme import Programme
from truepose.design.shares_kept import SharesKept, shares_kept
from truepose.design.space import Combination, DesignSpace
from truepose.design.statistical_judge import (
    STANDARD_ERRORS,
    QuantilePlace,
    Sampling,
    StatisticalJudge,
)
from truepose.machine import Condition, Machine

DRAWS = 4_000
"""Machines drawn at a place while the design is looked for,"""

FINAL_DRAWS = 100_000
"""and at each of the worst, of a seed of their own, when it is found."""

SHARE_DRAWS = 20_000
"""Machines that are sent to all poses."""

GATHER = Sampling(0, 8, DRAWS, 0)
CLIMB = Sampling(8, 8, DRAWS, 0)

FRESH = 1_000
"""Poses that no judge has seen, at which a design is looked at when it is found."""

_ROUNDS = 60
_IMPROVED = 3
"""Times that the laws are taken anew at the design found, and a cheaper one is looked for."""

_CHECKS = 12
_LEVELS = 8
_CLOSE = 0.08
"""Of a normal variable: how much surer than asked the share at all poses may be."""


@dataclass(frozen=True, eq=False)
class StatisticalTask:
    """What is asked: `share` of the machines within the `targets` (q,), at each pose, or at all."""

    machine: Machine
    conditions: dict[str, Condition]
    targets: tuple[float | None, ...]
    reserve: float
    state: str
    after: bool
    gap: float
    share: float
    all_poses: bool


@dataclass(eq=False)
class StatisticalOutcome:
    """The best design, its candidate and bands, and what fresh machines showed of it.

    `shortfall`: of combinations that cannot be, the one least far off, and its worst place.
    """

    best: GradedDesign | None = None
    candidate: StatisticalCombination | None = None
    kept: SharesKept | None = None
    places: tuple[QuantilePlace, ...] = ()
    shortfall: tuple[Combination, QuantilePlace | None] | None = None
    impossible: int = 0
    rounds: int = 0
    interrupted: bool = False


@dataclass(frozen=True, eq=False)
class _Cut:
    """A place's law over the columns: `coefficients` (x,) times them is at most `most`."""

    place: QuantilePlace
    coefficients: Floats
    most: float


class StatisticalCombination:
    """A combination of options: its machine, its cuts, and the cheapest grades within them."""

    def __init__(
        self,
        space: DesignSpace,
        task: StatisticalTask,
        combination: Combination,
        machine: Machine,
        tick: Callable[[], None],
    ) -> None:
        self.space, self.task, self.combination = space, task, combination
        self.option_cost = space.option_cost(combination)
        tie_of = np.zeros(len(space.features), np.intp)
        for number, tie in enumerate(space.ties):
            tie_of[list(tie.features)] = number
        self.bands: AllocatedBands = allocated_bands(machine, space.features, tie_of.tolist())
        conditions = list(task.conditions.values())
        self.models = [ErrorModel(self.bands, one, after=task.after) for one in conditions]
        self.judge = StatisticalJudge(
            conditions, task.state, JudgedPoses.of(machine), task.targets, task.reserve
        )
        self.level = task.share
        self.estimate = self.option_cost
        self._cuts: dict[tuple[object, ...], _Cut] = {}
        self._out: list[Floats] = []
        self._tried: set[tuple[int, ...]] = set()
        self._programme = Programme(space.cost, space.tie_of)
        self._tick = tick
        distributions = [self.bands.template.distribution[place] for place in self.bands.places]
        variance = np.ones(self.bands.member.shape[1])
        for feature, distribution in zip(self.bands.feature_of, distributions, strict=True):
            variance[self.bands.variable_of[feature]] = distribution.sigmas**-2.0
        self._variance: Floats = variance

    def halves(self, grades: Sequence[int]) -> Floats:
        """(f,) half widths of a grade for every tie, SI."""
        return np.asarray(self.space.chosen(grades) @ self.space.halves)

    def finest(self) -> list[QuantilePlace]:
        """The worst places with everything at its finest; they are cuts from then on."""
        x = self.space.finest()
        places = self._assessed(x, GATHER)
        self._cut(places, x)
        return places

    def relax(self, rounds: int = 8) -> None:
        """Estimate what the combination costs, between grades."""
        for _ in range(rounds):
            self._tick()
            solution = self._programme.relaxed(*self._rows())
            if solution is None:
                self.estimate = math.inf
                return
            self.estimate = self.option_cost + solution.cost
            beyond = [one for one in self._assessed(solution.x, GATHER) if one.share > 1.01]
            if not beyond:
                return
            self._cut(beyond, solution.x)

    def cheapest(self, gap: float) -> tuple[GradedDesign, list[QuantilePlace]] | None:
        """The cheapest grades that the judge takes for clean; None where there are none."""
        best = None
        for wide in dict.fromkeys((max(FIRST_GAP, gap), gap)):
            best = self._clean(wide) or best
        for _ in range(_IMPROVED if best is not None else 0):
            assert best is not None
            self._renew(best[0])
            again = self._clean(gap)
            if again is None or again[0].cost >= best[0].cost:
                break
            best = again
        return best

    def cut(self, places: Sequence[QuantilePlace], design: GradedDesign) -> None:
        """Cut off a design of which places were found beyond their limits."""
        x = self.space.chosen(design.grades)
        self._cut(places, x)
        if any(math.isinf(place.size) for place in places):
            self._out.append(x)

    def variances_of(self, place: QuantilePlace, halves: Floats) -> Floats:
        """(f,) what each feature adds to <G, C> at a place, with half widths (f,)."""
        moved = self._slopes([place])[0] * halves
        together = moved @ self.bands.member @ np.diag(self._variance) @ self.bands.member.T
        return np.asarray(np.einsum("kf,kl,lf->f", moved, place.weight, together))

    def at_level(self, level: float, design: GradedDesign | None) -> None:
        """Ask another share of the machines at each pose from now on."""
        self.level = level
        if design is not None:
            self._renew(design)
        else:
            self._cuts.clear()
            self.finest()

    # --- inside

    def _clean(self, gap: float) -> tuple[GradedDesign, list[QuantilePlace]] | None:
        for _ in range(_ROUNDS):
            self._tick()
            solution = self._programme.whole(*self._rows(), gap)
            if solution is None:
                return None
            places = self._assessed(solution.x, GATHER)
            if not any(place.exceeds for place in places):
                places = self._assessed(solution.x, CLIMB)
            beyond = [place for place in places if place.exceeds]
            design = self._design(solution.x, places)
            if not beyond:
                return design, places
            self._cut(beyond, solution.x)
            if design.grades in self._tried or any(math.isinf(one.size) for one in beyond):
                # Laws that are taken elsewhere let it in again: at least one tie has to be finer.
                self._out.append(solution.x)
            self._tried.add(design.grades)
        return None

    def _renew(self, design: GradedDesign) -> None:
        """Take all laws anew, at a design."""
        x = self.space.chosen(design.grades)
        wanted = {
            (cut.place.case, cut.place.pose.tobytes()): (cut.place.case, cut.place.pose)
            for cut in self._cuts.values()
        }
        places = self.judge.at_poses(self._machine(x), self.level, list(wanted.values()), DRAWS)
        self._cuts.clear()
        self._cut(places, x)

    def _assessed(self, x: Floats, sampling: Sampling) -> list[QuantilePlace]:
        return self.judge.assess(self._machine(x), self.level, sampling)

    def _machine(self, x: Floats) -> Machine:
        """The machine of columns; between grades of their root mean square width."""
        return self.bands.designed(np.sqrt(x @ np.square(self.space.halves)))

    def _design(self, x: Floats, places: Sequence[QuantilePlace]) -> GradedDesign:
        cost = math.fsum([self.option_cost, *self.space.cost[x > 0.5].tolist()])
        witnesses = tuple(place.witness for place in places)
        findings = Findings(witnesses, self.judge.left_out, ())
        return GradedDesign(self.combination, self.space.grades(x), cost, findings)

    def _cut(self, places: Sequence[QuantilePlace], x: Floats) -> None:
        """Take the laws of places, of the design of columns x."""
        told = [place for place in places if math.isfinite(place.size)]
        for place, slopes in zip(told, self._slopes(told), strict=True):
            self._cuts[place.key] = self._law(place, slopes, x)

    def _law(self, place: QuantilePlace, slopes: Floats, x: Floats) -> _Cut:
        now = float((place.weight * place.covariance).sum())
        if now <= 0.0:  # nothing spreads
            return _Cut(place, np.zeros(x.size), -1.0 if place.exceeds else 1.0)
        # v <= allowed, of which the columns add as much as they do now to what others do.
        own = self._variances(place, slopes)
        allowed = max(place.limit - place.size + now, 0.0) ** 2 / now
        scale = max(now, allowed)
        return _Cut(place, own / scale, (allowed - now + float(own @ x)) / scale)

    def _variances(self, place: QuantilePlace, slopes: Floats) -> Floats:
        """(x,) what each column adds to <G, C> at a place."""
        moved = np.einsum(
            "kf,xf,fv->xkv",
            slopes,
            self.space.halves,
            self.bands.member,
            optimize=True,
        )
        weighed = np.einsum("xkv,kl,xlv->xv", moved, place.weight, moved, optimize=True)
        return np.asarray(weighed @ self._variance)

    def _slopes(self, places: Sequence[QuantilePlace]) -> list[Floats]:
        """(k, f) what a unit of each feature's half width does, at each of some places."""
        slopes = [np.empty(0)] * len(places)
        for case, model in enumerate(self.models):
            numbers = [at for at, place in enumerate(places) if place.case == case]
            if not numbers:
                continue
            errors = model.at(np.array([places[at].pose for at in numbers]))
            for at, of_pose in zip(numbers, errors.slopes, strict=True):
                slopes[at] = of_pose[model.kinds[places[at].quantity]]
        return slopes

    def _rows(self) -> tuple[Floats, Floats]:
        count = self.space.cost.size
        cuts = list(self._cuts.values())
        rows = [cut.coefficients for cut in cuts]
        most = [cut.most for cut in cuts]
        for x in self._out:
            grades: Indices = np.array(self.space.grades(x))
            rows.append(np.asarray(self.space.grade_of >= grades[self.space.tie_of], np.float64))
            most.append(len(self.space.ties) - 1.0)
        return np.array(rows).reshape(len(rows), count), np.array(most)


class StatisticalSearch:
    """Looks for the cheapest design of a statistical task."""

    def __init__(
        self,
        space: DesignSpace,
        task: StatisticalTask,
        progress: Callable[[int, int], None] | None = None,
    ) -> None:
        self.space, self.task, self._progress = space, task, progress
        self.outcome = StatisticalOutcome()
        self._seed = 0

    def run(self) -> StatisticalOutcome:
        """The best design; on Ctrl-C that of then.

        Raises `KeyboardInterrupt` where there is none yet.
        """
        try:
            possible = sorted(self._possible(), key=lambda one: one.estimate)
            for candidate in possible:
                best = self.outcome.best
                if best is None or candidate.estimate < best.cost * (1.0 - self.task.gap):
                    self._found(candidate)
        except KeyboardInterrupt:
            if self.outcome.best is None:
                raise
            self.outcome.interrupted = True
        return self.outcome

    def candidate_as_filed(self) -> StatisticalCombination:
        """The machine of the file, its options as they are."""
        return self._candidate(self.space.combinations[0], self.task.machine)

    # --- inside

    def _candidate(self, combination: Combination, machine: Machine) -> StatisticalCombination:
        return StatisticalCombination(self.space, self.task, combination, machine, self._tick)

    def _tick(self) -> None:
        self.outcome.rounds += 1
        if self._progress is not None:
            self._progress(self.outcome.rounds, 0)

    def _possible(self) -> list[StatisticalCombination]:
        possible = []
        for combination in self.space.combinations:
            machine = machine_of(self.task.machine, self.space, combination)
            candidate = self._candidate(combination, machine)
            self._tick()
            places = candidate.finest()
            worst = places[0] if places else None
            if worst is None or worst.exceeds:
                self.outcome.impossible += 1
                before = self.outcome.shortfall
                if (
                    before is None
                    or before[1] is None
                    or (worst is not None and worst.share < before[1].share)
                ):
                    self.outcome.shortfall = combination, worst
                continue
            candidate.relax()
            if math.isfinite(candidate.estimate):
                possible.append(candidate)
        return possible

    def _found(self, candidate: StatisticalCombination) -> None:
        if self.task.all_poses:
            self._at_all_poses(candidate)
        else:
            self._confirmed(candidate)
        if self.outcome.best is None and self.outcome.shortfall is None:
            self.outcome.shortfall = candidate.combination, candidate.finest()[0]

    def _confirmed(self, candidate: StatisticalCombination) -> GradedDesign | None:
        """The cheapest design of a combination of which fresh machines show the share."""
        for _ in range(_CHECKS):
            cheapest = candidate.cheapest(self.task.gap)
            if cheapest is None:
                return None
            design, places = cheapest
            kept, beyond = self._fresh(candidate, design, places)
            if not beyond:
                self._better(candidate, design, kept, places)
                return design
            candidate.cut(beyond, design)
        return None

    def _at_all_poses(self, candidate: StatisticalCombination) -> None:
        """Ask more at each pose until the share is kept at all of them at once."""
        from truepose.probability.quantiles import normal_quantile

        share = self.task.share
        wanted = float(normal_quantile(np.array(share)))
        level, design = 1.0 - 0.5 * (1.0 - share), None
        for _ in range(_LEVELS):
            candidate.at_level(level, design)
            cheapest = candidate.cheapest(self.task.gap)
            if cheapest is None:
                return
            design, places = cheapest
            kept, _ = self._fresh(candidate, design, places)
            sure = kept.all_poses - STANDARD_ERRORS * kept.all_poses_error
            short = wanted - float(normal_quantile(np.clip(np.array(sure), 1e-6, 1.0 - 1e-6)))
            if short <= 0.0:
                self._better(candidate, design, kept, places)
                if short >= -_CLOSE:
                    return
            now = float(normal_quantile(np.array(level)))
            level = _normal_share(now + short + (0.01 if short > 0.0 else 0.0))
            level = max(level, share)

    def _fresh(
        self,
        candidate: StatisticalCombination,
        design: GradedDesign,
        places: Sequence[QuantilePlace],
    ) -> tuple[SharesKept, list[QuantilePlace]]:
        """What machines of another seed at other poses show, and where it is too little."""
        self._tick()
        self._seed += 1
        judge, task = candidate.judge, self.task
        poses = _fresh_poses(judge.places, self._seed)
        machine = candidate.bands.designed(candidate.halves(design.grades))
        sampling = Sampling(CLIMB.starts, 6, FINAL_DRAWS, self._seed)
        seen = judge.assess(machine, candidate.level, sampling, poses)
        beyond = [
            dataclasses.replace(one, size=max(one.size, one.limit * (1.0 + 1e-4)))
            for one in seen
            if one.within - STANDARD_ERRORS * one.standard_error < candidate.level
        ]
        worst = min(seen, key=lambda one: one.within)
        looked = np.concatenate([poses, [one.pose for one in (*seen, *places)]])
        kept = shares_kept(
            machine,
            list(task.conditions.values()),
            task.state,
            task.targets,
            looked,
            SHARE_DRAWS,
            self._seed,
        )
        return dataclasses.replace(
            kept, each_pose=worst.within, each_pose_error=worst.standard_error
        ), beyond

    def _better(
        self,
        candidate: StatisticalCombination,
        design: GradedDesign,
        kept: SharesKept,
        places: Sequence[QuantilePlace],
    ) -> None:
        outcome = self.outcome
        if outcome.best is None or design.cost < outcome.best.cost:
            outcome.best, outcome.candidate = design, candidate
            outcome.kept, outcome.places = kept, tuple(places)


def _fresh_poses(places: JudgedPoses, seed: int) -> Floats:
    """(n, d) poses of the box at random, or some that are listed."""
    if places.listed is not None:
        return places.listed[:FRESH]
    shares = np.random.default_rng([seed, 1]).random((FRESH, places.lower.size))
    return np.asarray(places.lower + shares * (places.upper - places.lower))


def _normal_share(z: float) -> float:
    """The share of a normal variable below z."""
    return 0.5 * math.erfc(-z / math.sqrt(2.0))


__all__ = ["StatisticalCombination", "StatisticalOutcome", "StatisticalSearch", "StatisticalTask"]
