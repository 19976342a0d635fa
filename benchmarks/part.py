"""The part: its samples against Monte Carlo's, its fits, and a long program against its correction.

`python -m benchmarks.part FOLDER TIMES` writes a program there, without TIMES a process reads and
walks it, and says what memory that takes at most.
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

import truepose
from benchmarks.gcode import FORCE, LINES, ROOT, WARMER, program
from benchmarks.rows import Row
from benchmarks.timing import best_seconds, require_agreement
from truepose import _kernel
from truepose.machine import Condition, Machine
from truepose.runs.poses import required_sources
from truepose.workpiece.along import Walked, walk
from truepose.workpiece.fits import AnyPlane, CircleInPlane, associate
from truepose.workpiece.read import read_part
from truepose.workpiece.states import PartState, in_space, part_states

SEED, ROUNDS = 1, 5
POINTS, SAMPLES, MONTE_CARLO = 360, 256, 65_536
MACHINES, PATH = 10_000, 4000
PARTS, SIZE, FORM = 500, 0.02, 1e-5
TIMES = 10
ASKED_SOLVE, ASKED_LINEAR, ASKED_ZONE, ASKED_PROGRAM, ASKED_MEMORY = 1.2, 2.0, 1.0, 3.0, 1.1
FEATURE = '[[feature]]\nname = "contour"\nkind = "profile"\nlines = "1001-1300"\nzone = "1 mm"\n'


def measure() -> list[Row]:
    """On one thread, in processor time, but for the peaks of memory of processes of their own."""
    before = _kernel.threads()
    _kernel.threads(1)
    try:
        return [_memory(), *_samples(), *_zones(), _program()]
    finally:
        _kernel.threads(before)


def _samples() -> list[Row]:
    """The hexapod as its file has it: what is unknown is a machine's, and nothing runs along."""
    machine = truepose.load(ROOT / "machines" / "hexapod.toml")
    state = _state(machine, POINTS)
    varying = state.varying(SEED)
    home = machine.kernel.home[np.newaxis]

    def monte_carlo() -> object:
        return truepose.monte_carlo(machine, home, MONTE_CARLO, SEED)

    def exact() -> object:
        return state.exact_errors(varying, 0, SAMPLES)

    _require_monte_carlo(machine, state)
    calls: dict[str, Callable[[], object]] = {"monte_carlo": monte_carlo, "part": exact}
    best = best_seconds(calls, rounds=ROUNDS)
    solve = best["part"] / (SAMPLES * POINTS)
    peer = best["monte_carlo"] / MONTE_CARLO

    long = _state(machine, PATH)

    def linear() -> None:
        for name in ("first_order", "effects", "known_error"):
            long.__dict__.pop(name, None)
        random = long.varying(SEED)
        for first in range(0, MACHINES, 250):
            long.linear_errors(random, first, 250)

    seconds = best_seconds({"linear": linear}, rounds=2)["linear"]
    count = state.variables.columns.size
    return [
        Row(
            "part, an exact sample at a point over a sample of `monte_carlo`",
            solve / peer,
            "x",
            "at most",
            ASKED_SOLVE,
            f"{1e9 * solve:.0f} ns ({POINTS} points, {SAMPLES} samples) against {1e9 * peer:.0f} "
            f"ns (one pose, {MONTE_CARLO:,} samples), hexapod, {count} parameters",
        ),
        Row(
            f"part, errors to first order of {MACHINES:,} machines at {PATH:,} points",
            seconds,
            "s",
            "at most",
            ASKED_LINEAR,
            f"hexapod, {count} parameters, the first order itself and the draws included",
        ),
    ]


def _state(machine: Machine, count: int) -> PartState:
    """As commanded, at the points of a circle."""
    angle = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    poses = np.tile(machine.kernel.home, (count, 1))
    poses[:, :2] += SIZE * np.column_stack([np.cos(angle), np.sin(angle)])
    sources = required_sources(machine, machine.condition)
    still = np.zeros((count, len(machine.drives)))
    states, status = part_states(machine, machine.condition, sources, poses, still)
    if status.any():
        raise RuntimeError("the hexapod does not reach the circle")
    return states[0]


def _require_monte_carlo(machine: Machine, state: PartState) -> None:
    """Samples of the part are solutions of the kernel, one at a time."""
    varying = state.varying(SEED)
    errors, good = state.exact_errors(varying, 0, 8)
    if not good.all():
        raise RuntimeError("a sample could not be assembled")
    t = varying.rows(0, 8)
    half = np.broadcast_to(state.variables.half_width, (POINTS, state.variables.columns.size))
    shifted, shift = state.variables.shift
    moved = half[0] * t[:, state.variables.variable_of]
    deviations = np.zeros((8, len(machine.parameters)))
    np.add.at(deviations, (slice(None), state.variables.columns), moved)
    deviations[:, shifted] += shift[0]
    single, _ = machine.kernel.displacement(
        np.repeat(state.block.joints[:1], 8, 0),
        np.repeat(state.block.placements[:1], 8, 0),
        np.arange(len(machine.parameters)),
        deviations,
    )
    require_agreement("samples of the part", errors[:, 0], in_space(machine, np.asarray(single)))


