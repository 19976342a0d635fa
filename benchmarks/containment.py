"""Ten million machines drawn at random and the worst vertices, against the proven bounds."""

from __future__ import annotations

import time

import truepose
from benchmarks.hexapod import MACHINE
from benchmarks.rows import Row
from truepose.reporting.display import nearest_middle

MACHINES = ("planar_two_slider", "hexapod", "linear_delta", "3prs", "rotary_delta")
SAMPLES = 10_000_000
SEED = 1


def measure() -> list[Row]:
    """Samples and vertices of each machine, with all sources of its file, at a middle pose."""
    return [_row(name) for name in MACHINES]


def _row(name: str) -> Row:
    machine = truepose.load(MACHINE.with_name(f"{name}.toml"))
    poses = machine.poses()
    pose = poses[nearest_middle(poses)[:1]]
    start = time.perf_counter()
    sampled = truepose.monte_carlo(machine, pose, SAMPLES, SEED)
    seconds = time.perf_counter() - start
    vertices = truepose.worst_case(machine, pose)
    bound = truepose.bounds(machine, pose)
    if int(sampled["samples"][0]) != SAMPLES or bound["status"].values[0] != "proven":
        raise RuntimeError(f"{name}: not as many samples as asked for, or no bound")

    lower, upper, most = (bound[each].values[0] for each in ("lower", "upper", "magnitude"))
    outside = 0
    shares = []
    for found, (low, high, size) in (
        (sampled, ("minimum", "maximum", "magnitude_maximum")),
        (vertices, ("exact_lower", "exact_upper", "magnitude_exact")),
    ):
        least, largest = found[low].values[0], found[high].values[0]
        outside += int((least < lower).sum() + (largest > upper).sum())
        outside += int((found[size].values[0] > most).sum())
        shares.append((largest - least) / (upper - lower))
    of_samples, of_vertices = shares
    return Row(
        f"extremes of samples and vertices outside of their bound, {name}",
        outside,
        f"of {2 * (2 * lower.size + most.size)}",
        "at most",
        0,
        f"{SAMPLES:,} samples in {seconds:.1f} s fill {of_samples.min():.3f} to "
        f"{of_samples.max():.3f} of the bounds' width, the worst vertices "
        f"{of_vertices.min():.4f} to {of_vertices.max():.4f}",
    )
