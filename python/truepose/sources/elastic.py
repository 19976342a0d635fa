"""Elastic deformation under the wrench on the tool, of all that has a stiffness.

    shift = load on the parameter * compliance of the parameter

One rule for struts and their joints (on the strut's length), drives (on their offset) and what the
base joints stand on (on their x, y, z). The load comes from the closures by virtual work, at
nominal parameters and the commanded pose (the paper's way; the self-consistent equilibrium differs
in the second order). It is known: there is no band. `docs/sources/elastic.md` has the reference.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Self

import numpy as np

from truepose.errors import TrueposeError
from truepose.sources._stiffness import lacking
from truepose.sources.deviation import Deviation
from truepose.sources.pose_block import Cause, PoseBlock

if TYPE_CHECKING:
    from pydantic import BaseModel

    from truepose.machine import Condition, Machine, SourceBuilder

_ASKED_BY = ("condition.force", "condition.moment", "condition.cutting", "condition.kienzle")
_CAUSE = "a force acts on the tool"


@dataclass(frozen=True)
class Elastic:
    """Deflection of struts, joints, drives, carriages and frame, of given stiffness."""

    name: ClassVar[str] = "elastic"
    doc: ClassVar[str] = "elastic deformation under the wrench on the tool"
    tables: ClassVar[Mapping[str, type[BaseModel]]] = {}
    sets_overall_edges: ClassVar[bool] = False
    over_region: ClassVar[str] = "wrench"
    yields_under: ClassVar[Cause] = "tool"

    requested: bool
    """The file gives a wrench and a stiffness, were the wrench zero."""

    @classmethod
    def build(cls, parts: SourceBuilder) -> Self | None:
        """Always there, for a condition given later may have a force that the file has not."""
        problems = lacking(parts.drives, parts.struts, parts.limbs, _CAUSE)
        if np.any(parts.condition.wrench != 0.0):
            for problem in problems:
                parts.record(problem)
        known = len(problems) < len(parts.struts)
        return cls(requested=known and any(map(parts.has, _ASKED_BY)))

    def acts(self, condition: Condition) -> bool:
        """Where the file asks for it, and in any condition with a force or moment."""
        return self.requested or bool(np.any(condition.wrench != 0.0))

    def deviation(self, machine: Machine, condition: Condition, block: PoseBlock) -> Deviation:
        """Deflection of every parameter that gives way, m or rad, (n, k).

        Raises `TrueposeError` (no-stiffness) for limbs whose stiffness the machine does not say;
        all of them at once.
        """
        yielding = block.compliances
        columns = yielding.columns
        if not np.any(condition.wrench != 0.0):
            return Deviation.of(columns)
        problems = lacking(machine.drives, machine.struts, machine.limbs, _CAUSE)
        if problems:
            raise TrueposeError(*problems)
        return Deviation.of(columns, yielding.deflection(block.loads(columns, "tool")))
