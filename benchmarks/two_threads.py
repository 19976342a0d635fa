"""How a large batch speeds up on a second core."""

from __future__ import annotations

import time

import truepose
from benchmarks.hexapod import Batch, load
from benchmarks.monte_carlo import Kernel
from benchmarks.rows import Row
from benchmarks.timing import best_seconds, require_agreement

COUNT = 131_072
ROUNDS = 60
ASKED_OF_ARRAYS = 1.7
SAMPLES = 2_000_000
SAMPLING_ROUNDS = 10
ASKED_OF_SAMPLING = 1.9


def measure() -> list[Row]:
    """Wall time of the same work on one thread and on two: into fresh arrays, and sampling."""
    return [_fresh_arrays(), _sampling()]


def _fresh_arrays() -> Row:
    batch = Batch.of(COUNT)

    def on_threads(count: int):
        def run():
            truepose.threads(count)
            return batch.machine.kernel.displacement(
                batch.joints, batch.placements, batch.columns, batch.deviations
            )[0]

        return run

    calls = {"one": on_threads(1), "two": on_threads(2)}
    require_agreement("forward, one thread and two", calls["one"](), calls["two"]())
    best = best_seconds(calls, rounds=ROUNDS, clock=time.perf_counter)
    return Row(
        "forward kinematics in a batch, two threads over one",
        best["one"] / best["two"],
        "x",
        "at least",
        ASKED_OF_ARRAYS,
        f"{1e3 * best['two']:.1f} ms against {1e3 * best['one']:.1f} ms of wall time; "
        f"{COUNT} poses, into fresh arrays",
    )


def _sampling() -> Row:
    kernel = Kernel(load())

    def on_threads(count: int):
        def run():
            truepose.threads(count)
            return kernel.moments(SAMPLES)[1]

        return run

    calls = {"one": on_threads(1), "two": on_threads(2)}
    # Sums in another order: equal to rounding.
    require_agreement("Monte Carlo, one thread and two", calls["one"](), calls["two"]())
    best = best_seconds(calls, rounds=SAMPLING_ROUNDS, clock=time.perf_counter)
    return Row(
        "Monte Carlo, two threads over one",
        best["one"] / best["two"],
        "x",
        "at least",
        ASKED_OF_SAMPLING,
        f"{1e3 * best['two']:.1f} ms against {1e3 * best['one']:.1f} ms of wall time; "
        f"{SAMPLES} samples of 42 normal parameters",
    )
