"""Make tests/archive/VERSION: machine files, measurements and results as this version has them.

`python tests/make_archive.py 0.2`, once for each version that is released and never again. Later
versions read the files and run the calls of `calls.toml` anew: tests/archive/test_archive.py.
Results are of few poses, and every random number has its seed, so that a folder stays small.
"""

from __future__ import annotations

import json
import os
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import truepose as tp
from build_machine import machine_files
from made_measurements import made_measurements, poses_within
from truepose.calibration import write_measurements
from truepose.cli import run
from truepose.machine import Machine

ARCHIVE = Path(__file__).parent / "archive"
FOLDERS = ("machines", "measurements", "programs", "results", "exports")
ALL_FORMS = ("planar_two_slider", "hexapod")
"""Machines of which a result is kept as JSON, CSV and NetCDF; of the others as JSON."""

QUESTIONS: dict[str, list[str]] = {
    "check": [],
    "budget": [],
    "compensate": [],
    "bounds": [],
    "shares": ["--samples", "64", "--seed", "5"],
    "montecarlo": ["--samples", "1000", "--seed", "7"],
}
INSTRUMENTS = {
    "planar_two_slider": ("position", "distance"),
    "rotary_delta": ("position", "joint-angle"),
    "hexapod": ("pose", "strut-length"),
}
EXPORTS = {
    "linuxcnc-genhexkins": "hexapod",
    "linuxcnc-lineardelta": "linear_delta",
    "klipper": "linear_delta",
    "marlin": "linear_delta",
    "reprap": "linear_delta",
    "pose-map": "planar_two_slider",
}
"""Controllers whose files are numbers; printed C is not: its formulas may be ordered anew."""

PROGRAM = """\
G21 G90 G94
G0 X250 Y150
G1 X350 F1500
G3 X370 Y170 J20
G1 X300 Y250
M2
"""


def thinned(machine: Machine, count: int) -> list[str]:
    """`--set` for as many poses, apart along the first axis and anywhere along the others."""
    words = []
    poses = machine.poses()
    low, high = poses.min(axis=0), poses.max(axis=0)
    for number, axis in enumerate(machine.commanded):
        unit = machine.file_units["length" if axis in "xyz" else "angle"].scale
        several = count if number == 0 else 1
        shares = np.array([0.2, 0.9] if several > 1 else [0.35 + 0.1 * number] * 2)
        ends = np.round((low[number] + shares * (high - low)[number]) / unit, 4).tolist()
        words += ["--set", f"workspace.grid.{axis}=[{ends[0]}, {ends[1]}, {several}]"]
    return words


def measure(machine: Machine, kind: str, file: Path) -> None:
    """Readings of a machine that is off within its tolerances, with noise."""
    seed = len(machine.name) + len(kind)
    made = made_measurements(machine, kind, poses_within(machine, 24, seed=seed), values="nominal")
    random = np.random.default_rng(seed)
    noise = random.normal(0.0, made.uncertainty)
    write_measurements(file, machine, made.with_values(made.value + noise))


def calls(machines: dict[str, Machine]) -> Iterator[list[str]]:
    """Command lines in the folder of the version, each with its `--output` last."""
    for stem, machine in machines.items():
        for command, more in QUESTIONS.items():
            if command == "bounds" and machine.kernel.overconstrained:
                continue  # refused: nothing can be proven there
            # All quantiles of samples as JSON would be longer than everything else together.
            endings = ["csv"] if command == "montecarlo" else ["json"]
            if stem in ALL_FORMS and command != "check":
                endings = sorted({*endings, "csv", "nc"})
            poses = thinned(machine, 1 if command == "shares" else 2)
            for ending in endings:
                output = f"results/{stem}.{command}.{ending}"
                yield [command, f"machines/{stem}.toml", *poses, *more, "--output", output]
    for stem, kinds in INSTRUMENTS.items():
        for kind in kinds:
            case = f"{stem}.{kind}"
            ending = "nc" if stem in ALL_FORMS[:1] else "json"
            yield [
                "calibrate", f"machines/{stem}.toml", f"measurements/{case}.csv", "--seed", "3",
                "--date", "2026-01-31", "--force", "--machine-output", f"results/{case}.toml",
                "--output", f"results/{case}.calibrate.{ending}",
            ]  # fmt: skip
    for interpolation in ("either", "pose"):
        yield [
            "gcode", "machines/planar_two_slider.toml", "programs/part.ngc",
            "--interpolation", interpolation, "--output", f"programs/corrected.{interpolation}.ngc",
        ]  # fmt: skip
    for controller, stem in EXPORTS.items():
        yield ["export", controller, f"machines/{stem}.toml", "--output", f"exports/{controller}"]


def make(folder: Path) -> None:
    """Fill a new folder."""
    for name in FOLDERS:
        (folder / name).mkdir(parents=True)
    for path in machine_files():
        shutil.copy(path, folder / "machines")
    machines = {path.stem: tp.load(path) for path in machine_files()}
    for stem, kinds in INSTRUMENTS.items():
        for kind in kinds:
            measure(machines[stem], kind, folder / "measurements" / f"{stem}.{kind}.csv")
    (folder / "programs" / "part.ngc").write_text(PROGRAM, encoding="utf-8")
    os.chdir(folder)
    lines = [f"# What made this folder, with truepose {tp.__version__}.\n"]
    for words in calls(machines):
        code = run(words)
        if code not in (0, 1):
            sys.exit(f"exit code {code}: truepose {' '.join(words)}")
        lines.append(f"[[call]]\narguments = {json.dumps(words)}\ncode = {code}\n")
    Path("calls.toml").write_text("\n".join(lines), encoding="utf-8")


if __name__ == "__main__":
    if len(sys.argv) != 2 or (ARCHIVE / sys.argv[1]).exists():
        sys.exit("usage: python tests/make_archive.py VERSION, of which there is no folder yet")
    make(ARCHIVE / sys.argv[1])
