"""Sensitivity of the hexapod's pose to every parameter, a batch at a time."""

from __future__ import annotations

import math

import numpy as np

from benchmarks import numpy_hexapod
from benchmarks.hexapod import AXES, Batch, columns_of
from benchmarks.rows import Row
from benchmarks.timing import best_seconds, require_agreement
from truepose import _kernel

SQRT_3 = math.sqrt(3.0)  # standard deviations in a uniform half band

# Large enough that a call's own cost is not seen, small enough that memory's speed is not either.
COUNT = 1024
ROUNDS = 60
REPEATS = {"kernel": 10, "unkept": 10, "numpy": 1, "unkept_numpy": 1}
ASKED_OF_NUMPY = 12.0
ASKED_UNKEPT = 30.0
BAND = 1e-4  # half width of every parameter, of its unit


def measure() -> list[Row]:
    """Kernel against analytic NumPy, results equal to 1e-12 of the largest."""
    _kernel.use_instruction_set("best")
    batch = Batch.of(COUNT)
    machine = batch.machine
    others = [f"drive.{strut.drive}.scale" for strut in machine.struts]
    others += [f"tool.{axis}" for axis in AXES]
    columns = np.concatenate([batch.columns, columns_of(machine, others)])
    if sorted(columns) != list(range(len(machine.parameters))):
        raise ValueError("the hexapod has parameters that the NumPy peer does not know")
    base, platform, _ = np.split(machine.nominal[batch.columns], (18, 36))
    nominal = base.reshape(6, 3), platform.reshape(6, 3)

    def kernel():
        return machine.kernel.sensitivity_at(batch.joints, batch.placements, columns)[0]

    def peer():
        return numpy_hexapod.sensitivity(batch.placements, *nominal, batch.joints)

    count = len(machine.components)
    half = np.full((1, columns.size), BAND)
    nothing = np.zeros((COUNT, count))
    variables, sigmas = list(range(columns.size)), [SQRT_3] * columns.size

    def unkept():
        return machine.kernel.band_at(
            batch.joints,
            batch.placements,
            nothing,
            columns[:0],
            half[:, :0],
            columns,
            variables,
            half,
            sigmas,
            [],
        )[0]

    def unkept_peer():
        effects = BAND * peer()
        variance = np.square(effects).sum(axis=2) / SQRT_3**2
        return np.concatenate([np.abs(effects).sum(axis=2), np.sqrt(variance)], axis=1)

    require_agreement("sensitivity, kernel and NumPy", kernel(), peer())
    require_agreement("half widths and uncertainties", unkept(), unkept_peer())
    best = best_seconds(
        {"kernel": kernel, "unkept": unkept, "numpy": peer, "unkept_numpy": unkept_peer},
        rounds=ROUNDS,
        repeats=REPEATS,
    )
    each = {name: 1e9 * seconds / COUNT for name, seconds in best.items()}
    return [
        Row(
            "sensitivity in a batch, kernel over analytic vectorised NumPy",
            best["numpy"] / best["kernel"],
            "x",
            "at least",
            ASKED_OF_NUMPY,
            f"{each['kernel']:.0f} ns against {each['numpy']:.0f} ns a pose; "
            f"{COUNT} poses, 6 x {columns.size} numbers each",
        ),
        Row(
            "half widths and uncertainties of a band without its sensitivities, kernel over NumPy",
            best["unkept_numpy"] / best["unkept"],
            "x",
            "at least",
            ASKED_UNKEPT,
            f"{each['unkept']:.0f} ns against {each['unkept_numpy']:.0f} ns a pose; "
            f"{COUNT} poses, {columns.size} parameters",
        ),
    ]
