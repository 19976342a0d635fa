"""The gate: whether a calibration may be used, why not, and what would help."""

from truepose.calibration.gate.verdict import Candidate, Gate, HeldOut, Reason, Remedy, judge

__all__ = ["Candidate", "Gate", "HeldOut", "Reason", "Remedy", "judge"]
