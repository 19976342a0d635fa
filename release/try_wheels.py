"""Tries what is in dist/ as users get it, in clean environments, on every library machine.

`python -m release.try_wheels [FILE ...] [--python PYTHON ...] [--native]`. A wheel has nothing but
its own environment on the PATH, so no cargo; the sdist is built with the cargo there is. What is
for ARM runs elsewhere under QEMU (release/arm64.py); `--native` leaves such files out. What
the files answer is compared between them.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import platform
import shutil
import subprocess
import sys
import sysconfig
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from release import DIST, arm64

Answers = dict[str, object]
"""Machine -> what `truepose check --format json` says of it."""

AGREEMENT = 1e-9
"""Answers of two processors differ by no more, relative to the larger of both and to 1."""
PLACES = {"pose", "at", "example"}
"""Keys that say at which pose an answer is reached: of equal ones the last digit chooses."""
EXTRAS = {"report": ("report", "report.html"), "netcdf": ("budget", "budget.nc")}
"""Extra -> the command that needs it, and what that writes."""
REPORTED = "planar_two_slider"
"""The machine with which extras are tried."""
SHOWN = 300
"""Characters of what a failing command says."""
VERDICTS = (0, 1)
"""Exit codes of `truepose check` that are an answer."""


@dataclass(frozen=True)
class Installed:
    """A file of dist/, installed."""

    run: Callable[[Sequence[str]], subprocess.CompletedProcess[str]]
    """Runs the program `truepose` with arguments."""
    seconds: float
    """How long installing took, by the wall."""


def main() -> int:
    """0, or 1 where a file does not work or answers otherwise than the first."""
    parser = argparse.ArgumentParser(prog="python -m release.try_wheels", description=__doc__)
    parser.add_argument("files", nargs="*", type=Path, metavar="FILE", help="default: all of dist/")
    parser.add_argument("--python", nargs="+", default=[sys.executable], metavar="PYTHON")
    parser.add_argument("--extras", nargs="*", choices=EXTRAS, default=list(EXTRAS))
    parser.add_argument("--native", action="store_true", help="only files for this machine")
    arguments = parser.parse_args()
    files = arguments.files or sorted((*DIST.glob("*.whl"), *DIST.glob("*.tar.gz")))
    files = sorted(filter(runs_here, files)) + sorted(filter(under_qemu_only, files))
    if arguments.native:
        files = list(filter(runs_here, files))
    if not files:
        parser.error(f"nothing for this machine in {DIST}; run: make wheels")
    first: Answers = {}
    failed = False
    for file in files:
        for python in arguments.python if runs_here(file) else arguments.python[:1]:
            faults = tried(file.absolute(), python, arguments.extras, first)
            failed |= bool(faults)
            for fault in faults:
                print(f"  {fault}", file=sys.stderr, flush=True)
    return int(failed)


def runs_here(file: Path) -> bool:
    """Whether it is for this machine; the sdist always is."""
    tags = file.name.removesuffix(".whl").rpartition("-")[2]
    linux = "musllinux" if "musl" in str(sysconfig.get_config_var("HOST_GNU_TYPE")) else "manylinux"
    system = {"linux": linux, "darwin": "macosx", "win32": "win"}[sys.platform]
    return file.name.endswith(".tar.gz") or (
        system in tags and platform.machine().lower() in tags.lower()
    )


def under_qemu_only(file: Path) -> bool:
    """Whether it is for Linux on ARM, and this machine is no such one."""
    return "manylinux" in file.name and "aarch64" in file.name and not runs_here(file)


def tried(file: Path, python: str, extras: Sequence[str], first: Answers) -> list[str]:
    """What is wrong with a file; its answers become those of the first, where there are none."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        emulated = under_qemu_only(file)
        installed = (
            under_qemu(file, folder) if emulated else in_environment(file, python, extras, folder)
        )
        answers, faults = asked(installed, folder)
        faults += [] if emulated else reported(installed, extras, folder)
    apart = difference(first, answers) if first else 0.0
    if apart > AGREEMENT:
        faults.append(f"answers are {apart:.1e} from those of the first file")
    first.update(answers)
    how = "under QEMU" if emulated else f"with {Path(python).name}"
    print(
        f"{file.name} {how}: installed in {installed.seconds:.0f} s, {len(answers)} machines, "
        f"{len(faults)} faults, within {apart:.1e} of the first",
        flush=True,
    )
    return faults


