"""The variables of samples at the points of a path: which of them change on the way, and how.

A sample is one machine. What varies with the machine it has from `uncertainty_analysis.sampler`, to
the bit, so that a part without anything that changes on the way has the samples of `monte_carlo`.
Beside it there are

    with the run        run 0 as the machine's, another draw in every other run
    with position       a phase, uniform in [-1, 1), for each variable; its law makes t of it
    with each visit     a draw for each point and run

by the same counter-based numbers: streams and numbers of the variables stay, and another run or
visit is another seed, which a hash makes of the seed, the run and the point.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from truepose.arrays import Flags, Floats, Indices
from truepose.files import varies
from truepose.runs.variables import Variables
from truepose.sources.deviation import UNIFORM, Distribution
from truepose.sources.variation import Law, Ripple, Rounding
from truepose.uncertainty_analysis.sampler import Random

SEED_BYTES = 8
"""Of a hash: a seed of the kernel's."""


TOGETHER = 16
"""Samples, or points, that are worked on together: what is made on the way stays near."""


class OnTheWay(NamedTuple):
    """What a variable that changes on the way does to a parameter at a point in a run, SI."""

    point: int
    run: int
    variable: str
    parameter: str
    value: float


@dataclass(frozen=True)
class _Some:
    """Some of the variables of a set, as `Random` takes them."""

    names: tuple[str, ...]
    distributions: tuple[Distribution, ...]
    correlation: Floats | None
    directions: tuple[Indices, ...]
    streams: Indices
    numbers: Indices


