"""Error sources: what moves the machine's parameters, each in a file of its own.

A source is the new file and its line in `REGISTRY`; the machine file's keys, the budget, the
documentation's table and the law tests walk the registry.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, cast

from truepose.probability.distributions import Listed, discrete, empirical, student_t
from truepose.sources._expansion import NO_MATERIAL, not_included, not_included_text
from truepose.sources.actuator import Actuator
from truepose.sources.backlash import Backlash
from truepose.sources.clearance import Clearance
from truepose.sources.deviation import (
    ARCSINE,
    OWN_GROUP,
    TRIANGULAR,
    TWO_POINT,
    UNIFORM,
    Deviation,
    Distribution,
    Source,
    normal,
)
from truepose.sources.elastic import Elastic
from truepose.sources.guideway import Guideway
from truepose.sources.loads import Loads
from truepose.sources.pose_block import PoseBlock
from truepose.sources.screw_coupling import ScrewCoupling
from truepose.sources.sensor import Sensor
from truepose.sources.thermal import Thermal
from truepose.sources.tolerance import DimensionalTolerance

if TYPE_CHECKING:
    from truepose.machine import Condition, Machine

REGISTRY: tuple[type[Source], ...] = (
    DimensionalTolerance,
    Thermal,
    Elastic,
    Loads,
    Backlash,
    Clearance,
    ScrewCoupling,
    Sensor,
    Actuator,
    Guideway,
)


def acting(machine: Machine, condition: Condition | None = None) -> tuple[Source, ...]:
    """The machine's sources that do something in `condition` (default: the machine's own)."""
    given = machine.condition if condition is None else condition
    sources = cast("tuple[Source, ...]", machine.sources)
    return tuple(source for source in sources if source.acts(given))


__all__ = [
    "ARCSINE",
    "NO_MATERIAL",
    "OWN_GROUP",
    "REGISTRY",
    "TRIANGULAR",
    "TWO_POINT",
    "UNIFORM",
    "Clearance",
    "Deviation",
    "Distribution",
    "Elastic",
    "Listed",
    "Loads",
    "PoseBlock",
    "Source",
    "Thermal",
    "acting",
    "discrete",
    "empirical",
    "normal",
    "not_included",
    "not_included_text",
    "student_t",
]
