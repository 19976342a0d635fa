"""Klipper's printer.cfg: sections and options, what is included, and the block of SAVE_CONFIG.

`[section]` and `option: value` or `option = value`; a line that is indented goes on with the value
above; `#` begins a comment anywhere, `;` at the start of a line or behind a blank. A section that
stands twice is one, of an option that does the last counts. `[include pattern]` stands for the
files that it names, beside the file that it is in. Below a line `#*# <--- SAVE_CONFIG --->` Klipper
keeps what it found itself, each line behind `#*# `; what stands above it counts more, and where one
of its lines begins otherwise Klipper reads none of it. Facts from Klipper's configuration
reference (https://www.klipper3d.org/Config_Reference.html) and from what its own code takes.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from truepose.controllers._reader import ControllerFile
from truepose.errors import Fault, MachineFileError, Problem, ReadingError

_SAVED = (
    "#*# <---------------------- SAVE_CONFIG ---------------------->",
    "#*# DO NOT EDIT THIS BLOCK OR BELOW. The contents are auto-generated.",
    "#*#",
)
_MARK = "#*#"
_SECTION = re.compile(r"\[(?P<name>.+)\]")
_OPTION = re.compile(r"(?P<name>.*?)\s*[=:]\s*(?P<value>.*)$")
_BEHIND = re.compile(r"\s;.*$")


@dataclass(frozen=True)
class Entry:
    """A value as it is written, and where: `saved`, in the block of SAVE_CONFIG."""

    text: str
    file: ControllerFile
    line: int
    saved: bool = False


@dataclass
class Config:
    """The options of a printer.cfg by section and name, names of options in small letters.

    `hidden`: options of the saved block that are not read, as they stand above it. `unread_line`:
    the line for which Klipper reads nothing of the saved block.
    """

    file: ControllerFile
    options: dict[tuple[str, str], Entry] = field(default_factory=dict)
    sections: dict[str, Entry] = field(default_factory=dict)
    """Where each section begins; its text is the line."""
    hidden: dict[tuple[str, str], Entry] = field(default_factory=dict)
    unread_line: int | None = None

    def get(self, section: str, name: str) -> Entry | None:
        """An option, or None where there is none."""
        return self.options.get((section, name))


def read_config(file: ControllerFile) -> Config:
    """A printer.cfg with all that it includes.

    Raises `MachineFileError` with every line that is none of Klipper's, each once.
    """
    config = Config(file)
    problems: list[Problem] = []
    lines = file.lines
    saved, config.unread_line = _saved_block(lines)
    end = len(lines) if saved is None else saved - len(_SAVED)
    for section, name, option in _Lines(config, problems).of(file, lines[:end], 1):
        config.options[section, name] = option
    if saved is not None:
        block = [line[len(_MARK) + 1 :] for line in lines[saved:]]
        found = list(_Lines(config, problems, saved=True).of(file, block, saved + 1))
        for section, name, option in found:
            above = config.get(section, name)
            kept = config.options if above is None or above.saved else config.hidden
            kept[section, name] = option
    if problems:
        raise MachineFileError(*dict.fromkeys(problems))
    return config


def _saved_block(lines: Sequence[str]) -> tuple[int | None, int | None]:
    """The index of the first line of what was saved, and the line that keeps it from being read."""
    head = len(_SAVED)
    # The first line of a file has none before it, and so begins no block.
    starts = (at for at in range(1, len(lines)) if tuple(lines[at : at + head]) == _SAVED)
    start = next(starts, None)
    marked = [at for at, line in enumerate(lines) if at and line.startswith(f"{_MARK} ")]
    if start is None:
        return None, marked[0] + 1 if marked else None
    if marked[0] < start:
        return None, marked[0] + 1
    last = max(at for at, line in enumerate(lines) if line.strip())
    for at in range(start + head, last + 1):
        line = lines[at]
        if not line.startswith(_MARK) or line[len(_MARK) : len(_MARK) + 1] not in ("", " "):
            return None, at + 1
    return start + head, None


class _Lines:
    """Lines of a file and of what it includes, which go on with one section after the other."""

    def __init__(self, config: Config, problems: list[Problem], *, saved: bool = False) -> None:
        self._config, self._problems, self._saved = config, problems, saved

    def of(
        self, file: ControllerFile, lines: Sequence[str], first: int
    ) -> Iterator[tuple[str, str, Entry]]:
        """Section, name and value of every option; `first`: the number of the first line."""
        section: str | None = None
        name, value, at, indent = "", [""], 0, 0

        def whole() -> Iterator[tuple[str, str, Entry]]:
            if name and section is not None:
                text = "\n".join(value).strip()
                yield section, name, Entry(text, file, at, self._saved)

        for number, line in enumerate(lines, first):
            text = line.partition("#")[0].rstrip()
            if text.lstrip().startswith(";"):
                continue
            text = _BEHIND.sub("", text)
            if not text.strip():
                continue
            depth = len(text) - len(text.lstrip())
            text = text.strip()
            if name and depth > indent:
                value.append(text)
                continue
            yield from whole()
            name, indent = "", depth
            header = _SECTION.match(text)
            if header is not None and header["name"].startswith("include "):
                yield from self._included(file, header["name"].removeprefix("include "), number)
                section = None  # Klipper begins anew below it
            elif header is not None:
                section = header["name"]
                self._config.sections.setdefault(section, Entry(text, file, number, self._saved))
            elif section is None:
                self._refuse(file, number, text, "a line above the first section")
            else:
                option = _OPTION.match(text)
                if option is None or not option["name"]:
                    self._refuse(file, number, text, "a line that is no option")
                    continue
                name, value, at = option["name"].rstrip().lower(), [option["value"]], number
        yield from whole()

    def _included(
        self, file: ControllerFile, pattern: str, line: int
    ) -> Iterator[tuple[str, str, Entry]]:
        if self._saved:
            self._refuse(file, line, f"[include {pattern}]", "an include in the saved block")
            return
        try:
            files = file.included(pattern.strip())
        except ReadingError as failure:
            self._problems.append(file.problem(failure.fault, line))
            return
        except MachineFileError as failure:
            self._problems += failure.problems
            return
        for included in files:
            yield from self.of(included, included.lines, 1)

    def _refuse(self, file: ControllerFile, line: int, text: str, message: str) -> None:
        self._problems.append(
            file.problem(
                Fault(
                    "import-syntax",
                    message,
                    found=text[:80],
                    expected="[section], or option: value below one",
                ),
                line,
            )
        )


__all__ = ["Config", "Entry", "read_config"]
