"""Readings in another frame than stated, or of another point of the platform."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from truepose.calibration.data_checks._base import Hypothesis, OfMend, View
from truepose.calibration.data_checks.nominal import Placement
from truepose.calibration.data_checks.placement import Free
from truepose.spatial import rotation_angle


def suppose_target(view: View) -> Iterator[Hypothesis]:
    """The point that is looked at stands off the stated one, along the platform's axes."""
    instrument = view.instrument
    if instrument.target_unknown or not _sees_point(view):
        return
    free = Free(tuple(instrument.frame.unknown), True, instrument.bias_unknown)
    judged = view.judge(free=free)
    off = judged.setup.target - np.array(instrument.target)
    shown = ", ".join(view.amount(float(each), "m") for each in off)
    words = f"the target stands ({shown}) off the stated point, in the platform's axes"
    yield Hypothesis(words, _columns(view), judged)


def suppose_frame(view: View) -> Iterator[Hypothesis]:
    """The frame stands elsewhere, or is turned, by one rigid motion for all rows."""
    instrument = view.instrument
    if all(instrument.frame.unknown) or not _sees_frame(view):
        return
    # Of a planar machine nothing tells a frame's height, nor its tilt.
    spatial = "z" in view.machine.components
    unknown = (True, True, spatial, spatial, spatial, True)
    free = Free(unknown, instrument.target_unknown, instrument.bias_unknown)
    judged = view.judge(free=free)
    stated, found = Placement.stated(instrument), judged.setup
    off = float(np.linalg.norm(found.origin - stated.origin))
    turn = float(rotation_angle(found.rotation @ stated.rotation.T))
    words = (
        f"the readings are in another frame than stated: its origin {view.amount(off, 'm')} away, "
        f"turned by {view.amount(turn, 'rad')}"
    )
    yield Hypothesis(words, _columns(view), judged)


def _sees_point(view: View) -> bool:
    return any(column.name in ("x", "y", "z", "distance") for column in view.columns)


def _sees_frame(view: View) -> bool:
    return any(
        column.unit != "rad" and not column.name.endswith(".length") for column in view.columns
    ) or any(column.name in ("a", "b", "c") for column in view.columns)


def _columns(view: View) -> tuple[str, ...]:
    return tuple(column.name for column in view.columns)


TARGET = OfMend(
    "target-offset", "the target's offset is forgotten or wrong", suppose_target, free=True
)
FRAME = OfMend("other-frame", "read in another frame than stated", suppose_frame, free=True)
