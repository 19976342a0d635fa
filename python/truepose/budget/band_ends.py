"""Where distributions without ends are taken to end, so that there is a box to bound over."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numpy as np

from truepose.budget.spread import Spread
from truepose.errors import Problem, RequestError
from truepose.machine import Machine

NAMED = 3
"""Variables that a refusal names."""


@dataclass(frozen=True)
class Ends:
    """`sigmas`: standard deviations at which a normal or Student's distribution is cut, or None."""

    sigmas: float | None

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
        return {"truncate": "none" if self.sigmas is None else self.sigmas}

    def narrowed(self, machine: Machine, moves: Spread) -> Spread:
        """The spread with every single variable in [-1, 1]: what has no ends is cut.

        Raises `RequestError` (no-finite-band) where something has no ends and is not to be cut.
        """
        endless = [at for at, each in enumerate(moves.distributions) if not each.bounded]
        if not endless:
            return moves.centred()
        if self.sigmas is None:
            named = ", ".join(
                f"{moves.names[at]} ({moves.distributions[at]})" for at in endless[:NAMED]
            )
            more = f" and {len(endless) - NAMED} more" if len(endless) > NAMED else ""
            raise RequestError(
                Problem(
                    "no-finite-band",
                    "there is no bound where a deviation has no ends",
                    file=machine.file,
                    found=named + more,
                    expected="bands with ends, as uniform, triangular or listed values have",
                    hint="say where to cut: truncate=3 (--truncate 3) takes them to end at three "
                    "standard deviations, which the result then says",
                )
            )
        factor = np.ones(len(moves.names))
        for at in endless:
            factor[at] = self.sigmas / moves.distributions[at].sigmas
        cut = dataclasses.replace(moves, swing=moves.swing * factor[moves.variables])
        return cut.centred()
