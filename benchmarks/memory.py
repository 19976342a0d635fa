"""Memory of Monte Carlo: as much for a hundred million samples as for a million."""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import time

import numpy as np

import truepose
from benchmarks.hexapod import MACHINE
from benchmarks.rows import Row

FEW = 1_000_000
MANY = 100_000_000
ASKED = 1.1
SEED = 1


def measure() -> list[Row]:
    """Peak resident memory of two processes, each with one `truepose.monte_carlo`."""
    few, many = _of_process(FEW), _of_process(MANY)
    detail = (
        f"planar_two_slider, one pose: {many['mib']:.1f} MiB for {MANY:,} samples, "
        f"{few['mib']:.1f} MiB for {FEW:,}"
    )
    return [
        Row(
            f"Monte Carlo, peak memory of {MANY:.0e} samples to that of {FEW:.0e}",
            many["mib"] / few["mib"],
            "x",
            "at most",
            ASKED,
            detail,
        ),
        Row(
            "Monte Carlo of the planar machine, a core",
            MANY / many["seconds"],
            "samples/s",
            "at least",
            None,
            f"planar_two_slider, one pose, {MANY:,} samples of 2 uniform parameters: "
            f"{many['seconds']:.1f} s",
        ),
    ]


def _of_process(samples: int) -> dict[str, float]:
    """What a fresh process says of itself: peak memory only ever rises."""
    run = subprocess.run(
        [sys.executable, "-m", "benchmarks.memory", str(samples)],
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    answer: dict[str, float] = json.loads(run.stdout)
    return answer


def _here(samples: int) -> dict[str, float]:
    machine = truepose.load(MACHINE.with_name("planar_two_slider.toml"))
    poses = machine.kernel.home[np.newaxis]
    start = time.perf_counter()
    found = truepose.monte_carlo(machine, poses, samples, SEED)
    seconds = time.perf_counter() - start
    if int(found["samples"][0]) != samples or int(found["failed"][0]) != 0:
        raise RuntimeError("the samples are not those asked for")
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return {
        "mib": peak / (2**20 if sys.platform == "darwin" else 2**10),
        "seconds": seconds,
    }


if __name__ == "__main__":
    print(json.dumps(_here(int(sys.argv[1]))))
