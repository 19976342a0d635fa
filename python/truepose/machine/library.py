"""The machine files that come with the package, one for each kind of machine.

They are found in the package itself (`machine_library`: in a checkout a link to `machines/`), and
what is said of each is read from the file.
"""

from __future__ import annotations

import tomllib
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import resources
from typing import Any

from truepose.errors import Problem, RequestError
from truepose.files.wording import did_you_mean, one_of

FOLDER = "machine_library"

SCHEMA_FILE = "truepose-schema.json"
"""What the JSON schema is called beside a machine file, as `truepose schema` writes it."""

SCHEMA_LINE = f"#:schema {SCHEMA_FILE}\n"
"""First line of a machine file that names it for editors, as the language server taplo reads it."""


@dataclass(frozen=True)
class LibraryMachine:
    """A machine file that `truepose init` writes; `kind` is the file's name without its ending."""

    kind: str
    name: str
    description: str
    dof: tuple[str, ...]
    commanded: tuple[str, ...]
    drives: Mapping[str, int]
    """Kind of drive -> how many."""
    text: str
    """The file as it is."""

    @property
    def parasitic(self) -> tuple[str, ...]:
        """Freedoms of the platform that cannot be commanded."""
        return tuple(freedom for freedom in self.dof if freedom not in self.commanded)


def kinds() -> tuple[str, ...]:
    """The kinds of the library's machines, in order; no file is read."""
    names = (entry.name for entry in (resources.files("truepose") / FOLDER).iterdir())
    return tuple(sorted(name.removesuffix(".toml") for name in names if name.endswith(".toml")))


def text_of(kind: str) -> str:
    """The file of a kind that there is, as it is."""
    file = resources.files("truepose") / FOLDER / f"{kind}.toml"
    return file.read_text(encoding="utf-8")


def machines() -> tuple[LibraryMachine, ...]:
    """Every machine of the library, in the order of their kinds."""
    return tuple(_machine(kind, text_of(kind)) for kind in kinds())


def machine_of(kind: str) -> LibraryMachine:
    """The machine of one kind. Raises `RequestError` (unknown-kind) with the nearest."""
    every = {machine.kind: machine for machine in machines()}
    if kind in every:
        return every[kind]
    alike = [name for name in every if kind.lower() in name]
    raise RequestError(
        Problem(
            "unknown-kind",
            f'there is no machine of the kind "{kind}"',
            found=kind,
            expected=one_of(every, limit=len(every)),
            hint=f"did you mean {one_of(alike)}?"
            if alike
            else did_you_mean(kind, every) or "`truepose init --list` describes each",
        )
    )


def _machine(kind: str, text: str) -> LibraryMachine:
    file = tomllib.loads(text)
    machine: dict[str, Any] = file["machine"]
    every = file.get("each", {}).get("drive", {})
    return LibraryMachine(
        kind,
        machine["name"],
        machine["description"],
        tuple(machine["dof"]),
        tuple(machine.get("commanded", machine["dof"])),
        Counter((every | drive)["kind"] for drive in file["drive"]),
        text,
    )
