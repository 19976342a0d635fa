"""Sizes of patterns for people, in the machine file's units."""

from __future__ import annotations

import numpy as np

from truepose.arrays import Floats
from truepose.calibration.acceptance import sentences
from truepose.calibration.residual_checks._base import ResidualsView


def length_words(view: ResidualsView, size: float) -> str:
    """A length as in "0.12 mm"."""
    return sentences.quantity(size, "m", units=view.machine.shown)


def place_words(view: ResidualsView, sizes: Floats) -> str:
    """How far a frame was moved and turned, or by how much the constants of columns changed."""
    if view.by_frame.any():
        parts = [(float(np.linalg.norm(sizes[:3])), "m"), (float(np.linalg.norm(sizes[3:])), "rad")]
    else:
        largest = int(np.argmax(np.abs(sizes)))
        own = view.by_column[:, largest] != 0.0
        unit = "m" if view.of_lengths[own].all() else "rad"
        parts = [(float(np.abs(sizes[largest])), unit)]
    said = [
        sentences.quantity(size, unit, units=view.machine.shown)
        for size, unit in parts
        if size > 0.0
    ]
    return " and ".join(said)
