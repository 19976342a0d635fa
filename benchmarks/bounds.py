"""Proven bounds: how close they come to what is reached, and how long they take."""

from __future__ import annotations

import time
from collections.abc import Mapping

import numpy as np
import xarray as xr

import truepose
from benchmarks.hexapod import MACHINE, Array, geometry_columns, load
from benchmarks.rows import Row
from benchmarks.timing import best_seconds
from truepose.probability.domain import Domain
from truepose.runs.quantities import quantities
from truepose.sources import UNIFORM
from truepose.uncertainty_analysis.corners import worst_corners

BAND = 1e-4  # m, of every parameter of the hexapod, to either side
ROUNDS = 7
REPEATS = {"bounds": 5}
ASKED_OF_COMPONENTS = 1.1
GAP = 0.05
# A component below this share of its quantity's size is closed to the gap of this share.
MINOR = 0.1
ASKED_OF_REGIONS = 1.0 + GAP
# The planar machine's whole workspace, and cubes about the middle of the delta's, m.
REGIONS: tuple[tuple[str, str, Mapping[str, tuple[float, float]]], ...] = (
    ("planar_two_slider", "whole workspace", {"x": (0.2, 0.4), "y": (0.1, 0.3)}),
    (
        "linear_delta",
        "10 mm cube",
        {"x": (-0.005, 0.005), "y": (-0.005, 0.005), "z": (0.095, 0.105)},
    ),
    (
        "linear_delta",
        "100 mm cube",
        {"x": (-0.05, 0.05), "y": (-0.05, 0.05), "z": (0.05, 0.15)},
    ),
)


def measure() -> list[Row]:
    """Bounds of the hexapod at home, then over the regions of two machines."""
    rows = _at_home()
    for name, which, region in REGIONS:
        rows += _over(name, which, region)
    return rows


def _at_home() -> list[Row]:
    machine = load()
    columns = geometry_columns(machine)
    joints, placements, status = machine.kernel.place(machine.kernel.home[np.newaxis])
    slopes, regular = machine.kernel.sensitivity_at(joints, placements, columns)
    if status.any() or regular.any():
        raise ValueError("home is not a pose to bound the error at")

    def bounds():
        return machine.kernel.bounds_at(
            joints,
            placements,
            np.empty(0, np.int64),
            np.empty((1, 0)),
            columns,
            list(range(columns.size)),
            np.full((1, columns.size), BAND),
        )

    def exact(poses: Array, t: Array):
        return machine.kernel.displacement(joints[poses], placements[poses], columns, BAND * t)

    kinds = quantities(machine.components)
    nothing = np.zeros((1, len(machine.components)))
    domain = Domain.of([UNIFORM] * columns.size)
    found = worst_corners(exact, nothing, BAND * slopes, domain, list(kinds.values()))
    if found.status.any():
        raise RuntimeError("the hexapod does not close at one of the corners")
    reached = found.most[0]
    lower, upper, magnitudes, proven, _ = bounds()
    if proven != ["proven"]:
        raise RuntimeError(f"nothing is proven at home: {proven[0]}")
    bound = np.concatenate([upper[0], -np.array(lower[0]), magnitudes[0]])
    over = bound / reached
    if not (over >= 1.0).all():
        raise RuntimeError("a corner lies outside of its bound, which is then none")
    sizes = over[-len(kinds) :]
    each = over[: -len(kinds)]
    seconds = best_seconds({"bounds": bounds}, rounds=ROUNDS, repeats=REPEATS)["bounds"]
    about = f"hexapod, home, 0.1 mm on {columns.size} parameters"
    return [
        Row(
            "bound of a component over the exact worst vertex, largest",
            float(each.max()),
            "x",
            "at most",
            ASKED_OF_COMPONENTS,
            f"{about}; {each.min():.4f} to {each.max():.4f} x; sizes of "
            + ", ".join(f"{kind} {size:.4f} x" for kind, size in zip(kinds, sizes, strict=True)),
        ),
        Row("bounds of one pose", 1e3 * seconds, "ms", "at most", None, about),
    ]


def _over(name: str, which: str, region: Mapping[str, tuple[float, float]]) -> list[Row]:
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
