"""How a large batch speeds up on a second core."""

from __future__ import annotations

import time

import truepose
from benchmarks.hexapod import Batch
from benchmarks.rows import Row
from benchmarks.timing import best_seconds, require_agreement

COUNT = 131_072
ROUNDS = 60
ASKED = 1.8


def measure() -> list[Row]:
    """Wall time of the same batch of forward solutions on one thread and on two."""
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
    return [
        Row(
            "forward kinematics in a batch, two threads over one",
            best["one"] / best["two"],
            "x",
            "at least",
            ASKED,
            f"{1e3 * best['two']:.1f} ms against {1e3 * best['one']:.1f} ms of wall time; "
            f"{COUNT} poses",
        )
    ]
