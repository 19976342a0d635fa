"""Force on the tool from cutting data."""

from __future__ import annotations

from truepose.machine.chains import Vector
from truepose.machine.tables.force import CuttingTable, KienzleTable

_UNIT_THICKNESS = 1e-3
"""m: the chip thickness that Kienzle's specific force k_c1.1 is stated for."""


def cutting_force(cutting: CuttingTable) -> Vector:
    """Force on the tool in N, base axes: each component is specific force x chip section.

    Gojtan & Hess-Coelho (2005): the chip's thickness times the depth, and times the width, of cut.
    """
    per_length = cutting.specific_force * cutting.chip_thickness
    x, y, z = (
        per_length * (cutting.depth * along_depth + cutting.width * along_width)
        for along_depth, along_width in zip(
            cutting.depth_direction, cutting.width_direction, strict=True
        )
    )
    return (x, y, z)


def kienzle_force(cutting: KienzleTable) -> Vector:
    """Force on the tool in N, base axes: F = k_c1.1 b h (h / 1 mm)^-m_c along the direction.

    Kienzle, O. (1952): Die Bestimmung von Kräften und Leistungen an spanenden Werkzeugen und
    Werkzeugmaschinen. VDI-Z 94 (11/12), 299-305.
    """
    thickness = cutting.chip_thickness
    specific = cutting.specific_force * (thickness / _UNIT_THICKNESS) ** -cutting.exponent
    force = specific * cutting.width * thickness
    x, y, z = (force * component for component in cutting.direction)
    return (x, y, z)
