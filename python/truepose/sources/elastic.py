"""Elastic deformation of the struts under the wrench on the tool.

    shift = tension * compliance,   compliance = length / (modulus * area)  or  1 / stiffness

The tension comes from the closures by virtual work, at nominal parameters and the commanded pose
(the paper's way; the self-consistent equilibrium differs in the second order). It is known: there
is no band. `docs/sources/elastic.md` has the reference.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Self

import numpy as np

from truepose.errors import Problem, TrueposeError
from truepose.sources._base import Block, Deviation, refuse

if TYPE_CHECKING:
    from pydantic import BaseModel

    from truepose.machine import Condition, FileParts, Machine, Strut

_ASKED_BY = ("condition.force", "condition.moment", "condition.cutting")


@dataclass(frozen=True)
class Elastic:
    """Axial stretch of the struts, of given stiffness or of given section and modulus."""

    name: ClassVar[str] = "elastic"
    doc: ClassVar[str] = "elastic deformation of the struts under the wrench on the tool"
    tables: ClassVar[Mapping[str, type[BaseModel]]] = {}
    sets_overall_edges: ClassVar[bool] = False

    requested: bool
    """The file gives a wrench and a stiffness, were the wrench zero."""

    @classmethod
    def build(cls, parts: FileParts) -> Self | None:
        """Always there, for a condition given later may have a force that the file has not."""
        if np.any(parts.condition.wrench != 0.0):
            for problem in filter(None, map(_no_stiffness, parts.struts)):
                refuse(parts, problem)
        known = any(_no_stiffness(strut) is None for strut in parts.struts)
        return cls(requested=known and any(map(parts.says, _ASKED_BY)))

    def acts(self, condition: Condition) -> bool:
        """Where the file asks for it, and in any condition with a force or moment."""
        return self.requested or bool(np.any(condition.wrench != 0.0))

    def deviation(self, machine: Machine, condition: Condition, block: Block) -> Deviation:
        """Stretch of every strut's length, m, (n, n_closure), tension positive.

        Raises `TrueposeError` (no-stiffness) for struts whose stiffness the machine does not
        say; all of them at once.
        """
        columns = machine.kernel.length_parameters
        if not np.any(condition.wrench != 0.0):
            return Deviation.of(columns)
        problems = [problem for problem in map(_no_stiffness, machine.struts) if problem]
        if problems:
            raise TrueposeError(*problems)
        return Deviation.of(columns, block.tension * machine.axial_compliance(block.lengths))


def _no_stiffness(strut: Strut) -> Problem | None:
    if strut.stiffness is not None or (strut.area is not None and strut.modulus is not None):
        return None
    lacking = [
        name
        for name, value in (("section_area", strut.area), ("modulus", strut.modulus))
        if value is None
    ]
    return Problem(
        code="no-stiffness",
        message=f"a force acts on the tool, but nothing says how stiff strut {strut.name} is",
        path=f"strut.{strut.name}",
        found="no " + " and no ".join(lacking),
        expected="section_area and modulus (or material), or an outright axial stiffness",
        hint='for example section_area = "28.3 mm^2" and material = "steel"',
    )
