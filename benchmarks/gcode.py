"""Correction of a program, its proof included, against LinuxCNC's parsing of the same file."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np

import truepose
from benchmarks.rows import Row
from benchmarks.timing import DisagreementError

MACHINES = ("planar_two_slider", "hexapod")
LINES = 200_000
ROUNDS = 5
ASKED_RATIO = 1.0
WARMER, FORCE = 25.0, (300.0, 200.0, -150.0)
ROOT = Path(__file__).parent.parent


def program(machine: truepose.Machine, path: Path, lines: int = LINES) -> None:
    """Short moves, under 1 mm, on a spiral of many turns within the machine's workspace.

    A shorter program is the beginning of a longer one.
    """
    box = machine.poses()
    low, high = box.min(axis=0), box.max(axis=0)
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    angle = np.linspace(0.0, 800.0 * np.pi, LINES)[:lines]
    reach = np.linspace(0.2, 0.9, LINES)[:lines]
    x = 1e3 * (middle[0] + half[0] * reach * np.cos(angle))
    y = 1e3 * (middle[1] + half[1] * reach * np.sin(angle))
    scale = {name: 1e3 if name in "xyz" else np.degrees(1.0) for name in machine.commanded}
    others = zip(machine.commanded[2:], middle[2:], strict=True)
    first = " ".join(f"{name.upper()}{value * scale[name]:.4f}" for name, value in others)
    with path.open("w", encoding="ascii") as file:
        file.write(f"G21 G90 G94 F1000\nG0 X{x[0]:.4f} Y{y[0]:.4f} {first}\n")
        file.writelines(f"G1 X{a:.4f} Y{b:.4f}\n" for a, b in zip(x, y, strict=True))
        file.write("M2\n")


def measure() -> list[Row]:
    """Wall time of both on two cores, the best of several in turns; only theirs parses alone."""
    if shutil.which("rs274") is None:
        raise RuntimeError("rs274 (Debian: linuxcnc-uspace) is not installed")
    return [measured(name) for name in MACHINES]


def measured(name: str) -> Row:
    """One machine, 25 K warm and under load."""
    machine = truepose.load(ROOT / "machines" / f"{name}.toml")
    given = machine.condition
    condition = given.replace(temperature=given.reference_temperature + WARMER, force=FORCE)
    with tempfile.TemporaryDirectory() as folder:
        part, target = Path(folder) / "part.ngc", Path(folder) / "corrected.ngc"
        program(machine, part)
        ours, theirs = [], []
        for _ in range(ROUNDS):
            begun = time.perf_counter()
            command = ["rs274", "-g", str(part), str(Path(folder) / "canonical")]
            subprocess.run(command, check=True, capture_output=True)
            theirs.append(time.perf_counter() - begun)
            begun = time.perf_counter()
            proof = truepose.correct_program(machine, part, target, condition)
            ours.append(time.perf_counter() - begun)
        worst = proof.after.position
        if worst is None or proof.moves != LINES + 1 or not worst.value <= proof.tolerance:
            raise DisagreementError(f"{name}: the corrected program is not the one meant")
    best, peer = min(ours), min(theirs)
    detail = (
        f"{LINES / best:,.0f} against {LINES / peer:,.0f} lines a second of wall time; {LINES:,} "
        f"short moves, thermal and elastic, divided, written, read back and proven: at most "
        f"{1e6 * worst.value:.2g} µm left"
    )
    what = f"G-code correction over `rs274 -g`, lines a second, {name}"
    return Row(what, peer / best, "x", "at least", ASKED_RATIO, detail)
