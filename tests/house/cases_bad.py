"""Bad input: machine files, measurements and programs that are refused, each for its reason."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

from house.recorded_cases import INPUTS, MACHINES, Case, Files

GROUP = 12
"""Broken files of one case, one command for each."""


def rows_of(name: str) -> list[dict[str, Any]]:
    """The table of inputs of a name."""
    rows: list[dict[str, Any]] = json.loads((INPUTS / f"{name}.json").read_text(encoding="utf-8"))
    return rows


def with_edits(base: str, edits: list[tuple[int, int, str]]) -> str:
    """A file of the inputs with lines replaced: (first, last, text), counted from 0."""
    lines = (INPUTS / base).read_text(encoding="utf-8").splitlines(keepends=True)
    for first, last, text in reversed(edits):
        lines[first:last] = [text]
    return "".join(lines)


def cases() -> Iterator[Case]:
    """All of them."""
    for number, row in enumerate(rows_of("broken_machines"), start=1):
        files: Files = {"machine.toml": with_edits(row["base"], row["edits"]), **row["files"]}
        step = ("check", "machine.toml", "--format", "json")
        yield Case(f"broken_machine/{number:03}_{row['code']}", (step,), files)
    for number, row in enumerate(rows_of("broken_measurements"), start=1):
        machine = (MACHINES / f"{row['machine']}.toml").read_text(encoding="utf-8")
        files = {"machine.toml": machine, "data.csv": row["text"]}
        step = ("calibrate", "machine.toml", "data.csv", "--format", "json")
        yield Case(f"broken_measurements/{number:03}_{row['code']}", (step,), files)
    programs = rows_of("broken_programs")
    tripod = (MACHINES / "tripod.toml").read_text(encoding="utf-8")
    hexapod = (MACHINES / "hexaglide.toml").read_text(encoding="utf-8")
    for start in range(0, len(programs), GROUP):
        group = programs[start : start + GROUP]
        files = {"tripod.toml": tripod, "hexapod.toml": hexapod}
        steps = []
        for number, row in enumerate(group, start=1):
            files[f"{number}.ngc"] = row["program"]
            asked = (f"{number}.ngc", "-o", "out.ngc", "--units", "mm")
            steps.append(("gcode", "tripod.toml", *asked, "--format", "json"))
            steps.append(("gcode", "tripod.toml", *asked[:-2]))
        yield Case(f"broken_program/{start:03}", tuple(steps), files, 2.0)
    yield from files_that_cannot_be_read()


UNREADABLE: Files = {
    "latin.toml": b'schema = 1\nname = "\xe4"\n',
    "utf16.toml": "schema = 1\n".encode("utf-16"),
    "elf.toml": b"\x7fELF\xff",
    "empty.toml": "",
    "version.toml": "schema = 2\n",
    "tables.toml": "schema = 1\n",
    "doubled.toml": "schema = 1\nschema = 2\n",
    "open.toml": 'schema = "1',
    "deep.toml": "x = " + "[" * 5000,
    "large.toml": "schema = 1\n[machine]\nname = 'm'\ndof = ['x']\n[drive]\nname = 'a'\n",
    "folder/machine.toml": "schema = 1\n",
}


def files_that_cannot_be_read() -> Iterator[Case]:
    """What is no machine file at all."""
    names = [name for name in UNREADABLE if "/" not in name]
    names += ["folder", "none.toml", "latn.toml", "folder/none.toml", "latin.toml/below", "x" * 300]
    steps = tuple(("check", name, "--format", "json") for name in names)
    yield Case("unreadable/machine", steps, UNREADABLE)
    machine = (MACHINES / "planar_two_slider.toml").read_bytes()
    files: Files = {
        "machine.toml": machine,
        "latin.csv": b"x (mm)\n\xe4\n",
        "empty.csv": "",
        "quoted.csv": '"x (mm)\n1\n',
        "folder/data.csv": "x (mm)\n1\n",
    }
    data = ("latin.csv", "empty.csv", "quoted.csv", "folder", "none.csv", "machine.toml")
    steps = tuple(("calibrate", "machine.toml", name, "--format", "json") for name in data)
    yield Case("unreadable/measurements", steps, files)
    programs: Files = {"machine.toml": machine, "bytes.ngc": b"G0 X\xff1\n", "folder/a.ngc": ""}
    steps = tuple(
        ("gcode", "machine.toml", name, "-o", "out.ngc") for name in ("bytes.ngc", "folder", "none")
    )
    yield Case("unreadable/program", steps, programs)
