"""Random points of a set of variables, in coordinates of unit variance.

The coordinate of an independent variable is `c = t sigmas`, that of a correlated one the normal z
of its copula. A linear function of the coordinates then has a variance known in closed form,
whatever the distributions, and parts of the coordinates can be drawn anew given the others by a
linear map.

Every variable draws from a generator of its own (Philox4x64, counter-based), keyed by the seed and
by what the variable is: the same numbers come whatever else acts, and in parts of any length.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property

import numpy as np

from truepose.arrays import Flags, Floats, Indices
from truepose.probability.copula import NORMAL, Copula
from truepose.probability.domain import unit
from truepose.sources.deviation import Distribution

STUDENT = "student-t"

_STREAM = 1 << 32
"""Variables that one stream can number."""

SEEDS = 1 << 64
"""Seeds there are, from 0."""


class Drawing:
    """The coordinates of n_variable variables, and points of them."""

    def __init__(
        self,
        distributions: Sequence[Distribution],
        correlation: Floats | None,
        streams: Indices,
        numbers: Indices,
        names: Sequence[str],
        seed: int,
        directions: Sequence[Indices] = (),
    ) -> None:
        """`streams`, `numbers` (n_variable,): what each variable is, for its random numbers.

        `directions`: numbers of the variables that are together a unit vector.

        Raises `RequestError` (correlation-out-of-reach).
        """
        self.distributions = tuple(distributions)
        self.sigmas: Floats = np.array(
            [distribution.sigmas for distribution in distributions], np.float64
        )
        self.copula = Copula.of(distributions, correlation, names)
        self.directions = tuple(directions)
        self._seed = seed
        self._identity = [
            int(stream) * _STREAM + int(number)
            for stream, number in zip(streams, numbers, strict=True)
        ]

    @property
    def linked(self) -> Indices:
        """(k,) variables that are correlated with another."""
        return self.copula.linked

    @cached_property
    def single(self) -> Flags:
        """(n_variable,) whether the variable is independent of all others."""
        single = np.ones(len(self.distributions), np.bool_)
        single[self.linked] = False
        return single

    @cached_property
    def by_itself(self) -> list[Indices]:
        """Numbers of the variables of each cause: a direction's together, all others alone."""
        alone = np.ones(len(self.distributions), np.bool_)
        for members in self.directions:
            alone[members] = False
        causes = [*np.flatnonzero(alone)[:, np.newaxis], *self.directions]
        return sorted(causes, key=lambda members: int(members[0]))

    @cached_property
    def covariance(self) -> Floats:
        """(n_variable, n_variable) of the coordinates."""
        covariance = np.eye(len(self.distributions))
        covariance[np.ix_(self.linked, self.linked)] = self.copula.latent
        return covariance

    def points(self, purpose: int) -> Points:
        """An endless row of random points; another `purpose` draws others, independent of them."""
        generators = [generator(self._seed, identity, purpose) for identity in self._identity]
        return Points(self, generators)

    def variables(self, coordinates: Floats) -> Floats:
        """(s, n_variable) variables t at the coordinates (s, n_variable)."""
        variables: Floats = coordinates / self.sigmas
        if self.linked.size:
            variables[:, self.linked] = self.copula.variables(coordinates[:, self.linked])
        return variables


class Points:
    """Random points of a drawing, one after the other."""

    def __init__(self, drawing: Drawing, generators: list[np.random.Generator]) -> None:
        self._drawing = drawing
        self._generators = generators

    def independent(self, count: int) -> Floats:
        """(count, n_variable) as `next`, but with unit normals for correlated ones."""
        drawing = self._drawing
        points = np.empty((count, len(self._generators)))
        of_normals = set(drawing.linked.tolist()).union(*map(np.ndarray.tolist, drawing.directions))
        for column, numbers in enumerate(self._generators):
            if column in of_normals:
                points[:, column] = numbers.standard_normal(count)
            else:
                points[:, column] = _unit(numbers, drawing.distributions[column], count)
        for members in drawing.directions:
            points[:, members] = unit(points[:, members]) * drawing.sigmas[members]
        return points

    def next(self, count: int) -> Floats:
        """(count, n_variable) coordinates of the next points."""
        points = self.independent(count)
        linked = self._drawing.linked
        if linked.size:
            points[:, linked] = points[:, linked] @ self._drawing.copula.factor
        return points


def generator(seed: int, identity: int, purpose: int) -> np.random.Generator:
    """Random numbers that depend on these three alone (Salmon et al. 2011, Philox)."""
    return np.random.Generator(
        np.random.Philox(
            key=np.array([seed, identity], np.uint64),
            counter=np.array([0, 0, 0, purpose], np.uint64),
        )
    )


def _unit(numbers: np.random.Generator, distribution: Distribution, count: int) -> Floats:
    """(count,) values of the distribution, scaled to unit variance."""
    if distribution.name == NORMAL:
        return numbers.standard_normal(count)
    if distribution.name == STUDENT:
        dof = distribution.dof
        assert dof is not None
        scaled: Floats = numbers.standard_t(dof, count) * math.sqrt((dof - 2.0) / dof)
        return scaled
    values: Floats = distribution.quantile(numbers.random(count)) * distribution.sigmas
    return values
