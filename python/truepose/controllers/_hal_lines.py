"""Which lines of a HAL file, or of LinuxCNC's INI, are to change for other numbers."""

from __future__ import annotations

import re
from collections.abc import Iterator

from truepose.controllers._edit import Edit, no_difference, same_number
from truepose.controllers._export import Export
from truepose.controllers._reader import ControllerFile

_SETP = re.compile(r"(?P<begin>\s*setp\s+(?P<key>\S+)\s+)(?P<value>\S+)(?P<rest>.*)$")
_NET = re.compile(r"\s*net\s+\S+(?P<pins>[^#]*+)")
_SECTION = re.compile(r"\s*\[(\w+)\]")
_KEY = re.compile(r"(?P<begin>\s*(?P<key>\w+)\s*=\s*)(?P<value>\S+)(?P<rest>.*)$")

NOT_FITTED = ("KINS", "TRAJ")
"""Sections that are printed beside the numbers: those of the file stay."""


def edits(file: ControllerFile, export: Export) -> Iterator[Edit]:
    """The pins of a HAL file; of an INI the numbers of its joints.

    Raises `RequestError` (no-difference) for a file that sets none of them.
    """
    ini = any(_SECTION.match(line) for line in file.lines)
    of_kind = [text for name, text in export.files.items() if name.endswith(".ini") == ini]
    wanted = {place: value for text in of_kind for place, _, value in _placed(text.split("\n"))}
    wanted = {place: v for place, v in wanted.items() if place[0] not in NOT_FITTED}
    last: dict[tuple[str, str], tuple[int, str]] = {}
    sections: dict[str, int] = {}
    for place, number, value in _placed(file.lines):
        last[place] = number, value
        sections[place[0]] = number
    if not last.keys() & wanted.keys():
        raise no_difference(
            f"{file.path} has none of these numbers",
            "no line that sets one of them",
            "a file with " + ", ".join(_told(place) for place in list(wanted)[:2]) + ", ...",
        )
    below: dict[int, list[str]] = {}
    # A pin that a signal drives is not set.
    driven = {pin for line in file.lines for pin in _driven(line)}
    for place, value in wanted.items():
        if place not in last:
            if place[1] in driven:
                continue
            new = f"{place[1]} = {value}" if ini else f"setp {place[1]} {value}"
            below.setdefault(sections.get(place[0], max(sections.values())), []).append(new)
            continue
        number, before = last[place]
        if not same_number(before, value):
            match = (_KEY if ini else _SETP).match(file.lines[number - 1])
            assert match is not None
            yield Edit(file, number, match["begin"] + value + match["rest"])
    for number, lines in below.items():
        yield Edit(file, number, below=tuple(lines))


def _placed(lines: list[str]) -> Iterator[tuple[tuple[str, str], int, str]]:
    """Section and key of every line that sets a value, its number from 1, and the value."""
    section = ""
    for number, line in enumerate(lines, 1):
        header = _SECTION.match(line)
        if header is not None:
            section = header[1]
            continue
        match = _SETP.match(line) or (_KEY.match(line) if section else None)
        if match is not None:
            yield (section, match["key"]), number, match["value"]


def _driven(line: str) -> list[str]:
    """Pins of a net; arrows between them are for people."""
    net = _NET.match(line)
    return [] if net is None else net["pins"].split()


def _told(place: tuple[str, str]) -> str:
    return f"[{place[0]}]{place[1]}" if place[0] else place[1]


__all__ = ["edits"]
