"""A measured circular test against the predicted one: within what the model says, and if not, why.

    d = measured F - mean of the machines, each pair of paths about its own least-squares circle

    farthest   largest |d| / sqrt(variance of the machines + u^2) of a reading: where the machines
               go, but not so far
    distance   d' (covariance of the machines + u^2)^-1 d over the number of readings, its root
               (Mahalanobis 1936): what no machine does, however little it is

with u the noise of a reading. Either is counted in that of its own which (1 + probability) / 2 of
the machines stay below, and the larger is within if it is not above what the share `probability` of
machines have themselves, read with the same noise at the same angles. Mean and covariance are of
half of the machines drawn, all limits of the other half. That is one question for the whole test.
Readings within a step of where a drive turns round are left out, as a step cannot be told between
two angles.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from truepose.arrays import Flags, Floats
from truepose.machine_tests.circle import least_squares, ring_widths
from truepose.machine_tests.circular_prediction import CircularTest
from truepose.machine_tests.circular_quantities import QUANTITIES
from truepose.machine_tests.circular_readings import BallBarReadings, Path2D
from truepose.machine_tests.seen import centred
from truepose.runs.variables import Variables
from truepose.workpiece.states import in_space

ALIKE = 0.999
"""Cosine between two patterns from which on a test cannot tell the causes apart."""

NAMED = 5
"""Causes of one pattern that are named; the others are counted."""

NOISY = 500
"""Machines whose quantities, and distances, are taken with the noise of the readings."""

MOST_MACHINES = 500
"""Machines of which the covariance is taken."""

STREAM = 0x5EED
"""Of the noise, beside that of the machines."""


@dataclass(frozen=True)
class Suspect:
    """A parameter, or several that this test cannot tell apart, that would explain the difference.

    `value`: by how much it would have to be off besides, in SI `unit`; `share` of the sum of
    squares of the difference that this explains; `bands`: how many standard uncertainties of the
    model that is, NaN where the file gives the parameter no band.
    """

    names: tuple[str, ...]
    value: float
    unit: str
    share: float
    bands: float


@dataclass(frozen=True, eq=False)
class ComparedReadings:
    """BallBarReadings against a test. `uncertainty`: standard, of one reading, m."""

    test: CircularTest
    readings: BallBarReadings
    uncertainty: float

    @cached_property
    def angles(self) -> Floats:
        """(m,) rad, of all readings that make pairs, path after path."""
        return np.concatenate([path.angles for path in self._paths])

    @cached_property
    def _paths(self) -> list[Path2D]:
        return [path for pair in self.readings.pairs for path in pair]

    @cached_property
    def ways(self) -> Floats:
        """(m,) direction of each reading."""
        return np.concatenate([np.full(path.angles.size, path.direction) for path in self._paths])

    @cached_property
    def deviations(self) -> Floats:
        """(m,) measured F, m."""
        deviations = []
        for there, back in self.readings.pairs:
            angles = np.concatenate([there.angles, back.angles])
            radii = np.concatenate([there.radii, back.radii])
            circle = least_squares(angles, radii[np.newaxis])
            deviations.append(circle.deviations[0] + circle.radius[0] - self.test.path.radius)
        return np.concatenate(deviations)

    @cached_property
    def values(self) -> Floats:
        """(q,) measured quantities, m, mean of the pairs of paths."""
        nominal = self.test.path.radius
        rows = []
        for there, back in self.readings.pairs:
            angles = np.concatenate([there.angles, back.angles])
            radii = np.concatenate([there.radii, back.radii])[np.newaxis]
            circle = least_squares(angles, radii)
            of_all = circle.deviations[0] + circle.radius[0] - nominal
            one, other = of_all[: there.angles.size], of_all[there.angles.size :]
            again = np.interp(there.angles, back.angles, other, period=2.0 * np.pi)
            row = {
                "G_b": ring_widths(angles, radii)[0],
                "G_ccw": ring_widths(there.angles, there.radii[np.newaxis])[0],
                "G_cw": ring_widths(back.angles, back.radii[np.newaxis])[0],
                "H": np.abs(one - again).max(),
                "D": circle.radius[0] - nominal,
                "F_max_ccw": one.max(),
                "F_min_ccw": one.min(),
                "F_max_cw": other.max(),
                "F_min_cw": other.min(),
            }
            rows.append([row[name] for name in QUANTITIES])
        return np.asarray(np.mean(rows, axis=0))

    def at_readings(self, patterns: Floats) -> Floats:
        """(s, m) of deviations (s, 2, n) at the angles of the test, at those of the readings."""
        test, count = self.test.path.angles, self.test.path.count
        place = self.angles / (2.0 * np.pi) * count
        low = np.floor(place).astype(np.intp)
        share = place - low
        ways = self.ways.astype(np.intp)
        between = (1.0 - share) * patterns[:, ways, low % test.size]
        between += share * patterns[:, ways, (low + 1) % test.size]
        return self._centred(between)

    def _centred(self, radial: Floats) -> Floats:
        """Each pair of paths about a centre of its own, as it is measured."""
        first = 0
        centre = np.empty_like(radial)
        for there, back in self.readings.pairs:
            size = there.angles.size + back.angles.size
            part = slice(first, first + size)
            centre[:, part] = centred(self.angles[part], radial[:, part])
            first += size
        return centre

    @cached_property
    def counted(self) -> Flags:
        """(m,) readings that are not next to where a drive turns round."""
        turns = np.array([step.angle for step in self.test.steps])
        if not turns.size:
            return np.ones(self.angles.size, np.bool_)
        apart = np.abs(self.angles[:, np.newaxis] - turns)
        apart = np.minimum(apart, 2.0 * np.pi - apart).min(axis=1)
        away: Flags = apart > 2.0 * np.pi / self.test.path.count
        return away if away.any() else np.ones(self.angles.size, np.bool_)

    @cached_property
    def _machines(self) -> Floats:
        """(s, m) F of the machines drawn, that could be assembled, as commanded."""
        deviations = self.test.deviations(0)
        return self.at_readings(deviations[np.isfinite(deviations).all(axis=(1, 2))])

    @cached_property
    def _model(self) -> tuple[Floats, Floats, Floats]:
        """Mean (m,) of half the machines, how they differ from it (s, m), and a factor (s, s).

        The factor is the inverse of (s - 1) u^2 + X X', so that with few machines and many readings
        nothing of the size of the readings is solved (Woodbury 1950).
        """
        machines = self._machines[::2][:MOST_MACHINES][:, self.counted]
        mean = machines.mean(axis=0)
        apart = machines - mean
        inner = apart @ apart.T
        inner[np.diag_indices_from(inner)] += max(len(machines) - 1, 1) * self.uncertainty**2
        return mean, apart, np.asarray(np.linalg.inv(inner))

    def statistics(self, deviations: Floats) -> Floats:
        """(2, s) farthest and distance of F (s, m), in standard uncertainties."""
        mean, apart, inverse = self._model
        d = deviations[:, self.counted] - mean
        spread = np.square(apart).sum(axis=0) / max(len(apart) - 1, 1) + self.uncertainty**2
        farthest = np.abs(d / np.sqrt(spread)).max(axis=1)
        along = d @ apart.T
        square = np.square(d).sum(axis=1) - ((along @ inverse) * along).sum(axis=1)
        distance = np.sqrt(np.maximum(square, 0.0) / d.shape[1]) / self.uncertainty
        return np.stack([farthest, distance])

    @cached_property
    def measured_statistics(self) -> Floats:
        """(2,) of the readings."""
        return np.asarray(self.statistics(self.deviations[np.newaxis])[:, 0])

    @cached_property
    def _of_machines(self) -> Floats:
        """(2, s) of the other half of the machines, read with noise."""
        machines = self._machines[1::2] if len(self._machines) > 1 else self._machines
        if len(machines) < NOISY:
            machines = np.tile(machines, (-(-NOISY // len(machines)), 1))
        noise = np.random.default_rng([STREAM, self.test.seed]).normal(
            scale=self.uncertainty, size=machines.shape
        )
        return self.statistics(self._centred(machines + noise))

    @cached_property
    def limits(self) -> Floats:
        """(2,) what each may be, so that the share `probability` of machines keeps both."""
        own = np.quantile(self._of_machines, 0.5 * (1.0 + self.test.probability), axis=1)
        larger = (self._of_machines / own[:, np.newaxis]).max(axis=0)
        return np.asarray(own * np.quantile(larger, self.test.probability))

    @property
    def share(self) -> float:
        """Share of the machines that are at least as far off."""
        larger = (self._of_machines / self.limits[:, np.newaxis]).max(axis=0)
        return float((larger >= (self.measured_statistics / self.limits).max()).mean())

    @property
    def within(self) -> bool:
        """Whether the readings are what the model says."""
        return bool((self.measured_statistics <= self.limits).all())

    @cached_property
    def outside(self) -> float:
        """Share of the readings outside the interval at their angle."""
        low, high = self.test.interval(self._machines)
        reach = 2.0 * self.uncertainty
        off = (self.deviations < low - reach) | (self.deviations > high + reach)
        return float(off.mean())

    @cached_property
    def intervals(self) -> tuple[Floats, Floats]:
        """Ends (q,) of the interval of each quantity as it is read, with the noise of readings."""
        from truepose.machine_tests.circular_quantities import evaluated

        path = self.test.path
        machines = self.test.deviations(0)[:NOISY]
        machines = machines[np.isfinite(machines).all(axis=(1, 2))]
        if len(machines) == 1:
            machines = np.repeat(machines, NOISY, axis=0)
        noise = np.random.default_rng([STREAM, 1 + self.test.seed]).normal(
            scale=self.uncertainty, size=machines.shape
        )
        radii = path.radius + machines + noise
        return self.test.interval(evaluated(path.angles, radii, path.radius).values)

    @cached_property
    def difference(self) -> Floats:
        """(m,) measured F less that of the known errors, m."""
        known = self.at_readings(self.test.before.nominal.deviations)[0]
        return np.asarray(self.deviations - known)

    @cached_property
    def explained(self) -> float:
        """Share of the difference that all parameters inside their bands explain together."""
        state = self.test.before.state
        sigmas = np.array([one.sigmas for one in state.variables.distributions])
        if not sigmas.size:
            return 0.0
        effects = self.test.before.patterns(state.effects).reshape(len(sigmas), 2, -1)
        uncertain = self.at_readings(effects / sigmas[:, np.newaxis, np.newaxis])
        covariance = np.eye(len(sigmas))
        if state.variables.correlation is not None:
            covariance = state.variables.correlation
        normal = uncertain @ uncertain.T / self.uncertainty**2
        # (C^-1 + E E^T / u^2)^-1 E d / u^2, without the inverse of a C that has none.
        right = covariance @ (uncertain @ self.difference) / self.uncertainty**2
        t = np.linalg.solve(np.eye(len(sigmas)) + covariance @ normal, right)
        rest = self.difference - t @ uncertain
        return 1.0 - float(rest @ rest) / float(self.difference @ self.difference)

    @cached_property
    def explanations(self) -> list[Suspect]:
        """Each parameter alone, what explains most first; alike ones together."""
        names, units, bands, patterns = zip(*self._candidates(), strict=True)
        table = self.at_readings(np.stack(patterns))
        size = np.sqrt(np.square(table).sum(axis=1))
        there = size > 1e-9 * size.max()
        unit = table / np.where(there, size, 1.0)[:, np.newaxis]
        along = unit @ self.difference
        share = np.where(there, np.square(along) / float(self.difference @ self.difference), 0.0)
        # Of those alike, one that has a band speaks for all.
        order = np.lexsort((np.isnan(bands), -share.round(6)))
        ranked: list[Suspect] = []
        taken = ~there
        for at in order.tolist():
            if taken[at]:
                continue
            alike = (np.abs(unit @ unit[at]) > ALIKE) & ~taken
            taken |= alike
            others = [number for number in order.tolist() if alike[number] and number != at]
            value = float(along[at] / size[at])
            ranked.append(
                Suspect(
                    tuple(names[number] for number in [at, *others]),
                    value,
                    units[at],
                    float(share[at]),
                    abs(value) / bands[at],
                )
            )
        return ranked

    def _candidates(self) -> Iterator[tuple[str, str, float, Floats]]:
        """Name, SI unit, standard uncertainty (NaN: no band) and pattern (2, n) of one unit."""
        machine, seen = self.test.path.machine, self.test.before
        state, block = seen.state, seen.state.block
        parameters, shift = state.variables.shift
        every = np.arange(len(machine.parameters), dtype=np.intp)
        slopes, _ = machine.kernel.sensitivity_moved(
            block.joints, block.placements, every, parameters, np.ascontiguousarray(shift)
        )
        spatial = np.swapaxes(in_space(machine, np.swapaxes(slopes, 1, 2)), 1, 2)
        patterns = seen.patterns(spatial).reshape(len(every), 2, -1)
        known = _uncertainties(state.variables, len(every))
        for number, name in enumerate(machine.parameters):
            yield name, machine.units[number], known[number], patterns[number]
        travel = np.concatenate([self.test.path.both[1]])
        for joint, drive in enumerate(machine.drives):
            offset = machine.parameters.index(f"{drive.part}.offset")
            lag = -0.5 * travel[:, joint, np.newaxis] * spatial[:, :, offset]
            play = seen.patterns(lag[:, :, np.newaxis]).reshape(1, 2, -1)[0]
            yield f"{drive.part}.play", machine.units[offset], float("nan"), play


def _uncertainties(variables: Variables, count: int) -> Floats:
    """(count,) standard uncertainty of each parameter, NaN of one without a band."""
    variance = np.zeros(count)
    sigmas = np.array([one.sigmas for one in variables.distributions])
    if sigmas.size:
        half = variables.half_width.max(axis=0) / sigmas[variables.variable_of]
        np.add.at(variance, variables.columns, np.square(half))
    return np.where(variance > 0.0, np.sqrt(variance), np.nan)


__all__ = ["ComparedReadings", "Suspect"]
