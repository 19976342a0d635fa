"""Acceptance: whether a calibration may be used, why not, and what would help."""

from truepose.calibration.acceptance.gate import Gate, assess
from truepose.calibration.acceptance.reasons import HeldOut, Reason
from truepose.calibration.acceptance.remedy import Candidate, Remedy

__all__ = ["Candidate", "Gate", "HeldOut", "Reason", "Remedy", "assess"]
