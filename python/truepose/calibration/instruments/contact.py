"""contact: a point of the platform held in one fixed point, whatever the pose.

Nothing is read: that the target stands in the frame's origin is the measurement.
"""

from __future__ import annotations

from truepose.calibration.instruments._base import AXES, Kind, of_origin

KIND = Kind(
    "contact",
    "A target held in one fixed point, at several poses: a ball in a socket, a centre hole.",
    "by contact with one point alone",
    {},
    least=0,
    fixed=AXES,
    frame=of_origin,
)
