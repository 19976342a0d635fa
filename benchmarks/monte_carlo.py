"""Monte Carlo of the hexapod at home: 42 normal parameters, exact pose, full covariance."""

from __future__ import annotations

import numpy as np

from benchmarks import numpy_hexapod
from benchmarks.hexapod import N_STRUT, SPREAD, Array, geometry_columns, load
from benchmarks.rows import Row
from benchmarks.timing import DisagreementError, best_seconds, require_agreement
from truepose import _kernel
from truepose.machine import Machine

COUNT = 65_536
# What NumPy is quickest with: larger batches leave the cache, smaller ones are all calls.
NUMPY_BATCH = 2048
ROUNDS = 15
REPEATS = {"kernel": 8}
CHECKED = 1_000_000
SOLVED = 8192
STANDARD_ERRORS = 5.0
ASKED = 35.0
SEED = 1

Moments = tuple[Array, Array]


class Kernel:
    """The kernel's samples, with histograms of six components and two magnitudes."""

    def __init__(self, machine: Machine) -> None:
        self.machine = machine
        self.columns = geometry_columns(machine)
        self.joints, self.placements, status = machine.kernel.place(machine.kernel.home[np.newaxis])
        if status.any():
            raise ValueError("home is out of the machine's reach")
        numbers = range(self.columns.size)
        self.variables = _kernel.Variables(
            [{"kind": "normal", "sigmas": 1.0, "stream": 0, "number": i} for i in numbers]
        )
        self.study = _kernel.Study(
            machine.kernel,
            self.joints,
            self.placements,
            np.empty(0, np.int64),
            np.empty((1, 0)),
            self.columns,
            list(numbers),
            np.full((1, self.columns.size), SPREAD),
        )

    def tallies(self, count: int) -> _kernel.Tallies:
        """What is kept of `count` samples, random numbers included."""
        tallies = _kernel.Tallies(np.zeros((1, 8)), np.full((1, 8), SPREAD / 64), 8, 6)
        self.study.sample(self.variables, SEED, 0, count, tallies)
        if tallies.count[0] != count:
            raise RuntimeError("a forward solution of the benchmark was not found")
        return tallies

    def moments(self, count: int) -> Moments:
        """Mean (6,) and covariance (6, 6) of `count` samples."""
        tallies = self.tallies(count)
        return tallies.mean[0, :6], tallies.covariance[0]

    def errors(self, deviations: Array) -> Array:
        """(n, 6) of deviations (n, 42)."""
        places = (
            np.repeat(self.joints, len(deviations), 0),
            np.repeat(self.placements, len(deviations), 0),
        )
        errors, status = self.machine.kernel.displacement(*places, self.columns, deviations)
        if status.any():
            raise RuntimeError("a forward solution of the benchmark was not found")
        return errors


class Peer:
    """The same in vectorised NumPy."""

    def __init__(self, machine: Machine, kernel: Kernel) -> None:
        self.nominal = machine.nominal[kernel.columns]
        self.joints = kernel.joints
        self.placements = np.repeat(kernel.placements, max(NUMPY_BATCH, SOLVED), axis=0)
        self.steps = 0

    def errors(self, deviations: Array) -> Array:
        """(n, 6) of deviations (n, 42)."""
        count = len(deviations)
        base, platform, offset = np.split(self.nominal + deviations, (18, 36), axis=1)
        errors, self.steps = numpy_hexapod.displacement(
            self.placements[:count],
            np.ascontiguousarray(base.reshape(count, N_STRUT, 3)),
            np.ascontiguousarray(platform.reshape(count, N_STRUT, 3)),
            self.joints + offset,
        )
        return errors

    def moments(self, count: int) -> Moments:
        """Mean (6,) and covariance (6, 6) of `count` samples, random numbers included."""
        random = np.random.default_rng(SEED)
        errors = np.empty((count, 6))
        for start in range(0, count, NUMPY_BATCH):
            part = errors[start : start + NUMPY_BATCH]
            part[:] = self.errors(random.normal(0.0, SPREAD, (len(part), self.nominal.size)))
        return errors.mean(axis=0), np.cov(errors.T)


def measure() -> list[Row]:
    """Kernel against NumPy: each sample equal to 1e-12, moments within their standard errors."""
    before = _kernel.threads()
    _kernel.threads(1)
    try:
        return _measure()
    finally:
        _kernel.threads(before)


def _measure() -> list[Row]:
    _kernel.use_instruction_set("best")
    machine = load()
    kernel = Kernel(machine)
    peer = Peer(machine, kernel)
    _require_same_samples(kernel, peer)
    _require_same_moments(kernel.moments(CHECKED), peer.moments(CHECKED))
    calls = {"kernel": lambda: kernel.moments(COUNT), "numpy": lambda: peer.moments(COUNT)}
    best = best_seconds(calls, rounds=ROUNDS, repeats=REPEATS)
    each = {name: 1e9 * seconds / COUNT for name, seconds in best.items()}
    return [
        Row(
            "Monte Carlo with random numbers and covariance, kernel over vectorised NumPy",
            best["numpy"] / best["kernel"],
            "x",
            "at least",
            ASKED,
            f"{each['kernel']:.0f} ns ({_kernel.instruction_set()}; histograms and magnitudes "
            f"too) against {each['numpy']:.0f} ns a sample, {peer.steps} Newton steps in NumPy; "
            f"hexapod, home, {kernel.columns.size} normal parameters",
        )
    ]


def _require_same_samples(kernel: Kernel, peer: Peer) -> None:
    """The kernel's own samples, solved by both; and that the moments are those of the samples."""
    deviations = SPREAD * kernel.variables.draw(SEED, 0, SOLVED)
    errors = peer.errors(deviations)
    mean, covariance = kernel.moments(SOLVED)
    require_agreement("Monte Carlo, mean of the same samples", mean, errors.mean(axis=0))
    # In units of the spread: the covariance is far below 1 m^2.
    size = np.outer(errors.std(axis=0), errors.std(axis=0))
    expected = np.cov(errors.T) / size
    require_agreement("Monte Carlo, covariance of the same samples", covariance / size, expected)
    require_agreement("Monte Carlo, errors of the same samples", kernel.errors(deviations), errors)


def _require_same_moments(ours: Moments, theirs: Moments) -> None:
    """Random numbers of two kinds: equal within five standard errors of their difference."""
    (mean, covariance), (peer_mean, peer_covariance) = ours, theirs
    variance = np.diag(peer_covariance)
    of_mean = np.sqrt(2.0 * variance / CHECKED)
    # Of a normal distribution, which the error is to first order.
    of_covariance = np.sqrt(
        2.0 * (np.outer(variance, variance) + np.square(peer_covariance)) / CHECKED
    )
    for what, gap, error in (
        ("means", mean - peer_mean, of_mean),
        ("covariances", covariance - peer_covariance, of_covariance),
    ):
        most = float((np.abs(gap) / error).max())
        if not most <= STANDARD_ERRORS:
            raise DisagreementError(f"Monte Carlo, {what} differ by {most:.3g} standard errors")
