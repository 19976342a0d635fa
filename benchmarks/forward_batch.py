"""Exact pose of the hexapod with all 42 geometry parameters moved, a batch at a time."""

from __future__ import annotations

from benchmarks import numpy_hexapod
from benchmarks.hexapod import Batch
from benchmarks.rows import Row
from benchmarks.timing import best_seconds, require_agreement
from truepose import _kernel

COUNT = 4096
ROUNDS = 30
# One after another, as in a program that works through its batches.
REPEATS = {"lanes": 20, "scalar": 4, "numpy": 4}
# What one core's vectors can be asked to gain over the scalar path.
ASKED_OF_LANES = {"avx512": 3.0, "avx2": 2.3}
ASKED_OF_NUMPY = 30.0


def measure() -> list[Row]:
    """Kernel lanes against NumPy and against the kernel's scalar path, results equal to 1e-12."""
    _kernel.use_instruction_set("best")
    lanes = _kernel.instruction_set()
    batch = Batch.of(COUNT)
    geometry = batch.geometry()

    def kernel_with(instruction_set: str):
        def run():
            _kernel.use_instruction_set(instruction_set)
            errors, status = batch.machine.kernel.displacement(
                batch.joints, batch.placements, batch.columns, batch.deviations
            )
            if status.any():
                raise RuntimeError("a forward solution of the benchmark was not found")
            return errors

        return run

    def peer():
        return numpy_hexapod.displacement(batch.placements, *geometry)

    calls = {"lanes": kernel_with("best"), "scalar": kernel_with("scalar"), "numpy": peer}
    ours = calls["lanes"]()
    solution, steps = peer()
    require_agreement("forward, kernel and NumPy", ours, solution)
    require_agreement("forward, kernel's lanes and scalars", ours, calls["scalar"]())
    best = best_seconds(calls, rounds=ROUNDS, repeats=REPEATS)
    each = {name: 1e9 * seconds / COUNT for name, seconds in best.items()}
    size = f"{COUNT} poses, 42 moved parameters"
    return [
        Row(
            f"forward kinematics in a batch, {lanes} over the kernel's scalar path",
            best["scalar"] / best["lanes"],
            "x",
            "at least",
            ASKED_OF_LANES.get(lanes),
            f"{each['lanes']:.0f} ns against {each['scalar']:.0f} ns a pose; {size}",
        ),
        Row(
            f"forward kinematics in a batch, {lanes} over vectorised NumPy",
            best["numpy"] / best["lanes"],
            "x",
            "at least",
            ASKED_OF_NUMPY,
            f"{each['lanes']:.0f} ns against {each['numpy']:.0f} ns a pose, "
            f"{steps} Newton steps in NumPy; {size}",
        ),
    ]