class Varying:
    """Values of the n_variable variables at the n points of a path, of any sample of one run.

    `variables`: at the points, half widths (n or 1, k). `joints` (n, n_joint): coordinates that the
    drives are sent to, m or rad. `places` (n,): number of each point among all that are visited,
    which is what visits are drawn by; default 0 .. n - 1.
    Raises `RequestError` (correlation-out-of-reach), as `Random` does.
    """

    def __init__(
        self,
        variables: Variables,
        joints: Floats,
        seed: int,
        run: int = 0,
        places: Indices | None = None,
    ) -> None:
        self.variables, self.joints, self.seed, self.run = variables, joints, seed, run
        self.places = np.arange(len(joints), dtype=np.intp) if places is None else places
        words = np.array([one.word for one in variables.variations], np.str_)
        self._of_run = np.flatnonzero(words == varies.RUN)
        self._visiting = np.flatnonzero(words == varies.VISIT)
        self._phased = np.flatnonzero(words == varies.POSITION)
        self._laws: tuple[Law, ...] = tuple(
            law for one in variables.variations if (law := one.law) is not None
        )
        self._machines = Random(variables, seed)
        of_run = self._of_run if run else self._of_run[:0]
        self._runs = self._random(of_run, _seed(seed, varies.RUN, run))
        self._visits = self._random(self._visiting, seed)
        self._phases = self._random(self._phased, seed, UNIFORM)
        self._seeds = [_seed(seed, varies.VISIT, run, place) for place in self.places.tolist()]

    @property
    def constant(self) -> bool:
        """Whether every variable has one value at all points."""
        return not self.varying.size

    @cached_property
    def varying(self) -> Indices:
        """Numbers of the variables that change on the way, ascending."""
        return np.flatnonzero(self.variables.varies_along)

    def rows(self, first: int, count: int) -> Floats:
        """(count, n_variable) of the samples from number `first` on, for all points of the run.

        Of a variable that varies with position the phase, in [-1, 1); of one that varies with each
        visit nothing that counts.
        """
        rows = self._machines.rows(first, count)
        for numbers, random in ((self._of_run, self._runs), (self._phased, self._phases)):
            if random is not None:
                rows[:, numbers] = random.rows(first, count)
        return rows

    def along(self, rows: Floats, first: int, points: slice | Indices = slice(None)) -> Floats:
        """(count, n_points, n_varying) of the `varying` ones alone, at some points.

        `rows`: of the samples from number `first` on.
        """
        chosen = np.arange(len(self.joints))[points]
        values = np.zeros((len(rows), chosen.size, self.varying.size))
        at = np.searchsorted(self.varying, self._phased)
        for column, number, law in zip(at.tolist(), self._phased.tolist(), self._laws, strict=True):
            phase = _phase(rows[:, number])[:, np.newaxis]
            values[:, :, column] = law.at(self.joints[chosen, law.joint], phase)
        if self._visits is not None:
            at = np.searchsorted(self.varying, self._visiting)
            for place, point in enumerate(chosen.tolist()):
                if self._is_felt[point]:
                    values[:, place, at] = self._visited(point, first, len(rows))
        return values

    def at(self, rows: Floats, first: int, points: slice | Indices = slice(None)) -> Floats:
        """(count, n_points, n_variable) at some points, of the samples from number `first` on."""
        along = self.along(rows, first, points)
        values = np.repeat(rows[:, np.newaxis], along.shape[1], axis=1)
        values[:, :, self.varying] = along
        return values

    def at_point(self, rows: Floats, first: int, point: int) -> Floats:
        """(count, n_variable) at one point: what `Study.errors` takes there.

        `rows` themselves where nothing changes on the way.
        """
        if self.constant:
            return rows
        values = rows.copy()
        values[:, self.varying] = self.along(rows, first, np.array([point]))[:, 0]
        return values

    def linear(
        self,
        rows: Floats,
        first: int,
        value: Floats,
        effects: Floats,
        points: slice | Indices = slice(None),
    ) -> Floats:
        """(count, n_points, m) to first order: `value` (n, m) + `effects` (n, m, n_variable) t.

        With `effects` as of `runs.first_order`, over all points; `rows` of the samples from number
        `first` on. One product for all that is constant and all ripples, which are a sine and a
        cosine of the phase.
        """
        chosen = np.arange(len(self.joints))[points]
        # Component before point: what is added to a component at all points lies side by side.
        slopes = effects[chosen].transpose(1, 0, 2)
        factors, matrices = self._product(rows, chosen, slopes)
        matrix = np.concatenate(matrices, axis=2)
        count, columns = slopes.shape[0] * slopes.shape[1], matrix.shape[2]
        errors = np.concatenate(factors, axis=1) @ matrix.reshape(count, columns).T
        errors = errors.reshape(len(rows), *slopes.shape[:2])
        errors += value[chosen].T
        for number, law in zip(self._phased.tolist(), self._laws, strict=True):
            if isinstance(law, Rounding):
                phases, way = _phase(rows[:, number]), self.joints[chosen, law.joint]
                _add_rounding(errors, law, way, phases, slopes[:, :, number])
        if self._visits is not None:
            self._add_visits(errors, first, chosen, slopes[:, :, self._visiting])
        return errors.transpose(0, 2, 1)

    def _product(
        self, rows: Floats, chosen: Indices, slopes: Floats
    ) -> tuple[list[Floats], list[Floats]]:
        """Factors (count, f) of each sample, and matrices (m, n_points, f) that they multiply."""
        steady = np.flatnonzero(~self.variables.varies_along)
        factors, matrices = [rows[:, steady]], [slopes[:, :, steady]]
        for number, law in zip(self._phased.tolist(), self._laws, strict=True):
            if isinstance(law, Ripple):
                turn = math.tau * _phase(rows[:, number])
                way = math.tau * self.joints[chosen, law.joint] / law.period
                factors.append(np.stack([np.cos(turn), np.sin(turn)], axis=1))
                waves = np.stack([np.sin(way), np.cos(way)], axis=1)
                matrices.append(slopes[:, :, number, np.newaxis] * waves)
        return factors, matrices

    def _add_visits(self, errors: Floats, first: int, chosen: Indices, slopes: Floats) -> None:
        """Add to `errors` (count, m, n_points) what `slopes` (m, n_points, n_visiting) make."""
        for start in range(0, chosen.size, TOGETHER):
            some = chosen[start : start + TOGETHER].tolist()
            added = np.zeros((*errors.shape[:2], len(some)))
            for place, point in enumerate(some):
                if self._is_felt[point]:
                    t = self._visited(point, first, len(errors))
                    added[:, :, place] = t @ slopes[:, start + place].T
            errors[:, :, start : start + TOGETHER] += added

    def on_the_way(self, t: Floats, parameters: Sequence[str]) -> list[OnTheWay]:
        """What changes on the way where the variables are `t` (n, n_variable): a witness's rows.

        `parameters`: names of the kernel's. A row for every parameter that a variable moves at a
        point; added to the parameters there, they make what the variables that vary make.
        """
        variables = self.variables
        changing = np.flatnonzero(variables.varies_along[variables.variable_of])
        moved = self._half_width[:, changing] * t[:, variables.variable_of[changing]]
        return [
            OnTheWay(
                int(place),
                self.run,
                variables.names[variables.variable_of[column]],
                parameters[variables.columns[column]],
                float(value),
            )
            for place, values in zip(self.places, moved, strict=True)
            for column, value in zip(changing, values, strict=True)
            if value != 0.0
        ]

    @property
    def _half_width(self) -> Floats:
        half_width = self.variables.half_width
        return np.broadcast_to(half_width, (len(self.joints), half_width.shape[1]))

    @cached_property
    def _is_felt(self) -> Flags:
        """(n,) whether a variable that varies with each visit moves anything at the point."""
        columns = np.isin(self.variables.variable_of, self._visiting)
        return np.asarray(self._half_width[:, columns].any(axis=1), np.bool_)

    def _visited(self, point: int, first: int, count: int) -> Floats:
        """(count, n_visiting) at one point."""
        assert self._visits is not None
        return self._visits.with_seed(self._seeds[point]).rows(first, count)

    def _random(
        self, numbers: Indices, seed: int, distribution: Distribution | None = None
    ) -> Random | None:
        """Draws of some variables, `distribution` in place of their own; None where there are none.

        What is correlated, or one direction, varies with the same (`Deviation`): all of it is among
        them, or nothing.
        """
        if not numbers.size:
            return None
        variables = self.variables
        own = tuple(variables.distributions[number] for number in numbers.tolist())
        correlation = variables.correlation
        some = _Some(
            tuple(variables.names[number] for number in numbers.tolist()),
            own if distribution is None else (distribution,) * numbers.size,
            None if correlation is None else correlation[np.ix_(numbers, numbers)],
            tuple(
                np.searchsorted(numbers, members)
                for members in variables.directions
                if np.isin(members, numbers).all()
            ),
            variables.streams[numbers],
            variables.numbers[numbers],
        )
        return Random(some, seed)


def _phase(drawn: Floats) -> Floats:
    """In [0, 1) of what is uniform in [-1, 1)."""
    phase: Floats = 0.5 * (drawn + 1.0)
    return phase


def _add_rounding(
    errors: Floats, law: Rounding, joint: Floats, phases: Floats, slopes: Floats
) -> None:
    """Add to `errors` (count, m, n) what a law makes at `joint` (n,), by `slopes` (m, n)."""
    felt = np.flatnonzero(slopes.any(axis=1)).tolist()
    for start in range(0, len(errors), TOGETHER):
        some = slice(start, start + TOGETHER)
        t = law.at(joint, phases[some, np.newaxis])
        added = np.empty_like(t)
        for component in felt:
            np.multiply(t, slopes[component], out=added)
            errors[some, component] += added


def _seed(seed: int, *of: str | int) -> int:
    """Another seed, as good as any: a hash of the seed and of what it is for."""
    text = " ".join(str(one) for one in (seed, *of))
    return int.from_bytes(hashlib.sha256(text.encode()).digest()[:SEED_BYTES], "big")


__all__ = ["OnTheWay", "Varying"]
