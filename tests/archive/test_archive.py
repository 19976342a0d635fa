"""What an earlier version read and answered, this version reads and answers alike.

The folder of a version (tests/make_archive.py) holds machine files, measurements and results, and
in `calls.toml` the command lines that made them, which are run again here. Where numbers are others
now, `changed.toml` of the version says of which file, variable and source, and why: with an entry
of CHANGELOG.md. Files and variables are patterns; a call that may no longer be made as it was is
an error of this version.
"""

from __future__ import annotations

import re
import shutil
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import cache
from pathlib import Path

import pytest

import truepose as tp
from archived import Key, columns_of, differences
from sweeps import sweep, thinned
from truepose.calibration import read_measurements
from truepose.cli import run

HERE = Path(__file__).parent
CHANGELOG = HERE.parents[1] / "CHANGELOG.md"
VERSIONS = sorted(path.parent for path in HERE.glob("*/calls.toml"))
READ_BY_CALLS = ("machines", "measurements", "programs")
MADE_BY_CALLS = ("results", "exports")
EXIT_CODE: Key = ("exit code", "")
QUICK = ("planar_two_slider.", "rotary_delta.position", "programs/", "exports/klipper")
"""Calls with one of these in their output are in the quick suite."""


@dataclass(frozen=True)
class Call:
    """A command line of a version's folder, its exit code, and the files that it wrote."""

    version: Path
    arguments: tuple[str, ...]
    code: int

    @property
    def outputs(self) -> list[str]:
        """Paths within the folder, of what it archived."""
        pairs = zip(self.arguments, self.arguments[1:], strict=False)
        named = [value for key, value in pairs if key in ("--output", "--machine-output")]
        found = []
        for name in named:
            place = self.version / name
            found += [place] if place.is_file() else sorted(place.iterdir())
        return [path.relative_to(self.version).as_posix() for path in found]

    def __str__(self) -> str:
        return f"{self.version.name}: {self.outputs[0]}"


@dataclass(frozen=True)
class Changed:
    """An entry of `changed.toml`."""

    version: Path
    why: str
    file: str
    variable: str = "*"
    source: str = "*"

    def of(self, file: str) -> bool:
        return fnmatchcase(file, self.file)

    def covers(self, file: str, key: Key) -> bool:
        variable, source = key
        return (
            self.of(file)
            and fnmatchcase(variable, self.variable)
            and fnmatchcase(source, self.source)
        )


@dataclass(frozen=True)
class Answer:
    """How a call ends today: its exit code, and what differs, by file."""

    code: int
    differing: dict[str, list[Key]]


def calls() -> Iterator[Call]:
    for version in VERSIONS:
        document = tomllib.loads((version / "calls.toml").read_text(encoding="utf-8"))
        for entry in document["call"]:
            yield Call(version, tuple(entry["arguments"]), entry["code"])


def changes() -> Iterator[Changed]:
    for version in VERSIONS:
        document = tomllib.loads((version / "changed.toml").read_text(encoding="utf-8"))
        for entry in document.get("changed", []):
            yield Changed(version, **entry)


CALLS = list(calls())
CHANGES = list(changes())
QUICK_CALLS = [call for call in CALLS if any(word in call.outputs[0] for word in QUICK)]


def files(folder: str) -> list[Path]:
    return [path for version in VERSIONS for path in sorted((version / folder).iterdir())]


def run_again(call: Call, folder: Path) -> Answer:
    """Run the call in an empty folder, with the files that it reads."""
    for name in READ_BY_CALLS:
        shutil.copytree(call.version / name, folder / name)
    for name in MADE_BY_CALLS:
        (folder / name).mkdir()
    for name in call.outputs:
        (folder / name).unlink(missing_ok=True)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        code = run(list(call.arguments))
    differing = {}
    for name in call.outputs:
        archived, present = call.version / name, folder / name
        everything = list(columns_of(archived))
        keys = differences(archived, present) if present.is_file() else everything
        if keys:
            differing[name] = keys
    return Answer(code, differing)


