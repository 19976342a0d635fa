"""Whether a machine changed between two machine files of it, such as two dated calibrations.

Parameter by parameter and at the tool, with what both files say of their uncertainty: the bands of
their tolerances. The two are taken to be independent. Where both rest on the same tolerances, or
share measurements, their difference is less uncertain than that: of machines that did not change
far fewer than `ALPHA` are then said to have changed, and small changes are missed.

    difference = new - old,    covariance = covariance of old + covariance of new

Two tests are made, each with half of the probability, at most `ALPHA`, that a machine which did
not change is said to have changed: every parameter by itself (its share of the probability by
Bonferroni), and all together by difference^T covariance^-1 difference, a chi-square, which also
sees what shows only in how parameters differ with each other. What is not determined has a wide
band, and decides nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from truepose.arrays import Floats
from truepose.calibration.result.bands import tolerance_covariance
from truepose.calibration.result.directions import (
    deviation_jacobian,
    deviation_of,
    direction_at,
    directions,
)
from truepose.errors import Problem, RequestError
from truepose.files.shown_units import Shown, ShownUnits
from truepose.machine import Machine
from truepose.probability.quantiles import normal_quantile
from truepose.runs.poses import PoseRun, SkippedPoses, no_pose_left, requested_poses
from truepose.version import version

if TYPE_CHECKING:
    import xarray as xr

ALPHA = 0.05
"""Probability that a machine that did not change is said to have changed, at most."""

_ROUNDING = 1e-12
"""Of the number of parameters: an eigenvalue so small, of a correlation matrix, is zero."""

_CERTAIN = 1e-3
"""Standard deviations from which a difference counts as a change where no file is uncertain."""

_EXACT = 1e-12
"""Relative to a parameter: a smaller difference is rounding."""

_ROUNDED = 1e-15
"""m, rad: the same for parameters near zero, of which a relative size says nothing."""

_TURNED = 0.5
"""Cosine of the angle by which a direction may have turned."""

_QUANTITIES = {"position": "m", "orientation": "rad"}
_NAMED = 3
"""Parameters that the verdict names; more are counted."""


@dataclass(frozen=True)
class _Change:
    """What changed of the parameters (n,): both estimates, their uncertainties, and both tests."""

    old: Floats
    new: Floats
    old_uncertainty: Floats
    new_uncertainty: Floats
    covariance: Floats
    normalised: Floats
    limit: float
    chi_square: float
    dof: int
    probability: float

    @property
    def each(self) -> np.ndarray:
        """(n,) which changed, each for itself."""
        return np.asarray(np.abs(self.normalised) > self.limit)

    @property
    def changed(self) -> bool:
        """Whether the machine changed."""
        return bool(self.each.any()) or self.probability < 0.5 * ALPHA


def compare(old: Machine, new: Machine, poses: ArrayLike | None = None) -> xr.Dataset:
    """Compare two machine files of one machine, SI.

    `poses` (..., n_commanded): where the tool is looked at, by default the workspace of `old`.
    The estimate of a parameter is its nominal value and the middle of its band; a direction's tilts
    are those from the old axis. `displacement` (pose, component) is what the change does to the
    tool: commanded by the old estimate, where the new one goes, exactly; `displacement_uncertainty`
    is first order. `moved` and `moved_uncertainty` (pose, quantity): its length, and its
    uncertainty along itself. The attribute `changed` is the answer, `verdict` a sentence of it.

    Raises `RequestError` (not-the-same-machine, bad-poses, no-workspace, no-pose-left).
    """
    _require_same(old, new)
    before, after, change = _change(old, new)
    requested = requested_poses(old, poses)
    run = PoseRun(before, requested, old.condition)
    columns = np.arange(len(old.parameters))
    blocks = []
    for block in run:
        kernel = after.kernel
        displacement, solved = kernel.displacement(
            block.joints, block.placements, columns[:1], np.zeros((1, 1))
        )
        usable = run.keep(block.indices, solved)
        slopes, _ = before.kernel.sensitivity_at(block.joints, block.placements, columns)
        covariance = slopes[usable] @ change.covariance @ slopes[usable].transpose(0, 2, 1)
        blocks.append((block.indices[usable], displacement[usable], covariance))
    if not sum(len(indices) for indices, _, _ in blocks):
        raise no_pose_left(before, requested, run.left_out.counts(), of_file=poses is None)
    indices, displacement, covariance = (
        np.concatenate(parts) for parts in zip(*blocks, strict=True)
    )
    return _dataset(old, new, change, requested, run.left_out, indices, displacement, covariance)


def _require_same(old: Machine, new: Machine) -> None:
    """Raise where the two are not the same machine with other numbers."""
    for what in ("dof", "commanded", "joints", "parameters"):
        first, second = getattr(old, what), getattr(new, what)
        if first != second:
            lacking = sorted(set(first) ^ set(second)) or list(first)
            raise _not_same(old, new, f"their {what} differ: {', '.join(lacking[:6])}")
    kinds = [[(drive.name, drive.kind) for drive in machine.drives] for machine in (old, new)]
    if kinds[0] != kinds[1]:
        raise _not_same(old, new, "their drives are of other kinds")


def _not_same(old: Machine, new: Machine, why: str) -> RequestError:
    return RequestError(
        Problem(
            "not-the-same-machine",
            f"{old.file} and {new.file} do not describe the same machine",
            new.file,
            found=why,
            expected="two files of one machine, with other values",
        )
    )


def _change(old: Machine, new: Machine) -> tuple[Machine, Machine, _Change]:
    """Both machines at their estimates, and what differs, in the old one's axes."""
    was, now = tolerance_covariance(old), tolerance_covariance(new)
    values = [machine.nominal + what.shift for machine, what in ((old, was), (new, now))]
    names = old.parameters
    before, after = (
        machine.replace(dict(zip(names, map(float, estimate), strict=True)))
        for machine, estimate in zip((old, new), values, strict=True)
    )
    effects, old_values, new_values = now.effects.copy(), values[0], values[1].copy()
    for was_along, now_along in zip(directions(old), directions(new), strict=True):
        at = list(was_along.columns)
        if np.array_equal(was_along.axis, now_along.axis):
            continue
        along = direction_at(now_along.axis, new_values[at])
        if was_along.axis @ along < _TURNED:
            where = f"{was_along.table}.{was_along.part}.{was_along.key}"
            raise _not_same(old, new, f"{where} points quite another way")
        effects[at] = (
            deviation_jacobian(now_along.axis, new_values[at], was_along.axis) @ effects[at]
        )
        new_values[at] = deviation_of(was_along.axis, along)
    after_covariance = effects @ now.correlation @ effects.T
    return before, after, _tested(old_values, new_values, was.covariance, after_covariance)


