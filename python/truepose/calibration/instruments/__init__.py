"""Instruments: what measures a machine, each kind in a file of its own.

A kind is the new file and its line in `REGISTRY`; the reader of measurements, the documentation's
table and the tests walk the registry.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from truepose.calibration.instruments import (
    contact,
    coordinate,
    distance,
    joint_angle,
    orientation,
    parameter,
    plane,
    pose,
    position,
    separation,
    strut_direction,
    strut_length,
)
from truepose.calibration.instruments._base import (
    FRAME_FREEDOMS,
    KNOWN,
    Frame,
    Instrument,
    Kind,
)

REGISTRY: Mapping[str, Kind] = MappingProxyType(
    {
        module.KIND.name: module.KIND
        for module in (
            pose,
            position,
            coordinate,
            orientation,
            plane,
            distance,
            strut_length,
            strut_direction,
            joint_angle,
            contact,
            parameter,
            separation,
        )
    }
)
"""Every kind of instrument by its name."""

__all__ = ["FRAME_FREEDOMS", "KNOWN", "REGISTRY", "Frame", "Instrument", "Kind"]
