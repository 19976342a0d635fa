"""What measurements determine: the evidence that changes when some are added."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Literal

import numpy as np

from truepose.arrays import Floats
from truepose.calibration.acceptance import sentences
from truepose.calibration.acceptance.observability import (
    Observability,
    RowCovariance,
    WhitenedRows,
    fitted,
    normalised_rms,
    observability,
    prior,
    prior_rows,
    project_out_instruments,
    row_covariance,
    stacked,
    weighted,
)
from truepose.calibration.acceptance.reasons import HeldOut, Reason, ToolSize, at_worst_pose
from truepose.calibration.acceptance.tool_uncertainty import Considered, Tool, ToolUncertainty
from truepose.calibration.least_squares import singular_decomposition
from truepose.representation import Represented

if TYPE_CHECKING:
    from truepose.calibration.identification.unknowns import Unknowns


POOR = 1e-3
"""Of the largest singular value: below it a direction is weak, where there is no tolerance."""

Kind = Literal["unseen", "weak", "gauge", "harmless"]


@dataclass(frozen=True, eq=False, repr=False)
class Direction(Represented):
    """A direction (n_machine,) over the machine's unknowns that the data leave open.

    `kind`: "unseen" and it moves the tool; "weak", the data say less than the tolerances do;
    "gauge", the whole machine in an instrument's unknown frame; "harmless", the tool does not move.
    `members`: names of the unknowns with a part in it.
    """

    kind: Kind
    effects: Floats
    members: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Outcome:
    """What the measured rows lead to: what they determine, and what the tool is then known to.

    `moving` (k, n): directions that neither data nor prior determine and that move the tool, for
    people; `unseen` and `weak` (k, n): such that the data do not see, or hardly, for people too,
    the latter against the tolerances where `within`. `still` (k, n): standard uncertainties along
    those weak ones that do nothing at the tool. `before` and `after` count the tolerances that were
    `considered`, too.
    """

    data: RowCovariance
    used: RowCovariance
    directions: tuple[Direction, ...]
    moving: Floats
    unseen: Floats
    weak: Floats
    within: bool
    still: Floats
    before: ToolUncertainty | None
    after: ToolUncertainty
    relative: bool
    considered: Considered | None = None

    @property
    def open(self) -> tuple[tuple[Floats, bool], ...]:
        """The directions that the data leave open, each with whether within the tolerances."""
        return (self.unseen, False), (self.weak, self.within)

    def with_considered(self, considered: Considered | None) -> Outcome:
        """With the tolerances that were not identified, which matter where nothing is open."""
        if considered is None or len(self.moving):
            return self
        return replace(
            self,
            before=considered.before,
            after=considered.after,
            relative=self.relative or considered.relative,
            considered=considered,
        )


@dataclass(frozen=True, eq=False)
class Case:
    """Everything that does not change when measurements are added."""

    unknowns: Unknowns
    values: Floats
    rows: Floats
    factor: Floats  # (<= n, n) triangle of the rows, their uncertainties multiplied by `birge`
    weights: Floats
    rms: float
    degrees: float
    use_prior: bool
    tool: Tool
    by: str
    nominal: Floats
    measured: tuple[float | None, float | None]
    target: tuple[float | None, float | None]
    margin: float
    held_out: tuple[HeldOut, ...]
    prior_rows: Floats = field(repr=False)  # (k, n)

    @classmethod
    def of(
        cls,
        unknowns: Unknowns,
        *,
        values: Floats,
        jacobian: Floats,
        residual: Floats,
        weights: Floats,
        use_prior: bool,
        tool: Tool,
        by: str,
        nominal: Floats,
        measured: tuple[float | None, float | None],
        target: tuple[float | None, float | None],
        margin: float,
        held_out: tuple[HeldOut, ...] = (),
        noise: tuple[float, float] | None = None,
    ) -> Case:
        """Raises `ValueError` for arrays whose shapes do not fit."""
        n, n_machine = len(unknowns.names), unknowns.n_machine
        shapes = {
            "values": (values.shape, (n,)),
            "the Jacobian": (jacobian.shape, (residual.size, n)),
            "the weights": (weights.shape, residual.shape),
            "the tool's sensitivity": (tool.effects.shape[2:], (n_machine,)),
        }
        for name, (shape, expected) in shapes.items():
            if shape != expected:
                raise ValueError(f"{name}: shape {shape}, expected {expected}")
        for name, array in (("the Jacobian", jacobian), ("the residuals", residual)):
            if not np.isfinite(array).all():
                raise ValueError(f"{name}: not finite")
        rows = weighted(jacobian, weights)
        held = prior_rows(unknowns.known_beforehand(tolerances=use_prior))
        if noise is None:
            degrees = float(np.count_nonzero(weights)) - fitted(rows, held)
            noise = (normalised_rms(residual, weights, degrees), degrees)
        rms, degrees = noise
        birge = max(1.0, rms) if np.isfinite(rms) else 1.0
        triangle = np.linalg.qr(rows / birge, mode="r") if rows.shape[0] > n else rows / birge
        return cls(
            unknowns, values, rows, np.asarray(triangle, np.float64), weights, rms, degrees,
            use_prior, tool, by, nominal, measured, target, margin, held_out, held,
        )  # fmt: skip

    @property
    def n(self) -> int:
        """How many unknowns are the machine's."""
        return self.unknowns.n_machine

    @property
    def birge(self) -> float:
        """Factor on the data's uncertainties, one or more."""
        return max(1.0, self.rms) if np.isfinite(self.rms) else 1.0

    @cached_property
    def labels(self) -> tuple[str, ...]:
        """Of the machine's unknowns."""
        return self.unknowns.labels[: self.n]

    @cached_property
    def prior(self) -> Floats:
        """(n, n) of the machine's unknowns."""
        return np.asarray(self.unknowns.prior_covariance, np.float64)[: self.n, : self.n]

    @cached_property
    def sigma(self) -> Floats:
        """Prior standard deviations (n,), inf where there is none."""
        sigma: Floats = np.sqrt(np.diagonal(self.prior))
        return sigma

    @cached_property
    def observability(self) -> Observability:
        """Of the data as their uncertainties are stated."""
        whole = np.vstack([self.rows, self.instrument_rows])
        rows = project_out_instruments(whole, self.n, self.sigma)
        return observability(rows, int(np.count_nonzero(self.weights > 0.0)), self.sigma)

    @cached_property
    def half(self) -> Floats:
        """Half bands of the tolerances (n,), NaN where there is none."""
        half = np.asarray(self.unknowns.half, np.float64)[: self.n]
        return np.where(np.isfinite(half), half, np.nan)

    @cached_property
    def instrument_rows(self) -> Floats:
        """(k, n) whitened rows of what is known of the instruments beforehand."""
        return prior_rows(self.unknowns.known_beforehand(tolerances=False))

    def machine_rows(self, extra: Floats | None) -> WhitenedRows:
        """What the data say of the machine's unknowns, their uncertainties times `birge`."""
        parts = [self.factor] if extra is None else [self.factor, extra]
        parts.append(self.instrument_rows)
        return project_out_instruments(np.vstack(parts), self.n, self.sigma)

    def outcome(self, extra: Floats | None = None) -> Outcome:
        """With `extra` (k, n) whitened rows, or as it is."""
        rows = self.machine_rows(extra)
        data = row_covariance(rows)
        used = row_covariance(stacked(rows, prior(self.prior))) if self.use_prior else data
        seen = self.observability if extra is None else observability(rows, 0, self.sigma)
        free = self.unknowns.prior_mean.size > self.n
        of_data = self.tool.sort(data, with_gauge=free)
        tool = self.tool.relative(of_data.gauge)
        moving = self.tool.sort(used, with_gauge=free).moving
        before = tool.beforehand(self.prior)
        after = tool.uncertainty(used.root, moving)
        weak, still = self._weak(seen, rows, tool, before)
        unit = seen.unit
        unseen = _sparse(of_data.moving / unit)
        groups: tuple[tuple[Kind, Floats], ...] = (
            ("unseen", unseen),
            ("weak", weak),
            ("gauge", _sparse(of_data.gauge / unit)),
            ("harmless", _sparse(of_data.harmless / unit)),
        )
        directions = tuple(
            Direction(
                kind,
                direction * unit,
                tuple(self.unknowns.names[i] for i in sentences.members(direction)),
            )
            for kind, group in groups
            for direction in group
        )
        return Outcome(
            data, used, directions, _sparse(moving / unit), unseen, weak, seen.scaling == "prior",
            still, before, after, len(of_data.gauge) > 0,
        )  # fmt: skip

    def reason(self, code: str, **values: object) -> Reason:
        """A reason in the machine's units."""
        return Reason(code, values, self.unknowns.shown)

    def open(self, *groups: tuple[Floats, bool]) -> dict[str, object]:
        """Values of a reason: directions (k, n) left open, and whether within tolerances."""
        return {"open": groups, "labels": self.labels, "by": self.by}

    def _weak(
        self, seen: Observability, rows: WhitenedRows, tool: Tool, before: ToolUncertainty | None
    ) -> tuple[Floats, Floats]:
        """Directions (k, n) that are seen but of which the data say too little.

        Those that move the tool, scaled and sparse; and standard uncertainties along the others.
        """
        with_noise, right = singular_decomposition(rows.matrix * seen.unit)
        lengths = 1.0 / seen.unit
        kept = range(seen.rank)
        if seen.scaling == "prior":
            chosen = [i for i in kept if with_noise[i] < 1.0]
        else:
            limit = self.margin * before.position_max if before is not None else self.measured[0]
            chosen = []
            for i in kept:
                if limit is not None:
                    step = right[i] * seen.unit / max(with_noise[i], 1e-300)
                    if tool.size_of(step) > limit:
                        chosen.append(i)
                elif with_noise[i] < POOR * with_noise[0]:
                    chosen.append(i)
        moving = [i for i in chosen if tool.moves(right[i] * seen.unit, lengths)]
        still = [i for i in chosen if i not in moving]
        steps = right[still] * seen.unit / np.maximum(with_noise[still], 1e-300)[:, np.newaxis]
        if not moving:
            return right[moving], steps
        return sentences.clustered(right[moving], with_noise[moving]), steps

    def reference(self, before: ToolUncertainty | None) -> tuple[float | None, float | None]:
        """What the tool is known to before, position and rotation, at the worst pose."""
        return self.measured if before is None else before.worst

    def sizes(self, outcome: Outcome) -> list[ToolSize]:
        """The tool at the worst pose, of which something is known before."""
        return [
            size
            for size in at_worst_pose(outcome.after.worst, self.reference(outcome.before))
            if size.before is not None and (size.before > 0.0 or size.after > 0.0)
        ]

    def gained_share(self, outcome: Outcome) -> float:
        """Share of the tool's variance that the data take away, of what is commanded; NaN: unknown.

        1 - largest after / largest before, each the trace at its worst pose.
        """
        before = outcome.before and outcome.before.largest_variance(self.tool.length)
        return 1.0 - outcome.after.largest_variance(self.tool.length) / before if before else np.nan

    def keeps_target(self, outcome: Outcome) -> bool:
        """Whether something is asked, and the machine as filed is known to keep it."""
        asked = [
            (most, size)
            for most, size in zip(self.target, self.reference(outcome.before), strict=True)
            if most is not None
        ]
        return bool(asked) and all(size is not None and size <= most for most, size in asked)


def _sparse(directions: Floats) -> Floats:
    return sentences.sparse(directions) if len(directions) else directions
