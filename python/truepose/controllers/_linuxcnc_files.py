"""A LinuxCNC configuration as its readers see it: the INI's entries and the pins that HAL sets.

It begins with either file. An INI names its HAL files, `[HAL]HALFILE` and `HALCMD`, which count
where they stand in its folder; one that names none, and a HAL file, go with the file of the same
name and the other ending. Of a pin that is set twice the last counts.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from decimal import Decimal

from truepose.controllers._decimals import decimal_of
from truepose.controllers._hal_text import (
    INCLUDED,
    HalEntry,
    HalText,
    hal_text,
    ini_entries,
    value_of,
    values_of,
)
from truepose.errors import Problem

Beside = Callable[[str], tuple[str, str] | None]
"""A file's name -> its place and text, None where it is not in the folder."""

UNITS = {
    "mm": ("mm", Decimal(1)),
    "metric": ("mm", Decimal(1)),
    "inch": ("in", Decimal("25.4")),
    "in": ("in", Decimal("25.4")),
    "imperial": ("in", Decimal("25.4")),
}
"""LINEAR_UNITS -> the unit of a machine file, and mm of it."""

DEEPEST = 5
"""Files that `source` files."""


@dataclass
class Configuration:
    """The two files as one.

    `pins`: name -> where it is set. `driven`: pins that a signal drives, not a value. `left_out`:
    files that are named and were not read. `kinematics`: the module's name, None where neither
    file says. `known`: the INI's values as HAL reads them.
    """

    ini: list[HalEntry]
    pins: dict[str, HalEntry]
    driven: dict[str, HalEntry]
    left_out: list[str]
    files: list[str]
    kinematics: HalEntry | None
    known: dict[str, str] = field(default_factory=dict)

    def number(self, section: str, key: str, problems: list[Problem]) -> Decimal | None:
        """A number of the INI, None without one; one that cannot be read is a problem."""
        entry = value_of(self.ini, section, key)
        return None if entry is None else read(entry, problems)


def read(entry: HalEntry, problems: list[Problem]) -> Decimal | None:
    """The number that an entry has; what is none is a problem."""
    words = entry.text.split("#")[0].split()
    value = decimal_of(words[0]) if words else None
    if value is None:
        problems.append(
            Problem(
                "import-value",
                f"{entry} cannot be read",
                entry.file,
                entry.line,
                found=repr(entry.text[:60]),
                expected="a number",
            )
        )
    return value


def is_ini(text: str) -> bool:
    """Whether a text is an INI of LinuxCNC."""
    return any(
        entry.section in ("KINS", "EMCMOT", "TRAJ", "EMC", "HAL") for entry in ini_entries(text, "")
    )


def configuration(text: str, file: str, stem: str, beside: Beside) -> Configuration:
    """What a file and those that go with it say. `stem`: its name without the ending."""
    config = Configuration([], {}, {}, [], [file], None)
    if is_ini(text):
        _take_ini(config, text, file, beside, 0)
        _hal_of_ini(config, stem, beside)
    else:
        other = beside(f"{stem}.ini")
        if other is not None and is_ini(other[1]):
            config.files.append(other[0])
            _take_ini(config, other[1], other[0], beside, 0)
        _take(config, hal_text(text, file, config.known), beside, 0)
    named = value_of(config.ini, "KINS", "KINEMATICS")
    config.kinematics = named or config.kinematics
    return config


def _take_ini(config: Configuration, text: str, file: str, beside: Beside, depth: int) -> None:
    """The entries of an INI and of those that it includes."""
    for entry in ini_entries(text, file):
        if entry.key != INCLUDED:
            config.ini.append(entry)
            continue
        other = beside(entry.text) if depth < DEEPEST else None
        if other is None:
            config.left_out.append(entry.text)
        elif other[0] not in config.files:
            config.files.append(other[0])
            _take_ini(config, other[1], other[0], beside, depth + 1)
    config.known = values_of(config.ini)


def _hal_of_ini(config: Configuration, stem: str, beside: Beside) -> None:
    named = False
    for entry in config.ini:
        if entry.section != "HAL":
            continue
        if entry.key == "HALCMD":
            _take(config, hal_text(entry.text, entry.file, config.known), beside, 0, entry.line)
        elif entry.key == "HALFILE":
            named = True
            _take_file(config, entry.text.split()[:1], beside, 0)
    if not named:
        _take_file(config, [f"{stem}.hal"], beside, 0)


def _take_file(config: Configuration, names: Iterable[str], beside: Beside, depth: int) -> None:
    for name in names:
        other = None if name.startswith("LIB:") or name.endswith(".tcl") else beside(name)
        if other is None:
            config.left_out.append(name)
        elif other[0] not in config.files:
            config.files.append(other[0])
            _take(config, hal_text(other[1], other[0], config.known), beside, depth)


def _take(
    config: Configuration, said: HalText, beside: Beside, depth: int, line: int | None = None
) -> None:
    """What a HAL file says. `line`: of the INI, where it is a command there."""
    for pin in said.pins:
        config.pins[pin.key] = (
            pin if line is None else HalEntry("", pin.key, pin.text, pin.file, line)
        )
    for pin in said.nets:
        config.driven[pin.key] = pin
    for module in said.modules:
        name = module.text.split("=")[0]
        if name.endswith("kins"):
            config.kinematics = HalEntry("", "loadrt", name, module.file, line or module.line)
    if depth < DEEPEST:
        for source in said.files:
            _take_file(config, [source.text], beside, depth + 1)


__all__ = ["UNITS", "Beside", "Configuration", "configuration", "is_ini", "read"]
