"""A pattern of tolerances that says nothing, since what it means has another."""

from __future__ import annotations

from collections.abc import Iterator

from truepose.language import say
from truepose.plausibility._base import MachineAtHome, Remark, Rule
from truepose.sources.tolerance import DimensionalTolerance


def inspect(view: MachineAtHome) -> Iterator[Remark]:
    """Every idle pattern; a calibrated file has full names beside the patterns of the drawing."""
    if view.machine.calibration is not None:
        return
    for source in view.machine.sources:
        if isinstance(source, DimensionalTolerance):
            for pattern, parameter, by in source.idle:
                yield (
                    say(
                        '"{pattern}" under [tolerance] changes nothing: what counts for '
                        "{parameter} is {by}, and each other that it matches has its own too; "
                        "usual is a pattern that some parameter is left for. Look at what counts, "
                        "and change that or take the pattern out. If it is meant, leave it",
                        pattern=pattern,
                        parameter=parameter,
                        by=by,
                    ),
                    (f"tolerance.{pattern}",),
                )


RULE = Rule(
    "idle-tolerance",
    "a pattern of [tolerance] changes nothing: every parameter that it matches has another",
    "No threshold: a full name goes before a pattern, and a strut's length_tolerance is one.",
    inspect,
)
