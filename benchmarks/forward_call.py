"""One forward solution from Python: the latency of a single call."""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import fsolve

from benchmarks.hexapod import Array, Batch
from benchmarks.rows import Row
from benchmarks.timing import best_seconds, require_agreement

ROUNDS = 25
REPEATS = {"truepose": 2000, "fsolve": 20}
ASKED = 250.0


def rotation(a: float, b: float, c: float) -> Array:
    """(3, 3) rotation Rz(c) Ry(b) Rx(a)."""
    ca, sa, cb, sb = math.cos(a), math.sin(a), math.cos(b), math.sin(b)
    cc, sc = math.cos(c), math.sin(c)
    return np.array(
        [
            [cc * cb, cc * sb * sa - sc * ca, cc * sb * ca + sc * sa],
            [sc * cb, sc * sb * sa + cc * ca, sc * sb * ca - cc * sa],
            [-sb, cb * sa, cb * ca],
        ]
    )


def measure() -> list[Row]:
    """`Machine.forward` against scipy.optimize.fsolve, from the same start to the same pose."""
    batch = Batch.of(1)
    moved = batch.machine.nominal[batch.columns] + batch.deviations[0]
    names = [batch.machine.parameters[i] for i in batch.columns]
    actual = batch.machine.replace(dict(zip(names, moved.tolist(), strict=True)))
    joints = batch.joints[0]
    start = batch.machine.kernel.pose_of(batch.placements)[0]
    base, platform, lengths = (part[0] for part in batch.geometry())

    def residual(pose: Array) -> Array:
        struts = pose[:3] + platform @ rotation(*pose[3:]).T - base
        return np.sqrt(np.einsum("ij,ij->i", struts, struts)) - lengths

    def ours() -> Array:
        return actual.forward(joints, start)

    def peer() -> Array:
        return fsolve(residual, start, xtol=1e-12)

    require_agreement("one forward call, truepose and fsolve", ours(), peer())
    best = best_seconds({"truepose": ours, "fsolve": peer}, rounds=ROUNDS, repeats=REPEATS)
    return [
        Row(
            "one forward call from Python over scipy.optimize.fsolve",
            best["fsolve"] / best["truepose"],
            "x",
            "at least",
            ASKED,
            f"{1e9 * best['truepose']:.0f} ns against {1e6 * best['fsolve']:.0f} us; "
            "hexapod, 42 moved parameters, from the commanded pose",
        )
    ]
