"""The number of threads: by call and by environment."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import truepose

PLANAR = Path(__file__).parent.parent.parent / "machines" / "planar_two_slider.toml"


def with_threads(value: str, *words: str | Path) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "TRUEPOSE_THREADS": value}
    return subprocess.run(
        [sys.executable, "-c", *words],
        env=environment, capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip


def test_threads_by_call() -> None:
    before = truepose.threads()
    try:
        assert truepose.threads(3) == 3
        assert truepose.threads() == 3
        with pytest.raises(ValueError, match="from 1 to 1024"):
            truepose.threads(0)
    finally:
        truepose.threads(before)


def test_threads_by_environment() -> None:
    run = with_threads("3", "import truepose; print(truepose.threads())")
    assert (run.returncode, run.stdout.strip()) == (0, "3")


@pytest.mark.parametrize("value", ["0", "-1", "two", "1.5", ""])
def test_a_number_that_is_none_is_refused(value: str) -> None:
    run = with_threads(value, "from truepose.cli import main; main()", "check", PLANAR)
    assert run.returncode == 2
    assert "TRUEPOSE_THREADS" in run.stderr
    assert "bad-setting" in run.stderr
    assert "Traceback" not in run.stderr