def _zones() -> list[Row]:
    """Minimum zones of a circle and of a face that are off by a form, as machines make it."""
    random = np.random.default_rng(SEED)
    angle = np.linspace(0.0, 2.0 * np.pi, POINTS, endpoint=False)
    waves = np.arange(1, 9)
    size = FORM * random.normal(size=(PARTS, waves.size)) / waves
    phase = random.uniform(0.0, 2.0 * np.pi, (PARTS, waves.size))
    off = np.einsum("sk,skn->sn", size, np.sin(np.multiply.outer(waves, angle) + phase[..., None]))
    circle = np.zeros((PARTS, POINTS, 3))
    circle[..., 0], circle[..., 1] = (SIZE + off) * np.cos(angle), (SIZE + off) * np.sin(angle)
    x, y = np.meshgrid(np.linspace(-SIZE, SIZE, 20), np.linspace(-SIZE, SIZE, 18))
    face = np.zeros((PARTS, POINTS, 3))
    face[..., 0], face[..., 1], face[..., 2] = x.ravel(), y.ravel(), off
    up = np.tile([0.0, 0.0, 1.0], (PARTS, 1))
    calls: dict[str, Callable[[], object]] = {
        "circle": lambda: associate(CircleInPlane(np.zeros((PARTS, 2))), circle),
        "face": lambda: associate(AnyPlane(up, 2.0 * SIZE), face),
    }
    best = best_seconds(calls, rounds=ROUNDS)
    return [
        Row(
            f"part, minimum zone of a {name} of {POINTS} points",
            1e3 * seconds / PARTS,
            "ms",
            "at most",
            ASKED_ZONE,
            f"{PARTS} parts at once, forms of {waves.size} waves of some {1e6 * FORM:.0f} µm",
        )
        for name, seconds in best.items()
    ]


def _program() -> Row:
    """Reading and the known error of a long program, over its correction with its proof."""
    machine, condition = _warm()
    with tempfile.TemporaryDirectory() as folder:
        part, features = _written(machine, Path(folder))
        target = Path(folder) / "corrected.ngc"

        def known() -> Walked:
            return _walked(machine, condition, part, features)

        def corrected() -> object:
            return truepose.correct_program(machine, part, target, condition)

        best = best_seconds({"part": known, "correction": corrected}, rounds=2)
        points = known().points
    return Row(
        f"part, reading and known error of {LINES:,} lines over their correction",
        best["part"] / best["correction"],
        "x",
        "at most",
        ASKED_PROGRAM,
        f"{best['part']:.1f} s ({points:,} points) against {best['correction']:.1f} s, hexapod, "
        f"thermal and elastic",
    )


def _warm() -> tuple[Machine, Condition]:
    """The hexapod, warm and under load."""
    machine = truepose.load(ROOT / "machines" / "hexapod.toml")
    given = machine.condition
    warm = given.replace(temperature=given.reference_temperature + WARMER, force=FORCE)
    return machine, warm


def _written(machine: Machine, folder: Path, times: int = 1) -> tuple[Path, Path]:
    """The program of `LINES` short moves, gone along so many times, and one feature of it."""
    part, features = folder / "part.ngc", folder / "features.toml"
    program(machine, part)
    if times > 1:
        *head, last = part.read_text(encoding="ascii").splitlines(keepends=True)
        with part.open("w", encoding="ascii") as file:
            file.writelines(head[:2])
            for _ in range(times):
                file.writelines(head[2:])
            file.write(last)
    features.write_text(FEATURE, encoding="utf-8")
    return part, features


def _walked(machine: Machine, condition: Condition, part: Path, features: Path) -> Walked:
    read = read_part(machine, part, features)
    sources = required_sources(machine, condition)
    return walk(machine, condition, sources, read.path(), read.program)


def _memory() -> Row:
    few, many = _of_process(1), _of_process(TIMES)
    return Row(
        f"part, peak memory of {TIMES * LINES:,} lines to that of {LINES:,}",
        many["mib"] / few["mib"],
        "x",
        "at most",
        ASKED_MEMORY,
        f"hexapod, read and walked: {many['mib']:.1f} MiB in {many['seconds']:.1f} s, "
        f"{few['mib']:.1f} MiB in {few['seconds']:.1f} s",
    )


def _of_process(times: int) -> dict[str, float]:
    """What a fresh process says of itself: peak memory only ever rises."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "benchmarks.part", folder]
        write = [*command, str(times)]
        subprocess.run(write, check=True)  # not in this process, whose peak its children inherit
        run = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True)
    answer: dict[str, float] = json.loads(run.stdout)
    return answer


def _here(folder: Path) -> dict[str, float]:
    start = time.perf_counter()
    _walked(*_warm(), folder / "part.ngc", folder / "features.toml")
    seconds = time.perf_counter() - start
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return {"mib": peak / (2**20 if sys.platform == "darwin" else 2**10), "seconds": seconds}


if __name__ == "__main__":
    if len(sys.argv) > 2:
        _written(_warm()[0], Path(sys.argv[1]), int(sys.argv[2]))
    else:
        print(json.dumps(_here(Path(sys.argv[1]))))
