"""A machine at some poses, whose errors are sampled, and what tallies of samples say."""

from __future__ import annotations

import numpy as np

from truepose._kernel import Study, Tallies
from truepose.arrays import Floats
from truepose.machine import Machine
from truepose.runs.first_order import first_order
from truepose.runs.quantities import POSITIONS, quantities
from truepose.runs.variables import Variables
from truepose.sources import PoseBlock
from truepose.uncertainty_analysis.failed_samples import OfAll
from truepose.uncertainty_analysis.sampler import Draws, Sampler, study_of
from truepose.uncertainty_analysis.stopping_rule import BATCH

LEVELS = np.linspace(0.0, 1.0, 201)
"""Probabilities of the quantiles that a result has."""

FINENESS = 100.0
"""Bins of a histogram in one standard deviation."""


class MachineSampler(Sampler):
    """A machine at some poses; columns of its tallies: components, magnitudes, ellipse distance."""

    def __init__(self, machine: Machine, block: PoseBlock, variables: Variables) -> None:
        self.machine, self.block, self.variables = machine, block, variables
        self._study = self._studied(None)
        kinds = quantities(machine.components)
        self._kinds = list(kinds.values())
        self._axes = [at for at, name in enumerate(machine.components) if name in POSITIONS]
        self.n_pose = block.indices.size
        self._unwhitened = (self._origins()[0], self._widths())

    def _studied(self, whitening: Floats | None) -> Study:
        return study_of(self.machine, self.block, self.variables, whitening)

    def _origins(self) -> tuple[Floats, int]:
        error = np.asarray(self._study.shift_error)
        origins = np.concatenate([error, np.zeros((len(error), len(self._kinds)))], axis=1)
        return np.where(np.isfinite(origins), origins, 0.0), error.shape[1]

    def _widths(self) -> Floats:
        """(n, n_column) bins of the order of a hundredth of the first-order spread."""
        _, effects, _ = first_order(self.machine, self.block, self.variables)
        sigmas = np.array([distribution.sigmas for distribution in self.variables.distributions])
        deviation = np.sqrt(np.square(effects / sigmas).sum(axis=2)) if sigmas.size else 0.0
        deviation = np.nan_to_num(np.broadcast_to(deviation, effects.shape[:2]))
        parts = [np.linalg.norm(deviation[:, kind], axis=1) for kind in self._kinds]
        every = np.concatenate([deviation, np.stack(parts, axis=1)], axis=1)
        # Where first order has no spread the bins begin tiny, and widen to what is met.
        widths: Floats = np.maximum(every, 1e-15) / FINENESS
        return widths

    def begin(self, draws: Draws, count: int) -> Tallies:
        """The first samples; the covariance of the first batch is the shape of the ellipse.

        Its position errors are kept until that is known: the batch is not drawn again.
        """
        origins, widths = self._unwhitened
        tallies = Tallies(origins, widths, origins.shape[1], len(self.machine.components))
        if not self._axes:
            self.sample(draws, 0, count, tallies)
            return tallies
        pilot = min(count, BATCH)
        given = draws.given(0, pilot)
        if given is None:
            positions = self._study.sample_keeping(draws.variables, draws.seed, 0, pilot, tallies)
        else:
            positions = self._study.sample_given_keeping(draws.variables, given, tallies)
        covariance = np.asarray(tallies.covariance)[:, self._axes][:, :, self._axes]
        self._centre = np.asarray(tallies.mean)[:, self._axes]
        self._shape = np.nan_to_num(covariance)
        whitening = _whitening(self.machine, self._centre, self._shape)
        tallies.append_lengths(positions, whitening, 1.0 / FINENESS)
        self._study = self._studied(whitening)
        if count > pilot:
            self.sample(draws, pilot, count - pilot, tallies)
        return tallies

    def sample(self, draws: Draws, first: int, count: int, into: Tallies) -> None:
        """Evaluates the samples from number `first` on."""
        given = draws.given(first, count)
        if given is None:
            self._study.sample(draws.variables, draws.seed, first, count, into)
        else:
            self._study.sample_given(draws.variables, given, into)

    @property
    def checked(self) -> slice:
        """Columns whose figures are to be stable."""
        return slice(0, len(self.machine.components))

    def values(self, tallies: Tallies, probability: float) -> dict[str, np.ndarray]:
        """All variables of the schema, over poses first."""
        m = len(self.machine.components)
        values = statistics(tallies, m, probability)
        sizes = slice(m, m + len(self._kinds))
        of_all = OfAll(tallies)
        upper = of_all.below([probability])[..., 0]
        values |= {
            "magnitude_mean": np.asarray(tallies.mean)[:, sizes],
            "magnitude_upper": upper[:, sizes],
            "magnitude_maximum": np.asarray(tallies.extremes)[:, sizes, 1],
            "magnitude_quantile": of_all.below(LEVELS.tolist())[:, sizes],
        }
        if self._axes:
            factor = upper[:, -1]
            values["ellipse_centre"] = self._centre
            values["ellipse"] = self._shape * np.square(factor)[:, np.newaxis, np.newaxis]
        return values


def _whitening(machine: Machine, centre: Floats, covariance: Floats) -> Floats:
    """(n, 12) centre and matrix of the position error, in three components.

    A direction in which nothing spreads does not count.
    """
    places = [POSITIONS.index(name) for name in machine.components if name in POSITIONS]
    rows = np.zeros((len(centre), 12))
    rows[:, places] = centre
    values, vectors = np.linalg.eigh(covariance)
    least = 1e-12 * values[:, -1:]
    scale = np.where(values > np.maximum(least, 0.0), values, np.inf) ** -0.5
    matrix: Floats = np.asarray(scale[:, :, np.newaxis] * np.swapaxes(vectors, 1, 2))
    for row in range(len(places)):
        for column, place in enumerate(places):
            rows[:, 3 + 3 * row + place] = matrix[:, row, column]
    return rows


def statistics(tallies: Tallies, m: int, probability: float) -> dict[str, np.ndarray]:
    """The variables of `SCHEMA` of the first m columns, over poses first."""
    tail = 0.5 * (1.0 - probability)
    of_all = OfAll(tallies)
    ends = of_all.between([tail, 1.0 - tail])[:, :m]
    shortest = of_all.shortest(probability)[:, :m]
    extremes = np.asarray(tallies.extremes)[:, :m]
    covariance = np.asarray(tallies.covariance)
    variance = np.maximum(np.diagonal(covariance, axis1=1, axis2=2), 0.0)
    return {
        "mean": np.asarray(tallies.mean)[:, :m],
        "standard_deviation": np.sqrt(variance),
        "covariance": covariance,
        "lower": ends[..., 0],
        "upper": ends[..., 1],
        "shortest_lower": shortest[..., 0],
        "shortest_upper": shortest[..., 1],
        "minimum": extremes[..., 0],
        "maximum": extremes[..., 1],
        "quantile": of_all.between(LEVELS.tolist())[:, :m],
        "samples": np.asarray(tallies.count),
        "failed": np.asarray(tallies.failed),
    }


__all__ = ["FINENESS", "LEVELS", "MachineSampler", "statistics"]
