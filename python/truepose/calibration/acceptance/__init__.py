"""The gate: whether a calibration may be used, why not, and what would help."""

from truepose.calibration.acceptance.decision import Candidate, Gate, HeldOut, Reason, Remedy, judge

__all__ = ["Candidate", "Gate", "HeldOut", "Reason", "Remedy", "judge"]
