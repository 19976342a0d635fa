"""A target that is not where it is stated to be on the platform."""

from __future__ import annotations

import numpy as np

from truepose.calibration.residual_checks._base import Finding, PatternKind, ResidualsView
from truepose.calibration.residual_checks.sizes import length_words


def inspect(view: ResidualsView) -> Finding | None:
    """The offset that explains most; where it is looked for already, nothing is left."""
    if view.instrument.target_unknown or not view.by_target.any():
        return None
    pattern = view.pattern(view.by_target)
    if pattern is None:
        return None
    size = length_words(view, float(np.linalg.norm(pattern.sizes)))
    words = f"its target looks {size} off the stated point, in the platform's axes"
    return Finding(pattern, view.by_target, words)


KIND = PatternKind("target-offset", "the target is not at the stated point", inspect)
