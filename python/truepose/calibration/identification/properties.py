"""Properties that can be identified beside parameters: how heat or load changes a strut's length.

A property shifts parameters in proportion to itself, differently at every row: an expansion
coefficient by the strut's rise in temperature, a compliance by the load on it. By how much is asked
of the error sources themselves, so that what calibration finds is what the budget then uses.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from truepose.machine import Machine
from truepose.machine.parts import Strut


@dataclass(frozen=True)
class PropertyKind:
    """A property of struts: `unit` and meaning of its unknown, and the strut with it changed.

    `changed(strut, amount)` has the property changed by `amount` of the unknown; None where the
    file does not say enough for a start. `value(strut)`: the property itself, SI, for people, and
    `of(strut, amount)` after the change.
    """

    name: str
    unit: str
    label: str
    step: float
    changed: Callable[[Strut, float], Strut | None]


def _expanded(strut: Strut, amount: float) -> Strut:
    return dataclasses.replace(strut, expansion=(strut.expansion or 0.0) + amount)


def _yielding(strut: Strut, amount: float) -> Strut | None:
    """The strut with its compliance (1 + amount) times what it was; its joints stay."""
    share = 1.0 / (1.0 + amount)
    if strut.stiffness is not None:
        return dataclasses.replace(strut, stiffness=strut.stiffness * share)
    if strut.modulus is not None and strut.area is not None:
        return dataclasses.replace(strut, modulus=strut.modulus * share)
    return None


PROPERTIES: Mapping[str, PropertyKind] = {
    kind.name: kind
    for kind in (
        PropertyKind("expansion", "1/K", "expansion of strut {}", 1e-6, _expanded),
        PropertyKind(
            "compliance", "1", "relative change of compliance of strut {}", 1.0, _yielding
        ),
    )
}
"""By the last word of the unknown's name, `strut.<name>.expansion`. A compliance's unknown is its
relative change, for it may be stated as a stiffness, or as a modulus and an area."""


@dataclass(frozen=True)
class Property:
    """One property of one strut, by its index."""

    kind: str
    strut: int

    @property
    def _kind(self) -> PropertyKind:
        return PROPERTIES[self.kind]

    @property
    def unit(self) -> str:
        """SI unit of its unknown."""
        return self._kind.unit

    @property
    def step(self) -> float:
        """An amount by which its effect is asked; effects are in proportion."""
        return self._kind.step

    def label(self, machine: Machine) -> str:
        """For people."""
        return self._kind.label.format(machine.struts[self.strut].name)

    def name(self, machine: Machine) -> str:
        """As in `strut.1.expansion`."""
        return f"{machine.struts[self.strut].part}.{self.kind}"

    def changed(self, machine: Machine, amount: float) -> Machine | None:
        """The machine with the property changed; None where there is nothing to start from."""
        changed = self._kind.changed(machine.struts[self.strut], amount)
        if changed is None:
            return None
        struts = list(machine.struts)
        struts[self.strut] = changed
        return dataclasses.replace(machine, struts=tuple(struts))


def properties_of(machine: Machine) -> dict[str, Property]:
    """Every property that could be identified, by name."""
    every = (Property(kind, index) for kind in PROPERTIES for index in range(len(machine.struts)))
    return {identifiable.name(machine): identifiable for identifiable in every}
