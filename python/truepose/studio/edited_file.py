"""The machine file with the edits written into it, in which only what was changed changes.

This text is what the studio evaluates, shows the difference of and saves: so every command that
reads the saved file gives the numbers of the studio.
"""

from __future__ import annotations

import codecs
import hashlib
import re
from collections.abc import Iterator
from dataclasses import dataclass
from difflib import unified_diff
from functools import cached_property
from pathlib import Path

import tomlkit

from truepose.calibration.result.toml_edits import MachineText
from truepose.errors import Problem, RequestError
from truepose.files.document import MACHINE_FILE
from truepose.files.one_run import once_more, real_path
from truepose.files.text_file import read_text
from truepose.files.toml_text import TomlError, parse_toml
from truepose.files.writing import replacing, require_new, require_writable
from truepose.machine import Machine
from truepose.machine.loader import load_text
from truepose.sources import REGISTRY
from truepose.studio.inside import to_write
from truepose.studio.settings import Edits

ENDING = ".toml"

_HEADER = re.compile(r"^\s*(\[\[?[^\]]+\]\]?)")


@dataclass(frozen=True)
class OpenedFile:
    """A machine file as it was read: its path as given, its bytes' SHA-256, its text."""

    path: Path
    hash: str
    text: str
    mark: bool = False
    """Whether it begins with a byte order mark, which the text is without."""

    @classmethod
    def read(cls, path: Path) -> OpenedFile:
        """Read it. Raises `MachineFileError` as `truepose.load` does of what is no text."""
        with once_more():  # a file is read again after it changed
            content, text = read_text(path, MACHINE_FILE)
        mark = content.startswith(codecs.BOM_UTF8)
        return cls(path, hashlib.sha256(content).hexdigest(), text, mark)

    @property
    def folder(self) -> Path:
        """Where it is, links of folders followed: the studio writes nowhere else."""
        return real_path(self.path.parent)

    def machine(self, edits: Edits = ()) -> Machine:
        """The machine with the edits as settings.

        Raises `MachineFileError` and `RequestError` with every problem, as `truepose.load` does.
        """
        return load_text(self.path, self.text, settings=dict(edits), registry=REGISTRY)

    def edited(self, edits: Edits, machine: Machine | None = None) -> str:
        """The text with the edits written into it. `machine`: what `machine` gave, if it is there.

        Raises as `machine` does.
        """
        if not edits:
            return self.text
        read = self.machine(edits) if machine is None else machine
        changed = RequestError(
            Problem("machine-file-changed", "the file changed while it was edited", str(self.path))
        )
        text = MachineText(self.path, read, changed, self.text).text()
        return text if self._comes_back else _in_order(text, self.text)

    @cached_property
    def _comes_back(self) -> bool:
        """Whether tomlkit writes the text as it read it."""
        return tomlkit.dumps(tomlkit.parse(self.text)) == self.text

    def difference(self, edited: str) -> Iterator[str]:
        """Lines of the unified difference of an edited text to the file."""
        name = self.path.name
        yield from unified_diff(
            self.text.splitlines(keepends=True),
            edited.splitlines(keepends=True),
            name,
            f"{name} (edited)",
        )

    def save_as(self, name: str, edited: str, *, replace: bool = False) -> str:
        """Write an edited text into the machine's folder; the SHA-256 of what stands there then.

        Raises `RequestError`: output-not-writable for a name that leads out of the folder, through
        `..` or a link too; output-exists where one is there and it is not to be replaced;
        output-is-input for the machine file itself; output-ending.
        """
        target = to_write(self.folder, name)
        require_writable(target, [ENDING], [self.path])
        if not replace:
            require_new(target)
        content = (codecs.BOM_UTF8 if self.mark else b"") + edited.encode("utf-8")
        with replacing(target) as temporary:
            temporary.write_bytes(content)
        return hashlib.sha256(content).hexdigest()


def _in_order(edited: str, original: str) -> str:
    """An edited text with its tables in the order of the original.

    tomlkit puts tables of one name together that do not stand together; here they stay apart.
    """
    order = {header: at for at, (header, _) in enumerate(_tables(original))}
    there = list(_tables(edited))
    last = len(order)
    # A table that is new stays at the end, where it was written.
    ranked = sorted(there, key=lambda table: order.get(table[0], last))
    text = "".join(lines for _, lines in ranked)
    try:
        same = parse_toml(text) == parse_toml(edited)
    except TomlError:
        same = False
    return text if same else edited


def _tables(text: str) -> Iterator[tuple[tuple[str, int], str]]:
    """The tables of a text: (header, how many of it came before), and its lines."""
    count: dict[str, int] = {}
    header, lines = "", list[str]()
    for line in text.splitlines(keepends=True):
        match = _HEADER.match(line)
        if match is not None:
            yield (header, count.get(header, 0)), "".join(lines)
            count[header] = count.get(header, 0) + 1
            header, lines = match.group(1), []
        lines.append(line)
    yield (header, count.get(header, 0)), "".join(lines)


__all__ = ["OpenedFile"]
