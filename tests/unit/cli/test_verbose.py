"""`--verbose`: what was done and how long it took, on stderr; stdout stays what it is."""

from __future__ import annotations

import hashlib
import re
from pathlib import Path

import pytest

from command_line import PLANAR, call
from truepose._kernel import instruction_set
from truepose.cli import COMMANDS, cli
from truepose.explanations import readings
from truepose.reporting.live import part

Capture = pytest.CaptureFixture[str]
PROGRAM = "G21 G90 G94 F900\nG0 X300 Y200\nG1 X340 Y210\n"
QUICK = ("--set", "workspace.grid.x=[200, 400, 2]", "--set", "workspace.grid.y=[100, 300, 2]")
COMPUTING: dict[str, tuple[str, ...]] = {
    "check": ("check", "m.toml", *QUICK),
    "budget": ("budget", "m.toml", *QUICK, "--format", "json"),
    "compensate": ("compensate", "m.toml", *QUICK, "--format", "csv"),
    "montecarlo": ("montecarlo", "m.toml", *QUICK, "--samples", "200", "--seed", "7"),
    "bounds": ("bounds", "m.toml", *QUICK),
    "shares": ("shares", "m.toml", *QUICK, "--samples", "64"),
    "over-time": ("over-time", "warm.toml"),
    "strain": ("strain", "over.toml"),
    "report": ("report", "m.toml", *QUICK),
    "live": ("live", "m.toml"),
    "allocate": ("allocate", "costs.toml"),
    "plan": ("plan", "m.toml", "--instrument", "position=10um", "--poses", "2"),
    "calibrate": ("calibrate", "m.toml", "measured.csv"),
    "compare": ("compare", "m.toml", "m.toml"),
    "part": ("part", "m.toml", "part.ngc", "--features", "part.toml", "--samples", "50"),
    "gcode": ("gcode", "m.toml", "part.ngc", "--dry-run"),
    "export": ("export", "c", "m.toml"),
    "study": (
        "study",
        "m.toml",
        *QUICK,
        "--vary",
        "condition.temperature=20,30 degC",
        "-o",
        "s.zarr",
    ),
}
IMPORTING = "import"
"""Computes little, but reads files whose hashes count."""
NOT_COMPUTING = {"init", "explain", "schema", "completion", "studio"}
STEP = re.compile(r"^ *(\d+\.\d{3}) s  (.+)$", re.MULTILINE)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    # A page is written whatever stands in it.
    Path("kernel.gz").write_bytes(b"")
    monkeypatch.setattr(part, "kernel_file", lambda: tmp_path / "kernel.gz")
    text = PLANAR.read_text()
    Path("m.toml").write_text(text)
    log = text.replace("\ntemperature = 35", '\ntemperature_log = "log.csv"')
    Path("warm.toml").write_text(log)
    Path("log.csv").write_text("time (min), default (degC)\n0, 20\n20, 25\n")
    cost = '[[cost.tolerance]]\nof = "strut.*.length"\nbands = ["50 um"]\nat = "50 um"\ncost = 4\n'
    Path("costs.toml").write_text(f"{text}\n{cost}")
    Path("over.toml").write_text((PLANAR.parent / "overconstrained.toml").read_text())
    Path("measured.csv").write_text(readings("planar_two_slider"))
    Path("part.ngc").write_text(PROGRAM)
    Path("part.toml").write_text(
        '[[feature]]\nname = "front"\nkind = "straightness"\nlines = "3"\nzone = "0.1 mm"\n'
    )
    return tmp_path


def test_every_command_that_computes_has_it() -> None:
    assert COMPUTING.keys() | NOT_COMPUTING | {IMPORTING} == COMMANDS.keys()


@pytest.mark.parametrize("name", COMPUTING)
def test_what_is_said(name: str, folder: Path, capsys: Capture) -> None:
    plain = call(capsys, *COMPUTING[name])
    outcome = call(capsys, *COMPUTING[name], "--verbose")
    assert (outcome.code, outcome.out) == (plain.code, plain.out)
    said = outcome.err
    # What is said without it is still said, in its order.
    rest = iter(said.splitlines())
    assert all(line in rest for line in plain.err.splitlines())
    for word in COMPUTING[name]:
        file = folder / word
        if file.is_file():
            content = file.read_bytes()
            digest = hashlib.sha256(content).hexdigest()
            assert said.count(f"read {word}: {len(content):,} bytes, SHA-256 {digest}") == 1
    assert instruction_set() in said
    assert "1 thread" in said
    assert re.search(r"machine .+: \d+ drives, \d+ struts, \d+ parameters", said)
    assert re.search(r"workspace: \d+ poses", said)
    assert re.search(r"sources: \w+", said)
    steps = [(float(seconds), what) for seconds, what in STEP.findall(said)]
    assert len(steps) >= 3, "the machine file, what is asked, and all"
    *parts, (in_all, last) = steps
    assert last.startswith("in all, ")
    # Steps within another one are indented, and part of it.
    outer = sum(seconds for seconds, what in parts if not what.startswith(" "))
    rest_of_it = float(last.split()[2])
    assert in_all == pytest.approx(outer + rest_of_it, abs=0.002 * len(steps))


def test_samples_and_seed(folder: Path, capsys: Capture) -> None:
    said = call(capsys, *COMPUTING["montecarlo"], "-v").err
    assert "result: 4 poses, 800 samples, seed 7" in said
    assert f"settings: {QUICK[1]}, {QUICK[3]}" in said


def test_data_files_are_said_too(folder: Path, capsys: Capture) -> None:
    said = call(capsys, *COMPUTING["over-time"], "-v").err
    assert re.search(r"read log\.csv: \d+ bytes, SHA-256 [0-9a-f]{64}", said)


def test_a_step_that_fails_is_said_not_to_be_finished(folder: Path, capsys: Capture) -> None:
    outcome = call(capsys, "budget", "m.toml", "-v", "--set", "strut.1.lenght=3")
    assert (outcome.code, outcome.codes) == (2, ["unknown-key"])
    assert "machine file, not finished" in outcome.err
    # In one process, nothing is said any more afterwards.
    assert call(capsys, "check", "m.toml").err == ""


def test_help_offers_it_where_it_is() -> None:
    for name in COMMANDS:
        command = cli.get_command(None, name)  # type: ignore[arg-type]
        assert command is not None
        options = {option for param in command.params for option in param.opts}
        assert ("--verbose" in options) == (name in COMPUTING or name == IMPORTING)


def test_an_import_says_what_it_read(folder: Path, capsys: Capture) -> None:
    file = PLANAR.parents[1] / "examples" / "data" / "printer.cfg"
    said = call(capsys, IMPORTING, file, "-o", "printer.toml", "--verbose").err
    assert re.search(r"machine .+: 3 drives, 3 struts, \d+ parameters", said)
    assert STEP.findall(said)
