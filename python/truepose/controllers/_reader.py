"""The form of every reader of a controller's files, and the files that it is given.

The reader of a format stands beside the adapter of that controller. It is pure: from the text of a
file, and of the files that this includes, it makes the text of a machine file. The machine and the
measurements are then made of it by truepose's own readers (`truepose.controllers._import`), so that
what cannot be is told as usual.
"""

from __future__ import annotations

import glob
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from itertools import takewhile
from pathlib import Path
from typing import ClassVar, Protocol

from truepose.errors import Fault, MachineFileError, Problem, ReadingError
from truepose.files.limits import LONGEST_TOML, MOST_INCLUDED
from truepose.files.one_run import is_stdin, real_path
from truepose.files.text_file import FileKind, read_text

CONTROLLER_FILE = FileKind("a file of a controller, such as printer.cfg", ".cfg")

ASSUMED = "assumed"
"""In the comment of every line of a machine file that the controller's file does not say."""


@dataclass(frozen=True)
class Setting:
    """What a controller's file does not say, and `--set KEY=VALUE` may.

    `dimension` names what a quantity measures, SI once read, bare numbers being mm and degrees;
    None: the value is text.
    """

    doc: str
    dimension: str | None = "length"


@dataclass(frozen=True)
class Assumption:
    """What the machine file says that the controller's did not: a sentence, and the key of it."""

    sentence: str
    key: str


@dataclass(frozen=True)
class ControllerReading:
    """What a reader makes of a controller's file.

    `machine`: the text of a machine file, what is assumed in lines with a comment that says so.
    `measurements`: the text of a file of measurements of that machine, None where the controller
    keeps none. `holds`: what the controller holds, its own names -> as printed there. `lost`: what
    the file says and the machine file cannot, or does not mean, a sentence each.
    """

    machine: str
    measurements: str | None = None
    holds: Mapping[str, str] = field(default_factory=dict)
    assumptions: tuple[Assumption, ...] = ()
    lost: tuple[str, ...] = ()


class Reader(Protocol):
    """The reader of a controller's files, beside its adapter for `truepose export`."""

    name: ClassVar[str]
    doc: ClassVar[str]
    settings: ClassVar[Mapping[str, Setting]]
    """What may be said besides, by its key; machine file keys where there is one."""

    @classmethod
    def recognises(cls, text: str) -> bool:
        """Whether a file is of this controller, from its content alone."""
        ...

    @classmethod
    def read(cls, file: ControllerFile, settings: Mapping[str, float | str]) -> ControllerReading:
        """What the file says, with the `settings` that were given.

        Raises `MachineFileError` with everything that is wrong, each with the file's own line.
        """
        ...


def refuse(problems: Iterable[Problem]) -> None:
    """Raise `MachineFileError` with all problems, each once, where there are any."""
    every = list(dict.fromkeys(problems))
    if every:
        raise MachineFileError(*every)


@dataclass
class _Confined:
    """The folder that includes may not leave, links followed; how many files may still come."""

    folder: Path
    left: int = MOST_INCLUDED


@dataclass(frozen=True)
class ControllerFile:
    """A file of a controller: its `path`, for problems too, and its `text`, lines ended alike."""

    path: Path
    text: str
    _confined: _Confined
    _above: tuple[Path, ...] = ()
    """The files that include this one, links followed."""

    @classmethod
    def at(cls, path: Path) -> ControllerFile:
        """The file at a path; what it includes lies beside or below it.

        Raises `MachineFileError` as `truepose.files.text_file.read_text`, and file-too-large.
        """
        folder = real_path(Path() if is_stdin(path) else path.parent)
        return cls(path, _text(path), _Confined(folder))

    @property
    def lines(self) -> list[str]:
        """Its lines; the first is number 1 in problems."""
        return self.text.split("\n")

    def problem(self, fault: Fault, line: int | None = None, path: str | None = None) -> Problem:
        """A problem of this file, at a line, of the key `path` in the controller's own words."""
        return fault.at(str(self.path), line, path)

    def included(self, pattern: str) -> tuple[ControllerFile, ...]:
        """The files that `[include pattern]` or the like names here, in order of their names.

        A pattern with wildcards may name none. Raises `ReadingError` (import-include) for what is
        outside of the folder, not there, includes itself, or too many, and `MachineFileError` for a
        file that cannot be read.
        """
        place = Path() if is_stdin(self.path) else self.path.parent
        wanted = os.path.normpath(pattern)  # what goes up behind a wildcard is above the folder too
        if not real_path(place / _without_wildcards(wanted)).is_relative_to(self._confined.folder):
            raise self._refused(pattern, "a file outside of the folder")
        try:
            names = sorted(glob.glob(wanted, root_dir=place))  # noqa: PTH207
        except (OSError, ValueError):
            names = []
        if not names and not glob.has_magic(pattern):
            raise self._refused(pattern, "a file that is not there")
        return tuple(self._included(pattern, place / name) for name in names)

    def _included(self, pattern: str, path: Path) -> ControllerFile:
        real = real_path(path)
        above = (*self._above, real_path(self.path))
        if not real.is_relative_to(self._confined.folder):
            raise self._refused(pattern, f"{path}, a link out of the folder")
        if real in above:
            raise self._refused(pattern, f"{path}, which includes this file")
        if self._confined.left == 0:
            raise self._refused(pattern, f"more than {MOST_INCLUDED} files")
        self._confined.left -= 1
        return ControllerFile(path, _text(path), self._confined, above)

    def _refused(self, pattern: str, found: str) -> ReadingError:
        return ReadingError(
            "import-include",
            f"what is included cannot be read: {pattern[:80]}",
            found=found,
            expected=f"a file in {self._confined.folder} or below it",
            hint="copy the files that it includes beside it, as the controller has them",
        )


def _without_wildcards(pattern: str) -> Path:
    """A pattern's path up to the first part that has a wildcard."""
    return Path(*takewhile(lambda part: not glob.has_magic(part), Path(pattern).parts))


def _text(path: Path) -> str:
    _, text = read_text(path, CONTROLLER_FILE)
    if len(text) > LONGEST_TOML:
        raise MachineFileError(
            Problem(
                "file-too-large",
                f"{path} is too large",
                str(path),
                found=f"{len(text):,} characters",
                expected=f"at most {LONGEST_TOML:,}",
            )
        )
    return text.replace("\r\n", "\n").replace("\r", "\n")


__all__ = [
    "ASSUMED",
    "Assumption",
    "ControllerFile",
    "ControllerReading",
    "Reader",
    "Setting",
    "refuse",
]
