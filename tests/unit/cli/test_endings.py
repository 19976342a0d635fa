"""Outputs that take nothing, and defects: a sentence and a code that nobody takes for an answer."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
from pathlib import Path

import pytest

from command_line import PLANAR, call

FULL = Path("/dev/full")
NOT_WRITABLE = "error[output-not-writable]: what is printed cannot be written"


def shell(line: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """A line of `sh` in which $T is the program and $M a machine file."""
    program = f"{sys.executable} -c 'from truepose.cli import main; main()'"
    return subprocess.run(
        ["/bin/sh", "-c", line.replace("$T", program)],
        env={**os.environ, "M": str(PLANAR), **environment},
        capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip


@pytest.mark.skipif(not FULL.exists(), reason="this system has no /dev/full")
@pytest.mark.parametrize(
    "words", ["check $M", "check $M --format json", "--help", "--version", "budget --help"]
)
def test_a_standard_output_that_is_full(words: str) -> None:
    run = shell(f"$T {words} > /dev/full")
    assert run.returncode == 2
    assert NOT_WRITABLE in run.stderr
    assert "No space left on device" in run.stderr
    assert "Traceback" not in run.stderr
    assert "Exception ignored" not in run.stderr


@pytest.mark.parametrize("words", ["check $M", "--help"])
def test_a_standard_output_that_is_closed(words: str) -> None:
    run = shell(f"$T {words} >&-")
    assert run.returncode == 2
    assert NOT_WRITABLE in run.stderr
    assert "closed" in run.stderr
    assert "Traceback" not in run.stderr


@pytest.mark.parametrize("redirection", ["2>&-", "2>/dev/full"])
@pytest.mark.parametrize(("words", "code"), [("check nothing.toml", 2), ("check --nonsense", 2)])
def test_a_standard_error_that_takes_nothing(words: str, code: int, redirection: str) -> None:
    run = shell(f"$T {words} {redirection}")
    assert run.returncode == code
    assert run.stdout == ""


def test_a_closed_standard_error_changes_no_answer() -> None:
    said, silent = shell("$T check $M"), shell("$T check $M 2>&-")
    assert (silent.returncode, silent.stdout) == (said.returncode, said.stdout)


@pytest.mark.parametrize(
    "words", ["check $M --format json", "--help", "check nothing.toml 2>&1", "--nonsense 2>&1"]
)
def test_a_reader_that_goes_away(words: str) -> None:
    # The reader is gone before the first line: it closes its end and waits for the program.
    run = shell(f"{{ $T {words}; echo $? >&3; }} 3>&2 | exec 0<&- sleep 3")
    assert run.stderr.split() == ["141"]


@pytest.mark.parametrize(
    ("failure", "what"),
    [
        (ZeroDivisionError("float division by zero"), "ZeroDivisionError (float division by zero)"),
        (RuntimeError(), "RuntimeError"),
        (RuntimeError("a\nb" + "c" * 500), "RuntimeError (a bccc"),
        (OSError(2, "No such file or directory", "lost"), "FileNotFoundError"),
        (type("PanicException", (BaseException,), {})("index"), "PanicException (index)"),
    ],
)
def test_a_defect(
    failure: BaseException,
    what: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise failure

    monkeypatch.setattr("truepose.load", fail)
    outcome = call(capsys, "check", PLANAR)
    assert outcome.code == 70
    assert outcome.out == ""
    assert f"this is a defect of truepose 0.1.0, not of your input: {what}" in outcome.err
    assert "in truepose/cli/_steps.py, line " in outcome.err
    assert "report this sentence" in outcome.err
    assert len(outcome.err.splitlines()) == 1
    assert len(outcome.err) < 700


def test_a_defect_with_its_traceback(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr("truepose.load", fail)
    monkeypatch.setenv("TRUEPOSE_TRACEBACK", "1")
    outcome = call(capsys, "check", PLANAR)
    assert outcome.code == 70
    assert outcome.err.startswith("Traceback")


def test_no_memory(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object, **__: object) -> None:
        raise MemoryError

    monkeypatch.setattr("truepose.load", fail)
    outcome = call(capsys, "check", PLANAR)
    assert outcome.code == 2
    assert "not enough memory" in outcome.err


def of_limited_files() -> None:
    """No file may have more than 8 KiB: what a full disk is to who writes."""
    resource.setrlimit(resource.RLIMIT_FSIZE, (8192, 8192))


@pytest.mark.parametrize("ending", [".nc", ".json", ".csv"])
def test_a_disk_that_is_full(ending: str, tmp_path: Path) -> None:
    if ending == ".nc":
        pytest.importorskip("h5netcdf")
    file = tmp_path / f"out{ending}"
    file.write_text("old")
    run = subprocess.run(
        [
            *(sys.executable, "-c", "from truepose.cli import main; main()"),
            *("budget", str(PLANAR), "-o", str(file)),
        ],
        capture_output=True, text=True, timeout=120, check=False, preexec_fn=of_limited_files,
    )  # fmt: skip
    assert run.returncode == 2
    assert run.stderr.splitlines()[0].endswith(
        "error[output-not-writable]: the output file could not be written"
    )
    assert "File too large" in run.stderr
    assert len(run.stderr.splitlines()) == 3
    assert [path.name for path in tmp_path.iterdir()] == [file.name]
    assert file.read_text() == "old"
