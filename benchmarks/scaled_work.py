"""The same work in several sizes: against poses, samples, moved parameters, closures, threads.

Moved parameters are the first ones of a random order, so that more contain fewer; each has a band
of 10 um (urad, 1e-5) to either side, or is off by as much where an error that is known is meant.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np

import truepose
from benchmarks.calibration import Fit
from benchmarks.gcode import program
from benchmarks.hexapod import MACHINE, SPREAD, Batch, workspace_poses
from truepose.machine import Machine
from truepose.sources import Deviation
from truepose.sources.tolerance import DimensionalTolerance

MOST_PARAMETERS = "hexaglide"
"""A shipped machine with 87 parameters: none has more."""
CLOSURES = {2: "planar_two_slider", 3: "3rpr", 6: "hexapod"}
"""Machines whose closures are struts, one for each freedom. Four are one too many for a planar
platform; with five a guide holds the sixth freedom."""
WITH_GUIDE = "pentapod"
OFF = 1e-5
SEED = 1
FEW_MOVED = 12
"""Parameters moved where something else grows."""

Call = Callable[[], object]


@dataclass(frozen=True)
class Scaled:
    """Work that grows along one axis."""

    work: str
    axis: str
    sizes: Sequence[int]
    make: Callable[[int], Call]
    why: str = ""
    """Why it does not grow linearly; empty: it should, and an exponent of one is asked for."""


@cache
def shipped(name: str) -> Machine:
    """A machine of machines/."""
    return truepose.load(MACHINE.with_name(f"{name}.toml"))


def moved(name: str, count: int, *, known: bool = False) -> Machine:
    """The machine with `count` of its parameters moved, and no other source of error.

    `known`: not by a band but by an error that compensation takes out.
    """
    machine = shipped(name)
    columns = columns_moved(machine, count)
    bands = Deviation.of(columns, OFF, 0.0) if known else Deviation.of(columns, 0.0, OFF)
    return replace(machine, sources=(DimensionalTolerance(bands=bands),))


def columns_moved(machine: Machine, count: int) -> np.ndarray:
    """(count,) indices of parameters, ascending."""
    order = np.random.default_rng(SEED).permutation(len(machine.parameters))
    if count > order.size:
        raise ValueError(f"{count} parameters of {order.size}")
    return np.sort(order[:count])


def budget(machine: Machine, count: int) -> Call:
    """Of `count` poses."""
    poses = workspace_poses(machine, count)
    return lambda: truepose.budget(machine, poses)


def monte_carlo(machine: Machine, count: int, samples: int) -> Call:
    """Of `count` poses."""
    poses = workspace_poses(machine, count)
    return lambda: truepose.monte_carlo(machine, poses, samples, SEED)


def bounds(machine: Machine, count: int) -> Call:
    """At `count` poses."""
    poses = workspace_poses(machine, count)

    def call() -> object:
        found = truepose.bounds(machine, poses)
        if (found["status"].values != "proven").any():
            raise RuntimeError("not every bound is proven")
        return found

    return call


def calibration(machine: Machine, columns: np.ndarray, count: int) -> Call:
    """Of the parameters `columns`, which alone have tolerances, from `count` poses."""
    joints, placements, status = machine.kernel.place(workspace_poses(machine, count))
    if status.any():
        raise ValueError("a pose of the benchmark is out of the machine's reach")
    deviations = np.random.default_rng(2).normal(0.0, SPREAD, (count, columns.size))
    fit = Fit.of(Batch(machine, columns, joints, placements, deviations))
    # Of many parameters some would be told apart by nothing but their tolerances.
    return lambda: fit.solve(tolerances=True)


def correction(machine: Machine, lines: int, folder: Path) -> Call:
    """Of a program of so many lines, read, corrected, written and proven."""
    part = folder / f"{lines}.ngc"
    program(machine, part, lines)
    return lambda: truepose.correct_program(machine, part, folder / "corrected.ngc")


def over_constrained(closures: int, folder: Path) -> Machine:
    """The planar double parallelogram with so many rods, an even number; three would do."""
    text = MACHINE.with_name("overconstrained.toml").read_text("utf-8")
    head, _, rest = text.partition("[[strut]]")
    tail = rest[rest.index("[tolerance]") :]
    rods = [
        f'[[strut]]\nname = "{side[0]}{number + 1}"\ndrive = "{side}"\nbase = [0, {y:.6f}, 0]\n'
        f"platform = [{x}, {y:.6f}, 0]\n\n"
        for side, x in (("left", -100), ("right", 100))
        for number, y in enumerate(np.linspace(60.0, -60.0, closures // 2))
    ]
    path = folder / f"rods{closures}.toml"
    path.write_text(head + "".join(rods) + tail, "utf-8")
    return truepose.load(path)


@contextmanager
def every_scaling(largest: float = 1.0) -> Iterator[list[Scaled]]:
    """All there are, with sizes times `largest`; their files lie in a folder meanwhile."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        yield [
            *_against_size(folder, largest),
            *_against_parameters(folder, largest),
            *_against_closures(folder, largest),
        ]


