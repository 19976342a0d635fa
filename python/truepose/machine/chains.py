"""What limbs, and the carriages and arms of drives, are made of: joints and beams, in series."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from truepose.machine.sections import Section
from truepose.spatial import tangents

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class ChainJoint:
    """A joint: `prismatic`, `revolute`, `universal` or `spherical`.

    N/m and N m/rad, infinite where it is rigid. A revolute gives way across its axis by `radial`
    and along it by `axial`, another across and along the limb. A prismatic gives way `across` its
    way, along y and z, and by `tilt` about its way, y and z; of other joints all three are one.
    """

    kind: str
    radial: float = math.inf
    axial: float = math.inf
    across: tuple[float, float] = (math.inf, math.inf)
    tilt: Vector = (math.inf, math.inf, math.inf)
    axis: Vector | None = None
    """The y of a prismatic, where it is not the limb's axis."""


@dataclass(frozen=True)
class Beam:
    """A uniform beam; `length` in m, None: what the other beams leave.

    `section` None: it is rigid. `modulus` and `shear_modulus` in Pa, `expansion` in 1/K.
    """

    length: float | None
    section: Section | None
    modulus: float = math.inf
    shear_modulus: float = math.inf
    expansion: float | None = None

    @property
    def per_metre(self) -> list[float]:
        """What a metre gives way: stretch, shear along y and z, torsion, bending about y and z.

        In 1/N and 1/(N m^2); the expansion, 1/K, comes last.
        """
        expansion = self.expansion or 0.0
        section = self.section
        if section is None:
            return [0.0] * 6 + [expansion]
        sheared = self.shear_modulus * section.area
        return [
            1.0 / (self.modulus * section.area),
            1.0 / (sheared * section.shear_y),
            1.0 / (sheared * section.shear_z),
            1.0 / (self.shear_modulus * section.torsion),
            1.0 / (self.modulus * section.about_y),
            1.0 / (self.modulus * section.about_z),
            expansion,
        ]


def triad(x: np.ndarray, nearest: np.ndarray | None) -> list[list[float]]:
    """Unit x, and across it the y that is nearest to a direction, if it is not along x."""
    x = x / np.linalg.norm(x)
    across = np.zeros(3) if nearest is None else nearest - (nearest @ x) * x
    size = float(np.linalg.norm(across))
    y = across / size if size > _ALONG else tangents(x)[0]
    return [x.tolist(), y.tolist()]


_ALONG = 1e-6
"""Sine of an angle below which a direction is no help to find one across another."""


def yields(stiffness: float) -> float:
    """Compliance of a stiffness; an infinite one is rigid."""
    return 0.0 if math.isinf(stiffness) else 1.0 / stiffness


__all__ = ["Beam", "ChainJoint", "triad", "yields"]
