"""What a study may be asked to make small: one number of each variant."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from truepose.arrays import Floats
from truepose.errors import Problem, RequestError
from truepose.files.wording import did_you_mean, one_of
from truepose.verdict.answer import STATES

MINIMISE = "minimise"
"""In what makes a study this one: the name of its objective."""


@dataclass(frozen=True)
class Objective:
    """A number of a variant: that of the `variable` at `index` beyond the dim variant.

    `quantity`: of which quantity of a study it is; `title`: what it is, for people.
    """

    name: str
    quantity: str
    variable: str
    index: tuple[int, ...]
    title: str

    def of(self, variants: Mapping[Any, Any]) -> Floats:
        """(n_variant,) its values in the variables of a study, SI."""
        values = np.asarray(variants[self.variable], np.float64)
        for at in self.index:
            values = values[:, at]
        return values


OBJECTIVES = {
    one.name: one
    for one in (
        Objective("error", "error", "linear_maximum", (0,), "linear maximum of the position"),
        Objective("known", "error", "known", (0,), "known error of the position"),
        *(
            Objective(
                f"coverage-{state.partition(' ')[0]}",
                "coverage",
                "coverage_95",
                (at, 0),
                f"position error that 95 % of all machines stay below, {state}",
            )
            for at, state in enumerate(STATES)
        ),
    )
}


def required_objective(name: str) -> Objective:
    """The objective of this name. Raises `RequestError` (unknown-choice)."""
    if name not in OBJECTIVES:
        raise RequestError(
            Problem(
                "unknown-choice",
                "a study can make no such number small",
                found=str(name),
                expected=one_of(OBJECTIVES),
                hint=did_you_mean(str(name), OBJECTIVES),
            )
        )
    return OBJECTIVES[name]


__all__ = ["MINIMISE", "OBJECTIVES", "Objective", "required_objective"]
