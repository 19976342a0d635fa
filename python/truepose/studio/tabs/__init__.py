"""What a window of the studio shows besides: a tab a file, and its line in `REGISTRY`."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from truepose.studio.answers import Question, Value
from truepose.studio.tabs import budget, calibration, modes, over_time, part, studies


@dataclass(frozen=True)
class Tab:
    """A tab: its name, what of the settings it follows from, and what gives its value."""

    name: str
    follows: frozenset[str]
    give: Callable[[Question], Iterator[Value]]


REGISTRY: tuple[Tab, ...] = tuple(
    Tab(module.NAME, module.FOLLOWS, module.give)
    for module in (budget, over_time, part, calibration, studies, modes)
)

TABS = {tab.name: tab for tab in REGISTRY}
"""By name."""

__all__ = ["REGISTRY", "TABS", "Tab"]
