"""Error sources: what moves the machine's parameters, each in a file of its own.

A source is the new file and its line in `REGISTRY`; the machine file's keys, the budget, the
documentation's table and the law tests walk the registry.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, cast

from truepose.sources._base import (
    OWN_GROUP,
    UNIFORM,
    Block,
    Deviation,
    Distribution,
    Source,
    normal,
)
from truepose.sources.elastic import Elastic
from truepose.sources.thermal import Thermal
from truepose.sources.tolerance import Tolerance

if TYPE_CHECKING:
    from truepose.machine import Condition, Machine

REGISTRY: tuple[type[Source], ...] = (
    Tolerance,
    Thermal,
    Elastic,
)


def acting(machine: Machine, condition: Condition | None = None) -> tuple[Source, ...]:
    """The machine's sources that do something in `condition` (default: the machine's own)."""
    given = machine.condition if condition is None else condition
    sources = cast("tuple[Source, ...]", machine.sources)
    return tuple(source for source in sources if source.acts(given))


__all__ = [
    "OWN_GROUP",
    "REGISTRY",
    "UNIFORM",
    "Block",
    "Deviation",
    "Distribution",
    "Source",
    "acting",
    "normal",
]
