"""Stretches of a program: which of its lines are an element, by line, N number, tool or comment."""

from __future__ import annotations

import bisect
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from truepose.arrays import Flags, Indices
from truepose.errors import Fault

Interval = tuple[int, int]
"""First and last line, counted from 1, both included."""

_ENDLESS = 1 << 62
"""A line behind the last of any program."""

_RANGE = re.compile(r"\s*+(\d{1,9})\s*+(?:-\s*+(\d{1,9})\s*+)?+")
_NUMBERED = re.compile(r"\s*+[Nn]?\s*+(\d{1,9})(?:\s*+-\s*+[Nn]?\s*+(\d{1,9}))?+\s*+")
_TOOL = re.compile(r"\s*+[Tt]?\s*+(\d{1,9})\s*+")

_COMMENT = re.compile(rb"\(([^()]*+)\)|;(.*+)")
_N = re.compile(rb"/?[Nn]0*+(\d++)")
_T = re.compile(rb"[Tt]0*+(\d++)")
_M6 = re.compile(rb"[Mm]0*+6(?![\d.])")
_BARE = re.compile(rb"\s*+(?:/?\s*+[Nn][\s\d.]++)?+")
"""What a line is besides its comments where it is a comment alone: nothing, or its N number."""

UNITS = (20, 21)
"""G codes of inches and millimetres."""

_MODAL = re.compile(rb"[Gg][ \t]*+0*+(1[789]|2[01])(?![\d.])")
"""Working planes and units, as a program sets them."""

_SAYS = re.compile(r"\s*+(?:(feature|datum)\s*+:|end\s++(?:feature|datum)\s*+\Z)", re.IGNORECASE)
"""How a comment begins that says something of the part."""


@dataclass(frozen=True)
class Address:
    """Where in a program an element is: on the lines of which all hold that is given.

    `lines`: intervals; `numbers`: from one N number to another, both included, in the order in
    which they stand; `tool`: its T number; `comment`: behind a comment that holds this text, up to
    the next line that is a comment alone, or in a line that has such a comment.
    """

    lines: tuple[Interval, ...] | None = None
    numbers: Interval | None = None
    tool: int | None = None
    comment: str | None = None

    @property
    def words(self) -> str:
        """The address as a file has it."""
        said = []
        if self.lines is not None:
            said.append(f'lines = "{", ".join(map(_in_words, self.lines))}"')
        if self.numbers is not None:
            first, last = self.numbers
            said.append(f'n = "N{first}"' if first == last else f'n = "N{first}-N{last}"')
        if self.tool is not None:
            said.append(f'tool = "T{self.tool}"')
        if self.comment is not None:
            said.append(f'comment = "{self.comment}"')
        return ", ".join(said)


def lines_of(text: str) -> tuple[Interval, ...] | Fault:
    """The intervals that "12-15, 20" is."""
    ranges = [match for part in text.split(",") if (match := _RANGE.fullmatch(part)) is not None]
    intervals = tuple((int(match[1]), int(match[2] or match[1])) for match in ranges)
    if len(ranges) == text.count(",") + 1 and all(0 < first <= last for first, last in intervals):
        return intervals
    return _unreadable(text, 'lines of the program, the first is 1, such as "12-15" or "12, 20-22"')


def numbers_of(text: str) -> Interval | Fault:
    """The interval that "N100-N140" is."""
    match = _NUMBERED.fullmatch(text)
    if match is None:
        return _unreadable(text, 'N numbers of the program, such as "N100" or "N100-N140"')
    return int(match[1]), int(match[2] or match[1])


def tool_of(text: str) -> int | Fault:
    """The number that "T3" is."""
    match = _TOOL.fullmatch(text)
    return _unreadable(text, 'a tool, such as "T3"') if match is None else int(match[1])


def _unreadable(text: str, expected: str) -> Fault:
    return Fault(
        "part-address",
        "this says no place in a program",
        found=f'"{text[:60]}"',
        expected=expected,
    )


@dataclass(frozen=True)
class Said:
    """A comment of the program that says something of the part.

    `word`: "feature" or "datum", "" of one that ends it; `text` behind the colon; `place`: the
    lines that it holds for, which are those of the comments directly with it.
    """

    line: int
    word: str
    text: str
    place: Interval


@dataclass(frozen=True)
class ProgramText:
    """What is asked of a program's text, found in one reading of it.

    `count` of lines; `said` in comments, in their order; `stretches` of each address, None where it
    is nowhere in the program; `planes` and `units`: from which line on G17, G18 or G19, and G20 or
    G21, hold.
    """

    count: int
    said: tuple[Said, ...]
    stretches: dict[Address, tuple[Interval, ...] | None]
    planes: tuple[tuple[int, int], ...] = ()
    units: tuple[tuple[int, int], ...] = ()


