"""Which lines are to change: M665 and M666 as they are sent, or Configuration.h's definitions."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping

from truepose.controllers._edit import Edit, no_difference, same_number
from truepose.controllers._export import Export
from truepose.controllers._reader import ControllerFile
from truepose.controllers._word_lines import CODES, printed_words, word_edits

NAMES: Mapping[str, tuple[str, ...]] = {
    "DELTA_DIAGONAL_ROD": ("M665 L",),
    "DELTA_RADIUS": ("M665 R",),
    "DELTA_HEIGHT": ("M665 H",),
    "DELTA_TOWER_ANGLE_TRIM": ("M665 X", "M665 Y", "M665 Z"),
    "DELTA_DIAGONAL_ROD_TRIM_TOWER": ("M665 A", "M665 B", "M665 C"),
    "DELTA_ENDSTOP_ADJ": ("M666 X", "M666 Y", "M666 Z"),
}
"""Name in Configuration.h -> the words that say the same."""

ZERO = "DELTA_RADIUS_TRIM_TOWER"
"""Radius trims, which the export takes to be 0."""

_DEFINE = re.compile(
    r"(?P<begin>\s*#\s*define\s+(?P<name>\w+)\s+)(?P<value>[^/]*?)(?P<rest>\s*(//.*|/\*.*)?)$"
)


def edits(file: ControllerFile, export: Export) -> Iterator[Edit]:
    """Raises `RequestError` (no-difference): a file with neither commands nor definitions."""
    words = printed_words(export)
    defined = [_DEFINE.match(line) for line in file.lines]
    names = {match["name"] for match in defined if match is not None}
    if "DELTA_RADIUS" in names:
        yield from _of_definitions(file, defined, words)
    elif any(code in file.text for code in CODES):
        yield from word_edits(file, words)
    else:
        raise no_difference(
            f"{file.path} is no file of a delta with Marlin",
            "neither M665 and M666 nor DELTA_RADIUS",
            "a file of commands, or Configuration.h",
        )


def _of_definitions(
    file: ControllerFile,
    defined: list[re.Match[str] | None],
    words: Mapping[str, Mapping[str, str]],
) -> Iterator[Edit]:
    missing = dict.fromkeys(NAMES)
    place = 0
    for number, match in enumerate(defined, 1):
        if match is None:
            continue
        name = match["name"]
        if name == "DELTA_RADIUS":
            place = number
        if name == ZERO or name in NAMES:
            missing.pop(name, None)
            values = ["0.0"] * 3 if name == ZERO else _values(name, words)
            before = [text.strip() for text in match["value"].strip(" {}").split(",")]
            if not same_number(":".join(before), ":".join(values)):
                yield Edit(file, number, match["begin"] + _written(values) + match["rest"])
    lines = tuple(f"#define {name} {_written(_values(name, words))}" for name in missing)
    if lines:
        yield Edit(file, place, below=lines)


def _values(name: str, words: Mapping[str, Mapping[str, str]]) -> list[str]:
    pairs = (word.split() for word in NAMES[name])
    return [words[code][letter] for code, letter in pairs]


def _written(values: list[str]) -> str:
    return values[0] if len(values) == 1 else f"{{ {', '.join(values)} }}"


__all__ = ["edits"]
