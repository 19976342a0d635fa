"""An accuracy at a coverage: what the share p of all machines keeps at the worst pose.

The number is the p quantile of the length of the error at the pose where that is largest. Machines
are drawn from the distributions of all sources with their correlations and solved exactly, the same
that `truepose.monte_carlo` draws; one that cannot be assembled, or leaves its branch, is infinitely
far off. What the poses are that may be the worst, `screening` says.

At each of them two of the lengths in order enclose the quantile (`order_statistics`), all of them
together with a probability of `CONFIDENCE`: the risk is shared out evenly over the poses and over
all looks that there may be while draws are doubled (Bonferroni). So the largest of the lower ends
and the largest of the upper ends enclose the quantile at the worst of these poses, whenever the
doubling ends. Nothing of this asks for a distribution, or for an error that is linear; that no
other pose is worse rests on first order alone.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from typing import Literal

import numpy as np

from truepose.arrays import Flags, Floats, Indices
from truepose.language import grouped, marked, say
from truepose.machine import Machine
from truepose.representation import Represented
from truepose.runs.poses import Progress
from truepose.runs.quantities import quantities
from truepose.uncertainty_analysis.arguments import required_probability, required_seed
from truepose.verdict.order_statistics import ranks
from truepose.verdict.screening import WITHIN, Pose, Screen, State

CONFIDENCE = 0.99
"""Probability that the interval holds the number at the worst of the poses sampled."""

DRAWS = 20_000
"""Machines drawn at every pose that may be the worst, doubled where they do not decide."""

MOST = 1_000_000
"""Machines drawn at a pose at most, against a target."""

MOST_UNASKED = 100_000
"""Machines drawn at a pose at most where there is no target: until the interval is narrow."""

NARROW = 0.02
"""Of the number: width of the interval that is narrow enough where there is no target."""

MOST_POSES = 1_000
"""Poses that are sampled at most, those of the largest first-order numbers."""

QUICK = 0.95
QUICK_POSES, QUICK_DRAWS = 3, 10_000
"""At which coverage, and with how much effort, a number is told that is no answer: how far off the
tool is over the workspace. An `[accuracy] at` takes all poses and as many draws as decide."""

TOGETHER = 8_000_000
"""Lengths kept at once."""

ROUNDING = 1e-9
"""Of a number: a smaller difference does not tell the worst of two poses."""

Answer = Literal["met", "NOT met", "undecided"]


@dataclass(frozen=True, repr=False)
class CoverageAnswer(Represented):
    """What a share `probability` of all machines keeps at the worst pose, m or rad.

    `estimate` is the quantile of the draws at pose number `pose`, where it is largest, infinite
    where more machines than the rest cannot be assembled. `lower` and `upper` enclose the number
    at the worst of the poses sampled with a probability of `CONFIDENCE`; `upper` is infinite where
    there are too few draws for an end.
    `answer` to the `target`, None where there is none. `draws`, `failed` at that pose: machines
    drawn, and those of them that cannot be assembled. `sampled` poses of the `within` that may be
    the worst, of `poses` in all. `sizes` (draws,): the lengths of the draws at that pose, m or rad,
    in ascending order, infinite where a machine cannot be assembled.
    """

    quantity: str
    probability: float
    target: float | None
    answer: Answer | None
    estimate: float
    lower: float
    upper: float
    pose: int
    draws: int
    failed: int
    seed: int
    sampled: int
    within: int
    poses: int
    sizes: Floats = field(default_factory=lambda: np.empty(0), compare=False)

    def share_within(self, size: float) -> float:
        """The share of the machines drawn that are no farther off than `size`, m or rad."""
        return float(np.searchsorted(self.sizes, size, side="right")) / self.draws

    @property
    def rests_on(self) -> str:
        """What the answer rests on, in words."""
        drawn = say(
            "{draws} machines drawn at the worst pose, seed {seed}",
            draws=grouped(self.draws),
            seed=self.seed,
        )
        if self.poses == 1:
            return drawn
        if self.sampled == self.poses:
            return f"{drawn}; {say('each of the {poses} poses sampled', poses=grouped(self.poses))}"
        values = {
            "sampled": grouped(self.sampled),
            "poses": grouped(self.poses),
            "within": grouped(self.within),
            "below": marked(f"{100.0 * WITHIN:g}"),
        }
        if self.sampled < self.within:
            some = say(
                "{sampled} of {poses} poses sampled, the largest by first order of {within} that "
                "may be the worst, all others are {below} % or more below the largest by first "
                "order",
                **values,
            )
        else:
            some = say(
                "{sampled} of {poses} poses sampled, all others are {below} % or more below the "
                "largest by first order",
                **values,
            )
        return f"{drawn}; {some}"


def coverage(
    machine: Machine,
    states: Iterable[State],
    quantity: str,
    probability: float,
    target: float | None = None,
    *,
    seed: int = 0,
    most_poses: int = MOST_POSES,
    most_draws: int | None = None,
    progress: Progress | None = None,
) -> CoverageAnswer:
    """The `probability` quantile of the length of the error at the worst pose, against a `target`.

    `states`: blocks of poses with the joints that are commanded there, nominal or corrected, and
    their spreads; gone through twice. `quantity`: "position" or "orientation", `target` in m or
    rad. At every pose that may be the worst 20,000 machines are drawn, and twice as many again, up
    to a million, where the interval at the pose holds the target. Without a target they are
    doubled up to 100,000 where a pose may be the worst and the interval is wider than 2 %.

    `most_poses` are sampled at most, those of the largest first-order numbers, with at most
    `most_draws` machines each, by default a million against a target and 100,000 without.

    Met: the whole interval is at most the target. NOT met: the whole interval is above it.
    Equal seeds give equal answers, whatever the number of threads. `progress` is called with
    (machines drawn over all poses, those that are to be drawn as far as is known).

    Raises `RequestError` (bad-probability, bad-seed, correlation-out-of-reach), `ValueError` where
    the machine has no such quantity or there is no pose.
    """
    p, number = required_probability(probability), required_seed(seed)
    kinds = quantities(machine.components)
    if quantity not in kinds:
        raise ValueError(f"no {quantity} of this machine's tool")
    screened = Screen(machine, states, kinds[quantity], p, number).candidates(most_poses)
    most = most_draws or (MOST_UNASKED if target is None else MOST)
    sampled = _Sampled(screened.poses, p, target, most, progress)
    sampled.run()
    worst = sampled.worst
    return CoverageAnswer(
        quantity,
        p,
        target,
        sampled.answer,
        float(sampled.estimate[worst]),
        float(sampled.lower.max()),
        float(sampled.upper.max()),
        screened.poses[worst].number,
        int(sampled.draws[worst]),
        int(sampled.failed[worst]),
        number,
        len(screened.poses),
        screened.within,
        screened.every,
        sampled.sizes_at(worst),
    )


@dataclass
class _Sampled:
    """Poses (n,) with the quantiles of their draws so far: estimate, and ends that enclose it."""

    poses: Sequence[Pose]
    probability: float
    target: float | None
    most: int
    progress: Progress | None
    estimate: Floats = field(init=False)
    lower: Floats = field(init=False)
    upper: Floats = field(init=False)
    draws: Indices = field(init=False)
    failed: Indices = field(init=False)
    _kept: tuple[int, Floats] = field(init=False, default=(-1, np.empty(0)))

    def __post_init__(self) -> None:
        count = len(self.poses)
        self.estimate, self.lower = np.zeros(count), np.zeros(count)
        self.upper = np.full(count, np.inf)
        self.draws, self.failed = np.zeros(count, np.intp), np.zeros(count, np.intp)

    @property
    def worst(self) -> int:
        """Where the number is largest; of equal ones, but for rounding, the first of the run."""
        largest = np.flatnonzero(self.estimate >= self.estimate.max() * (1.0 - ROUNDING))
        return int(min(largest.tolist(), key=lambda at: self.poses[at].number))

    @property
    def answer(self) -> Answer | None:
        """Of the intervals as they are."""
        if self.target is None:
            return None
        if self.lower.max() > self.target:
            return "NOT met"
        return "met" if self.upper.max() <= self.target else "undecided"

    def run(self) -> None:
        """Draw at all poses, then twice as many where that may decide."""
        looks = _looks(self.most)
        risk = (1.0 - CONFIDENCE) / (len(self.poses) * len(looks))
        drawn = 0
        for count in looks:
            going = self._open()
            if not going.any():
                return
            total = drawn + count * int(going.sum())
            for batch in _batches(self.poses, np.flatnonzero(going), count):
                self._draw(batch, count, risk)
                drawn += count * len(batch)
                if self.progress is not None:
                    self.progress(drawn, total)

    def _open(self) -> Flags:
        """(n,) where more draws may change the answer, or the number where nothing is asked."""
        if not self.draws.any():
            return np.ones(len(self.poses), np.bool_)
        reached = self.lower.max()
        if self.target is not None:
            # One pose at which it is not kept is enough.
            if reached > self.target:
                return np.zeros(len(self.poses), np.bool_)
            return np.asarray(self.upper > self.target)
        if self.upper.max() <= reached + NARROW * self.estimate.max():
            return np.zeros(len(self.poses), np.bool_)
        return np.asarray(self.upper > reached)

    def _draw(self, batch: Indices, count: int, risk: float) -> None:
        """Machines number 0 to `count` at poses of one part, which have the same variables."""
        sizes = self._sizes(batch, count)
        of = ranks(count, self.probability, risk)
        self.estimate[batch], self.lower[batch], self.upper[batch] = of.of(sizes)
        self.draws[batch] = count
        self.failed[batch] = np.isinf(sizes).sum(axis=1)
        row = np.flatnonzero(batch == self.worst)
        if row.size:
            self._kept = (self.worst, sizes[int(row[0])].copy())

    def _sizes(self, batch: Indices, count: int) -> Floats:
        """(n, count) lengths of the errors of machines number 0 to `count` at these poses."""
        sizes = np.empty((len(batch), count))
        draws = self.poses[int(batch[0])].draws
        for first in range(0, count, DRAWS):
            t = draws.rows(first, min(DRAWS, count - first))
            for row, at in enumerate(batch):
                sizes[row, first : first + len(t)] = self.poses[int(at)].sizes(t)
        return sizes

    def sizes_at(self, pose: int) -> Floats:
        """(draws,) all lengths at a pose, ascending; of the worst so far they are kept."""
        kept, sizes = self._kept
        if kept != pose or sizes.size != self.draws[pose]:
            # Another pose turned out to be the worst when one that was had more draws.
            (sizes,) = self._sizes(np.array([pose]), int(self.draws[pose]))
        return np.sort(sizes)


def _looks(most: int) -> list[int]:
    """Numbers of draws, each twice the one before it."""
    counts = [min(DRAWS, most)]
    while counts[-1] < most:
        counts.append(min(2 * counts[-1], most))
    return counts


def _batches(poses: Sequence[Pose], chosen: Indices, count: int) -> Iterable[Indices]:
    """Poses of one part that are drawn together, as many as their lengths leave room for."""
    step = max(1, TOGETHER // count)

    def part(at: int) -> int:
        return poses[at].part

    for _, members in groupby(sorted(chosen.tolist(), key=part), part):
        together = np.array(list(members), np.intp)
        for start in range(0, len(together), step):
            yield together[start : start + step]
