"""What a budget says over all its poses, added up block by block, wherever that was."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from truepose.arrays import Flags
from truepose.error_budget import comparison
from truepose.error_budget.guide_loads import GuideLoads
from truepose.machine import Machine
from truepose.runs.quantities import quantities
from truepose.sources import Deviation, PoseBlock

HIGHEST = {
    "highest_lower": "error_lower",
    "highest_upper": "error_upper",
    "highest_percent_lower": "percent_lower",
    "highest_percent_upper": "percent_upper",
    "overall_highest_lower": "overall_error_lower",
    "overall_highest_upper": "overall_error_upper",
    "overall_highest_percent_lower": "overall_percent_lower",
    "overall_highest_percent_upper": "overall_percent_upper",
}
"""What is highest over poses, and of which variable over poses."""


class Tally:
    """Over poses: what is highest, means, what guides carry, the distributions met."""

    def __init__(self, machine: Machine, n_source: int) -> None:
        self._kinds = quantities(machine.components)
        self._accuracy = machine.accuracy
        n_component = len(machine.components)
        self._highest = {
            name: comparison.Highest(
                (n_component,) if name.startswith("overall") else (n_source, n_component)
            )
            for name in HIGHEST
        }
        self._statistics = comparison.LengthStatistics(n_source, len(self._kinds))
        self._guides = GuideLoads(machine)
        self._distributions: list[dict[str, None]] = [{} for _ in range(n_source)]
        self.count = 0

    def note(self, deviations: Sequence[Deviation]) -> None:
        """The distributions inside the bands of a block's sources."""
        for names, deviation in zip(self._distributions, deviations, strict=True):
            names.update((str(deviation.distribution[k]), None) for k in deviation.banded)

    def add(
        self,
        block: PoseBlock,
        values: Mapping[str, np.ndarray],
        highest: Mapping[str, np.ndarray],
        usable: Flags,
    ) -> None:
        """The poses of a block where `usable` (n,), with `values` (n, ...) of each variable.

        `highest`: those of the variables over the block, where all of it is usable.
        """
        if not usable.any():
            return
        self.count += int(usable.sum())
        every = bool(usable.all())
        for name, running in self._highest.items():
            if every:
                running.raise_to(highest[HIGHEST[name]])
            else:
                running.add(values[HIGHEST[name]][usable])
        self._statistics.add(values["largest"] if every else values["largest"][usable])
        self._guides.add(block, usable)

    def join(self, later: Tally) -> None:
        """The poses that follow, of the same machine and sources: the bits of one tally of all."""
        self.count += later.count
        for name, running in self._highest.items():
            running.raise_to(later._highest[name].value)
        self._statistics.join(later._statistics)
        self._guides.join(later._guides)
        for names, more in zip(self._distributions, later._distributions, strict=True):
            names.update(more)

    def over_all(self) -> dict[str, Any]:
        """Every variable of the budget that has no pose."""
        statistics = self._statistics
        shares = comparison.share(statistics.highest[:, 0])
        return {
            **{name: running.value for name, running in self._highest.items()},
            "highest": statistics.highest,
            "rms": statistics.rms,
            "share": shares,
            "rank": comparison.rank(shares),
            "verdict": comparison.verdict(statistics.highest, self._kinds, self._accuracy),
        }

    def distributions(self) -> list[str]:
        """Those of each source, in words."""
        return [" / ".join(names) or "none" for names in self._distributions]

    def warnings(self) -> list[dict[str, str]]:
        """What the budget warns of: `code` and `sentence` of each."""
        return self._guides.warnings()


__all__ = ["HIGHEST", "Tally"]
