"""Exact poses of the hexapod in a batch against Numba and JAX, where these are installed.

`make bench-peers` installs them (`requirements-peers.txt`); nothing else needs them.
"""

from __future__ import annotations

import importlib
import sys

from benchmarks import numpy_hexapod
from benchmarks.forward_batch import COUNT
from benchmarks.hexapod import Array, Batch
from benchmarks.rows import Row
from benchmarks.timing import best_seconds, require_agreement
from truepose import _kernel

ROUNDS = 20
REPEATS = {"kernel": 20, "numba": 2, "jax": 2}


def measure() -> list[Row]:
    """A row for each peer that is installed; results are equal to 1e-12 first."""
    _kernel.use_instruction_set("best")
    batch = Batch.of(COUNT)
    geometry = batch.geometry()
    _, steps = numpy_hexapod.displacement(batch.placements, *geometry)

    def kernel() -> Array:
        errors, status = batch.machine.kernel.displacement(
            batch.joints, batch.placements, batch.columns, batch.deviations
        )
        if status.any():
            raise RuntimeError("a forward solution of the benchmark was not found")
        return errors

    calls = {"kernel": kernel}
    shown = {"numba": "Numba, loops compiled", "jax": "JAX, mapped and compiled, its derivatives"}
    extra = {"jax": (steps,)}
    for name in shown:
        try:
            module = importlib.import_module(f"benchmarks.{name}_hexapod")
        except ImportError:
            print(f"peers: {name} is not installed, which is left out", file=sys.stderr)
            continue
        arguments = (batch.placements, *geometry, *extra.get(name, ()))
        calls[name] = lambda run=module.displacement, given=arguments: run(*given)
        require_agreement(f"forward, kernel and {name}", kernel(), calls[name]())
    best = best_seconds(calls, rounds=ROUNDS, repeats=REPEATS)
    each = {name: 1e9 * seconds / COUNT for name, seconds in best.items()}
    return [
        Row(
            f"forward kinematics in a batch over {shown[name]}",
            best[name] / best["kernel"],
            "x",
            "at least",
            None,
            f"{each['kernel']:.0f} ns against {each[name]:.0f} ns a pose; {COUNT} poses, "
            "42 moved parameters",
        )
        for name in calls
        if name != "kernel"
    ]
