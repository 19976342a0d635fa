"""Thermal expansion: a strut that is warmer than the reference is longer.

    shift = expansion * (temperature - reference temperature) * length

with the strut's length at the pose, so that a telescopic strut grows by what it is long there.
The temperatures are known: there is no band. `docs/sources/thermal.md` has the reference.
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


@dataclass(frozen=True)
class Thermal:
    """Expansion of the struts; temperature and expansion may differ from strut to strut."""

    name: ClassVar[str] = "thermal"
    doc: ClassVar[str] = "thermal expansion of the struts"
    tables: ClassVar[Mapping[str, type[BaseModel]]] = {}
    sets_overall_edges: ClassVar[bool] = False

    requested: bool
    """The file gives a temperature and an expansion, were it the reference temperature."""

    @classmethod
    def build(cls, parts: FileParts) -> Self | None:
        """Always there, for a condition given later may have temperatures that the file has not."""
        for strut in parts.struts:
            if strut.expansion is None and parts.condition.temperature_rise(strut.part) != 0.0:
                refuse(parts, _no_expansion(strut))
        known = any(strut.expansion is not None for strut in parts.struts)
        return cls(requested=known and parts.says("condition.temperature"))

    def acts(self, condition: Condition) -> bool:
        """Where the file asks for it, and in any condition that leaves the reference."""
        temperatures = (condition.default_temperature, *condition.part_temperatures.values())
        return self.requested or any(t != condition.reference_temperature for t in temperatures)

    def deviation(self, machine: Machine, condition: Condition, block: Block) -> Deviation:
        """Growth of every strut's length, m, (n, n_closure).

        Raises `TrueposeError` (no-expansion) for struts off the reference temperature whose
        expansion the machine does not say; all of them at once.
        """
        rises = np.array([condition.temperature_rise(strut.part) for strut in machine.struts])
        silent = [
            strut
            for strut, rise in zip(machine.struts, rises, strict=True)
            if rise != 0.0 and strut.expansion is None
        ]
        if silent:
            raise TrueposeError(*map(_no_expansion, silent))
        expansions = np.array([strut.expansion or 0.0 for strut in machine.struts])
        return Deviation.of(machine.kernel.length_parameters, block.lengths * (expansions * rises))


def _no_expansion(strut: Strut) -> Problem:
    return Problem(
        code="no-expansion",
        message=f"strut {strut.name} is not at the reference temperature, "
        "but nothing says how much it expands",
        path=f"strut.{strut.name}",
        found="neither expansion nor material",
        expected='expansion = "1.1e-5 1/K", or a material',
        hint="a strut that does not expand has expansion = 0",
    )
