"""Proven bounds over regions: how close they come to what is reached, and how long they take.

The cubes of the delta take minutes: `make bench-region` runs them.
"""

from __future__ import annotations

import time
from collections.abc import Mapping

import numpy as np
import xarray as xr

import truepose
from benchmarks.bounded import GAP
from benchmarks.hexapod import MACHINE, Array
from benchmarks.rows import Row
from truepose.runs.quantities import quantities

# A component below this share of its quantity's size is closed to the gap of this share.
MINOR = 0.1
ASKED_OF_REGIONS = 1.0 + GAP
ASKED_WALL = 300.0  # s, of the larger cube, on two cores
# Cubes about the middle of the delta's workspace, m.
CUBES: tuple[tuple[str, Mapping[str, tuple[float, float]]], ...] = (
    ("10 mm cube", {"x": (-0.005, 0.005), "y": (-0.005, 0.005), "z": (0.095, 0.105)}),
    ("100 mm cube", {"x": (-0.05, 0.05), "y": (-0.05, 0.05), "z": (0.05, 0.15)}),
)


def measure() -> list[Row]:
    """Bounds over the cubes of the linear delta."""
    rows = []
    for which, cube in CUBES:
        start = time.perf_counter()
        rows += bounds_over_region("linear_delta", which, cube)
        seconds = time.perf_counter() - start
        asked = ASKED_WALL if which == "100 mm cube" else None
        threads = f"{truepose.threads()} threads"
        what = f"bounds over a region, linear_delta, {which}, wall time"
        rows.append(Row(what, seconds, "s", "at most", asked, threads))
    return rows


def bounds_over_region(
    name: str, which: str, region: Mapping[str, tuple[float, float]]
) -> list[Row]:
    """How close the bounds of a machine over a region, m and rad, come, and how long they take."""
    machine = truepose.load(MACHINE.with_name(f"{name}.toml"))
    start = time.process_time()
    found = truepose.bounds(machine, region=region, gap=GAP)
    seconds = time.process_time() - start
    status, boxes = str(found["status"].values), int(found["boxes"])
    # A bound that is not proven is missing, and so is no ratio.
    sizes = _number(found["magnitude"].values / found["reached_magnitude"].values)
    each = _components(machine, found)
    sides = ", ".join(f"{axis} {low:g} to {high:g} m" for axis, (low, high) in region.items())
    kinds = found["quantity"].values
    detail = (
        f"{sides}; {status}, {boxes:,} boxes; "
        + ", ".join(f"{kind} {size:.4f} x" for kind, size in zip(kinds, sizes, strict=True))
        + f", components up to {each.max():.4f} x"
    )
    return [
        Row(
            f"bound over a region over what is reached in it, {name}, {which}",
            float(max(sizes.max(), each.max())),
            "x",
            "at most",
            ASKED_OF_REGIONS,
            detail,
        ),
        Row(
            f"bounds over a region, {name}, {which}, CPU time",
            seconds,
            "s",
            "at most",
            None,
            detail,
        ),
    ]


def _components(machine: truepose.Machine, found: xr.Dataset) -> Array:
    """Bounds over what is reached, of either end; minor components by a share of the size."""
    size = np.empty(len(machine.components))
    kinds = quantities(machine.components).values()
    for columns, reached in zip(kinds, found["reached_magnitude"].values, strict=True):
        size[columns] = reached
    ends = []
    for end, sign in (("upper", 1.0), ("lower", -1.0)):
        reached = sign * found[f"reached_{end}"].values
        beyond = sign * found[end].values - reached
        ends.append(1.0 + beyond / np.maximum(np.abs(reached), MINOR * size))
    return _number(np.concatenate(ends))


def _number(ratios: Array) -> Array:
    return np.where(np.isnan(ratios), np.inf, ratios)
