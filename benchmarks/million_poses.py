"""Memory and time of a budget of all sources over a million poses."""

from __future__ import annotations

import resource
import sys
import time

import numpy as np

import truepose
from benchmarks.hexapod import load, workspace_poses
from benchmarks.rows import Row

COUNT = 1_000_000
ASKED_GIB = 2.0


def measure() -> list[Row]:
    """Peak resident memory of this process after one `truepose.budget`, and how long that took."""
    machine = load()
    poses = workspace_poses(machine, COUNT)
    start = time.perf_counter()
    results = truepose.budget(machine, poses)
    seconds = time.perf_counter() - start
    kept, sources = results.sizes["pose"], results.sizes["source"]
    if kept != COUNT or sources != 3 or not np.isfinite(results["overall_error"].values).all():
        raise RuntimeError(f"budget of {kept} poses and {sources} sources is not the one meant")
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    gib = peak / 2**30 if sys.platform == "darwin" else peak / 2**20
    size = f"hexapod, {COUNT:,} poses, {sources} sources"
    return [
        Row("budget of a million poses, peak memory", gib, "GiB", "at most", ASKED_GIB, size),
        Row(
            "budget of a million poses, wall time",
            seconds,
            "s",
            "at most",
            None,
            f"{size}, {truepose.threads()} threads, results of {results.nbytes / 2**30:.2f} GiB",
        ),
    ]
