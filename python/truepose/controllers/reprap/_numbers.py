"""The numbers of a RepRapFirmware delta by their words, from config.g and what it takes in.

`M98 P"file"` and, by `M501`, config-override.g are read where they stand in the file's folder; of
a word that stands twice the last counts. The numbers are mm, degrees and percent. Sources:
https://docs.duet3d.com, M665, M666, M669, M98, M501, G31.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from decimal import Decimal

from truepose.controllers._commands import FirmwareCommand, commands
from truepose.controllers._decimals import decimal_of
from truepose.controllers._towers import Held
from truepose.errors import Problem

WORDS = {"M665": "RHBXYZ", "M666": "XYZAB", "M92": "XYZ", "G31": "XYZ", "M557": "R"}
"""Commands whose words count, and the words; the rods, M665 L, are a list."""

KINDS = {
    "0": "Cartesian",
    "1": "CoreXY",
    "2": "CoreXZ",
    "3": "linear delta",
    "4": "serial SCARA",
    "5": "CoreXYU",
    "6": "Hangprinter",
    "7": "polar",
    "8": "CoreXYUV",
    "9": "five-bar SCARA",
    "10": "rotary delta",
    "11": "Markforged",
}
"""M669 K; from 3.7 on its value is a name."""

DELTA = ("3", "lineardelta")

DEEPEST = 5
"""Files that take in files."""

Beside = Callable[[str], tuple[str, str] | None]
"""A file's name -> its place and text, None where it is not in the folder."""


@dataclass
class RepRapNumbers:
    """What was said: `held` by word, rods as "M665 L0", ...; `kind` of M669 or M667.

    `missing`: files that are taken in and are not there.
    """

    held: dict[str, Held] = field(default_factory=dict)
    problems: list[Problem] = field(default_factory=list)
    kind: Held | None = None
    missing: list[str] = field(default_factory=list)
    files: list[str] = field(default_factory=list)


def numbers(text: str, file: str, beside: Beside) -> RepRapNumbers:
    """The numbers of a configuration."""
    said = RepRapNumbers()
    _read(text, file, beside, said, 0)
    return said


def _read(text: str, file: str, beside: Beside, said: RepRapNumbers, depth: int) -> None:
    for command in commands(text):
        if command.code in ("M98", "M501") and depth < DEEPEST:
            asked = "config-override.g" if command.code == "M501" else command.words.get("P", "")
            name = asked.strip('"').removeprefix("0:").removeprefix("/sys/").lstrip("/")
            other = beside(name) if name else None
            if other is None:
                said.missing += [name] if name else []
            elif other[0] not in (file, *said.files):
                said.files.append(other[0])
                _read(other[1], other[0], beside, said, depth + 1)
        elif command.code in ("M669", "M667") and (text_of := _kind(command)) is not None:
            said.kind = Held(command.code, text_of, Decimal(0), file, command.line)
        elif command.code in WORDS:
            if "L" in command.words and command.code == "M665":
                for name in [name for name in said.held if name.startswith("M665 L")]:
                    del said.held[name]
            for word in _words(command, file):
                if isinstance(word, Problem):
                    said.problems.append(word)
                else:
                    said.held[word.name] = word
            if command.code == "M665":
                said.kind = Held("M665", DELTA[0], Decimal(0), file, command.line)


def _kind(command: FirmwareCommand) -> str | None:
    """The kind of kinematics that a command sets, as M669 K has it."""
    if command.code == "M669":
        kind = command.words.get("K", "").strip('"').lower()
        return kind or None
    return command.words.get("S")  # M667 knows 0, 1 and 2, and means the same by them


def _words(command: FirmwareCommand, file: str) -> Iterator[Held | Problem]:
    def read(name: str, text: str) -> Held | Problem:
        value = decimal_of(text)
        if value is not None:
            return Held(name, text, value, file, command.line)
        hint = "expressions in braces are not computed" if "{" in text else None
        return Problem(
            "import-value",
            f"{name} cannot be read",
            file,
            command.line,
            found=repr(text),
            expected="a number",
            hint=hint,
        )

    for letter, text in command.words.items():
        name = f"{command.code} {letter}"
        if name == "M665 L":
            for at, rod in enumerate(text.split(":")):
                yield read(f"{name}{at}", rod.strip())
        elif letter in WORDS[command.code]:
            yield read(name, text)


__all__ = ["DELTA", "KINDS", "RepRapNumbers", "numbers"]
