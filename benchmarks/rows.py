"""What a benchmark is and what it reports.

Imports nothing heavy: a child's peak memory starts from that of the runner.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class Benchmark:
    """A module of this package by its name, how many cores it may use, and when it runs.

    One that is not `usual` takes minutes: it runs only where it is named.
    """

    name: str
    cores: int = 1
    usual: bool = True


@dataclass(frozen=True)
class Row:
    """One line of the results: a figure, what was asked of it, and the times behind it."""

    what: str
    measured: float
    unit: str  # "x" for a ratio, "" for a number
    bound: Literal["at least", "at most"]
    asked: float | None  # None: told for orientation
    detail: str

    @property
    def met(self) -> bool:
        """Whether the figure is as good as was asked; always so where nothing was asked."""
        if self.asked is None:
            return True
        if self.bound == "at least":
            return self.measured >= self.asked
        return self.measured <= self.asked

    def cells(self) -> tuple[str, str, str, str, str]:
        """What, measured, asked, met or missed, and the times behind it, as text."""
        asked = "" if self.asked is None else f"{self.bound} {self.asked:g} {self.unit}".rstrip()
        verdict = "" if self.asked is None else ("met" if self.met else "**missed**")
        measured = f"{self.measured:.3g} {self.unit}".rstrip()
        return (self.what, measured, asked, verdict, self.detail)
