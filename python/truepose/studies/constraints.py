"""What a variant must have to be feasible: poses, conditioning, travel to spare.

What an optimiser is let do it does: without these it would shorten the rods until nothing is left
to be wrong at.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from truepose.arrays import Floats
from truepose.errors import Problem, RequestError

ROUNDING = 1e-12
"""Of a share: what is asked for in percent is no shorter than that."""


@dataclass(frozen=True)
class Constraints:
    """The least that a variant must have.

    `reach`: share of the poses of the base file; `conditioning`: at every pose, from 0 (singular)
    to 1; `travel_left`: share of a drive's travel between its coordinate and either end, at every
    pose. None: not asked.
    """

    reach: float = 1.0
    conditioning: float | None = None
    travel_left: float | None = None

    @property
    def needs_kinematics(self) -> bool:
        """Whether something is asked beside the reach."""
        return self.conditioning is not None or self.travel_left is not None

    def loses_reach(self, reach: float) -> bool:
        """Whether a variant with this share of the poses has too few."""
        return reach < self.reach - ROUNDING

    def broken(self, kinematics: Mapping[str, Any]) -> dict[str, str]:
        """The `code` and `reason` of the first constraint that does not hold; empty if all do."""
        asked = (
            ("conditioning", "conditioning", self.conditioning),
            ("travel_left", "travel to spare", self.travel_left),
        )
        for name, word, least in asked:
            value = float(kinematics[name])
            if least is not None and not value >= least - ROUNDING:
                reason = f"{word} {value:.4g} at the worst pose, at least {least:g} is asked"
                return {"code": name.replace("_", "-"), "reason": reason}
        return {}

    def shortfall(self, variants: Mapping[str, np.ndarray]) -> Floats:
        """(n,) how far infeasible variants are from feasible ones: comparable among themselves.

        Whoever loses poses is farther than whoever has them, badly conditioned.
        """
        short = np.where(variants["reach"] < self.reach - ROUNDING, 2.0 - variants["reach"], 0.0)
        missing = np.zeros(short.shape)
        for name in ("conditioning", "travel_left"):
            if (least := getattr(self, name)) is not None:
                lacking = np.nan_to_num((least - variants[name]) / least, nan=0.0)
                missing += np.clip(lacking, 0.0, 1.0)
        return np.asarray(np.where(short > 0.0, 1.0 + short, missing / 2.0), np.float64)


def required_constraints(
    reach: float, conditioning: float | None, travel_left: float | None
) -> Constraints:
    """The constraints of these numbers. Raises `RequestError` (bad-reach, bad-constraint)."""
    problems: list[Problem] = []
    if not 0.0 < reach <= 1.0:
        problems.append(
            Problem(
                "bad-reach",
                "no variant can be asked for such a share of the poses",
                found=f"{reach:g}",
                expected="a share above 0, at most 1, such as 0.98",
                hint=f"{reach:g} % is {reach / 100:g}" if 1.0 < reach <= 100.0 else None,
            )
        )
    for word, value, most in (
        ("conditioning", conditioning, 1.0),
        ("share of the travel to either end", travel_left, 0.5),
    ):
        if value is not None and not (math.isfinite(value) and 0.0 < value <= most):
            problems.append(
                Problem(
                    "bad-constraint",
                    f"no variant can be asked for such a {word}",
                    found=f"{value:g}",
                    expected=f"a number above 0, at most {most:g}",
                )
            )
    if problems:
        raise RequestError(*problems)
    own = tuple(None if one is None else float(one) for one in (conditioning, travel_left))
    return Constraints(float(reach), *own)


__all__ = ["Constraints", "required_constraints"]