def _tested(old: Floats, new: Floats, was: Floats, now: Floats) -> _Change:
    difference = new - old
    scale = np.maximum(np.abs(old), np.abs(new))
    difference[np.abs(difference) <= _EXACT * scale + _ROUNDED] = 0.0
    covariance = was + now
    deviation = np.sqrt(np.diagonal(covariance))
    scaled = np.where(deviation > 0.0, deviation, 1.0)
    moved = difference != 0.0
    normalised = np.zeros(len(difference))
    np.divide(difference, deviation, out=normalised, where=deviation > 0.0)
    normalised[moved & (deviation == 0.0)] = np.inf
    banded = np.flatnonzero(deviation)
    compared = int(np.count_nonzero(moved | (deviation > 0.0)))
    limit = float(normal_quantile(1.0 - 0.25 * ALPHA / max(compared, 1)))
    correlation = (covariance / np.outer(scaled, scaled))[np.ix_(banded, banded)]
    chi_square, dof, certain = _chi_square(normalised[banded], correlation)
    certain = certain or bool(np.isinf(normalised).any())
    return _Change(
        old,
        new,
        np.sqrt(np.diagonal(was)),
        np.sqrt(np.diagonal(now)),
        covariance,
        normalised,
        limit,
        chi_square,
        dof,
        0.0 if certain else chi_square_tail(chi_square, dof),
    )


def _chi_square(normalised: Floats, correlation: Floats) -> tuple[float, int, bool]:
    """Sum of squares of independent parts, how many, and whether one without uncertainty moved."""
    if normalised.size == 0:
        return 0.0, 0, False
    values, vectors = np.linalg.eigh(correlation)
    along = vectors.T @ normalised
    known_part = values > _ROUNDING * len(values)
    chi_square = float(np.sum(np.square(along[known_part]) / values[known_part]))
    certain = bool((np.abs(along[~known_part]) > _CERTAIN).any())
    return chi_square, int(np.count_nonzero(known_part)), certain


