"""Acceptance: whether a calibration may be used, why not, and what would help."""

from truepose.calibration.acceptance.decision import (
    Candidate,
    Gate,
    HeldOut,
    Reason,
    Remedy,
    assess,
)

__all__ = ["Candidate", "Gate", "HeldOut", "Reason", "Remedy", "assess"]
