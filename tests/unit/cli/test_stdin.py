"""`-` is standard input: for one file of a command, with problems that name it and its lines."""

from __future__ import annotations

import io
import json
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from build_machine import MACHINES
from command_line import PLANAR, Outcome, call
from truepose.explanations import readings

Capture = pytest.CaptureFixture[str]
Run = Callable[..., Outcome]
PROGRAM = "G21 G90 G94 F900\nG0 X300 Y200\nG1 X340 Y210\n"


@pytest.fixture
def piped(capsys: Capture, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Run:
    """Runs a command in an empty folder with bytes, or a text, on standard input."""
    monkeypatch.chdir(tmp_path)

    def run(content: bytes | str, *arguments: object) -> Outcome:
        data = content.encode() if isinstance(content, str) else content
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(data), encoding="ascii"))
        return call(capsys, *arguments)

    return run


@pytest.mark.parametrize("command", ["check", "budget", "compensate"])
def test_a_machine_file(command: str, piped: Run, capsys: Capture) -> None:
    asked = (command, "-", "--format", "json")
    outcome = piped(PLANAR.read_bytes(), *asked)
    of_file = call(capsys, command, PLANAR, "--format", "json")
    assert outcome.code == of_file.code
    assert outcome.out == of_file.out.replace(PLANAR.name, "<stdin>")


def test_problems_name_it_and_its_lines(piped: Run) -> None:
    text = PLANAR.read_text().replace("length = 500", "lenght = 500", 1)
    line = 1 + text.splitlines().index("lenght = 500")
    outcome = piped(text, "check", "-")
    assert (outcome.code, outcome.codes) == (2, ["unknown-key"])
    assert outcome.err.startswith(f"<stdin>:{line}: error[unknown-key]: strut.1.lenght")
    assert piped(b"\xff", "check", "-").codes == ["not-utf8"]
    assert piped("", "check", "-").codes == ["missing-key"]


def test_files_that_it_names_are_those_of_the_current_folder(piped: Run) -> None:
    text = PLANAR.read_text().replace("\ntemperature = 35", '\ntemperature_log = "log.csv"')
    missing = piped(text, "over-time", "-")
    assert missing.codes == ["file-missing"]
    Path("log.csv").write_text("time (min), default (degC)\n0, 20\n20, 25\n")
    assert piped(text, "over-time", "-").code == 0


def test_measurements(piped: Run, capsys: Capture) -> None:
    text = readings("planar_two_slider")
    outcome = piped(text, "calibrate", PLANAR, "-", "--format", "json")
    Path("measured.csv").write_text(text)
    of_file = call(capsys, "calibrate", PLANAR, "measured.csv", "--format", "json")
    assert outcome.code == of_file.code == 0
    assert outcome.out == of_file.out.replace("measured.csv", "<stdin>")
    wrong = piped(text.replace("200.2802", "here"), "calibrate", PLANAR, "-")
    assert wrong.err.startswith("<stdin>:6:")
    assert wrong.codes == ["not-a-number"]


def test_a_machine_that_is_calibrated_and_a_witness(piped: Run) -> None:
    """Both write a file made from the machine file, which is read but once."""
    Path("measured.csv").write_text(readings("planar_two_slider"))
    asked = ("calibrate", "-", "measured.csv", "--machine-output", "new.toml", "--date")
    assert piped(PLANAR.read_bytes(), *asked, "2026-01-31").code == 0
    assert 'machine = "<stdin>"' in Path("new.toml").read_text()
    strict = ("check", "-", "--set", 'accuracy.target="1 um"', "--witness", "witness.toml")
    assert piped(PLANAR.read_bytes(), *strict).code == 1
    assert Path("witness.toml").exists()


def test_a_program(piped: Run, capsys: Capture) -> None:
    outcome = piped(PROGRAM, "gcode", PLANAR, "-", "-o", "piped.ngc")
    assert outcome.code == 0
    Path("part.ngc").write_text(PROGRAM)
    assert call(capsys, "gcode", PLANAR, "part.ngc", "-o", "filed.ngc").code == 0
    assert Path("piped.ngc").read_text() == Path("filed.ngc").read_text()
    wrong = piped(PROGRAM + "G1 X3.4.5\n", "gcode", PLANAR, "-", "-o", "piped.ngc")
    # Where the output stands already, too.
    assert wrong.codes == ["gcode-bad-number"]
    assert wrong.err.startswith("<stdin>:4:")
    # A machine from standard input, and a program from a file.
    assert piped(PLANAR.read_bytes(), "gcode", "-", "part.ngc", "-o", "again.ngc").code == 0


def test_what_is_compared_exported_and_reported(piped: Run) -> None:
    text = PLANAR.read_bytes()
    assert piped(text, "compare", PLANAR, "-").code == 0
    assert "d1" in piped(text, "export", "c", "-").out
    assert piped((MACHINES / "five_bar.toml").read_bytes(), "report", "-").err.endswith(
        "wrote report.html\n"
    )


@pytest.mark.parametrize(
    "arguments", [("compare", "-", "-"), ("gcode", "-", "-", "--dry-run"), ("calibrate", "-", "-")]
)
def test_twice_is_refused(arguments: tuple[str, ...], piped: Run) -> None:
    outcome = piped(PLANAR.read_bytes(), *arguments)
    assert (outcome.code, outcome.codes, outcome.out) == (2, ["stdin-twice"], "")


def test_what_is_none_of_its_inputs(piped: Run) -> None:
    """A file may have its name, and nothing is read of it where no - is given."""
    Path("<stdin>").write_bytes(PLANAR.read_bytes())
    assert piped("", "check", "<stdin>").code == 1
    assert piped("", "check", "-").codes == ["missing-key"]
    assert piped("", "check", "./-").codes == ["file-missing"]
    assert piped(PLANAR.read_bytes(), "check", "-", "--watch").code == 2


def test_after_a_command_nothing_of_it_is_left(piped: Run) -> None:
    lengths = []
    for length in (500, 501):
        text = PLANAR.read_text().replace("length = 500", f"length = {length}", 1)
        result = json.loads(piped(text, "check", "-", "--format", "json").out)
        lengths.append(result["machine"])
    assert lengths[0] != lengths[1]
