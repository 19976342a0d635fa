"""`truepose init`: every machine file shipped can be had, from a checkout and from a wheel."""

from __future__ import annotations

import csv
import io
import json
import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import truepose
from build_machine import machine_files
from command_line import call
from truepose.machine.library import FOLDER, SCHEMA_LINE, machine_of, machines
from truepose.machine.template import commented
from truepose.sources import REGISTRY

ROOT = Path(__file__).parents[3]
KINDS = [path.stem for path in machine_files()]


@pytest.mark.parametrize("kind", KINDS)
def test_the_file_of_a_kind_is_what_is_shipped_with_more_comments(
    kind: str, capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    outcome = call(capsys, "init", kind)
    assert (outcome.code, outcome.out) == (0, "")
    assert outcome.err == f"wrote {kind}.toml\n"
    written = tmp_path / f"{kind}.toml"
    text, shipped = written.read_text("utf-8"), ROOT / "machines" / written.name
    assert text.startswith(SCHEMA_LINE)
    added = [line for line in text.splitlines() if not line.startswith("#")]
    kept = [line for line in shipped.read_text("utf-8").splitlines() if not line.startswith("#")]
    assert added == kept
    assert tomllib.loads(text) == tomllib.loads(shipped.read_text("utf-8"))
    assert list(tmp_path.iterdir()) == [written]
    assert truepose.load(written).name == machine_of(kind).name


def test_the_output_may_be_named(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    assert call(capsys, "init", "3rrr", "--output", file).code == 0
    assert file.read_text("utf-8") == commented(machine_of("3rrr").text, REGISTRY)


def test_each_key_is_explained_once_where_the_file_does_not() -> None:
    lines = commented(machine_of("linear_delta").text, REGISTRY).splitlines()
    at = lines.index("base = [-12.500012092, 21.6506281133, 0]")
    assert lines[at - 1].startswith("# Base-side joint centre")
    assert sum(line.startswith("# Base-side joint centre") for line in lines) == 1
    assert lines[lines.index("[tolerance]") - 1].startswith("# A pattern over parameter names")
    own = lines.index('commanded = ["x", "y", "z"] # the tilt is what the rods make of it')
    assert not lines[own - 1].startswith("#")
    assert max(map(len, (line for line in lines if line.startswith("# ")))) <= 100


def test_a_file_that_is_there_is_not_touched(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    file = tmp_path / "mine.toml"
    file.write_text("mine")
    outcome = call(capsys, "init", "hexapod", "-o", file)
    assert (outcome.code, outcome.codes) == (2, ["output-exists"])
    assert file.read_text() == "mine"
    assert list(tmp_path.iterdir()) == [file]


@pytest.mark.parametrize(
    ("kind", "hint"),
    [
        ("hexapud", 'did you mean "hexapod"?'),
        ("delta", f"did you mean one of {', '.join(k for k in KINDS if 'delta' in k)}?"),
        ("Tricept", "did you mean tricept?"),
        ("submarine", "`truepose init --list` describes each"),
    ],
)
def test_an_unknown_kind_is_told_with_the_nearest(
    kind: str, hint: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    outcome = call(capsys, "init", kind, "-o", tmp_path / "new.toml")
    assert (outcome.code, outcome.codes) == (2, ["unknown-kind"])
    assert hint in outcome.err
    assert all(each in outcome.err for each in KINDS)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("arguments", [[], ["hexapod", "--list"]])
def test_either_a_kind_or_the_list(
    arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    outcome = call(capsys, "init", *arguments)
    assert outcome.code == 2
    assert "Give a KIND, or --list" in outcome.err


@pytest.mark.parametrize(
    ("output", "code"), [("new.json", "output-ending"), ("none/new.toml", "output-not-writable")]
)
def test_an_output_that_cannot_be_written(
    output: str, code: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    assert call(capsys, "init", "hexapod", "-o", tmp_path / output).codes == [code]


def test_the_list_describes_every_kind(capsys: pytest.CaptureFixture[str]) -> None:
    table = call(capsys, "init", "--list").out
    listed = json.loads(call(capsys, "init", "--list", "--format", "json").out)["machines"]
    rows = list(csv.DictReader(io.StringIO(call(capsys, "init", "--list", "--format=csv").out)))
    assert [each["kind"] for each in listed] == [row["kind"] for row in rows] == KINDS
    for path, each, row in zip(machine_files(), listed, rows, strict=True):
        machine = tomllib.loads(path.read_text("utf-8"))["machine"]
        commanded = machine.get("commanded", machine["dof"])
        for name in ("name", "description"):
            assert each[name] == row[name] == machine[name]
        assert (each["dof"], each["commanded"]) == (machine["dof"], commanded)
        assert sum(each["drives"].values()) == len(commanded)
        assert row["commanded"] == " ".join(commanded)
        (line,) = (line for line in table.splitlines() if line.split()[:1] == [path.stem])
        assert machine["description"] in line
    tricept = next(each for each in listed if each["kind"] == "tricept")
    assert tricept["drives"] == {"telescopic": 3}
    assert "x y z (a b c)   3 × telescopic" in table


def test_a_checkout_has_the_files_of_machines() -> None:
    assert [machine.kind for machine in machines()] == KINDS
    assert (ROOT / "python" / "truepose" / FOLDER).resolve() == ROOT / "machines"


def test_a_wheel_has_them_in_the_package(tmp_path: Path) -> None:
    # As maturin lays a wheel out: files matching `include`, at their place below `python-source`.
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["maturin"]
    source = ROOT / settings["python-source"]
    # What has a form is of the sdist alone.
    patterns = [pattern for pattern in settings["include"] if isinstance(pattern, str)]
    shipped = [path for pattern in patterns for path in ROOT.glob(pattern)]
    assert sorted(path.stem for path in shipped) == KINDS
    # What maturin takes by itself, without the link's content.
    skipped = shutil.ignore_patterns(FOLDER, "__pycache__")
    shutil.copytree(source / "truepose", tmp_path / "truepose", ignore=skipped)
    for path in shipped:
        target = tmp_path / path.relative_to(source)
        target.parent.mkdir(exist_ok=True)
        shutil.copy(path, target)
    program = (
        "import sys, truepose; from truepose.machine.library import machines; "
        "print(truepose.__file__, *(machine.kind for machine in machines()))"
    )
    done = subprocess.run(
        [sys.executable, "-c", program],
        capture_output=True,
        text=True,
        check=True,
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(tmp_path)},
    )
    assert done.stdout.split() == [str(tmp_path / "truepose" / "__init__.py"), *KINDS]
