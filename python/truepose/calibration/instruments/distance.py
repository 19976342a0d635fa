"""distance: how far a target is from the origin of the frame."""

from __future__ import annotations

from truepose.calibration.instruments._base import Kind, of_origin

KIND = Kind(
    "distance",
    "How far a target is from a fixed point: a ball bar, a wire sensor, an interferometer that "
    "follows.",
    "by distances alone",
    {"distance": "distance"},
    frame=of_origin,
)