def holds_at(line: int, changes: Sequence[tuple[int, int]]) -> int | None:
    """The code of a group that holds in a line, of its `changes`; None before the first."""
    at = bisect.bisect_right(changes, line, key=lambda change: change[0])
    return changes[at - 1][1] if at else None


def read_text_of(program: Path, addresses: Iterable[Address]) -> ProgramText:
    """Look for the addresses, and for what comments say of the part. Raises `OSError`."""
    scan = _Scan(set(addresses))
    with program.open("rb") as file:
        for number, line in enumerate(file, 1):
            scan.line(number, line)
    return scan.found()


@dataclass
class _Open:
    """A stretch that is not ended yet, and those that are."""

    done: list[Interval] = field(default_factory=list)
    since: int | None = None

    def begin(self, line: int) -> None:
        if self.since is None:
            self.since = line

    def end(self, last: int) -> None:
        if self.since is not None and self.since <= last:
            self.done.append((self.since, last))
        self.since = None


class _Scan:
    """One reading of a program's lines."""

    def __init__(self, addresses: set[Address]) -> None:
        self._addresses = addresses
        self._count = 0
        self._said: list[tuple[int, str, str]] = []
        # Where a group of comments begins that have no words between them, and whether it is open.
        self._groups: list[int] = []
        self._together = False
        wanted = {address.numbers for address in addresses if address.numbers is not None}
        self._wanted = {number for interval in wanted for number in interval}
        self._numbers: dict[int, int] = {}
        self._texts = {
            address.comment: _Open() for address in addresses if address.comment is not None
        }
        self._with_tools = any(address.tool is not None for address in addresses)
        self._next_tool: int | None = None
        self._changed = False
        # Tools that are loaded by M6; and as T selects them, for programs without any M6.
        self._loaded: dict[int, _Open] = {}
        self._selected: dict[int, _Open] = {}
        self._modal: tuple[list[tuple[int, int]], list[tuple[int, int]]] = [], []

    def line(self, number: int, line: bytes) -> None:
        self._count = number
        code = line
        if b"(" in line or b";" in line:
            comments = [match[1] or match[2] or b"" for match in _COMMENT.finditer(line)]
            code = _COMMENT.sub(b"", line)
            self._comments(number, comments, alone=_BARE.fullmatch(code) is not None)
        elif self._together:
            self._together = not code.strip()
        for match in _MODAL.finditer(code):
            value = int(match[1])
            changes = self._modal[value >= UNITS[0]]
            if not changes or changes[-1][1] != value:
                changes.append((number, value))
        if not (self._wanted or self._with_tools):
            return
        code = code.translate(None, b" \t\r\n")
        numbered = _N.match(code)
        if numbered is not None and len(numbered[1]) < 10 and int(numbered[1]) in self._wanted:
            self._numbers.setdefault(int(numbered[1]), number)
        if self._with_tools:
            self._tools(number, code)

    def _comments(self, number: int, comments: Sequence[bytes], *, alone: bool) -> None:
        texts = [comment.decode("utf-8", "replace") for comment in comments]
        for text in texts:
            match = _SAYS.match(text)
            if match is not None:
                word = (match[1] or "").lower()
                self._said.append((number, word, text[match.end() :].strip()))
                self._groups.append(self._groups[-1] if word and self._together else number)
                self._together = bool(word)
        self._together = self._together and alone
        for wanted, stretch in self._texts.items():
            here = any(wanted.lower() in text.lower() for text in texts)
            if alone:
                stretch.end(number - 1)
                if here:
                    stretch.begin(number)
            elif here and stretch.since is None:
                stretch.done.append((number, number))

    def _tools(self, number: int, code: bytes) -> None:
        selected = _T.search(code)
        if selected is not None and len(selected[1]) < 10:
            self._next_tool = int(selected[1])
            _change(self._selected, self._next_tool, number)
        if _M6.search(code) is not None:
            self._changed = True
            if self._next_tool is not None:
                _change(self._loaded, self._next_tool, number)

    def found(self) -> ProgramText:
        last = self._count
        tools = self._loaded if self._changed else self._selected
        for stretch in (*self._texts.values(), *tools.values()):
            stretch.end(last)
        begins = sorted(set(self._groups))
        ends = dict(zip(begins, [*(line - 1 for line in begins[1:]), last], strict=False))
        said = tuple(
            Said(line, word, text, (first, ends[first]))
            for (line, word, text), first in zip(self._said, self._groups, strict=True)
        )
        stretches = {address: self._stretch(address, tools) for address in self._addresses}
        planes, units = map(tuple, self._modal)
        return ProgramText(last, said, stretches, planes, units)

    def _stretch(self, address: Address, tools: dict[int, _Open]) -> tuple[Interval, ...] | None:
        parts: list[Sequence[Interval]] = []
        if address.lines is not None:
            if any(last > self._count for _, last in address.lines):
                return None
            parts.append(_merged(address.lines))
        if address.numbers is not None:
            first, last = (self._numbers.get(number) for number in address.numbers)
            if first is None or last is None or last < first:
                return None
            parts.append([(first, last)])
        if address.tool is not None:
            parts.append(tools[address.tool].done if address.tool in tools else [])
        if address.comment is not None:
            parts.append(self._texts[address.comment].done)
        common: Sequence[Interval] = [(1, _ENDLESS)]
        for part in parts:
            common = list(_common(common, part))
        return tuple(common) or None


