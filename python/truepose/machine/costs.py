"""What may be chosen for a machine and what it costs: `[cost]` of its file, read and checked."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from truepose.representation import Facts, Represented

_AXIS = re.compile(r"\.[xyzuv]$")
_PART = re.compile(r"^(\w++)\.[^.]++\.")


@dataclass(frozen=True)
class CostLaw:
    """Cost of a half width t, SI: `cost (at / t)^power`, or `cost exp((at - t) / scale)`."""

    cost: float
    at: float
    power: int = 1
    scale: float | None = None

    def of(self, half: float) -> float:
        """Cost of a half width above zero; infinite where it is beyond all numbers."""
        try:
            if self.scale is not None:
                return self.cost * math.exp((self.at - half) / self.scale)
            return self.cost * (self.at / half) ** self.power
        except OverflowError:
            return math.inf


@dataclass(frozen=True)
class ToleranceCost:
    """A row of `[[cost.tolerance]]`: grades that may be chosen, from the finest.

    `path` in the file, such as `cost.tolerance[0]`, and its `line`. `features` (n,): the parameters
    that it is for, of the machine or of its family, `unit` of their deviations (m, rad or 1).
    `ties`: features, by number, that have one grade together, `tie_names` what they are called.
    `grades` (g,): as the file names them. `halves` (g, n): half widths; `costs` (g, n_tie) once a
    tie, never rising with the width. `law`: what the costs are of; None where a table says them.
    """

    path: str
    line: int | None
    of: str
    unit: str
    features: tuple[str, ...]
    ties: tuple[tuple[int, ...], ...]
    tie_names: tuple[str, ...]
    grades: tuple[str, ...]
    halves: tuple[tuple[float, ...], ...]
    costs: tuple[tuple[float, ...], ...]
    law: CostLaw | None

    def between(self, place: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Half widths (n,) and costs (n_tie,) at a `place` from 0, the finest, to g - 1.

        Between two grades the width is interpolated by its logarithm; so is the cost, where no law
        says it.
        """
        place = min(max(place, 0.0), len(self.grades) - 1.0)
        lower = min(int(place), max(len(self.grades) - 2, 0))
        upper, share = min(lower + 1, len(self.grades) - 1), place - lower
        halves = _between(self.halves[lower], self.halves[upper], share)
        if self.law is None or share == 0.0:
            return halves, _between(self.costs[lower], self.costs[upper], share)
        return halves, tuple(
            self.law.of(min(halves[member] for member in members)) for members in self.ties
        )


def _between(one: Sequence[float], other: Sequence[float], share: float) -> tuple[float, ...]:
    """Numbers above zero interpolated by their logarithms; by themselves where one is zero."""
    return tuple(
        a ** (1.0 - share) * b**share if a > 0.0 and b > 0.0 else (1.0 - share) * a + share * b
        for a, b in zip(one, other, strict=True)
    )


@dataclass(frozen=True)
class DesignOption:
    """An option of a choice: keys below a part and their values as TOML has them, and its cost."""

    name: str
    settings: tuple[tuple[str, str], ...]
    cost: float
    path: str
    line: int | None


@dataclass(frozen=True)
class DesignChoice:
    """A row of `[[cost.choice]]`: one of the `options` for all `parts`, or for each, if not `tied`.

    `parts`: paths, such as `strut.1`.
    """

    name: str
    parts: tuple[str, ...]
    tied: bool
    options: tuple[DesignOption, ...]
    path: str
    line: int | None


@dataclass(frozen=True, repr=False)
class Costs(Represented):
    """`[cost]` of a machine file. `unit` of all costs; empty where the file says none.

    `text` and `folder`: of the file, which options are written into.
    """

    unit: str
    tolerances: tuple[ToleranceCost, ...]
    choices: tuple[DesignChoice, ...]
    text: str = field(repr=False)
    folder: str = field(repr=False)

    def path(self, name: str) -> Path:
        """Where a machine file called `name` is, so that it finds its data files."""
        return Path(self.folder) / Path(name).name

    def _facts(self) -> Facts:
        yield "unit", self.unit or None
        for row in self.tolerances:
            yield row.of, f"{len(row.ties)} to choose, of {len(row.grades)} grades each"
        for choice in self.choices:
            yield choice.name, ", ".join(option.name for option in choice.options)


def tie_of(feature: str, tie: str) -> str:
    """What a feature is tied to: its own name, that of its joint, or that of its kind."""
    if tie == "joint":
        return _AXIS.sub("", feature)
    if tie == "kind" and feature.startswith("family."):
        return ".".join(feature.split(".")[:2])  # the same of all limbs
    if tie == "kind":
        return _PART.sub(r"\1.*.", feature)
    return feature


__all__ = ["CostLaw", "Costs", "DesignChoice", "DesignOption", "ToleranceCost", "tie_of"]
