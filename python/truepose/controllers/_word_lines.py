"""Lines of commands with words, `M665 L215.0 R106.2`: which are to change for other numbers."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator

from truepose.controllers._edit import Edit, same_number
from truepose.controllers._export import Export
from truepose.controllers._reader import ControllerFile

CODES = ("M665", "M666")

_WORD = re.compile(r"(?<![A-Za-z])([A-Z])([-+.:\d]+)")
_COMMENT = re.compile(r"\s*(;.*)?$")


RADIUS_OF_WORKSPACE = ("M665 B",)
"""Of RepRapFirmware; it is printed beside the numbers that were fitted."""


def edits(file: ControllerFile, export: Export) -> Iterator[Edit]:
    """M665 and M666 of RepRapFirmware."""
    yield from word_edits(file, printed_words(export), RADIUS_OF_WORKSPACE)


def printed_words(export: Export) -> dict[str, dict[str, str]]:
    """Words of each command of an export, in their order."""
    lines = [line for text in export.files.values() for line in text.splitlines()]
    return {
        code: dict(_WORD.findall(line.removeprefix(code)))
        for code in CODES
        for line in lines
        if line.startswith(f"{code} ")
    }


def word_edits(
    file: ControllerFile, words: dict[str, dict[str, str]], kept: Collection[str] = ()
) -> Iterator[Edit]:
    """Of each word the last line of its command that has it, else a word more in that line.

    A command that the file does not have comes below the other one, or at its end. Words that are
    `kept`, "M665 B", stay as they are in the file.
    """
    lines = file.lines
    last = len(lines) if lines[-1] else len(lines) - 1
    places = {code: _lines_of(lines, code) for code in words}
    end = max((number for numbers in places.values() for number in numbers), default=last)
    for code, values in words.items():
        changed: dict[int, str] = {}
        for word, value in values.items():
            if f"{code} {word}" in kept and places[code]:
                continue
            has = [at for at in places[code] if word in dict(_words(lines[at - 1], code))]
            at = (has or places[code] or [0])[-1]
            if at:
                line = changed.get(at, lines[at - 1])
                changed[at] = _with_word(line, code, word, value)
        for at, line in changed.items():
            if line != lines[at - 1]:
                yield Edit(file, at, line)
        if not places[code]:
            new = " ".join([code, *(word + value for word, value in values.items())])
            yield Edit(file, end, below=(new,))


def _lines_of(lines: list[str], code: str) -> list[int]:
    """Numbers of the lines with a command that is no comment, from 1."""
    is_command = re.compile(rf"[^;]*(?<![A-Za-z\d]){code}(?!\d)")
    return [number for number, line in enumerate(lines, 1) if is_command.match(line)]


def _words(line: str, code: str) -> list[tuple[str, str]]:
    _, _, behind = line.partition(";")[0].partition(code)
    return _WORD.findall(behind)


def _with_word(line: str, code: str, word: str, value: str) -> str:
    """The line with a word changed, or a word more before its comment."""
    begin = line.index(code) + len(code)
    comment = _COMMENT.search(line, begin)
    assert comment is not None
    stop = line.index(";", begin) if ";" in line[begin:] else comment.start()
    for match in _WORD.finditer(line, begin, stop):
        if match[1] == word:
            if same_number(match[2], value):
                return line
            return line[: match.start(2)] + value + line[match.end(2) :]
    body = line[:stop].rstrip()
    return f"{body} {word}{value}{line[len(body) :]}"


__all__ = ["CODES", "edits", "printed_words", "word_edits"]
