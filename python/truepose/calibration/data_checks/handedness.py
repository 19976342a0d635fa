"""An axis that points the other way: coordinates of a left-handed frame."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

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
    yield from _mirrored(view)


def _mirrored(view: View) -> Iterator[Hypothesis]:
    """What was read all at one height, as on a bed, with its deviations of the other sign."""
    for column in view.columns:
        own = column.observations
        if column.name not in _COORDINATES[:3]:
            continue
        predicted = view.readings.value[own] - view.as_given.residual[own]
        allowed = float(view.readings.scale[own].max())
        # About zero it is the axis that points the other way, about all of a frame its origin.
        if np.ptp(predicted) > allowed or np.abs(predicted).max() <= allowed:
            continue
        value = view.readings.value.copy()
        value[own] = 2.0 * predicted - value[own]
        words = f"the deviations of {column.name} from the command have the other sign"
        yield Hypothesis(words, (column.name,), view.suppose(value))


KIND = HypothesisKind(
    "flipped-axis", "one axis points the other way", propose, of_readings="numbers"
)
