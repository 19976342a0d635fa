"""Corrected programs: G-code whose poses take the actual machine where the program asks."""

from __future__ import annotations

from truepose.controllers.gcode._refusals import NoBetter
from truepose.controllers.gcode.correct import correct_program
from truepose.controllers.gcode.exact_stops import ExactStops
from truepose.controllers.gcode.proof import Errors, Proof, Worst
from truepose.controllers.gcode.tolerance import PathTolerance

__all__ = [
    "Errors",
    "ExactStops",
    "NoBetter",
    "PathTolerance",
    "Proof",
    "Worst",
    "correct_program",
]
