"""A machine, one instrument and what can be found with it: what tests of calibration start from."""

from __future__ import annotations

import zlib
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from made_measurements import made_measurements, poses_within
from truepose.calibration.identification.equations import Equations, whitened
from truepose.calibration.identification.placement import place_instruments
from truepose.calibration.identification.problem import IdentificationProblem, Prior
from truepose.calibration.identification.unknowns import Unknowns, unknowns_of
from truepose.calibration.instruments import REGISTRY
from truepose.calibration.measurements import Measurements
from truepose.machine import Machine

Floats = NDArray[np.float64]

KNOWN_FRAMES = ("coordinate", "orientation", "joint-angle")
"""Kinds that are tried in the machine's own frame; that of the others, if any, is to be found."""

AT_TOOL = ("contact", "plane")
"""Kinds that are tried with the tool point as their target."""

BIASED = ("joint-angle", "strut-length")
"""Kinds that are tried with a constant to be found in what they read."""


def kinds_for(machine: Machine) -> list[str]:
    """The kinds of instruments that can see anything of a machine."""
    return [name for name, kind in REGISTRY.items() if kind.observed(machine.components)]


@dataclass(frozen=True, eq=False)
class CalibrationUnderTest:
    """`rows` poses, read by one instrument of a `kind`, of the machine as filed."""

    machine: Machine
    kind: str
    rows: int = 12
    uncertainty: float | None = None

    @property
    def seed(self) -> int:
        """The machine's and the kind's own."""
        return zlib.crc32(f"{self.machine.name}{self.kind}".encode())

    @cached_property
    def measurements(self) -> Measurements:
        """What the machine as filed shows."""
        poses = poses_within(self.machine, self.rows, seed=self.seed % 1000)
        known = REGISTRY[self.kind].frame is None or self.kind in KNOWN_FRAMES
        return made_measurements(
            self.machine,
            self.kind,
            poses,
            frame="base" if known else "unknown",
            uncertainty=self.uncertainty,
            values="nominal",
            target=(0.0, 0.0, 0.0) if self.kind in AT_TOOL else (0.02, -0.01, 0.03),
            bias_unknown=self.kind in BIASED,
        )

    @cached_property
    def unknowns(self) -> Unknowns:
        """Everything that has a tolerance, and the instrument's own."""
        return unknowns_of(self.machine, self.measurements)

    @cached_property
    def problem(self) -> IdentificationProblem:
        """The measurements with their frames where they begin."""
        standing = place_instruments(self.machine, self.measurements).measurements
        return IdentificationProblem(self.machine, standing, self.unknowns)

    def equations(self, *, use_prior: bool) -> Equations:
        """At the values where the search starts."""
        prior = Prior.of(self.unknowns, tolerances=use_prior)
        slope = whitened(self.problem, self.unknowns.prior_mean)
        return Equations.of(slope, prior, self.unknowns)

    def truth(self, random: np.random.Generator, share: float = 1.0) -> Floats:
        """(n,) unknowns of some machine: normal ones, `share` of the tolerances wide.

        The instruments stand up to 0.3 mm and mrad from where they start.
        """
        unknowns, known = self.unknowns, self.unknowns.has_prior
        values = np.zeros(unknowns.count)
        factor = np.linalg.cholesky(unknowns.prior_covariance[np.ix_(known, known)])
        values[known] = share * factor @ random.standard_normal(int(known.sum()))
        values += unknowns.prior_mean
        values[~known] = 3e-4 * random.standard_normal(int((~known).sum()))
        return values
