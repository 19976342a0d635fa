"""Controllers' files that are told apart and not read: by name, with what is missing.

A line in `DECLINED` each; asked only of a file that no reader recognises.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from truepose.controllers._hal_text import hal_text, ini_entries, value_of
from truepose.controllers._linuxcnc_files import is_ini
from truepose.errors import Fault


@dataclass(frozen=True)
class Declined:
    """A file that is not read: `what` it is, why, in `missing`, and what helps instead."""

    what: str
    missing: str
    hint: str


CARTESIAN = "it is no parallel machine: its axes are moved one by one, or two by two"

LINUXCNC: dict[str, Declined] = {
    "rotarydeltakins": Declined(
        "a rotary delta in LinuxCNC's rotarydeltakins",
        "its four lengths do not say how far apart the rods are, nor how high its shoulders",
        "truepose init rotary_delta: shoulder_radius is platformradius, upper_arm thighlength, "
        "lower_arm shinlength, effector_radius footradius",
    ),
    "pentakins": Declined(
        "a pentapod in LinuxCNC's pentakins",
        "its effector's joints turn on rings about the tool's axis, and truepose has no strut that "
        "ends on a ring",
        "truepose init pentapod, and its joint centres by hand",
    ),
    "tripodkins": Declined(
        "a tripod in LinuxCNC's tripodkins",
        "truepose writes nothing for it with which what is read could be compared",
        "truepose init tripod, and its joint centres by hand",
    ),
}
"""Modules of LinuxCNC that move parallel machines and are not read."""

SERIAL = re.compile(r"[a-z0-9_-]{0,40}kins")

TEXTS: tuple[tuple[re.Pattern[str], Declined], ...] = (
    (
        re.compile(
            r"^\s*(?:arm_solution|arm_length|arm_radius|alpha_steps_per_mm|gamma_max)\s+\S",
            re.MULTILINE,
        ),
        Declined(
            "a configuration of Smoothieware",
            "truepose writes nothing for it with which what is read could be compared, and of its "
            "tower and endstop trims no documentation says which way they count",
            "truepose init linear_delta: radius is arm_radius and the effector's radius, rod "
            "arm_length",
        ),
    ),
    (
        re.compile(r"^\$1(?:00|01|02)\s*=", re.MULTILINE),
        Declined("settings of Grbl", CARTESIAN, "nothing of it can be read"),
    ),
    (
        re.compile(r"^EPR:\d+ \d+ ", re.MULTILINE),
        Declined(
            "a dump of Repetier's EEPROM",
            "its numbers are told by places that differ from version to version",
            "truepose init linear_delta, with the numbers of its delta",
        ),
    ),
)
"""What other controllers' files begin a line with."""


def declined(text: str) -> Fault | None:
    """Why a file is not read, where it is known what it is."""
    kinematics = _kinematics(text)
    if kinematics is not None:
        other = Declined(f"LinuxCNC's {kinematics}", CARTESIAN, "nothing of it can be read")
        return fault_of(LINUXCNC.get(kinematics, other), kinematics)
    for signs, what in TEXTS:
        if match := signs.search(text):
            return fault_of(what, match[0].strip())
    return None


def fault_of(declined: Declined, found: str) -> Fault:
    """What is told of it."""
    return Fault(
        "import-declined",
        f"{declined.what} is not imported: {declined.missing}",
        found[:60],
        "a machine that a reader takes: truepose import --list",
        declined.hint,
    )


def _kinematics(text: str) -> str | None:
    """The module that a configuration of LinuxCNC loads, None where it is none."""
    if "kins" not in text:
        return None
    if is_ini(text):
        entry = value_of(ini_entries(text, ""), "KINS", "KINEMATICS")
        words = [] if entry is None else entry.text.split()
        return words[0] if words and SERIAL.fullmatch(words[0]) else None
    hal = hal_text(text, "")
    for pin in (*hal.pins, *hal.modules):
        name = pin.text if pin.key == "loadrt" else pin.key.split(".")[0]
        if SERIAL.fullmatch(name):
            return name
    return None


__all__ = ["declined"]
