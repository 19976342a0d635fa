"""Error sources made by hand for tests: any deviation of any parameter, no machine file needed."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from truepose.machine import Machine
from truepose.sources import OWN_GROUP, Deviation, PoseBlock

# Of each unit: about 0.1 mm, 0.2 mrad and 1e-4 of the travel, machines being about a metre.
SIZE = {"m": 1e-4, "rad": 2e-4, "1": 1e-4}


@dataclass(frozen=True)
class MadeSource:
    """A source that gives one deviation everywhere, or what `of_block` says at the poses."""

    tables: ClassVar[Mapping[str, Any]] = {}
    doc: ClassVar[str] = "made for a test"

    name: str
    given: Deviation | None = None
    of_block: Callable[[PoseBlock], Deviation] | None = None
    sets_overall_edges: bool = False
    asked: list[int] = field(default_factory=list)

    @classmethod
    def build(cls, parts: object) -> Self | None:
        return None

    def acts(self, condition: object) -> bool:
        return True

    def deviation(self, machine: Machine, condition: object, block: PoseBlock) -> Deviation:
        self.asked.append(block.indices.size)
        if self.of_block is not None:
            return self.of_block(block)
        assert self.given is not None
        return self.given


def with_sources(machine: Machine, *sources: Any) -> Machine:
    """The machine with these sources instead of its file's."""
    return dataclasses.replace(machine, sources=sources)


def sizes(machine: Machine) -> NDArray[np.float64]:
    """(n_parameter,) a deviation that each parameter may well have, SI."""
    length = machine.characteristic_length
    return np.array([SIZE[unit] * (length if unit == "m" else 1.0) for unit in machine.units])


def random_deviation(
    machine: Machine, seed: int, *, shift: bool = True, half: bool = True, groups: bool = True
) -> Deviation:
    """Deviations of about two thirds of all parameters, some of them twice, some in groups."""
    random = np.random.default_rng(seed)
    count = len(machine.parameters)
    columns = random.permutation(np.concatenate([np.arange(count), random.choice(count, 4)]))
    columns = columns[: 2 * columns.size // 3]
    size = sizes(machine)[columns]
    drawn = random.integers(-6, 3, columns.size)
    return Deviation.of(
        columns,
        random.normal(size=columns.size) * size if shift else 0.0,
        random.uniform(size=columns.size) * size if half else 0.0,
        groups=np.where(drawn < 0, OWN_GROUP, drawn) if groups else OWN_GROUP,
        sign=random.choice([-1.0, 1.0], columns.size),
        edge=[machine.parameters[c].endswith((".length", ".offset")) for c in columns],
    )
