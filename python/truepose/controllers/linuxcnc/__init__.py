"""LinuxCNC: a kinematics module with live compensation, and what to write into INI and HAL.

The generated module includes LinuxCNC's headers and is under GPL-2.0-or-later, as it says itself.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from typing import ClassVar

from truepose.controllers._export import Export, Option, geometry_compensated
from truepose.controllers._prefix import prefix_of, prefix_option
from truepose.controllers.c import WITHOUT, names_of, program_of
from truepose.controllers.linuxcnc._compensation import SPARE, default_clamp
from truepose.controllers.linuxcnc._configuration import hal_text, ini_text
from truepose.controllers.linuxcnc._description import HELD, MILLIMETRE, PINS, Description
from truepose.controllers.linuxcnc._module import PREFIX, module_text
from truepose.controllers.linuxcnc._safe_box import Box, safe_box
from truepose.errors import Problem, RequestError
from truepose.machine import Machine

HASH_DIGITS = 8


class LinuxCNC:
    """Kinematics module for LinuxCNC 2.9."""

    name: ClassVar[str] = "linuxcnc"
    doc: ClassVar[str] = (
        "kinematics module for LinuxCNC 2.9 that compensates live, with INI and HAL"
    )
    options: ClassVar[Mapping[str, Option]] = {
        "without": WITHOUT,
        "prefix": prefix_option(f"without it, pins with {PINS}"),
        "clamp": Option(
            0.0,
            "most that a joint is corrected by; 0: three times the most over the workspace",
            "length",
        ),
        "rate_limit": Option(1.0, "how fast a joint is corrected at most, mm/s"),
    }

    @classmethod
    def export(cls, machine: Machine, options: Mapping[str, float | str]) -> Export:
        """`truepose_NAME.c`, `.ini` and `.hal`, NAME that of the machine file.

        With `prefix`, that in place of `truepose`: in the names of files, module and pins. All
        three state one hash, which the module compares when it is loaded.

        Raises `RequestError`: controller-cannot, bad-option, no-workspace, and what the machine's
        C is refused for.
        """
        rate_limit = _positive("rate_limit", float(options["rate_limit"])) * MILLIMETRE
        asked = _not_negative("clamp", float(options["clamp"]))
        program = program_of(machine, PREFIX, names_of(options["without"]))
        pins = prefix_of("linuxcnc", options["prefix"]) or PINS
        description = Description.of(machine, program, pins)
        clamp = asked if asked > 0.0 else default_clamp(description)
        box = safe_box(description, clamp)
        module = description.module

        def files(mark: str) -> dict[str, str]:
            return {
                f"{module}.c": module_text(description, program.in_one, clamp, rate_limit, mark),
                f"{module}.ini": ini_text(description, box, clamp, mark),
                f"{module}.hal": hal_text(description, clamp, rate_limit, mark),
            }

        return Export(
            files(_hash_of(files(""))),
            (
                *program.statement,
                *_statement(description, box, clamp, rate_limit, asked > 0.0),
                *geometry_compensated(machine),
            ),
        )


def _hash_of(files: Mapping[str, str]) -> str:
    """What the module, INI and HAL file of one export have in common: of all that they say."""
    together = "".join(files.values()).encode()
    return hashlib.sha256(together).hexdigest()[:HASH_DIGITS]


def _statement(
    description: Description, box: Box, clamp: float, rate_limit: float, asked: bool
) -> list[str]:
    reason = "as asked" if asked else f"{SPARE:g} times the largest over the workspace"
    extent = ", ".join(
        f"{name} {low / unit:.6g} to {high / unit:.6g}"
        for name, low, high, unit in zip(
            description.machine.commanded, box.low, box.high, description.pose_units, strict=True
        )
    )
    size = "the whole workspace" if box.asked else "cut from the workspace"
    return [
        f"compensation of a joint: at most {clamp / MILLIMETRE:.6g} mm ({reason}), "
        f"at most {rate_limit / MILLIMETRE:.6g} mm/s",
        f"axis limits, mm and degrees: {extent} ({size}; {box.checked} poses checked)",
        *_axes_that_do_not_move(description),
        f"{description.module}.c includes LinuxCNC's headers: it is under GPL-2.0-or-later",
    ]


def _axes_that_do_not_move(description: Description) -> list[str]:
    commanded = description.machine.commanded
    held = [name for name, held in zip(commanded, description.held, strict=True) if held]
    reasons = (
        (description.locked, "locked: {}, for the machine has no such freedom"),
        (held, f"locked: {{}}, for the workspace holds it within {HELD:g} mm or degrees"),
        (description.following, "not commanded: {}, which the others make"),
    )
    return [text.format(", ".join(names)) for names, text in reasons if names]


def _positive(option: str, value: float) -> float:
    if value > 0.0:
        return value
    raise _bad(option, value, "above zero")


def _not_negative(option: str, value: float) -> float:
    if value >= 0.0:
        return value
    raise _bad(option, value, "zero or more")


def _bad(option: str, value: float, expected: str) -> RequestError:
    return RequestError(
        Problem(
            "bad-option",
            f"option {option} of linuxcnc cannot be {value:g}",
            found=f"{value:g}",
            expected=expected,
        )
    )


__all__ = ["LinuxCNC"]