def _sizes(numbers: Sequence[int], largest: float) -> list[int]:
    return [max(1, round(number * largest)) for number in numbers]


def _against_size(folder: Path, largest: float) -> Iterator[Scaled]:
    hexapod, few = shipped("hexapod"), moved("hexapod", FEW_MOVED)
    columns = columns_moved(few, FEW_MOVED)
    warm = hexapod.condition.replace(temperature=hexapod.condition.reference_temperature + 25.0)
    warm_hexapod = replace(hexapod, condition=warm)
    yield Scaled(
        "budget",
        "poses",
        _sizes((1_000, 10_000, 100_000, 300_000), largest),
        lambda size: budget(hexapod, size),
    )
    yield Scaled(
        "Monte Carlo",
        "poses",
        _sizes((10, 40, 160), largest),
        lambda size: monte_carlo(few, size, 10_000),
    )
    yield Scaled(
        "Monte Carlo",
        "samples",
        _sizes((10_000, 100_000, 1_000_000, 10_000_000), largest),
        lambda size: monte_carlo(few, 1, size),
    )
    yield Scaled("bounds", "poses", _sizes((4, 16, 64), largest), lambda size: bounds(few, size))
    yield Scaled(
        "calibration",
        "poses",
        _sizes((25, 100, 400, 1600), max(largest, 0.2)),  # enough readings for the unknowns
        lambda size: calibration(few, columns, size),
    )
    yield Scaled(
        "G-code",
        "lines",
        _sizes((2_000, 10_000, 50_000), largest),
        lambda size: correction(warm_hexapod, size, folder),
    )


def _against_parameters(folder: Path, largest: float) -> Iterator[Scaled]:
    name, axis = MOST_PARAMETERS, "moved parameters"
    counts = (1, 3, 9, 29, len(shipped(name).parameters))
    (poses, samples, lines) = _sizes((20_000, 100_000, 10_000), largest)
    yield Scaled("budget", axis, counts, lambda size: budget(moved(name, size), poses))
    yield Scaled(
        "Monte Carlo", axis, counts, lambda size: monte_carlo(moved(name, size), 1, samples)
    )
    yield Scaled("bounds", axis, counts, lambda size: bounds(moved(name, size), 1))
    yield Scaled(
        "calibration",
        axis,
        counts,
        lambda size: calibration(moved(name, size), columns_moved(shipped(name), size), 50),
        why="the normal equations are of the order n^2 a reading, their factors n^3",
    )
    yield Scaled(
        "G-code",
        axis,
        counts,
        lambda size: correction(moved(name, size, known=True), lines, folder),
    )


def _against_closures(folder: Path, largest: float) -> Iterator[Scaled]:
    counts, axis = tuple(CLOSURES), "closures"
    (poses, samples, lines) = _sizes((20_000, 100_000, 10_000), largest)

    def machine(size: int, *, known: bool = False) -> Machine:
        return moved(CLOSURES[size], FEW_MOVED, known=known)

    yield Scaled("budget", axis, counts, lambda size: budget(machine(size), poses))
    yield Scaled("Monte Carlo", axis, counts, lambda size: monte_carlo(machine(size), 1, samples))
    yield Scaled("bounds", axis, counts, lambda size: bounds(machine(size), 4))
    yield Scaled(
        "calibration",
        axis,
        counts,
        lambda size: calibration(machine(size), columns_moved(machine(size), FEW_MOVED), 50),
    )
    yield Scaled(
        "G-code", axis, counts, lambda size: correction(machine(size, known=True), lines, folder)
    )
    yield Scaled(
        "over-constrained budget",
        axis,
        (4, 6, 8, 10, 12),
        lambda size: budget(over_constrained(size, folder), max(2, round(2_000 * largest))),
        why="at rest the n x n compliance among the closures is inverted, of the order n^3, and "
        "each rod brings its own tolerances",
    )
