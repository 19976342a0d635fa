"""42 parameters of a hexapod from 50 poses: truepose against SciPy's `least_squares`.

The same readings (position and angles, as by a tracker), the same residuals, the same start, both
to convergence and to the same values. SciPy is given NumPy forward kinematics, vectorised over the
poses, and works derivatives out by differences, as calibration scripts do. Besides, for comparison,
the other way that scripts go: the readings put into the closures, which needs no forward kinematics
but weighs what was read wrongly, so that its values are others.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from benchmarks import numpy_hexapod
from benchmarks.hexapod import N_STRUT, Array, Batch
from benchmarks.rows import Row
from benchmarks.timing import DisagreementError, best_seconds
from truepose.calibration.identification.problem import IdentificationProblem, Prior, Solved
from truepose.calibration.identification.unknowns import unknowns_of
from truepose.calibration.instruments import Frame, Instrument
from truepose.calibration.measurements import Measurements
from truepose.machine import Condition

POSES = 50
NOISE = {"m": 2e-6, "rad": 10e-6}
ASKED = 600.0
AGREED = 1e-10
"""Of the geometry's size: what our optimum may differ from SciPy's by central differences."""
AGREED_TIMED = 1e-8
"""The same from the one that is timed: by forward differences it ends some 1e-9 off."""


def measurements_of(batch: Batch) -> Measurements:
    """Position and angles at every pose, without values yet."""
    count = batch.count
    instrument = Instrument("tracker", "pose", Frame(), uncertainty=NOISE)
    return Measurements(
        (instrument,),
        batch.joints,
        batch.placements,
        np.zeros(count, np.intp),
        (Condition(),) * count,  # at the reference temperature, nothing on the tool
        np.zeros(count, np.bool_),
        np.repeat(np.arange(count), 6),
        np.tile(np.arange(6), count),
        np.full(6 * count, -1, np.intp),
        np.zeros(6 * count),
        np.tile([NOISE["m"]] * 3 + [NOISE["rad"]] * 3, count),
        np.zeros(count, np.intp),
    )


def readings(placements: Array, strokes: Array, values: Array) -> Array:
    """(n, 6) position and angles of hexapods with geometry `values` (42,), in NumPy."""
    base, platform, offset = np.split(values, (18, 36))
    error, _ = numpy_hexapod.displacement(
        placements,
        base.reshape(N_STRUT, 3),
        platform.reshape(N_STRUT, 3),
        strokes + offset,
    )
    return poses_of(placements, error)


def poses_of(placements: Array, error: Array) -> Array:
    """(n, 6) position and angles a, b, c, where placements are displaced by `error` (n, 6)."""
    turned = numpy_hexapod.turned_by(placements[:, 3:], error[:, 3:])
    r = numpy_hexapod.rotation_matrices(turned)
    level = np.hypot(r[:, 0, 0], r[:, 1, 0])
    angles = np.stack(
        [
            np.arctan2(r[:, 2, 1], r[:, 2, 2]),
            np.arctan2(-r[:, 2, 0], level),
            np.arctan2(r[:, 1, 0], r[:, 0, 0]),
        ],
        axis=1,
    )
    return np.hstack([placements[:, :3] + error[:, :3], angles])


@dataclass(frozen=True)
class Fit:
    """Readings of one machine with errors, and the identification of its 42 parameters."""

    batch: Batch
    problem: IdentificationProblem
    order: list[int]
    """(42,) which unknown each of the benchmark's columns is."""
    readings: Array
    """(300,) with noise."""
    uncertainty: Array
    """(300,) of each, m and rad."""

    @classmethod
    def of(cls, batch: Batch) -> Fit:
        """What is read at the batch's poses of a machine with the batch's first deviations.

        The machine has a tolerance on each of the batch's columns and on no other parameter.
        """
        measurements = measurements_of(batch)
        unknowns = unknowns_of(batch.machine, measurements)
        problem = IdentificationProblem(batch.machine, measurements, unknowns)
        # Each unknown is one parameter: where it stands among the benchmark's columns.
        numbers = list(unknowns.columns)
        order = [
            int(np.flatnonzero(unknowns.effects[numbers.index(column)])[0])
            for column in batch.columns
        ]
        truth = np.empty(unknowns.count)
        truth[order] = batch.deviations[0]
        noise = np.random.default_rng(7).standard_normal(6 * batch.count)
        read = problem.predict(truth) + measurements.uncertainty * noise
        return cls(batch, problem, order, read, measurements.uncertainty)

    def solve(self, *, tolerances: bool = False) -> Solved:
        """The fit, from nominal; where `tolerances` count they are known beforehand."""
        unknowns = self.problem.unknowns
        prior = Prior.of(unknowns) if tolerances else Prior.none(unknowns.count)
        solved = self.problem.solve(self.readings, prior=prior)
        if solved.ending[0] not in ("cost", "step", "gradient"):
            raise RuntimeError(f"the benchmark's fit ended as {solved.ending[0]}")
        return solved

    def values(self) -> Array:
        """(42,) deviations that were found, in the order of the batch's columns, m."""
        return self.solve().values[0][self.order]