def chi_square_tail(value: float, dof: int) -> float:
    """Probability that a chi-square variable of whole `dof` degrees of freedom is above `value`.

    M. Abramowitz, I. A. Stegun, Handbook of Mathematical Functions, 26.4.4 and 26.4.5.
    """
    if value <= 0.0 or dof <= 0:
        return 1.0
    half = 0.5 * value
    odd = dof % 2 == 1
    total = math.erfc(math.sqrt(half)) if odd else 0.0
    start = 0.5 if odd else 0.0
    for step in range(dof // 2):
        power = start + step
        total += math.exp(power * math.log(half) - half - math.lgamma(power + 1.0))
    return min(total, 1.0)


def _dataset(
    old: Machine,
    new: Machine,
    change: _Change,
    requested: Floats,
    left_out: SkippedPoses,
    indices: np.ndarray,
    displacement: Floats,
    covariance: Floats,
) -> xr.Dataset:
    import xarray as xr

    turning = np.array([name.startswith("r") for name in old.components])
    uncertainty = np.sqrt(np.maximum(np.einsum("ncc->nc", covariance), 0.0))
    sizes, along = [], []
    chosen = [(name, part) for name, part in zip(_QUANTITIES, (~turning, turning), strict=True)]
    chosen = [(name, part) for name, part in chosen if part.any()]
    for _, part in chosen:
        size, deviation = _along(displacement[:, part], covariance[:, part][:, :, part])
        sizes.append(size)
        along.append(deviation)
    component = ["rad" if turns else "m" for turns in turning]
    numbers, status = left_out.sorted()
    n = ("parameter",)
    data = {
        "old": (n, change.old, "parameter", "value in the old file, middle of its band"),
        "new": (n, change.new, "parameter", "value in the new file"),
        "difference": (n, change.new - change.old, "parameter", "new less old"),
        "old_uncertainty": (n, change.old_uncertainty, "parameter", "standard, of the old file"),
        "new_uncertainty": (n, change.new_uncertainty, "parameter", "standard, of the new file"),
        "standard_uncertainty": (
            n,
            np.sqrt(np.diagonal(change.covariance)),
            "parameter",
            "of the difference, the files independent",
        ),
        "normalised_difference": (
            n,
            change.normalised,
            "1",
            "difference divided by its standard uncertainty",
        ),
        "parameter_changed": (n, change.each, "1", "whether it changed, judged for itself"),
        "displacement": (
            ("pose", "component"),
            displacement,
            "component",
            "what the change does to the tool, exact",
        ),
        "displacement_uncertainty": (
            ("pose", "component"),
            uncertainty,
            "component",
            "standard uncertainty of it, first order",
        ),
        "moved": (("pose", "quantity"), np.stack(sizes, -1), "quantity", "size of displacement"),
        "moved_uncertainty": (
            ("pose", "quantity"),
            np.stack(along, -1),
            "quantity",
            "standard uncertainty along the displacement",
        ),
    }
    made = {}
    for name, (dims, values, units, text) in data.items():
        attrs = {"units": units, "long_name": text}
        if units in ("parameter", "component", "quantity"):
            attrs = {"units_by": f"{units}_units", "long_name": text}
        made[name] = xr.Variable(dims, values, attrs)
    quantities = [name for name, _ in chosen]
    coordinates: dict[str, object] = {
        "parameter": list(old.parameters),
        "parameter_units": ("parameter", list(old.units)),
        "pose": indices,
        "component": list(old.components),
        "component_units": ("component", component),
        "quantity": quantities,
        "quantity_units": ("quantity", [_QUANTITIES[name] for name in quantities]),
        "left_out_index": ("left_out", numbers),
        "left_out_status": ("left_out", np.asarray(status, object)),
    }
    for at, name in enumerate(old.commanded):
        unit = {"units": "m" if name in "xyz" else "rad"}
        coordinates[f"pose_{name}"] = ("pose", requested[indices, at], unit)
        coordinates[f"left_out_{name}"] = ("left_out", requested[numbers, at], unit)
    dataset = xr.Dataset(made, coordinates)
    dataset.attrs = {
        "truepose_version": version(),
        **_provenance("old", old),
        **_provenance("new", new),
        "alpha": ALPHA,
        "parameter_limit": change.limit,
        "chi_square": change.chi_square,
        "chi_square_dof": change.dof,
        "chi_square_probability": change.probability,
        "changed": int(change.changed),
        "poses_used": len(indices),
        "poses_left_out": len(numbers),
    }
    dataset.attrs["verdict"] = verdict(dataset, old.shown)
    return dataset


def _along(displacement: Floats, covariance: Floats) -> tuple[Floats, Floats]:
    """Length (n,) of displacements (n, k), and their standard uncertainty along themselves."""
    size = np.linalg.norm(displacement, axis=1)
    unit = np.divide(
        displacement,
        size[:, np.newaxis],
        out=np.zeros_like(displacement),
        where=size[:, np.newaxis] > 0.0,
    )
    variance = np.einsum("nc,ncd,nd->n", unit, covariance, unit)
    # What does not move has no direction: the largest uncertainty of any.
    largest = np.linalg.eigvalsh(covariance)[:, -1]
    return size, np.sqrt(np.maximum(np.where(size > 0.0, variance, largest), 0.0))


def _provenance(which: str, machine: Machine) -> dict[str, str]:
    made = machine.calibration
    return {
        f"{which}_file": machine.file,
        f"{which}_hash": machine.file_hash,
        f"{which}_date": "" if made is None else made.date,
        f"{which}_data": "" if made is None else made.data,
        f"{which}_data_hash": "" if made is None else made.data_hash,
        f"{which}_warning": "" if made is None else "; ".join(made.warning),
    }


def verdict(dataset: xr.Dataset, units: ShownUnits) -> str:
    """One sentence on what `compare` found, for people."""
    if not dataset.attrs["changed"]:
        normalised = np.abs(dataset["normalised_difference"].values)
        largest = int(normalised.argmax())
        if not normalised[largest]:
            return "No change beyond uncertainty: no parameter differs."
        name = str(dataset["parameter"].values[largest])
        return (
            f"No change beyond uncertainty: {name} differs most, by {normalised[largest]:.2g} "
            f"standard uncertainties; {_allowed(dataset, units)}."
        )
    tool = _at_tool(dataset, units)
    flags = dataset["parameter_changed"].values
    if not flags.any():
        return (
            "The machine changed: no parameter stands out by itself, but all together differ by "
            f"more than their uncertainty (chi-square {dataset.attrs['chi_square']:.4g} of "
            f"{dataset.attrs['chi_square_dof']}); {tool}."
        )
    order = np.argsort(-np.abs(dataset["normalised_difference"].values), kind="stable")
    order = order[: int(flags.sum())]
    parts = [
        _amount(
            str(dataset["parameter"].values[at]),
            float(dataset["difference"].values[at]),
            float(dataset["standard_uncertainty"].values[at]),
            units.small(str(dataset["parameter_units"].values[at])),
        )
        for at in order[:_NAMED]
    ]
    more = f" and {len(order) - _NAMED} more" if len(order) > _NAMED else ""
    return f"The machine changed: {', '.join(parts)}{more}; {tool}."


def _amount(name: str, value: float, deviation: float, unit: Shown) -> str:
    sign = "\N{PLUS-MINUS SIGN}"
    change, twice = unit.per_si * value, 2.0 * unit.per_si * deviation
    return f"{name} by {change:.4g} {unit.label} ({sign} {twice:.2g})"


def _allowed(dataset: xr.Dataset, units: ShownUnits) -> str:
    """How far the files differ at the tool, and how likely that is without a change."""
    likely = float(dataset.attrs["chi_square_probability"])
    return (
        f"the two files differ at the tool by up to {_largest(dataset, units)}, which is within "
        "their uncertainties: without a change all parameters together differ as much in "
        f"{100.0 * likely:.3g} % of cases"
    )


def _at_tool(dataset: xr.Dataset, units: ShownUnits) -> str:
    verb = "moves" if dataset["quantity"].values[0] == "position" else "turns"
    return f"the tool {verb} by up to {_largest(dataset, units)}"


def _largest(dataset: xr.Dataset, units: ShownUnits) -> str:
    """What the difference does to the tool at the worst pose: a size, (its uncertainty, k = 2)."""
    unit = units.error(str(dataset["quantity"].values[0]))
    sizes = dataset["moved"].values[:, 0]
    at = int(sizes.argmax())
    deviation = float(dataset["moved_uncertainty"].values[at, 0])
    sign = "\N{PLUS-MINUS SIGN}"
    size, twice = unit.per_si * sizes[at], 2.0 * unit.per_si * deviation
    return f"{size:.4g} {unit.label} ({sign} {twice:.2g}, k = 2)"
