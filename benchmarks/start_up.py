"""What commands cost before they have worked anything out, and what of it is imports."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

from benchmarks.hexapod import MACHINE
from benchmarks.rows import Row

ROUNDS = 25
FEW_ROUNDS = 5
ASKED_HELP_MS = 15.0
PLANAR = MACHINE.with_name("planar_two_slider.toml")

# As a user's shell has it: byte code is written once and read ever after.
ENVIRONMENT = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}


def processor_seconds(command: list[str]) -> float:
    """Processor time, user and system, of one run of a command."""
    quiet = subprocess.DEVNULL
    process = subprocess.Popen(command, stdout=quiet, stderr=quiet, env=ENVIRONMENT)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    # Exit code 1 is a verdict: the accuracy asked is not kept.
    if process.returncode not in (0, 1):
        raise RuntimeError(f"{command} ended with {process.returncode}")
    return usage.ru_utime + usage.ru_stime


def measure() -> list[Row]:
    """The least of several runs of each, taking turns."""
    truepose = str(Path(sys.executable).with_name("truepose"))
    bare = [sys.executable, "-c", "pass"]
    help_seconds, bare_seconds = least_seconds([[truepose, "--help"], bare], ROUNDS)
    rows = [
        Row(
            "`truepose --help` beyond the bare interpreter",
            1e3 * (help_seconds - bare_seconds),
            "ms",
            "at most",
            ASKED_HELP_MS,
            f"{1e3 * help_seconds:.0f} ms against {1e3 * bare_seconds:.0f} ms of processor time",
        )
    ]
    with tempfile.TemporaryDirectory() as folder:
        report = str(Path(folder) / "report.html")
        for what, arguments, asked in (
            ("`truepose init --list`", ["init", "--list"], 0.15),
            ("`truepose check`, hexapod", ["check", str(MACHINE)], 0.5),
            ("`truepose report`, planar machine", ["report", str(PLANAR), "-o", report], 1.1),
        ):
            (seconds,) = least_seconds([[truepose, *arguments]], FEW_ROUNDS)
            imports = min(import_seconds([truepose, *arguments]) for _ in range(FEW_ROUNDS))
            detail = f"processor time, interpreter in it; {imports:.2f} s of it imports"
            rows.append(Row(what, seconds, "s", "at most", asked, detail))
    return rows


def least_seconds(commands: list[list[str]], rounds: int) -> list[float]:
    """Processor time of each, the least of several runs in turns."""
    for command in commands:
        processor_seconds(command)  # writes the byte code
    runs = [[processor_seconds(command) for command in commands] for _ in range(rounds)]
    return [min(times) for times in zip(*runs, strict=True)]


def import_seconds(command: list[str]) -> float:
    """What the imports of a command's launcher and of all after it take, by `-X importtime`."""
    run = subprocess.run(
        [sys.executable, "-X", "importtime", *command],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        env=ENVIRONMENT,
        check=False,
    )
    return 1e-6 * sum(int(own) for own in re.findall(r"^import time: +(\d+) \|", run.stderr, re.M))
