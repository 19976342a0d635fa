"""What measurements determine: the part of the verdict that changes when some are added."""

from __future__ import annotations

from dataclasses import dataclass, field
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
from truepose.calibration.acceptance.tool_uncertainty import Tool, ToolUncertainty
from truepose.calibration.least_squares import singular_decomposition

if TYPE_CHECKING:
    from truepose.calibration.identification.unknowns import Unknowns


POOR = 1e-3
"""Of the largest singular value: below it a direction is weak, where there is no tolerance."""
NOTHING = 100.0
"""Half bands of a tolerance: a larger uncertainty is said in words, not as a number."""
ROUNDING = 1e-6
"""Relative: an uncertainty that is larger by no more than this is not larger."""

Kind = Literal["unseen", "weak", "gauge", "harmless"]


@dataclass(frozen=True)
class Reason:
    """A reason against the calibration, or a warning: code, and sentence without its full stop."""

    code: str
    sentence: str


@dataclass(frozen=True, eq=False)
class Direction:
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
    """What the measured rows lead to: (a), (b) and (e) of the verdict."""

    data: RowCovariance
    used: RowCovariance
    directions: tuple[Direction, ...]
    sentences: tuple[str, ...]
    before: ToolUncertainty | None
    after: ToolUncertainty
    relative: bool
    reasons: tuple[Reason, ...]


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
            use_prior, tool, by, nominal, measured, target, margin, held,
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
        not_seen = sentences.undetermined(unseen, self.labels, self.by)
        within = seen.scaling == "prior"
        hardly = sentences.undetermined(weak, self.labels, self.by, within_tolerances=within)
        reasons = []
        if len(moving):
            text = "; ".join(sentences.undetermined(_sparse(moving / unit), self.labels, self.by))
            reasons.append(Reason("not-determined", text))
        if hardly and not self.use_prior:
            reasons.append(Reason("not-told-apart", "; ".join(hardly)))
        if not self.use_prior:
            reasons += self._too_loose(data, still)
        if not len(moving):
            reasons += self._no_gain(before, after)
        return Outcome(
            data, used, directions, (*not_seen, *hardly), before, after,
            len(of_data.gauge) > 0, tuple(reasons),
        )  # fmt: skip

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

    def _too_loose(self, data: RowCovariance, still: Floats) -> list[Reason]:
        """(e): what is found is less certain than what was known of it before."""
        # Without the parts in null directions, of which those that matter are a reason of their
        # own, and without those that do nothing at the tool.
        variance = np.einsum("ij,ij->i", data.root, data.root)
        left = np.maximum(variance - (still**2).sum(axis=0), 0.0)
        own: Floats = np.sqrt(np.where(left > ROUNDING * variance, left, 0.0))
        with np.errstate(invalid="ignore"):
            ratio = np.where(np.isfinite(self.sigma), own / self.sigma, 0.0)
        loose = [int(i) for i in np.argsort(-ratio, kind="stable") if ratio[i] > 1.0]
        if not loose:
            return []
        at, unit, units = loose[0], self.unknowns.units[loose[0]], self.unknowns.shown
        half, sigma = float(self.half[at]), float(self.sigma[at])
        if np.isfinite(half) and own[at] > half:
            known = f"its tolerance is {sentences.stated(half, unit, units)}"
        else:
            known = f"its tolerance already to {sentences.quantity(sigma, unit, units=units)}"
        uncertainty = sentences.quantity(own[at], unit, units=units)
        text = f"the measurements determine {self.labels[at]} only to {uncertainty}, {known}"
        if np.isfinite(half) and own[at] > NOTHING * half:
            tolerance = sentences.stated(half, unit, units)
            text = (
                f"the measurements say almost nothing about {self.labels[at]}, "
                f"its tolerance is {tolerance}"
            )
        if len(loose) > 1:
            others = "one more unknown is" if len(loose) == 2 else f"{len(loose) - 1} more are"
            text += f" ({others} less certain than the tolerance, too)"
        return [Reason("less-than-tolerance", text)]

    def reference(self, before: ToolUncertainty | None) -> tuple[float | None, float | None]:
        """What the tool is known to before, position and rotation, at the worst pose."""
        return self.measured if before is None else before.worst

    def _no_gain(self, before: ToolUncertainty | None, after: ToolUncertainty) -> list[Reason]:
        """(b): the tool is not known better than before."""
        compared = [
            (name, unit, size, was)
            for (name, unit, size, _), was in zip(
                at_worst_pose(after, None), self.reference(before), strict=True
            )
            if was is not None and (was > 0.0 or size > 0.0)
        ]
        worse = [row for row in compared if row[2] > (1.0 + ROUNDING) * row[3]]
        gained = any(size <= self.margin * was for _, _, size, was in compared)
        if not compared or (gained and not worse):
            return []
        shown, units = worse or compared, self.unknowns.shown
        whose = "of the machine as filed" if before is not None else "measured before"
        texts = [
            f"{name} by {sentences.quantity(size, unit, units=units)}, against "
            f"{sentences.quantity(was, unit, units=units)} {whose}"
            for name, unit, size, was in shown
        ]
        texts[0] = texts[0].replace(" by ", " would be uncertain by ", 1)
        text = f"at the worst pose of the workspace {', and '.join(texts)}"
        if self.keeps_target(before):
            text += "; but the machine as filed already keeps the accuracy that is asked"
        return [Reason("no-gain", text)]

    def keeps_target(self, before: ToolUncertainty | None) -> bool:
        """Whether the machine as filed keeps the accuracy that is asked of it."""
        return is_kept(self.target, self.reference(before))

    def lacks_only_gain(self, outcome: Outcome) -> bool:
        """Whether the only reason is a missing gain that nobody asked for."""
        only = {reason.code for reason in outcome.reasons} == {"no-gain"}
        return only and self.keeps_target(outcome.before)


def _sparse(directions: Floats) -> Floats:
    return sentences.sparse(directions) if len(directions) else directions


def is_kept(
    target: tuple[float | None, float | None], sizes: tuple[float | None, float | None]
) -> bool:
    """Whether something is asked of position or rotation, and the sizes are known to keep it."""
    pairs = [(asked, size) for asked, size in zip(target, sizes, strict=True) if asked is not None]
    return bool(pairs) and all(size is not None and size <= asked for asked, size in pairs)


def at_worst_pose(
    after: ToolUncertainty, before: ToolUncertainty | None
) -> list[tuple[str, str, float, float | None]]:
    """(name, unit, after, before) of position and rotation at the worst pose."""
    was = (None, None) if before is None else before.worst
    return [
        ("the tool's position", "m", after.position_max, was[0]),
        ("the tool's rotation", "rad", after.rotation_max, was[1]),
    ]
