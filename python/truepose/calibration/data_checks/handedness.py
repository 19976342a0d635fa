"""An axis that points the other way: coordinates of a left-handed frame."""

from __future__ import annotations

from collections.abc import Iterator

from truepose.calibration.data_checks._base import Hypothesis, HypothesisKind, View

_COORDINATES = ("x", "y", "z", "direction.x", "direction.y", "direction.z")


def propose(view: View) -> Iterator[Hypothesis]:
    """One coordinate, in all its columns, of the other sign."""
    for observable in _COORDINATES:
        columns = [
            c for c in view.columns if c.name == observable or c.name.endswith(f".{observable}")
        ]
        if columns:
            words = f"the {observable[-1]} axis points the other way (a left-handed frame)"
            yield view.negated(columns, words)


KIND = HypothesisKind("flipped-axis", "one axis points the other way", propose)
