"""Sensitivity of the hexapod's pose to every parameter, a batch at a time."""

from __future__ import annotations

import numpy as np

from benchmarks import numpy_hexapod
from benchmarks.hexapod import AXES, Batch, columns_of
from benchmarks.rows import Row
from benchmarks.timing import best_seconds, require_agreement
from truepose import _kernel

# Large enough that a call's own cost is not seen, small enough that memory's speed is not either.
COUNT = 1024
ROUNDS = 60
REPEATS = {"kernel": 10, "numpy": 1}
ASKED_OF_NUMPY = 12.0


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

    require_agreement("sensitivity, kernel and NumPy", kernel(), peer())
    best = best_seconds({"kernel": kernel, "numpy": peer}, rounds=ROUNDS, repeats=REPEATS)
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
        )
    ]