def _change(tools: dict[int, _Open], tool: int, line: int) -> None:
    for stretch in tools.values():
        stretch.end(line - 1)
    tools.setdefault(tool, _Open()).begin(line)


def _merged(intervals: Iterable[Interval]) -> list[Interval]:
    """The same lines in order, each once."""
    merged: list[Interval] = []
    for first, last in sorted(intervals):
        if merged and first <= merged[-1][1] + 1:
            merged[-1] = merged[-1][0], max(last, merged[-1][1])
        else:
            merged.append((first, last))
    return merged


def _common(some: Sequence[Interval], others: Sequence[Interval]) -> Iterator[Interval]:
    """The lines of both, which are in order."""
    at = 0
    for first, last in some:
        while at < len(others) and others[at][1] < first:
            at += 1
        place = at
        while place < len(others) and others[place][0] <= last:
            yield max(first, others[place][0]), min(last, others[place][1])
            place += 1


def common_lines(some: Sequence[Interval], others: Sequence[Interval]) -> tuple[Interval, ...]:
    """The lines that both have."""
    return tuple(_common(some, others))


def trimmed(place: Sequence[Interval], lines: Indices) -> tuple[Interval, ...]:
    """The same as to `lines` (n,), which are in order: from one of them to another of them.

    Two places that hold the same of these lines are one then. One that holds none is as it was.
    """
    kept: list[Interval] = []
    for first, last in place:
        begin, end = np.searchsorted(lines, first), np.searchsorted(lines, last, side="right")
        if begin == end:
            continue
        if kept and kept[-1][1] == lines[begin - 1]:
            kept[-1] = kept[-1][0], int(lines[end - 1])
        else:
            kept.append((int(lines[begin]), int(lines[end - 1])))
    return tuple(kept) or tuple(place)


class Stretches:
    """Stretches of lines of which no two have a line in common, each with its number."""

    def __init__(self, stretches: Sequence[Sequence[Interval]]) -> None:
        rows = sorted(
            (first, last, number)
            for number, intervals in enumerate(stretches)
            for first, last in intervals
        )
        table = np.array(rows, np.int64).reshape(-1, 3)
        self._first, self._last, self._number = table.T
        self.count = len(stretches)

    def number_of(self, lines: Indices) -> Indices:
        """(n,) of the stretch that each of lines (n,) is in, -1 of none."""
        if not self._first.size:
            return np.full(len(lines), -1, np.intp)
        at = np.searchsorted(self._first, lines, side="right") - 1
        within: Flags = (at >= 0) & (lines <= self._last[at])
        return np.where(within, self._number[at], -1).astype(np.intp)


def overlap(some: Sequence[Interval], others: Sequence[Interval]) -> Interval | None:
    """The first lines of both; None: they have none in common."""
    return next(_common(some, others), None)


def _in_words(interval: Interval) -> str:
    first, last = interval
    return str(first) if first == last else f"{first}-{last}"


def not_there(name: str, address: Address, text: ProgramText, program: str) -> Fault:
    """That an address is nowhere in the program."""
    return Fault(
        "part-not-there",
        f"{name} is said to be where the program {program} has nothing",
        found=address.words,
        expected=f"a place in its {text.count:,} lines",
        hint="lines are counted from 1, as an editor does; N numbers, tools and comments are as "
        "the program writes them",
    )


__all__ = [
    "UNITS",
    "Address",
    "Interval",
    "ProgramText",
    "Said",
    "Stretches",
    "common_lines",
    "holds_at",
    "lines_of",
    "not_there",
    "numbers_of",
    "overlap",
    "read_text_of",
    "tool_of",
    "trimmed",
]