def in_environment(file: Path, python: str, extras: Sequence[str], folder: Path) -> Installed:
    """Install into an environment of its own, with extras; a wheel sees no cargo."""
    subprocess.run([python, "-m", "venv", str(folder / "venv")], check=True)
    binaries = folder / "venv" / ("Scripts" if sys.platform == "win32" else "bin")
    environment = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "VIRTUAL_"))}
    if file.name.endswith(".whl"):
        system = os.environ.get("SYSTEMROOT", "")
        environment["PATH"] = os.pathsep.join(
            [str(binaries), *([rf"{system}\System32"] if system else [])]
        )
        if shutil.which("cargo", path=environment["PATH"]):
            raise RuntimeError("there is a cargo in the clean environment")
    start = time.perf_counter()
    pip = [str(binaries / "python"), "-m", "pip", "install", "--quiet"]
    asked_for = f"{file}[{','.join(extras)}]" if extras else str(file)
    subprocess.run([*pip, asked_for], cwd=folder, env=environment, check=True)
    seconds = time.perf_counter() - start

    def run(arguments: Sequence[str]) -> subprocess.CompletedProcess[str]:
        return _output([str(binaries / "truepose"), *arguments], folder, environment)

    return Installed(run, seconds)


def under_qemu(file: Path, folder: Path) -> Installed:
    """Unpack for ARM beside an ARM Python."""
    command = arm64.python_command()
    start = time.perf_counter()
    arm64.install(file, folder / "site")
    seconds = time.perf_counter() - start
    environment = os.environ | {"PYTHONPATH": str(folder / "site")}

    def run(arguments: Sequence[str]) -> subprocess.CompletedProcess[str]:
        return _output([*command, "-m", "truepose", *arguments], folder, environment)

    return Installed(run, seconds)


def asked(installed: Installed, folder: Path) -> tuple[Answers, list[str]]:
    """What `truepose check` says of every machine that `truepose init` offers, and what fails."""
    listed = installed.run(["init", "--list", "--format", "json"])
    if listed.returncode:
        return {}, [f"init --list: {listed.stderr.strip()}"]
    answers: Answers = {}
    faults: list[str] = []
    for entry in json.loads(listed.stdout)["machines"]:
        kind = entry["kind"]
        file = folder / f"{kind}.toml"
        made = installed.run(["init", kind, "--output", str(file)])
        done = installed.run(["check", str(file), "--format", "json"])
        if made.returncode or done.returncode not in VERDICTS:
            said = (made.stderr or done.stderr).strip()[:SHOWN]
            faults.append(f"{kind}: exit {done.returncode}: {said}")
        else:
            answers[kind] = json.loads(done.stdout)
    return answers, faults


def reported(installed: Installed, extras: Sequence[str], folder: Path) -> list[str]:
    """What fails of the commands that need extras."""
    faults = []
    for command, name in (EXTRAS[extra] for extra in extras):
        machine, output = folder / f"{REPORTED}.toml", folder / name
        done = installed.run([command, str(machine), "--output", str(output)])
        if done.returncode not in VERDICTS or not output.exists():
            faults.append(f"{command}: exit {done.returncode}: {done.stderr.strip()}")
    return faults


def difference(one: object, other: object) -> float:
    """How far two answers are apart: numbers relative to the larger and 1, infinite of all else.

    Where it is reached is left out.
    """
    if isinstance(one, dict) and isinstance(other, dict):
        if one.keys() != other.keys():
            return math.inf
        numbers = one.keys() - PLACES
        return max((difference(one[key], other[key]) for key in numbers), default=0.0)
    if isinstance(one, list) and isinstance(other, list):
        if len(one) != len(other):
            return math.inf
        return max((difference(*pair) for pair in zip(one, other, strict=True)), default=0.0)
    if isinstance(one, (int, float)) and isinstance(other, (int, float)):
        return abs(one - other) / max(abs(one), abs(other), 1.0)
    return 0.0 if one == other else math.inf


def _output(
    command: Sequence[str], folder: Path, environment: dict[str, str]
) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        command,
        cwd=folder,
        env=environment,
        capture_output=True,
        encoding="utf-8",
        check=False,
    )


if __name__ == "__main__":
    sys.exit(main())
