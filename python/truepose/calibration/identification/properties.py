"""Properties that can be identified beside parameters: how heat or load changes a limb.

A property shifts parameters in proportion to itself, differently at every row: an expansion
coefficient by the strut's rise in temperature, a compliance by the load on it. By how much is asked
of the error sources themselves, so that what calibration finds is what the budget then uses.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

from truepose.machine import Machine
from truepose.machine.limbs import Limb, with_limbs
from truepose.machine.parts import Strut

Changed = Callable[[Machine, int, float], Machine | None]


@dataclass(frozen=True)
class PropertyKind:
    """A property of struts or limbs: `unit` and meaning of its unknown.

    `rows`: of which table of the machine, `struts` or `limbs`. `changed(machine, index, amount)`
    has the property of one row changed by `amount` of the unknown; None where the file does not say
    enough for a start. `step`: an amount by which its effect is asked; effects are in proportion.
    `written`: the keys of a row that it may stand in, with their dimension.
    """

    name: str
    rows: str
    unit: str
    label: str
    step: float
    changed: Changed
    written: Mapping[str, str]


def _expanded(machine: Machine, index: int, amount: float) -> Machine:
    strut = machine.struts[index]
    changed = dataclasses.replace(strut, expansion=(strut.expansion or 0.0) + amount)
    return _with_strut(machine, index, changed)


def _yielding(machine: Machine, index: int, amount: float) -> Machine | None:
    """The strut with its compliance (1 + amount) times what it was; its joints stay."""
    strut, share = machine.struts[index], 1.0 / (1.0 + amount)
    if strut.stiffness is not None:
        return _with_strut(
            machine, index, dataclasses.replace(strut, stiffness=strut.stiffness * share)
        )
    if strut.modulus is not None and strut.area is not None:
        return _with_strut(
            machine, index, dataclasses.replace(strut, modulus=strut.modulus * share)
        )
    return None


def _with_strut(machine: Machine, index: int, strut: Strut) -> Machine:
    struts = list(machine.struts)
    struts[index] = strut
    return dataclasses.replace(machine, struts=tuple(struts))


def _bending(machine: Machine, index: int, amount: float) -> Machine | None:
    """The limb whose beams give way (1 + amount) times as far; its joints stay."""
    limb = machine.limbs[index]
    if all(beam.section is None for beam in limb.beams):
        return None
    limbs = list(machine.limbs)
    limbs[index] = dataclasses.replace(limb, compliance=limb.compliance * (1.0 + amount))
    return with_limbs(machine, tuple(limbs))


_KINDS = (
    PropertyKind(
        "expansion",
        "struts",
        "1/K",
        "expansion of strut {}",
        1e-6,
        _expanded,
        {"expansion": "expansion"},
    ),
    PropertyKind(
        "compliance",
        "struts",
        "1",
        "relative change of compliance of strut {}",
        1.0,
        _yielding,
        {"stiffness": "stiffness", "modulus": "stress"},
    ),
    PropertyKind(
        "compliance",
        "limbs",
        "1",
        "relative change of compliance of the beams of limb {}",
        1.0,
        _bending,
        {"compliance": "ratio"},
    ),
)
"""By the last word of the unknown's name, `strut.<name>.expansion`. A compliance's unknown is its
relative change, for it may be stated as a stiffness, or as a modulus and a section."""


@dataclass(frozen=True)
class Property:
    """One property of one strut or limb, by its index."""

    kind: PropertyKind
    index: int

    @property
    def unit(self) -> str:
        """SI unit of its unknown."""
        return self.kind.unit

    @property
    def step(self) -> float:
        """An amount by which its effect is asked; effects are in proportion."""
        return self.kind.step

    def label(self, machine: Machine) -> str:
        """For people."""
        return self.kind.label.format(self._row(machine).name)

    def name(self, machine: Machine) -> str:
        """As in `strut.1.expansion`."""
        return f"{self._row(machine).part}.{self.kind.name}"

    def start(self, machine: Machine) -> float:
        """What the unknown is counted from, SI: an expansion's own value, a relative change's 0."""
        found = getattr(self._row(machine), self.kind.name, None)
        return float(found or 0.0) if self.kind.unit != "1" else 0.0

    def edits(self, before: Machine, after: Machine) -> Iterator[tuple[str, str, float]]:
        """(path, dimension, value in SI) of the keys that differ between two machines."""
        old, new = self._row(before), self._row(after)
        for key, dimension in self.kind.written.items():
            if getattr(new, key) != getattr(old, key):
                yield f"{new.part}.{key}", dimension, float(getattr(new, key))

    def _row(self, machine: Machine) -> Strut | Limb:
        row: Strut | Limb = getattr(machine, self.kind.rows)[self.index]
        return row

    def changed(self, machine: Machine, amount: float) -> Machine | None:
        """The machine with the property changed; None where there is nothing to start from."""
        return self.kind.changed(machine, self.index, amount)


def properties_of(machine: Machine) -> dict[str, Property]:
    """Every property that could be identified, by name."""
    every = (
        Property(kind, index)
        for kind in _KINDS
        for index in range(len(getattr(machine, kind.rows)))
    )
    return {identifiable.name(machine): identifiable for identifiable in every}
