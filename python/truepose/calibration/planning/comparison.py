"""How many readings of one instrument reach, at the tool, what so many of another reach.

Every number of readings is planned: what is compared is the best that each instrument can do.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from truepose.arrays import Floats
from truepose.calibration.instruments import Instrument
from truepose.calibration.planning import exchange
from truepose.calibration.planning.exchange import Candidates, Progress
from truepose.calibration.planning.plan import Field, counted_poses
from truepose.errors import Problem, RequestError
from truepose.machine import Condition, Machine
from truepose.representation import Facts, Represented

FEW = 30
"""Up to so many readings a start matters; beyond, the greedy one serves."""

MOST_TIMES = 10
"""An instrument is given up that does not reach the other with so many times its readings."""

STARTS = 2
"""Random starts of each number that is tried; without excursions, for there are many numbers."""


@dataclass(frozen=True, eq=False, repr=False)
class Comparison(Represented):
    """What the first of some instruments reaches, and how many readings the others need for it.

    `names` and `counts` (n,): poses at which each reads; None where no number of poses up to
    `most` does. `rms` (n, n_quantity): uncertainty at the tool that each then has, m and rad, with
    `most` readings where that is not enough. `before` (n_quantity,): before any reading.
    """

    names: tuple[str, ...]
    counts: tuple[int | None, ...]
    rms: Floats
    before: Floats
    most: int

    def _facts(self) -> Facts:
        yield "instruments", self.names
        yield "readings", self.counts
        yield "sentences", "; ".join(self.sentences)

    @property
    def sentences(self) -> tuple[str, ...]:
        """One for each instrument but the first, for people."""
        first = f"{_readings(self.counts[0], self.names[0])}"
        sentences = []
        for name, count in zip(self.names[1:], self.counts[1:], strict=True):
            if count is None:
                sentences.append(f"not even {_readings(self.most, name)} do what {first} do")
            else:
                verb = "does" if count == 1 else "do"
                sentences.append(f"{_readings(count, name)} {verb} what {first} do")
        return tuple(sentences)


def compare_instruments(
    machine: Machine,
    instruments: Sequence[Instrument],
    budget: int,
    *,
    candidates: ArrayLike | None = None,
    condition: Condition | None = None,
    identify: Iterable[str] = (),
    seed: int = 0,
    progress: Progress | None = None,
) -> Comparison:
    """How many planned readings of each instrument leave what `budget` of the first leave.

    Of the criterion "tool" of `plan`, in which position and rotation count; the options are those
    of `plan`. The tool is assessed in the machine's base frame, without the place of the whole
    machine where one of the instruments cannot determine that. `progress(instruments done,
    instruments)`.

    Raises `RequestError` as `plan` does, and plan-instrument for fewer than two.
    """
    count = counted_poses(budget)
    if len(instruments) < 2:
        raise RequestError(
            Problem(
                "plan-instrument",
                "one instrument alone cannot be compared",
                found=f"{len(instruments)} instruments",
                expected="two or more",
            )
        )
    wanted = tuple(identify)
    fields = [
        Field(machine, instrument, candidates=candidates, condition=condition, identify=wanted)
        for instrument in instruments
    ]
    # One measure for all: the effects that the least informative of them can determine.
    ruler = min(fields, key=lambda field: field.mean_before)
    for field in fields:
        field.assess_as(ruler)
    most = MOST_TIMES * count
    counts: list[int | None] = []
    rms = []
    goal = _planned(fields[0].candidates, count, seed)
    for index, field in enumerate(fields):
        counts.append(_fewest(field.candidates, goal.value, most, seed) if index else count)
        design = _planned(field.candidates, counts[-1] or most, seed) if index else goal
        rms.append(field.after(design.chosen)[0])
        if progress is not None:
            progress(index + 1, len(fields))
    before = ruler.after(np.empty(0, np.intp))[0]
    names = tuple(instrument.name for instrument in instruments)
    return Comparison(names, tuple(counts), np.array(rms), before, most)


def _planned(candidates: Candidates, count: int, seed: int) -> exchange.Design:
    starts = STARTS if count <= FEW else 0
    return exchange.best(candidates, count, starts=starts, seed=seed, excursions=False)


def _fewest(candidates: Candidates, goal: float, most: int, seed: int) -> int | None:
    """The least number of candidates that reach the goal, by halving; None: more than `most`."""
    low, high = 0, 1
    while _planned(candidates, high, seed).value > goal:
        if high == most:
            return None
        low, high = high, min(2 * high, most)
    while high - low > 1:
        middle = (low + high) // 2
        if _planned(candidates, middle, seed).value > goal:
            low = middle
        else:
            high = middle
    return high


def _readings(count: int | None, name: str) -> str:
    return f"{count} {name} reading" + ("" if count == 1 else "s")
