"""`truepose export --against FILE`: which lines of the user's own configuration are to change.

An *editor*, beside the controller's adapter, says for each number of the export which line of the
file has it and what that line becomes; comments, order and everything else stay. All of it is
written as a unified difference, which `patch` applies.
"""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from truepose.controllers._adapters import by_name
from truepose.controllers._edit import Edit, no_difference
from truepose.controllers._export import Export
from truepose.controllers._reader import CONTROLLER_FILE, ControllerFile
from truepose.controllers._registry import EDITORS, REGISTRY
from truepose.files.text_file import read_text
from truepose.files.wording import one_of

Editor = Callable[[ControllerFile, Export], Iterable[Edit]]


def difference(name: str, export: Export, path: str | Path) -> str:
    """What is to change in the file at `path`, and in what it includes, to hold the export.

    "" where nothing is. Raises `RequestError` (unknown-controller; no-difference of a controller
    whose files have no lines for its numbers, or a file of another kind) and `MachineFileError` for
    a file that cannot be read.
    """
    if name in REGISTRY and name not in EDITORS:
        raise no_difference(
            "this controller is given whole files, not lines of one",
            name,
            one_of(EDITORS),
            "leave --against away",
        )
    editor: Editor = by_name(name, EDITORS, "editor")
    edits: dict[Path, list[Edit]] = {}
    for edit in editor(ControllerFile.at(Path(path)), export):
        edits.setdefault(edit.file.path, []).append(edit)
    return "".join(_of_file(file, of_file) for file, of_file in edits.items())


def edited(lines: Iterable[str], edits: Iterable[Edit]) -> list[str]:
    """The lines with every edit made."""
    new: dict[int, str] = {}
    below: dict[int, list[str]] = {}
    for edit in edits:
        if edit.text is not None:
            new[edit.line] = edit.text
        below.setdefault(edit.line, []).extend(edit.below)
    result = list(below.get(0, []))
    for number, line in enumerate(lines, 1):
        result += [new.get(number, line), *below.get(number, [])]
    return result


def _of_file(path: Path, edits: list[Edit]) -> str:
    """The difference of one file, with its own line ends."""
    _, text = read_text(path, CONTROLLER_FILE)
    end = "\r\n" if "\r\n" in text else "\n"
    before = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    after = edited(before, edits)
    lines = difflib.unified_diff(
        list(_ended(before, end)), list(_ended(after, end)), str(path), str(path)
    )
    return "".join(_marked(lines))


def _ended(lines: list[str], end: str) -> Iterator[str]:
    """Lines with their ends; behind the last one is none, and no line where that is empty."""
    yield from (line + end for line in lines[:-1])
    if lines[-1]:
        yield lines[-1]


def _marked(lines: Iterable[str]) -> Iterator[str]:
    """A difference says of a line without an end that it has none."""
    for line in lines:
        yield line if line.endswith("\n") else f"{line}\n\\ No newline at end of file\n"


__all__ = ["difference", "edited"]
