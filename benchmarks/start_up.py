"""What `truepose --help` costs beyond the bare interpreter."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from benchmarks.rows import Row

ROUNDS = 25
ASKED_MS = 60.0


# As a user's shell has it: byte code is written once and read ever after.
ENVIRONMENT = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}


def processor_seconds(command: list[str]) -> float:
    """Processor time, user and system, of one run of a command."""
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, env=ENVIRONMENT)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise RuntimeError(f"{command} ended with {process.returncode}")
    return usage.ru_utime + usage.ru_stime


def measure() -> list[Row]:
    """The least of several runs of each, taking turns."""
    command = [str(Path(sys.executable).with_name("truepose")), "--help"]
    bare = [sys.executable, "-c", "pass"]
    processor_seconds(command)  # writes the byte code
    runs = [(processor_seconds(command), processor_seconds(bare)) for _ in range(ROUNDS)]
    help_seconds, bare_seconds = (min(times) for times in zip(*runs, strict=True))
    return [
        Row(
            "`truepose --help` beyond the bare interpreter",
            1e3 * (help_seconds - bare_seconds),
            "ms",
            "at most",
            ASKED_MS,
            f"{1e3 * help_seconds:.0f} ms against {1e3 * bare_seconds:.0f} ms of processor time",
        )
    ]
