"""The former place of `truepose.calibration.data_checks`, kept for this version."""

from __future__ import annotations

import warnings

from truepose.calibration.data_checks import suspicions

warnings.warn(
    "truepose.calibration.suspicions is now truepose.calibration.data_checks",
    DeprecationWarning,
    stacklevel=2,
)

__all__ = ["suspicions"]
