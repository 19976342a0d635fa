"""LinuxCNC's two kinds of files as text: an INI, and HAL files with what they set.

An INI has `[SECTION]` and `KEY = value` below it, keys may stand several times, and a comment has
a line of its own. A HAL file sets a pin with `setp pin value` or `pin = value`; `[SECTION]KEY` in
it is the INI's. Facts: https://linuxcnc.org/docs/stable/html/config/ini-config.html and the manual
page halcmd(1).
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

_SECTION = re.compile(r"\[\s*+([^\]\s]++)\s*+\]")
_OF_INI = re.compile(r"\[([A-Za-z0-9_]++)\](?:\(([A-Za-z0-9_]++)\)|([A-Za-z0-9_]++))")


INCLUDED = "#INCLUDE"


@dataclass(frozen=True)
class HalEntry:
    """`key` in `section`, or a pin of HAL where that is ""; its `text`, `file` and `line`."""

    section: str
    key: str
    text: str
    file: str
    line: int

    def __str__(self) -> str:
        return f"[{self.section}]{self.key}" if self.section else self.key


@dataclass(frozen=True)
class HalText:
    """What a HAL file says.

    `pins`: set to a value, in the file's order. `nets`: pins that a signal drives. `files`: those
    that it takes in by `source`. `modules`: loaded with `loadrt`, their names.
    """

    pins: tuple[HalEntry, ...]
    nets: tuple[HalEntry, ...]
    files: tuple[HalEntry, ...]
    modules: tuple[HalEntry, ...]


def ini_entries(text: str, file: str) -> list[HalEntry]:
    """The entries of an INI; a line that is none is left out, as LinuxCNC does.

    `#INCLUDE file` is an entry of the key INCLUDED.
    """
    entries = []
    section = ""
    for line, number in _whole_lines(text):
        said = line.strip()
        if said.startswith("#INCLUDE"):
            name = said.removeprefix("#INCLUDE").strip()
            entries.append(HalEntry(section, INCLUDED, name, file, number))
        if not said or said[0] in "#;":
            continue
        if match := _SECTION.match(said):
            section = match[1]
            continue
        key, equals, value = said.partition("=")
        if equals and key.strip():
            entries.append(HalEntry(section, key.strip(), value.strip(), file, number))
    return entries


def value_of(entries: Sequence[HalEntry], section: str, key: str) -> HalEntry | None:
    """The first entry of a key, which is the one that LinuxCNC reads; None without one."""
    for entry in entries:
        if entry.section == section and entry.key == key:
            return entry
    return None


def values_of(entries: Iterable[HalEntry]) -> dict[str, str]:
    """What HAL reads for `[SECTION]KEY`: of each the first."""
    known: dict[str, str] = {}
    for entry in entries:
        known.setdefault(str(entry), entry.text)
    return known


_NOTHING: Mapping[str, str] = {}


def hal_text(text: str, file: str, known: Mapping[str, str] = _NOTHING) -> HalText:
    """What a HAL file says; `known`: the INI's values, by `[SECTION]KEY`."""
    pins: list[HalEntry] = []
    nets: list[HalEntry] = []
    files: list[HalEntry] = []
    modules: list[HalEntry] = []
    for line, number in _whole_lines(text):
        words = _with_ini(line.split("#")[0], known).split()
        if len(words) < 2:
            continue
        if words[0] == "setp" and len(words) > 2:
            pins.append(HalEntry("", words[1], words[2], file, number))
        elif words[1] == "=" and len(words) > 2:
            pins.append(HalEntry("", words[0], words[2], file, number))
        elif words[0] == "net":
            ends = [word for word in words[2:] if word not in ("<=", "=>", "<=>")]
            nets += [HalEntry("", pin, words[1], file, number) for pin in ends]
        elif words[0] == "source":
            files.append(HalEntry("", "source", words[1], file, number))
        elif words[0] == "loadrt":
            modules.append(HalEntry("", "loadrt", words[1], file, number))
    return HalText(tuple(pins), tuple(nets), tuple(files), tuple(modules))


def _with_ini(line: str, known: Mapping[str, str]) -> str:
    """A line with `[SECTION]KEY` replaced by the INI's value; what it does not have stays."""

    def value(match: re.Match[str]) -> str:
        return known.get(f"[{match[1]}]{match[2] or match[3]}", match[0])

    return _OF_INI.sub(value, line)


def _whole_lines(text: str) -> Iterator[tuple[str, int]]:
    """Lines with those that a backslash continues, and the number of each first one."""
    begun, first = "", 1
    for number, line in enumerate(text.split("\n"), start=1):
        first = first if begun else number
        plain = line.rstrip("\r")
        if plain.endswith("\\"):
            begun += plain[:-1] + " "
            continue
        yield begun + plain, first
        begun = ""
    if begun:
        yield begun, first


__all__ = ["INCLUDED", "HalEntry", "HalText", "hal_text", "ini_entries", "value_of", "values_of"]
