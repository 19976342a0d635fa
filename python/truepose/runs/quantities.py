"""The quantities that errors are told of: position and orientation, and their components."""

from __future__ import annotations

import numpy as np

from truepose.arrays import Indices

POSITIONS = ("x", "y", "z")


def quantities(components: tuple[str, ...]) -> dict[str, Indices]:
    """Components of each quantity that the machine has: position (m), orientation (rad)."""
    kinds: dict[str, list[int]] = {}
    for index, component in enumerate(components):
        kind = "position" if component in POSITIONS else "orientation"
        kinds.setdefault(kind, []).append(index)
    return {
        kind: np.array(kinds[kind], np.intp)
        for kind in ("position", "orientation")
        if kind in kinds
    }
