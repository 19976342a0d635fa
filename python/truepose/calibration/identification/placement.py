"""Where an instrument stands, its target and its biases, while the machine is as its file has it.

An instrument depends on no other while the machine is fixed, so each is placed by itself, from the
closed forms of `frames` on. This is what the fit starts from, what the data are checked with, and
what every fold of a validation is given.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from truepose.arrays import Floats
from truepose.calibration.identification.equations import EXACT, SETTLED, Equations, whitened
from truepose.calibration.identification.frames import (
    FAR,
    TURNED,
    frame_starts,
    moved_frame,
    rotated_starts,
)
from truepose.calibration.identification.problem import (
    TOLERANCES,
    IdentificationProblem,
    Prior,
    row_shifts,
)
from truepose.calibration.identification.unknowns import Unknowns, unknowns_of_instruments
from truepose.calibration.instruments import Frame, Instrument
from truepose.calibration.measurements import Measurements
from truepose.errors import RequestError
from truepose.machine import Machine
from truepose.runs.displacement import ParameterDeviation

ROUGHLY = (1e-3, 1e-6, 1e-6)
"""When a search has settled of which only the size of the residuals is asked."""


@dataclass(frozen=True, eq=False)
class Placement:
    """One instrument's place: `instrument` with the frame that the search began with.

    `values` (n,): what was found of its `unknowns`, from there on. `residual` (k,): predicted less
    measured, over the uncertainty. `cost`: sum of their weighted squares, infinite where a reading
    cannot be predicted. `settled`: whether the search ended at a least sum of squares. `rank`: how
    many directions of the unknowns the readings determine.
    """

    instrument: Instrument
    unknowns: Unknowns
    values: Floats
    residual: Floats
    cost: float
    settled: bool
    rank: int

    @property
    def frame(self) -> Frame:
        """Where its frame stands."""
        return moved_frame(self.instrument.frame, self._found(slice(0, 6)))

    @property
    def target(self) -> Floats:
        """(3,) where its target is on the platform, m."""
        target: Floats = np.array(self.instrument.target) + self._found(slice(6, 9))
        return target

    def _found(self, places: slice) -> Floats:
        own = self.unknowns.frames[0][places]
        return np.array([0.0 if number is None else self.values[number] for number in own])

    @property
    def turned(self) -> bool:
        """Whether its frame has been turned far from where the search began."""
        return bool(np.abs(self._found(slice(3, 6))).max() > TURNED)


@dataclass(frozen=True, eq=False)
class Placements:
    """Where all instruments stand: `measurements` of a `machine` with their frames there.

    `of`: by the number of each instrument that measured anything.
    """

    machine: Machine
    measurements: Measurements
    of: dict[int, Placement]

    def as_filed(self, unknowns: Unknowns) -> Floats:
        """(n,) values of all unknowns: none of the machine's, and the instruments' where found."""
        by_name = {
            name: value
            for placement in self.of.values()
            for name, value in zip(placement.unknowns.names, placement.values.tolist(), strict=True)
        }
        return np.array([by_name.get(name, 0.0) for name in unknowns.names])


def place_instruments(machine: Machine, measurements: Measurements) -> Placements:
    """Every instrument that measured anything, by its own readings.

    Raises `RequestError` (no-fit) where the readings of one cannot be followed from any start.
    """
    placements = {}
    instruments = list(measurements.instruments)
    for number in np.unique(measurements.instrument).tolist():
        placement = place_instrument(machine, measurements.of_instrument(number)[0])
        placements[number] = placement
        instruments[number] = placement.instrument
    standing = dataclasses.replace(measurements, instruments=tuple(instruments))
    return Placements(machine, standing, placements)


def place_instrument(
    machine: Machine,
    measurements: Measurements,
    *,
    weights: Floats | None = None,
    shifts: ParameterDeviation | None = None,
    roughly: bool = False,
) -> Placement:
    """The place of the one instrument of the measurements.

    Of several starts of its frame the one that fits best is taken, one that settles before one that
    does not; a frame that is then still far from fitting is tried in other rotations. `weights`
    (k,) multiply squared residuals. `shifts`: what is known to move the machine's parameters from
    row to row. `roughly`: only from the likeliest start, and no further than the size of the
    residuals asks.

    Raises `RequestError` (no-fit) where from no start the readings can be followed.
    """
    unknowns = unknowns_of_instruments(machine, measurements)
    search = _Search(
        machine,
        measurements,
        unknowns,
        weights,
        row_shifts(machine, measurements, unknowns) if shifts is None else shifts,
        ROUGHLY if roughly else TOLERANCES,
    )
    starts = frame_starts(machine, measurements)
    if roughly and len(starts) > 1:
        starts = [min(starts, key=search.cost_at)]
    best, refused = search.best(starts)
    far = best is None or not (best.settled and best.cost <= FAR**2 * measurements.n_observation)
    if far and not roughly:
        turned, also = search.best(rotated_starts(machine, measurements))
        refused = refused or also
        if turned is not None and (best is None or _order(turned) < _order(best)):
            best = turned
    if best is None:
        assert refused is not None
        raise refused
    if best.turned and not roughly:
        # The unknown of half a turn is infinite: it counts from where the frame now is.
        best = search.from_frame(best.frame)
    return best


@dataclass(frozen=True, eq=False)
class _Search:
    machine: Machine
    measurements: Measurements
    unknowns: Unknowns
    weights: Floats | None
    shifts: ParameterDeviation
    tolerances: tuple[float, float, float]

    def problem(self, frame: Frame) -> IdentificationProblem:
        """The instrument's unknowns, its frame standing there."""
        (instrument,) = self.measurements.instruments
        there = dataclasses.replace(
            self.measurements, instruments=(dataclasses.replace(instrument, frame=frame),)
        )
        return IdentificationProblem(self.machine, there, self.unknowns, self.shifts)

    def cost_at(self, frame: Frame) -> float:
        """Weighted sum of squares before any step."""
        return self.cost(self.problem(frame).residual(np.zeros(self.unknowns.count)))

    def cost(self, residual: Floats) -> float:
        """Weighted sum of squares."""
        cost = float(np.sum(residual**2 if self.weights is None else self.weights * residual**2))
        return cost if np.isfinite(cost) else float("inf")

    def from_frame(self, frame: Frame) -> Placement:
        """The search from there on."""
        problem = self.problem(frame)
        (instrument,) = problem.measurements.instruments
        values = np.zeros(self.unknowns.count)
        settled, rank = True, 0
        if self.unknowns.count:
            known = Prior.of(self.unknowns)
            slope = whitened(problem, values)
            gauge = Equations.of(slope, known, self.unknowns).gauge_rows()
            read = Equations.of(slope, Prior.none(self.unknowns.count), self.unknowns)
            rank = int(read.seen.sum())
            solved = problem.solve(
                prior=known.with_rows(gauge),
                weights=self.weights,
                start=values,
                tolerances=self.tolerances,
            )
            values, settled = solved.values[0], solved.ending[0] in SETTLED
        residual = problem.residual(values)
        cost = self.cost(residual)
        exact = cost <= EXACT**2 * self.measurements.n_observation
        settled = np.isfinite(cost) and (settled or exact)
        return Placement(instrument, self.unknowns, values, residual, cost, bool(settled), rank)

    def best(self, starts: Iterable[Frame]) -> tuple[Placement | None, RequestError | None]:
        """The best from all starts, and what was wrong with one that could not be followed."""
        best: Placement | None = None
        refused: RequestError | None = None
        for start in starts:
            try:
                placed = self.from_frame(start)
            except RequestError as failure:
                refused = failure
                continue
            if best is None or _order(placed) < _order(best):
                best = placed
        return best, refused


def _order(placement: Placement) -> tuple[bool, float]:
    return not placement.settled, placement.cost


__all__ = ["Placement", "Placements", "place_instrument", "place_instruments"]
