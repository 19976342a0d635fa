"""Killed while it writes `--output`: what stood there still stands, or nothing does.

Two ways to die in the middle. A wrapper pauses the command inside the block in which the file is
written, with half of it on the disk, until the test sends SIGKILL. And the system itself ends the
command inside a write, where the file outgrows its limit (RLIMIT_FSIZE, with the signal's default).
"""

from __future__ import annotations

import json
import os
import resource
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from command_line import PLANAR, call
from sweeps import sweep, thinned

FORMS = (".json", ".csv", ".nc")
# Long enough that half of the text does not wait in a buffer of the file.
ARGUMENTS = ["budget", str(PLANAR), "--set", "workspace.grid.x=[200, 400, 40]"]
OLD = b"what stood here before"

# Writes the whole file as the command would, cuts it to half its length, says so, and waits.
PAUSING = """
import importlib, os, sys, time
from pathlib import Path
from typing import Any
from truepose.cli import main
from truepose.reporting.formats import FORMATS

module = importlib.import_module(FORMATS[Path(sys.argv[-1]).suffix])
whole = module.write

def half(result, path):
    whole(result, path)
    os.truncate(path, path.stat().st_size // 2)
    print("half", path.stat().st_size, flush=True)
    time.sleep(600)

module.write = half
main()
"""
# The signal that Python ignores, so that a full disk is an error, ends the process again.
LIMITED = """
import signal
signal.signal(signal.SIGXFSZ, signal.SIG_DFL)
from truepose.cli import main
main()
"""


@pytest.fixture(params=thinned(["a file", "no file"]))
def there(request: pytest.FixtureRequest) -> bool:
    return bool(request.param == "a file")


@pytest.fixture(params=FORMS)
def output(request: pytest.FixtureRequest, tmp_path: Path, there: bool) -> Iterator[Path]:
    file = tmp_path / f"result{request.param}"
    if there:
        file.write_bytes(OLD)
    yield file
    left = [path for path in tmp_path.iterdir() if path != file]
    assert len(left) == 1, "the half that was written, under a name of its own"
    assert left[0].name.startswith(".result.")
    assert left[0].suffix == file.suffix


def started(program: str, output: Path, **how: Any) -> subprocess.Popen[str]:
    arguments = [sys.executable, "-c", program, *ARGUMENTS, "--output", str(output)]
    return subprocess.Popen(
        arguments, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **how
    )


def unchanged(output: Path, there: bool) -> None:
    if there:
        assert output.read_bytes() == OLD
    else:
        assert not output.exists()


def test_kill_9_in_the_middle_of_writing(output: Path, there: bool) -> None:
    process = started(PAUSING, output)
    assert process.stdout is not None
    half = process.stdout.readline().split()
    assert half[:1] == ["half"], process.communicate()
    assert int(half[1]) > 1000
    process.send_signal(signal.SIGKILL)
    _, errors = process.communicate(timeout=60)
    assert (process.returncode, errors) == (-signal.SIGKILL, "")
    unchanged(output, there)


@sweep
def test_ended_by_the_system_inside_a_write(output: Path, there: bool, tmp_path: Path) -> None:
    limit = 20_000  # bytes; the files have several times as many

    def lower() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))

    # Byte code that is written on the way would end the process as well.
    quiet = os.environ | {"PYTHONDONTWRITEBYTECODE": "1"}
    process = started(LIMITED, output, preexec_fn=lower, env=quiet)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == -signal.SIGXFSZ, errors
    assert 0 < max(path.stat().st_size for path in tmp_path.glob(".result.*")) <= limit
    unchanged(output, there)


def test_the_next_run_writes_the_whole_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    output = tmp_path / "result.json"
    process = started(PAUSING, output)
    assert process.stdout is not None
    process.stdout.readline()
    process.send_signal(signal.SIGKILL)
    process.communicate(timeout=60)
    assert call(capsys, *ARGUMENTS, "--output", output).code == 0
    assert json.loads(output.read_text(encoding="utf-8"))["command"] == "budget"
