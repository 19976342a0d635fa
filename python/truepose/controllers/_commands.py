"""Commands of printers' firmware in any text that holds them: a file, a dump, a host's log.

A command is a letter G or M and its number, then words, a letter and its value each. Hosts write
before a line who spoke and when, and Marlin says `echo:`; both are left away here. What stands in
quotation marks or braces is one value, `;` and parentheses begin comments.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

_PREFIX = re.compile(
    r"\s*+(?:(?P<echo>echo\s*+:)|(?:recv|send|sending|sent|read|write|tx|rx)\s*+:|[<>]{1,3}+"
    r"|\[[^\]\n]{0,40}+\]|#++(?=\s*+(?:recv|sent|send)\b)"
    r"|\d{1,2}:\d\d:\d\d[\d.,:]*+(?:\s*+[ap]m)?(?:\s++:)?+)\s*+",
    re.IGNORECASE,
)
_CODE_AND_WORDS = re.compile(r"(?:N\d++\s*+)?([GM])\s*+(\d++(?:\.\d++)?)", re.IGNORECASE)
_WORD = re.compile(
    r'\s*+(?:([A-Za-z])\s*+("[^"\n]*+"|\{[^}\n]*+\}|[^\sA-Za-z"{;(]*+)|\([^)\n]*+\))'
)


_REPRAP = re.compile(
    r"^(?:M(?:98|584|569|574|557|558|550|563|667|669|911|950)\b|M665\b[^;\n]*L[\d.]+:"
    r"|; config-override\.g|M666\b[^;\n]*[AB]-?\d|G30 P\d|(?:G32 )?bed probe heights:"
    r"|Stopped at height )",
    re.IGNORECASE,
)


@dataclass(frozen=True)
class Line:
    """A line of a text without what a host put before it.

    `number` from 1; `echoed`: whether the firmware said `echo:` before it.
    """

    text: str
    number: int
    echoed: bool


@dataclass(frozen=True)
class FirmwareCommand:
    """`code` such as "M665", in capitals; `words`: letter in capitals -> its value as written."""

    code: str
    words: Mapping[str, str]
    line: int
    echoed: bool


def lines(text: str) -> Iterator[Line]:
    """The lines of a text that say anything."""
    for number, line in enumerate(text.split("\n"), start=1):
        echoed, at = False, 0
        while (match := _PREFIX.match(line, at)) and match.end() > at:
            echoed = echoed or match["echo"] is not None
            at = match.end()
        if said := line[at:].strip():
            yield Line(said, number, echoed)


def commands(text: str) -> list[FirmwareCommand]:
    """The commands of a text, in their order; lines that are none are left out."""
    every = (command(line) for line in lines(text))
    return [found for found in every if found is not None]


def command(line: Line) -> FirmwareCommand | None:
    """The command of a line, or None where it is something else; of one letter the last counts."""
    match = _CODE_AND_WORDS.match(line.text)
    if match is None:
        return None
    words: dict[str, str] = {}
    at = match.end()
    while (word := _WORD.match(line.text, at)) and word.end() > at:
        if word[1]:
            words[word[1].upper()] = word[2].strip()
        at = word.end()
    number = match[2].lstrip("0") or "0"
    return FirmwareCommand(f"{match[1].upper()}{number}", words, line.number, line.echoed)


def only_reprap(text: str) -> bool:
    """Whether a text has what RepRapFirmware alone takes or prints, and no delta of Marlin's."""
    return any(_REPRAP.match(line.text) for line in lines(text))


__all__ = ["FirmwareCommand", "Line", "command", "commands", "lines", "only_reprap"]
