"""Distributions without ends, and where they are taken to end, so that there is a box.

A normal or Student's variable has none. Like the worst case, bounds take it in its stated band of
k standard deviations, or at as many standard deviations as are asked for; either is said.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from truepose.errors import Problem, RequestError
from truepose.runs.variables import Variables
from truepose.sources import Distribution

AS_STATED = "as stated"
"""Each in its own band of k standard deviations."""

NONE = "none"
"""Nothing is without ends."""


class Endless:
    """Names of variables whose distribution has no ends, by the distribution in words."""

    def __init__(self) -> None:
        self._names: dict[str, dict[str, None]] = {}

    def note(self, names: Iterable[str], distributions: Iterable[Distribution]) -> None:
        """Add those of these variables that have no ends."""
        for name, distribution in zip(names, distributions, strict=True):
            if not distribution.bounded:
                self._names.setdefault(str(distribution), {})[name] = None

    def __bool__(self) -> bool:
        return bool(self._names)

    def __str__(self) -> str:
        return "; ".join(f"{how}: {', '.join(of)}" for how, of in self._names.items()) or NONE


@dataclass(frozen=True)
class Ends:
    """`sigmas`: standard deviations at which a normal or Student's variable ends; None: as stated.

    `endless`: the variables met so far that have no ends.
    """

    sigmas: float | None
    endless: Endless = field(default_factory=Endless)

    @classmethod
    def of(cls, truncate: float | None) -> Ends:
        """Checked. Raises `RequestError` (bad-truncation)."""
        if truncate is None:
            return cls(None)
        fine = isinstance(truncate, float | int | np.number) and not isinstance(truncate, bool)
        if fine and math.isfinite(truncate) and truncate > 0.0:
            return cls(float(truncate))
        raise RequestError(
            Problem(
                "bad-truncation",
                "a distribution cannot be cut there",
                found=f"{truncate!r}",
                expected="a number of standard deviations above 0, such as 3",
            )
        )

    @property
    def attrs(self) -> dict[str, float | str]:
        """What the result says of it."""
        cut = AS_STATED if self.sigmas is None else self.sigmas
        return {"truncate": cut if self.endless else NONE, "unbounded": str(self.endless)}

    def truncated(self, variables: Variables) -> Variables:
        """The variables with every single variable in [-1, 1], also what has no ends."""
        self.endless.note(variables.names, variables.distributions)
        if self.sigmas is None:
            return variables.centred()
        factor = np.ones(len(variables.names))
        for at, distribution in enumerate(variables.distributions):
            if not distribution.bounded:
                factor[at] = self.sigmas / distribution.sigmas
        cut = dataclasses.replace(
            variables, half_width=variables.half_width * factor[variables.variable_of]
        )
        return cut.centred()