@pytest.fixture(scope="module")
def today(tmp_path_factory: pytest.TempPathFactory) -> Callable[[Call], Answer]:
    """A function: how a call ends today. Each is made once."""
    return cache(lambda call: run_again(call, tmp_path_factory.mktemp("call")))


def unexplained(differing: Mapping[str, Sequence[Key]], entries: Sequence[Changed]) -> str:
    """Entries that `changed.toml` would need besides: none, if all that differs is explained."""
    lines = []
    for file, keys in differing.items():
        for variable, source in keys:
            if not any(entry.covers(file, (variable, source)) for entry in entries):
                of = f'source = "{source}"\n' if source else ""
                lines.append(
                    f'[[changed]]\nfile = "{file}"\nvariable = "{variable}"\n{of}why = ""\n'
                )
    return "\n".join(lines)


def one_line(text: str) -> str:
    return " ".join(text.split())


def test_there_is_an_archive() -> None:
    assert VERSIONS
    assert QUICK_CALLS


@pytest.mark.parametrize("path", files("machines"), ids=lambda path: path.stem)
def test_machine_files_are_read(path: Path) -> None:
    machine = tp.load(path)
    joints = machine.inverse(machine.poses()[:3], status=True)[0]
    assert joints.shape == (3, len(machine.joints))


@pytest.mark.parametrize("path", files("measurements"), ids=lambda path: path.name)
def test_measurements_are_read(path: Path) -> None:
    machine = tp.load(path.parents[1] / "machines" / f"{path.name.partition('.')[0]}.toml")
    found = read_measurements(path, machine)
    rows = [line for line in path.read_text(encoding="utf-8").splitlines() if line[:1] not in "#"]
    assert found.n_row == len(rows) - 1  # and the names of the columns


def test_every_result_is_of_a_call() -> None:
    made = {call.version / name for call in CALLS for name in call.outputs}
    kept = {path for folder in MADE_BY_CALLS for path in files(folder) if path.is_file()}
    kept |= {inside for path in files("exports") for inside in path.iterdir()}
    assert kept == {path for path in made if path.parent.name != "programs"}


@pytest.mark.parametrize("call", thinned(CALLS, QUICK_CALLS), ids=str)
def test_the_same_numbers_or_the_reason_why_not(
    call: Call, today: Callable[[Call], Answer]
) -> None:
    found = today(call)
    entries = [entry for entry in CHANGES if entry.version == call.version]
    missing = unexplained(found.differing, entries)
    assert not missing, f"others than {call.version.name} had, without a reason:\n{missing}"
    ended = {call.outputs[0]: [EXIT_CODE]} if found.code != call.code else {}
    assert not unexplained(ended, entries), f"exit code {found.code}, which was {call.code}"


def test_a_reason_is_an_entry_of_the_changelog() -> None:
    changelog = CHANGELOG.read_text(encoding="utf-8")
    entries = {one_line(part) for part in re.split(r"^(?:- |#.*$)", changelog, flags=re.MULTILINE)}
    assert all(change.why and one_line(change.why) in entries for change in CHANGES)


@sweep
@pytest.mark.parametrize("version", VERSIONS, ids=lambda version: version.name)
def test_what_is_said_to_have_changed_has(version: Path, today: Callable[[Call], Answer]) -> None:
    entries = {entry for entry in CHANGES if entry.version == version}
    for call in CALLS:
        names = call.outputs
        if call.version != version or not any(
            entry.of(name) for entry in entries for name in names
        ):
            continue
        found = today(call)
        ended = {names[0]: [EXIT_CODE]} if found.code != call.code else {}
        differing = [*ended.items(), *found.differing.items()]
        entries -= {
            entry
            for entry in entries
            if any(entry.covers(file, key) for file, keys in differing for key in keys)
        }
    assert not entries, "nothing differs where changed.toml says so"