def measure() -> list[Row]:
    """Both to the same optimum, and how long they take."""
    batch = Batch.of(POSES)
    fit = Fit.of(batch)
    start = batch.machine.nominal[batch.columns]
    table, sigma = fit.readings.reshape(POSES, 6), fit.uncertainty.reshape(POSES, 6)

    def by_pose(values: Array) -> Array:
        return ((readings(batch.placements, batch.joints, values) - table) / sigma).ravel()

    def scipy_pose():
        return least_squares(by_pose, start, method="lm", xtol=1e-13, ftol=1e-13, gtol=1e-13)

    def scipy_central():
        tight = {"xtol": 1e-15, "ftol": 1e-15, "gtol": 1e-15}
        return least_squares(by_pose, start, method="trf", jac="3-point", **tight)

    def by_closure(values: Array) -> Array:
        base, platform, offset = np.split(values, (18, 36))
        seen = numpy_hexapod.rotation_matrices(quaternions_of(table[:, 3:]))
        arms = platform.reshape(N_STRUT, 3) @ seen.transpose(0, 2, 1)
        struts = table[:, None, :3] + arms - base.reshape(N_STRUT, 3)
        return (np.linalg.norm(struts, axis=-1) - batch.joints - offset).ravel()

    def scipy_closure():
        return least_squares(by_closure, start, method="lm", xtol=1e-13, ftol=1e-13, gtol=1e-13)

    found = fit.values() + start
    peer = scipy_pose()
    size = float(np.abs(start).max())
    gap = float(np.abs(found - scipy_central().x).max()) / size
    timed_gap = float(np.abs(found - peer.x).max()) / size
    if not (gap <= AGREED and timed_gap <= AGREED_TIMED):
        raise DisagreementError(
            f"calibration: the optima differ by {gap:.3g} and {timed_gap:.3g} of the geometry"
        )
    calls = {"ours": fit.solve, "scipy": scipy_pose, "closure": scipy_closure}
    best = best_seconds(calls, rounds=5, repeats={"ours": 50})
    evaluations = fit.solve().evaluations[0]
    about = f"42 parameters from {POSES} poses"
    return [
        Row(
            "calibration, over SciPy's least_squares on the same residuals",
            best["scipy"] / best["ours"],
            "x",
            "at least",
            ASKED,
            f"{1e6 * best['ours']:.0f} us ({evaluations} evaluations) against "
            f"{1e3 * best['scipy']:.0f} ms ({peer.nfev}); {about}, optima equal to {gap:.1e}, "
            f"of SciPy's that is timed to {timed_gap:.1e}",
        ),
        Row(
            "calibration, over SciPy on closures that the readings are put into",
            best["closure"] / best["ours"],
            "x",
            "at least",
            None,
            f"{1e6 * best['ours']:.0f} us against {1e3 * best['closure']:.0f} ms; another "
            "optimum, for it weighs readings wrongly",
        ),
    ]


def quaternions_of(angles: Array) -> Array:
    """(n, 4) of angles a, b, c (n, 3): R = Rz(c) Ry(b) Rx(a)."""
    (sa, sb, sc), (ca, cb, cc) = np.sin(0.5 * angles).T, np.cos(0.5 * angles).T
    return np.stack(
        [
            cc * cb * ca + sc * sb * sa,
            cc * cb * sa - sc * sb * ca,
            cc * sb * ca + sc * cb * sa,
            sc * cb * ca - cc * sb * sa,
        ],
        axis=1,
    )
