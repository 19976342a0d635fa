"""Proven bounds: how close they come to what is reached, and how long they take."""

from __future__ import annotations

import numpy as np

from benchmarks.bounded import BAND, PLANAR, home_bounds
from benchmarks.bounds_region import bounds_over_region
from benchmarks.hexapod import Array, geometry_columns, load
from benchmarks.rows import Row
from benchmarks.timing import best_seconds
from truepose.probability.domain import Domain
from truepose.runs.quantities import quantities
from truepose.sources import UNIFORM
from truepose.uncertainty_analysis.corners import worst_corners

ROUNDS = 7
REPEATS = {"bounds": 5}
ASKED_OF_COMPONENTS = 1.1


def measure() -> list[Row]:
    """Bounds of the hexapod at home, then over the planar machine's whole workspace."""
    return _at_home() + bounds_over_region("planar_two_slider", "whole workspace", PLANAR)


def _at_home() -> list[Row]:
    machine = load()
    columns = geometry_columns(machine)
    (joints, placements), slopes, bounds = home_bounds(machine, columns)

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
