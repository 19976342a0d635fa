"""Make a number of a machine small: an optimiser says which variants are evaluated.

Every evaluation is a variant of the study, in the order in which it was asked for, and stands in
the store with its settings. What is done is not evaluated again: the optimiser is asked anew from
the beginning, and gets the same answers, so that it goes on where it was.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from truepose.arrays import Flags, Floats
from truepose.errors import Problem, RequestError
from truepose.studies.block import INFEASIBLE, OK, Arrays, BlockTask
from truepose.studies.evaluators import BlockEvaluator
from truepose.studies.objectives import Objective
from truepose.studies.optimiser import search
from truepose.studies.plan import StudyPlan
from truepose.studies.varied_keys import VariedKey

if TYPE_CHECKING:
    import xarray as xr

WORSE = 1e6
"""m or rad: no machine is so wrong. A variant that is infeasible is worse than any that is not."""

NEVER = 4.0 * WORSE
"""Of a variant that is no machine."""


class KeptVariants(Protocol):
    """A store of a study, or what stands for one."""

    def done(self) -> Flags:
        """(n_variant,) which are evaluated."""

    def read(self) -> xr.Dataset:
        """All of it."""

    def write(self, number: int, arrays: Arrays) -> None:
        """Keep the variables of a variant."""


@dataclass(frozen=True, eq=False)
class Minimised:
    """What is to be made small, of which variables, in how many evaluations.

    `template`: a task without variants.
    """

    objective: Objective
    varied: tuple[VariedKey, ...]
    count: int
    seed: int
    template: BlockTask

    def value_of(self, variants: Mapping[str, np.ndarray]) -> Floats:
        """(n,) what the optimiser is told of variants, finite: of any two the better is smaller."""
        status = np.asarray(variants["status"]).astype(object)
        value = np.full(len(status), NEVER)
        fine = status == OK
        value[fine] = np.nan_to_num(self.objective.of(variants)[fine], nan=NEVER)
        short = self.template.constraints.shortfall(variants)
        lost = status == INFEASIBLE
        value[lost] = WORSE * (1.0 + short[lost])
        return value

    def run(
        self, kept: KeptVariants, evaluator: BlockEvaluator, told: Callable[[int], None]
    ) -> None:
        """Evaluate what the optimiser asks for and is not done yet.

        Raises `RequestError`: other-study, and as `evaluator` and `kept` do.
        """
        asked = _Evaluations(self, kept, evaluator, told)
        search(asked, len(self.varied), self.count, self.seed)


class _Evaluations:
    """Answers what the optimiser asks, of what is done already where it is."""

    def __init__(
        self,
        of: Minimised,
        kept: KeptVariants,
        evaluator: BlockEvaluator,
        told: Callable[[int], None],
    ) -> None:
        self._of, self._kept, self._evaluator, self._told = of, kept, evaluator, told
        self._done = kept.done()
        before = kept.read()
        self._settings = before["setting"].values
        self._values = of.value_of({str(name): one.values for name, one in before.items()})
        self._number = 0

    def __call__(self, shares: Floats) -> Floats:
        first = self._number
        self._number += len(shares)
        texts, numbers = [], []
        for at, variable in enumerate(self._of.varied):
            words, values = variable.at_shares(shares[:, at])
            texts.append(words)
            numbers.append(values)
        settings = np.array(texts, object).T
        tasks: list[BlockTask] = []
        keys = tuple(variable.key for variable in self._of.varied)
        for row in range(len(shares)):
            own = tuple(settings[row].tolist())
            if self._done[first + row]:
                self._require_same(first + row, own)
            else:
                variant = tuple(f"{key}={text}" for key, text in zip(keys, own, strict=True))
                tasks.append(self._of.template.of(first + row, (variant,)))
        columns = np.array(numbers).T
        for number, arrays in self._evaluator.evaluate(iter(tasks), self._told):
            row = number - first
            asked = {"setting": settings[row : row + 1], "value": columns[row : row + 1]}
            self._kept.write(number, {**asked, **arrays})
            self._values[number] = self._of.value_of(arrays)[0]
        return np.asarray(self._values[first : first + len(shares)], np.float64)

    def _require_same(self, number: int, asked: tuple[str, ...]) -> None:
        found = tuple(map(str, self._settings[number]))
        if found != asked:
            raise RequestError(
                Problem(
                    "other-study",
                    f"the optimiser asks for another variant {number} than the store has",
                    found="; ".join(found),
                    expected="; ".join(asked),
                    hint="it was begun with another SciPy: go on with that, or give another "
                    "--output",
                )
            )


def undrawn(varied: tuple[VariedKey, ...], count: int) -> StudyPlan:
    """The plan of which every row is yet to be asked for."""
    shape = (count, len(varied))
    keys, units = tuple(one.key for one in varied), tuple(one.unit for one in varied)
    return StudyPlan(keys, units, np.full(shape, "", object), np.full(shape, np.nan))


__all__ = ["Minimised", "undrawn"]
