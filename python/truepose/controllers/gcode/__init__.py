"""Corrected programs: G-code whose poses take the actual machine where the program asks."""

from __future__ import annotations

from truepose.controllers.gcode.correct import correct_program
from truepose.controllers.gcode.proof import Errors, Proof, Worst

__all__ = ["Errors", "Proof", "Worst", "correct_program"]
