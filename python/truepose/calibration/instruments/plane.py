"""plane: contact with a plane, such as the bed of a printer.

The plane is z = 0 of the frame; the platform touches it, or stands at a known distance over it.
"""

from __future__ import annotations

from truepose.calibration.instruments._base import Kind, of_readings

KIND = Kind(
    "plane",
    "Contact with a plane, or a known height over it: a probe on a flat bed, a feeler gauge.",
    "by contact with a plane alone",
    {"distance": "z"},
    optional=True,
    frame=of_readings,
)
