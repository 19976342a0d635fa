"""Machines drawn at random, batch after batch, until a stopping rule has enough of them."""

from __future__ import annotations

import copy
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.errors import Problem, RequestError
from truepose.probability.copula import Copula
from truepose.probability.domain import unit
from truepose.probability.quantiles import normal_quantile
from truepose.sources.deviation import Distribution
from truepose.uncertainty_analysis.stopping_rule import Adaptive, StoppingRule

if TYPE_CHECKING:
    from truepose._kernel import Study, Tallies
    from truepose._kernel import Variables as KernelVariables
    from truepose.machine import Machine
    from truepose.runs.variables import Variables
    from truepose.sources import PoseBlock

_STUDENT = "student-t"


def study_of(
    machine: Machine, block: PoseBlock, variables: Variables, whitening: Floats | None = None
) -> Study:
    """The kernel's study of the poses of a block, with what `variables` move there."""
    from truepose._kernel import Study

    shifted, shift = variables.shift
    return Study(
        machine.kernel,
        block.joints,
        block.placements,
        shifted,
        np.ascontiguousarray(shift),
        variables.columns,
        variables.variable_of.tolist(),
        np.ascontiguousarray(variables.half_width),
        whitening,
    )


class SampledVariables(Protocol):
    """What draws are made of: `truepose.runs.variables.Variables`, or a `Model`."""

    @property
    def names(self) -> tuple[str, ...]:
        """Label of each."""
        ...

    @property
    def distributions(self) -> tuple[Distribution, ...]:
        """How each is distributed."""
        ...

    @property
    def correlation(self) -> Floats | None:
        """(n_variable, n_variable); None where all are independent."""
        ...

    @property
    def directions(self) -> Sequence[Indices]:
        """Numbers of the variables that are together a unit vector."""
        ...

    @property
    def streams(self) -> Indices:
        """(n_variable,) what each belongs to, for random numbers."""
        ...

    @property
    def numbers(self) -> Indices:
        """(n_variable,) number of each there."""
        ...


class Draws(Protocol):
    """The variables of any sample, by its number."""

    variables: KernelVariables
    seed: int

    def given(self, first: int, count: int) -> Floats | None:
        """(count, n_variable), or None where the kernel draws them itself."""
        ...

    def rows(self, first: int, count: int) -> Floats:
        """(count, n_variable)."""
        ...


class Random:
    """Random numbers of the kernel; correlated ones through a Gaussian copula."""

    def __init__(self, of: SampledVariables, seed: int) -> None:
        from truepose._kernel import Variables as KernelVariables

        self.seed = seed
        self.distributions = of.distributions
        self.directions = of.directions
        self.copula = Copula.of(of.distributions, of.correlation, of.names)
        linked = self.copula.linked.tolist()
        # The kernel has no quantile function of Student's distribution.
        self._by_hand = any(of.distributions[k].name == _STUDENT for k in linked)
        told = [
            described(distribution, int(stream), int(number))
            for distribution, stream, number in zip(
                of.distributions, of.streams, of.numbers, strict=True
            )
        ]
        if self._by_hand:
            for k in linked:
                told[k] |= {"kind": "normal", "sigmas": 1.0}
            linked = []
        factor = self.copula.factor if linked else np.empty((0, 0))
        self.variables = KernelVariables(
            told,
            linked,
            factor.ravel().tolist(),
            [members.tolist() for members in of.directions],
        )

    def given(self, first: int, count: int) -> Floats | None:
        """None, but where a correlated variable is of Student's distribution."""
        return self.rows(first, count) if self._by_hand else None

    def rows(self, first: int, count: int) -> Floats:
        """(count, n_variable)."""
        drawn = np.asarray(self.variables.draw(self.seed, first, count))
        if self._by_hand:
            linked = self.copula.linked
            drawn[:, linked] = self.copula.variables(drawn[:, linked] @ self.copula.factor.T)
        return drawn

    def with_seed(self, seed: int) -> Random:
        """The same variables, drawn anew."""
        other = copy.copy(self)
        other.seed = seed
        return other


