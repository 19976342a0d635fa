"""Which lines of a printer.cfg are to change: in its block of SAVE_CONFIG, in what it includes."""

from __future__ import annotations

import re
from collections.abc import Iterator

from truepose.controllers._edit import Edit, no_difference, same_number
from truepose.controllers._export import Export
from truepose.controllers._reader import ControllerFile
from truepose.controllers.klipper.config import Entry, read_config

_HEADER = re.compile(r"\[(.+)\]")
_PRINTED = re.compile(r"(\w+): (\S+)")

NOT_FITTED = ("kinematics", "print_radius", "minimum_z_position")
"""Options that are printed beside the numbers: those of the file stay."""


def edits(file: ControllerFile, export: Export) -> Iterator[Edit]:
    """Of each number its line; what the file does not have comes below its section's beginning.

    Raises `MachineFileError` for a file that Klipper would not read, `RequestError` (no-difference)
    for one of another kind of machine.
    """
    config = read_config(file)
    (text,) = export.files.values()
    printed = dict(_numbers(text))
    wanted = printed["printer", "kinematics"]
    kinematics = config.get("printer", "kinematics")
    if kinematics is None or kinematics.text != wanted:
        found = "no kinematics" if kinematics is None else f"kinematics: {kinematics.text}"
        raise no_difference(
            f"{file.path} is not of this machine", found, f"[printer] with kinematics: {wanted}"
        )
    below: dict[str, list[str]] = {}
    for (section, name), value in printed.items():
        if name in NOT_FITTED:
            continue
        entry = config.get(section, name)
        if entry is None:
            below.setdefault(section, []).append(f"{name}: {value}")
        elif not same_number(entry.text, value):
            yield Edit(entry.file, entry.line, _changed(entry, name, value))
    for section, lines in below.items():
        begins = config.sections.get(section)
        if begins is None:
            yield Edit(file, 0, below=(f"[{section}]", *lines, ""))
        else:
            mark = "#*# " if begins.saved else ""
            yield Edit(begins.file, begins.line, below=tuple(mark + line for line in lines))


def _numbers(text: str) -> Iterator[tuple[tuple[str, str], str]]:
    """Section, option and value of every line that was printed."""
    section = ""
    for line in text.splitlines():
        header, option = _HEADER.fullmatch(line), _PRINTED.fullmatch(line)
        if header is not None:
            section = header[1]
        elif option is not None:
            yield (section, option[1]), option[2]


def _changed(entry: Entry, name: str, value: str) -> str:
    """The line with another value; what stands before and behind it stays."""
    line = entry.file.lines[entry.line - 1]
    start = re.match(rf"(?:#\*# )?\s*{re.escape(name)}\s*[:=]\s*", line, re.IGNORECASE)
    if start is None or not line.startswith(entry.text, start.end()):
        raise no_difference(
            f"{entry.file.path}:{entry.line}: this number is not in one line",
            line.strip()[:80],
            f"{name}: {value}, in one line",
        )
    return line[: start.end()] + value + line[start.end() + len(entry.text) :]


__all__ = ["edits"]
