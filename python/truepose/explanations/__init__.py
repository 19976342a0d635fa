"""What each code means, what to do about it, and an example that gives it.

Codes of problems have their meaning in `errors.CATALOGUE`; the other codes (oddities, warnings,
suspicions, reasons of a calibration, why a pose is left out) have it here. All the rest is in the
tables beside this file, one a topic, from which `truepose explain` and docs/errors.md are made; a
test runs every example. Nothing heavy is imported: a shell completes codes from here.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from importlib import resources
from typing import Any

from truepose.errors import CATALOGUE

TOPICS: dict[str, str] = {
    "files": "Files",
    "values": "Keys and values",
    "structure": "The machine's structure",
    "tolerances": "Materials, tolerances and measured tables",
    "workspace": "The workspace and its poses",
    "oddities": "What looks odd",
    "requests": "Requests",
    "functions": "Calls in Python",
    "controllers": "Controllers",
    "imports": "Files of controllers",
    "measurements": "Measurements",
    "calibration": "Calibration and plans",
    "suspicions": "Suspicions about measurements",
    "reasons": "Reasons of a calibration's answer",
    "programs": "Programs of G-code",
    "machine_tests": "Tests of a machine",
    "parts": "Features of a part",
    "studies": "Studies",
}
"""Name of a table beside this file -> its title, in the order of the page."""

MACHINE = "planar_two_slider"
"""The kind of machine of an example that names no other."""

Step = tuple[str, tuple[str, ...]]
"""For people: what it is, nothing for a command, and its lines."""

MEASURED = "measured.csv"
"""Readings of a machine like that of the example, from a table beside this file."""

_CALIBRATED = """
import truepose as tp
{edited}
found = tp.calibrate(tp.load("machine.toml"), {asked})
print(*(suspicion.code for suspicion in found.suspicions))
print(*(reason.code for reason in (*found.gate.reasons, *found.gate.warnings)))
"""

_EDITED = """
with open("measured.csv") as file:
    lines = file.read().splitlines()
rows = [line.split(",") for line in lines[5:]]

{rows}

with open("measured.csv", "w") as file:
    file.write("\\n".join([*lines[:5], *(",".join(row) for row in rows)]))
"""


@dataclass(frozen=True)
class Example:
    """Files in a folder, and what is done there that gives the code.

    `machine`: the kind that `truepose init` writes as machine.toml, `changes` what then stands in
    it instead of what. `files`: others by their name; `measured`: what stands in measured.csv
    instead of what in the readings of that machine, None where there is no such file. `commands`:
    those of truepose, without its name, the last of which gives the code; or `python`: a script
    that does.
    """

    machine: str = MACHINE
    changes: tuple[tuple[str, str], ...] = ()
    measured: tuple[tuple[str, str], ...] | None = None
    files: Mapping[str, str] = field(default_factory=dict)
    commands: tuple[str, ...] = ()
    python: str = ""

    @property
    def needs_machine(self) -> bool:
        """Whether machine.toml has a part in it."""
        said = (*self.commands, self.python)
        return bool(self.changes) or any("machine.toml" in text for text in said)

    def all_files(self) -> dict[str, str]:
        """Every file but machine.toml, readings too."""
        if self.measured is None:
            return dict(self.files)
        text = readings(self.machine)
        for old, new in self.measured:
            if old not in text:
                raise ValueError(f"{old!r} is not in the readings of {self.machine}")
            text = text.replace(old, new)
        return {MEASURED: text, **self.files}

    def machine_steps(self) -> Iterator[Step]:
        """How machine.toml comes about, for people."""
        if self.needs_machine:
            yield "", (f"truepose init {self.machine} -o machine.toml",)
        for old, new in self.changes:
            was, now = (tuple(text.strip("\n").splitlines()) for text in (old, new))
            yield "in machine.toml, " + ("instead of" if any(now) else "take out"), was
            if any(now):
                yield "write", now

    def last_steps(self) -> Iterator[Step]:
        """What is done with the files, for people."""
        if self.python:
            yield "in Python", tuple(self.python.strip("\n").splitlines())
        for command in self.commands:
            yield "", (f"truepose {command.strip()}",)


@dataclass(frozen=True)
class Explanation:
    """A code: what it means, what to do, how it comes about. `topic`: a key of `TOPICS`."""

    code: str
    topic: str
    meaning: str
    advice: str
    example: Example | None
    """None for what takes more than a few lines to come about."""


def explanations() -> dict[str, Explanation]:
    """Every explanation by its code, topic by topic."""
    return {explanation.code: explanation for topic in TOPICS for explanation in _of(topic)}


def meanings() -> dict[str, str]:
    """Every code and what it means in a line."""
    return {code: explanation.meaning for code, explanation in explanations().items()}


def _of(topic: str) -> Iterator[Explanation]:
    for code, entry in tomllib.loads(_beside(f"{topic}.toml")).items():
        meaning = CATALOGUE[code] if code in CATALOGUE else entry["means"]
        yield Explanation(code, topic, meaning, entry["do"], _example(entry))


def _example(entry: Mapping[str, Any]) -> Example | None:
    """The example of an entry, if it has one.

    `measured`: what is replaced in the readings of its machine; `rows`: what a script does to them
    before it calibrates, with the arguments `calibrate`.
    """
    run, python = entry.get("run", ()), entry.get("python", "")
    if "rows" in entry:
        asked = ", ".join(filter(None, ('"measured.csv"', entry.get("calibrate", ""))))
        edited = _EDITED.format(rows=entry["rows"].strip()) if entry["rows"] else ""
        python = _CALIBRATED.format(edited=edited, asked=asked)
    if not (run or python):
        return None
    measured = entry.get("measured")
    return Example(
        entry.get("machine", MACHINE),
        _pairs(entry.get("change", ())),
        None if measured is None else _pairs(measured),
        entry.get("files", {}),
        (run,) if isinstance(run, str) else tuple(run),
        python,
    )


def _pairs(rows: Iterable[Sequence[str]]) -> tuple[tuple[str, str], ...]:
    return tuple((old, new) for old, new in rows)


def readings(machine: str) -> str:
    """A file of measurements of a machine of that kind, which is not as drawn."""
    return _beside(f"{machine}.csv")


def _beside(name: str) -> str:
    return resources.files(__name__).joinpath(name).read_text(encoding="utf-8")


__all__ = ["TOPICS", "Example", "Explanation", "Step", "explanations", "meanings", "readings"]