def described(distribution: Distribution, stream: int, number: int) -> dict[str, object]:
    """A variable as the kernel takes it: its distribution, what it belongs to, its number there."""
    told: dict[str, object] = {
        "kind": distribution.name,
        "sigmas": distribution.sigmas,
        "stream": stream,
        "number": number,
    }
    if distribution.dof is not None:
        told["dof"] = distribution.dof
    if distribution.values:
        values, up_to = distribution.steps
        told |= {
            "kind": "discrete",
            "values": values.tolist(),
            "probabilities": np.diff(up_to, prepend=0.0).tolist(),
        }
    return told


class _Sobol:
    """Scrambled Sobol points through the quantile functions of the variables."""

    def __init__(self, random: Random, samples: int) -> None:
        try:
            from scipy.stats import qmc
        except ImportError as failure:
            raise RequestError(
                Problem(
                    "extra-missing",
                    "Sobol points need a package that is not installed",
                    found=f"no {failure.name}",
                    expected="scipy",
                    hint="pip install 'truepose[sobol]'",
                )
            ) from failure
        self.variables, self.seed = random.variables, random.seed
        count = len(random.distributions)
        points = qmc.Sobol(count, scramble=True, rng=random.seed)
        # A point at 0 would be minus infinity of a normal variable.
        u = np.clip(points.random(samples), 2.0**-53, 1.0 - 2.0**-53)
        self._rows = np.empty_like(u)
        copula = random.copula
        for column, distribution in enumerate(random.distributions):
            if column not in copula.linked:
                self._rows[:, column] = distribution.quantile(u[:, column])
        if copula.linked.size:
            normals = normal_quantile(u[:, copula.linked]) @ copula.factor.T
            self._rows[:, copula.linked] = copula.variables(normals)
        for members in random.directions:
            self._rows[:, members] = unit(normal_quantile(u[:, members]))

    def given(self, first: int, count: int) -> Floats:
        """(count, n_variable)."""
        return np.ascontiguousarray(self._rows[first : first + count])

    rows = given


def sobol(random: Random, samples: int) -> Draws:
    """Scrambled Sobol points in place of random ones. Raises `RequestError` (extra-missing)."""
    return _Sobol(random, samples)


@dataclass(frozen=True)
class DrawnSamples:
    """Tallies of all samples, None where there are none; whether Ctrl-C ended it."""

    tallies: Tallies | None
    interrupted: bool
    per_pose: int = 0
    """Samples at each pose."""


class Sampler(ABC):
    """Whatever samples are evaluated on."""

    n_pose: int

    @abstractmethod
    def begin(self, draws: Draws, count: int) -> Tallies:
        """The first `count` samples, and what is learnt from the first of them for all others."""

    @abstractmethod
    def sample(self, draws: Draws, first: int, count: int, into: Tallies) -> None:
        """Evaluates the `count` samples from number `first` on into tallies."""

    @property
    @abstractmethod
    def checked(self) -> slice:
        """Columns whose figures are to be stable."""

    def run(
        self, draws: Draws, enough: StoppingRule, account: Callable[[int, int], None]
    ) -> DrawnSamples:
        """Draws until there are enough.

        `account` is called with the samples done over all poses, and with how many are expected at
        each pose, 0 where that is not known.
        """
        whole: Tallies | None = None
        done = 0
        try:
            while count := enough.next(done, self.n_pose):
                if whole is None:
                    batch = self.begin(draws, count)
                else:
                    batch = whole.blank()
                    self.sample(draws, done, count, batch)
                if isinstance(enough, Adaptive):
                    enough.update(batch, self.checked)
                if whole is None:
                    whole = batch
                else:
                    whole.merge(batch)
                done += count
                account(count * self.n_pose, enough.expected(done))
        except KeyboardInterrupt:
            return DrawnSamples(whole, True, done)
        return DrawnSamples(whole, False, done)
