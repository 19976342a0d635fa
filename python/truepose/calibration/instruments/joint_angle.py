"""joint-angle: by how much struts are turned in a joint, as a redundant sensor there says."""

from __future__ import annotations

from truepose.calibration.instruments._base import Kind, of_rotation

KIND = Kind(
    "joint-angle",
    "By how much a strut is turned about an axis from a zero direction: sensors in passive joints.",
    "by angles of joints alone",
    {"angle": "angle"},
    frame=of_rotation,
    has_target=False,
    keys=("axis", "zero", "end"),
)
