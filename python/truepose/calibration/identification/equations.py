"""The equations of a least-squares fit, whitened: what they determine, and how well."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from truepose.arrays import Flags, Floats
from truepose.calibration.identification.problem import IdentificationProblem, Prior
from truepose.calibration.identification.unknowns import Unknowns
from truepose.calibration.least_squares import singular_decomposition
from truepose.errors import Problem, RequestError

RANK = 1e-9
"""Singular values of the scaled equations below this share of the largest determine nothing."""

ROUNDING = 1e-13
"""Columns of the equations shorter than this share of the longest are rounding."""

HELD = 1e-3
"""Weight of the rows that hold an undetermined direction, in shares of the largest singular value;
no other equation acts on it."""

FIRM = 1e-3
"""Share of the machine, or radians, by which a held direction gives way to one standard
uncertainty: what readings see of it once the machine has moved must not pull it away."""

FAINT = (1.0, 0.1, 0.01, 1e-3)
"""Shares of the machine, or radians: directions known to no better than this by themselves are held
where the search does not settle, the faintest first."""

SETTLED = ("cost", "step", "gradient")
"""How a search ends that found what it looked for."""

EXACT = 1e-6
"""Residuals, in uncertainties, that are taken for rounding."""


@dataclass(frozen=True, eq=False)
class Equations:
    """Whitened equations (r, n), of readings and prior, in values over `scale` (n,), decomposed."""

    scale: Floats
    singular: Floats
    directions: Floats
    """(n, n): rows are right singular vectors, in the order of `singular`."""

    @classmethod
    def of(
        cls,
        jacobian: Floats,
        prior: Prior,
        unknowns: Unknowns,
        left_out: Floats | None = None,
    ) -> Equations:
        """Scaled by the tolerances' standard deviations, else by their columns.

        Along `left_out` (k, n), in the unknowns' own units, nothing counts as determined.
        """
        equations = np.vstack([jacobian, prior.rows])
        norms = np.linalg.norm(equations, axis=0)
        # A column of rounding is none: scaled by its length it would seem well determined.
        nothing = norms <= ROUNDING * norms.max(initial=0.0)
        norms[nothing], equations[:, nothing] = 0.0, 0.0
        variances = np.diagonal(unknowns.prior_covariance)
        has_prior = np.isfinite(variances)
        scale = np.where(norms > 0.0, 1.0 / np.where(norms > 0.0, norms, 1.0), 1.0)
        scale[has_prior] = np.sqrt(variances[has_prior])
        scaled = equations * scale
        if left_out is not None and len(left_out):
            basis = np.linalg.qr((left_out / scale).T)[0].T
            scaled = scaled - scaled @ basis.T @ basis
        return cls(scale, *singular_decomposition(np.asarray(np.linalg.qr(scaled, mode="r"))))

    @property
    def seen(self) -> np.ndarray:
        """(n,) which directions are determined."""
        flags: np.ndarray = self.singular > RANK * max(
            float(self.singular.max(initial=0.0)), 1e-300
        )
        return flags

    @property
    def null_space(self) -> Floats:
        """(k, n) unit directions that are not, in values over `scale`."""
        rows: Floats = self.directions[~self.seen]
        return rows

    @property
    def covariance(self) -> Floats:
        """(n, n) over what is determined, in the unknowns' own units."""
        covariance: Floats = self.root @ self.root.T
        return covariance

    @property
    def root(self) -> Floats:
        """(n, r) whose product with its transpose is the covariance."""
        rows = self.directions[self.seen] / self.singular[self.seen, np.newaxis] * self.scale
        columns: Floats = rows.T
        return columns

    def faint(self, extent: Floats, share: float) -> Floats:
        """(k, n) directions, in the unknowns' own units, that are hardly determined.

        One standard uncertainty along them is more than `share` of `extent` (n,) of an unknown: a
        model that is linear over such a way is none, and a search does not come to its end.
        """
        steps = self.directions * self.scale
        lengths = np.abs(steps / extent).max(axis=1, initial=0.0)
        rows: Floats = steps[lengths > share * self.singular]
        return rows

    def gauge_rows(self, extent: Floats | None = None, *, own_scale: bool = True) -> Floats:
        """(k, n) rows that hold what is not determined.

        With `extent` (n,), firmly: one standard uncertainty of a row is at most `FIRM` of it. Held
        is what is across all else in values over `scale`, or, where not `own_scale`, over `extent`:
        a scale that faint columns gave says nothing once the machine has moved.
        """
        firmness = np.full(len(self.null_space), HELD * float(self.singular.max(initial=1.0)))
        rows: Floats = firmness[:, np.newaxis] * self.null_space / self.scale
        if extent is None:
            return rows
        steps = self.null_space * self.scale / extent
        lengths = np.abs(steps).max(axis=1, initial=0.0)
        loose = lengths > FIRM * firmness
        rows[loose] *= (lengths / (FIRM * firmness))[loose, np.newaxis]
        if not own_scale:
            rows[loose] = steps[loose] / (FIRM * lengths[loose, np.newaxis] * extent)
        return rows


def whitened(problem: IdentificationProblem, values: Floats) -> Floats:
    """(m, n) derivatives of the readings over their uncertainties.

    Raises `RequestError` (no-fit) where a pose of the machine with these values cannot be solved.
    """
    every = np.ones(problem.measurements.n_observation, np.bool_)
    return whitened_jacobian(problem, values, problem.jacobian(values), every)


def whitened_jacobian(
    problem: IdentificationProblem, values: Floats, jacobian: Floats, counted: Flags
) -> Floats:
    """The same of a Jacobian that is there; zero where a reading does not count and has none."""
    if not np.isfinite(jacobian[counted]).all():
        status = problem.status(values)
        rows = np.flatnonzero(status)
        raise no_fit(problem, "a pose of it cannot be solved or is singular", rows)
    slope: Floats = jacobian / problem.measurements.uncertainty[:, np.newaxis]
    return np.where(np.isfinite(slope).all(axis=1, keepdims=True), slope, 0.0)


def no_fit(problem: IdentificationProblem, reason: str, rows: np.ndarray) -> RequestError:
    """What is said where no machine explains the measurements; `rows`: those at fault."""
    measurements = problem.measurements
    line = int(measurements.lines[rows[0]]) if rows.size and measurements.lines[rows[0]] else None
    return RequestError(
        Problem(
            "no-fit",
            f"no machine was found that explains the measurements: {reason}",
            measurements.file or None,
            line,
            found=f"{rows.size} such rows" if rows.size else "a search that does not settle",
            expected="measurements of this machine, near its nominal geometry",
            hint="look at the suspicions, at the units and at the frame of the instrument",
        )
    )
