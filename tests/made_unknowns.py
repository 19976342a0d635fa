"""Unknowns of a machine, a posterior of them, and where they come from, for tests of results."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.calibration.identification.properties import Property
from truepose.calibration.result.bands import bands_of
from truepose.calibration.result.file import Provenance
from truepose.machine import Machine

PROVENANCE = Provenance("measurements.csv", "ab" * 32, "2026-03-04", 300, 41.25, 1.03125, 1.5)


@dataclass(frozen=True)
class MadeUnknowns:
    """Unknowns of the machine alone."""

    names: tuple[str, ...]
    columns: Indices
    effects: Floats
    properties: dict[int, Property] = field(default_factory=dict)

    @property
    def n_machine(self) -> int:
        return len(self.names)


def of_bands(machine: Machine) -> tuple[MadeUnknowns, Floats]:
    """One unknown for each variable of the tolerances with a band, and their deviations (n,)."""
    bands = bands_of(machine)
    assert bands is not None
    columns, numbers = np.unique(bands.variables[bands.banded]), bands.variables
    names, deviations = [], []
    effects = np.zeros((len(bands.parameters), len(columns)))
    for at, number in enumerate(columns):
        members = np.flatnonzero(numbers == number)
        moved = bands.signed_half[0, members]
        largest = np.abs(moved).max()
        effects[members, at] = moved / largest
        deviations.append(largest / bands.distribution[members[0]].sigmas)
        group = int(bands.groups[members[0]])
        own = machine.parameters[bands.parameters[members[0]]]
        names.append(bands.group_names.get(group, own))
    return MadeUnknowns(tuple(names), bands.parameters, effects), np.array(deviations)


def posterior(deviations: Floats, random: np.random.Generator, smallest: float = 1e-8) -> Floats:
    """A covariance (n, n) whose eigenvalues, scaled by deviations (n,), go down to `smallest`."""
    count = len(deviations)
    axes = np.linalg.qr(random.normal(size=(count, count)))[0]
    scaled = axes * np.geomspace(1.0, smallest, count) @ axes.T
    found: Floats = 0.5 * (scaled + scaled.T) * np.outer(deviations, deviations)
    return found
