"""Readings in another frame than stated, or of another point of the platform."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from truepose.calibration.data_checks._base import Hypothesis, HypothesisKind, View
from truepose.spatial import quaternion_to_matrix, rotation_angle


def propose_target(view: View) -> Iterator[Hypothesis]:
    """The target is not at the stated point; the offset is along the platform's axes."""
    instrument = view.instrument
    if instrument.target_unknown or not _sees_point(view):
        return
    supposed = view.suppose(instrument=replace(instrument, target_unknown=True))
    off = supposed.misfit.placement.target - np.array(instrument.target)
    offset = ", ".join(view.format(float(component), "m") for component in off)
    words = f"the target stands ({offset}) off the stated point, in the platform's axes"
    yield Hypothesis(words, view.column_names, supposed)


def propose_frame(view: View) -> Iterator[Hypothesis]:
    """The frame is displaced and turned from the stated one, by one rigid motion for all rows."""
    instrument = view.instrument
    if all(instrument.frame.unknown) or not _sees_frame(view):
        return
    # Of a planar machine nothing tells a frame's height, nor its tilt.
    spatial = "z" in view.machine.components
    unknown = (True, True, spatial, spatial, spatial, True)
    stated = instrument.frame
    supposed = view.suppose(instrument=replace(instrument, frame=replace(stated, unknown=unknown)))
    fitted = supposed.misfit.placement.frame
    off = float(np.linalg.norm(np.subtract(fitted.origin, stated.origin)))
    turn = float(
        rotation_angle(
            quaternion_to_matrix(fitted.rotation) @ quaternion_to_matrix(stated.rotation).T
        )
    )
    words = (
        f"the readings are in another frame than stated: its origin {view.format(off, 'm')} away, "
        f"turned by {view.format(turn, 'rad')}"
    )
    yield Hypothesis(words, view.column_names, supposed)


def _sees_point(view: View) -> bool:
    return any(column.name in ("x", "y", "z", "distance") for column in view.columns)


def _sees_frame(view: View) -> bool:
    return any(
        column.unit != "rad" and not column.name.endswith(".length") for column in view.columns
    ) or any(column.name in ("a", "b", "c") for column in view.columns)


TARGET = HypothesisKind(
    "target-offset", "the target's offset is forgotten or wrong", propose_target, free=True
)
FRAME = HypothesisKind("other-frame", "read in another frame than stated", propose_frame, free=True)
