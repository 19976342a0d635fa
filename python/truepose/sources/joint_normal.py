"""The former place of `truepose.probability.joint_normal`, kept for this version."""

from __future__ import annotations

import warnings

from truepose.probability.joint_normal import normal_correlation, reach

warnings.warn(
    "truepose.sources.joint_normal is now truepose.probability.joint_normal",
    DeprecationWarning,
    stacklevel=2,
)

__all__ = ["normal_correlation", "reach"]
