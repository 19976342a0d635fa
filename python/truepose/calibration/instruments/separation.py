"""separation: how far the places of the target at two poses are from each other.

A calliper over two marks, a step gauge, a ball plate that is probed from ball to ball: lengths that
need no frame.
"""

from __future__ import annotations

from truepose.calibration.instruments._base import Kind

KIND = Kind(
    "separation",
    "How far the target's places at two poses are from each other: a calliper over two marks, a "
    "step gauge, a ball plate.",
    "by distances between two poses",
    {"distance": "separation"},
    poses=2,
)
