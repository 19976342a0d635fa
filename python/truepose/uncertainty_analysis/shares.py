"""Shares: how much of the variance of the tool's error comes from which variable and source.

    first    what of the variance would go if the variable were known (Sobol's first-order index)
    total    what would stay if all others were known: it, and all that it has a part in
    linear   its part of the variance that first-order propagation gives
    shapley  the variance divided fairly; there where variables are correlated

With independent variables, `first` sums to at most one, `total` to at least one, and both are
`linear` where the error is linear. `shapley` lies between them and sums to one.

With correlated ones `first` and `total` are the same two conditional variances (Kucherenko et al.
2012), but no longer parts of a whole: `first` counts in what the variable says about those that it
is correlated with, `total` leaves it out, and may be the smaller. `linear` divides the linear
variance as covariances with the whole, a_i (C a)_i / (a' C a), a_i the standard uncertainty that
variable i brings, C the correlation: it sums to one, but may be negative. There `shapley` is the
share to quote. A source's index is that of all its variables changed at once, not a sum.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, overload

import numpy as np
from numpy.typing import ArrayLike

from truepose.arrays import Floats, Indices
from truepose.errors import Problem, RequestError
from truepose.machine import Condition, Machine
from truepose.runs.arguments import checked
from truepose.runs.dataset import Schema, Variable, component_units, label
from truepose.runs.poses import BAND, REASONS, Progress
from truepose.runs.quantities import quantities
from truepose.sources import PoseBlock
from truepose.uncertainty_analysis import shapley, sobol
from truepose.uncertainty_analysis.arguments import (
    required_probability,
    required_samples,
    required_seed,
)
from truepose.uncertainty_analysis.failed_samples import lost_text
from truepose.uncertainty_analysis.functions.dataset import function_dataset
from truepose.uncertainty_analysis.model import FunctionModel, Model, Models, models
from truepose.uncertainty_analysis.random_points import Drawing

if TYPE_CHECKING:
    import xarray as xr

    from truepose.uncertainty_analysis.functions.inputs import Correlation, Input

_EACH = ("pose", "parameter", "component")
_SOURCE = ("pose", "source", "component")

SCHEMA: Schema = {
    "first": Variable(_EACH, "1", "first-order Sobol index of the variable"),
    "total": Variable(_EACH, "1", "total Sobol index of the variable"),
    "linear": Variable(_EACH, "1", "share of the variable in the first-order variance"),
    "first_confidence": Variable(_EACH, "1", "half width of the confidence interval of first"),
    "total_confidence": Variable(_EACH, "1", "half width of the confidence interval of total"),
    "source_first": Variable(_SOURCE, "1", "first-order Sobol index of the source"),
    "source_total": Variable(_SOURCE, "1", "total Sobol index of the source"),
    "source_linear": Variable(_SOURCE, "1", "share of the source in the first-order variance"),
    "source_first_confidence": Variable(
        _SOURCE, "1", "half width of the confidence interval of source_first"
    ),
    "source_total_confidence": Variable(
        _SOURCE, "1", "half width of the confidence interval of source_total"
    ),
    "standard_deviation": Variable(
        ("pose", "component"), "component", "standard deviation of the error, sampled"
    ),
    "evaluations": Variable(("pose",), "1", "evaluations of the exact error", np.intp),
    "failed": Variable(
        ("pose",), "1", "base samples left out, the machine not closing at one of them", np.intp
    ),
}

CORRELATED: Schema = {
    "shapley": Variable(_EACH, "1", "Shapley share of the variable"),
    "shapley_confidence": Variable(_EACH, "1", "half width of the confidence interval of shapley"),
}
"""What there is besides `SCHEMA` where variables are correlated."""

MACHINE_SAMPLES = 256
"""Base samples of a machine, unless asked for: 11 000 evaluations a pose with 40 variables."""

FUNCTION_SAMPLES = 8192
"""Base samples of a plain function, which may be anything but nearly linear."""

ROUNDING = 1e-12
"""Standard deviation, in the machine's size or in the values of a function, that is rounding."""


@overload
def shares(
    model: Machine,
    poses: ArrayLike | None = None,
    condition: Condition | None = None,
    *,
    samples: int | None = None,
    seed: int = 0,
    confidence: float = 0.95,
    progress: Progress | None = None,
) -> xr.Dataset: ...


@overload
def shares(
    model: Callable[..., Any],
    poses: Mapping[str, Input] | None = None,
    *,
    inputs: Mapping[str, Input] | None = None,
    correlation: Correlation = None,
    samples: int | None = None,
    seed: int = 0,
    confidence: float = 0.95,
) -> xr.Dataset: ...


@checked
def shares(
    model: Machine | Callable[..., Any],
    poses: Any = None,
    condition: Condition | None = None,
    *,
    inputs: Mapping[str, Input] | None = None,
    correlation: Correlation = None,
    samples: int | None = None,
    seed: int = 0,
    confidence: float = 0.95,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Which variable and which source how much of the error's variance comes from.

    Of a machine: `poses` (..., n_commanded), SI, default the file's workspace; `condition`, default
    the file's; `progress` is called with (poses done, poses in all). Of a plain function: its
    `inputs`, as the second argument or by name, and their `correlation`.

    `samples` base samples are drawn, plain random (Philox), from `seed` and the variable alone: the
    same for all poses, whatever else acts. Each needs 2 + (variables) + (sources) exact errors,
    more where variables are correlated. `confidence` is the probability of the intervals whose half
    widths stand beside the indices (jackknife over base samples). A base sample at one point of
    which the machine does not close is left out as a whole and counted in `failed`; a pose with too
    few others is left out as `band`. Ctrl-C gives
    the poses done so far, if any, with the attribute `interrupted` at 1.

    The shares of a component that does not vary at a pose, such as one that no variable moves, are
    NaN: there is no variance to share. The Dataset is described in docs/results.md.

    Raises `RequestError`: bad-samples, bad-seed, bad-probability, nothing-varies,
    correlation-out-of-reach; bad-poses, no-workspace, no-source, no-pose-left; `TrueposeError` as
    the sources do.
    """
    plain = not isinstance(model, Machine)
    default = FUNCTION_SAMPLES if plain else MACHINE_SAMPLES
    plan = _Plan(
        required_samples(default if samples is None else samples, sobol.LEAST),
        required_seed(seed),
        required_probability(confidence),
    )
    if isinstance(model, Machine):
        return _of_machine(models(model, poses, condition, progress), plan)
    return _of_function(
        FunctionModel(model, poses if inputs is None else inputs, correlation), plan
    )


def over_position(dataset: xr.Dataset) -> xr.DataArray:
    """(parameter,) share of each variable in the variance of the tool's position, over all poses.

    The total index, or where variables are correlated the Shapley share; mean over components x, y,
    z and poses, weighed by the variance there. Of a machine that only turns, of its rotations; of a
    plain function, plain mean over its outputs. NaN where nothing varies.
    """
    shares = dataset["shapley" if "shapley" in dataset else "total"]
    if "component_units" in dataset.coords:
        components = tuple(str(name) for name in dataset["component"].values)
        chosen = next(iter(quantities(components).values()))
        shares = shares.isel(component=chosen)
        weight = dataset["standard_deviation"].isel(component=chosen) ** 2
    else:
        import xarray as xr

        weight = xr.ones_like(dataset["standard_deviation"])
    weight = weight.where(shares.notnull().all("parameter"), 0.0)
    over = [dim for dim in shares.dims if dim != "parameter"]
    whole = weight.sum()
    return (shares.fillna(0.0) * weight).sum(over) / whole.where(whole > 0.0)


def first_to_tighten(dataset: xr.Dataset) -> tuple[str, float]:
    """The variable with the largest share in the variance of the position, and that share.

    From a Dataset of `shares`; see `over_position`. Raises `RequestError` (nothing-varies).
    """
    totals = over_position(dataset)
    if bool(totals.isnull().all()):
        raise RequestError(_nothing_varies(str(dataset.attrs.get("machine_file", "")) or None))
    at = int(np.nanargmax(totals.values))
    return str(totals["parameter"].values[at]), float(totals.values[at])


@dataclass(frozen=True)
class _Plan:
    samples: int
    seed: int
    confidence: float

    @property
    def attrs(self) -> dict[str, Any]:
        return {"samples": self.samples, "seed": self.seed, "confidence": self.confidence}


@dataclass(frozen=True)
class _Variables:
    """What acts: names and sources of the causes, how to draw them, and the points drawn.

    A cause is what varies by itself (`Drawing.by_itself`): a variable, or a direction. The points
    are those of the machine, not of a pose: all poses share them.
    """

    names: tuple[str, ...]
    sources: tuple[str, ...]
    correlation: Floats | None
    drawing: Drawing
    plan: _Plan

    @classmethod
    def of(cls, model: Model, plan: _Plan) -> _Variables:
        drawing = Drawing(
            model.distributions,
            model.correlation,
            model.streams,
            model.numbers,
            model.names,
            plan.seed,
            model.directions,
        )
        first = [int(members[0]) for members in drawing.by_itself]
        return cls(
            tuple(model.names[at] for at in first),
            tuple(model.sources[at] for at in first),
            model.correlation,
            drawing,
            plan,
        )

    @cached_property
    def design(self) -> sobol.SobolDesign:
        """Points of the Sobol indices: of each cause, then of each source."""
        causes = self.drawing.by_itself
        together = [np.concatenate([causes[at] for at in of]) for of in self.sets.values()]
        return sobol.SobolDesign(
            self.drawing, [*causes, *together], self.plan.samples, self.plan.seed
        )

    @cached_property
    def walks(self) -> shapley.Walks:
        """Points of the Shapley shares."""
        return shapley.Walks(self.drawing, self.plan.samples, self.plan.seed)

    @cached_property
    def sets(self) -> dict[str, Indices]:
        """Numbers of the causes of each source."""
        of = np.array(self.sources)
        return {name: np.flatnonzero(of == name) for name in dict.fromkeys(self.sources)}


def _at_one_pose(model: Model, variables: _Variables, floor: Floats) -> dict[str, np.ndarray]:
    """Every variable of the schemas that there is, without its dim pose."""
    drawing, confidence = variables.drawing, variables.plan.confidence
    causes = drawing.by_itself
    count = len(causes)
    slopes = (model.linear().effects / drawing.sigmas).T
    estimates = variables.design.indices(model.evaluate, slopes, confidence=confidence, floor=floor)
    linear = _linear(slopes, variables.correlation, causes, floor)
    values: dict[str, Any] = {
        "linear": linear,
        "source_linear": np.array(
            [linear[members].sum(axis=0) for members in variables.sets.values()]
        ),
        "standard_deviation": np.sqrt(estimates.variance),
        "evaluations": estimates.points,
        "failed": estimates.failed,
    }
    for name, estimate in (("first", estimates.first), ("total", estimates.total)):
        values[name], values[f"source_{name}"] = estimate.share[:count], estimate.share[count:]
        values[f"{name}_confidence"] = estimate.half_width[:count]
        values[f"source_{name}_confidence"] = estimate.half_width[count:]
    if drawing.linked.size:
        divided = variables.walks.shares(
            model.evaluate, estimates.slopes, confidence=confidence, floor=floor
        )
        values["shapley"] = divided.shares.share
        values["shapley_confidence"] = divided.shares.half_width
        values["evaluations"] += divided.points
        values["failed"] += divided.failed
    return values


def _linear(
    slopes: Floats, correlation: Floats | None, causes: Sequence[Indices], floor: Floats
) -> Floats:
    """(n_cause, m) shares of the linear variance, from standard uncertainties of either sign."""
    of_variables: Floats = slopes * (slopes if correlation is None else correlation @ slopes)
    parts: Floats = np.add.reduceat(
        of_variables[np.concatenate([np.empty(0, np.intp), *causes])],
        np.cumsum([0, *(members.size for members in causes)])[:-1],
        axis=0,
    )
    whole = parts.sum(axis=0)
    varies = np.sqrt(np.maximum(whole, 0.0)) > floor
    np.divide(parts, whole, out=parts, where=varies)
    parts[:, ~varies] = np.nan
    return parts


@dataclass(frozen=True)
class _Block:
    """What was worked out at the poses of one block, by their numbers in it."""

    block: PoseBlock
    variables: _Variables
    values: dict[int, dict[str, np.ndarray]]


def _of_machine(run: Models, plan: _Plan) -> xr.Dataset:
    floor = np.array(
        [
            ROUNDING * (run.machine.characteristic_length if unit == "m" else 1.0)
            for unit in component_units(run.machine)
        ]
    )
    blocks: list[_Block] = []
    interrupted, lost = 0, False
    try:
        for _, model in run:
            if not blocks or blocks[-1].block is not model.block:
                blocks.append(_Block(model.block, _Variables.of(model, plan), {}))
            at = blocks[-1]
            if not at.variables.names:
                continue
            values = _at_one_pose(model, at.variables, floor)
            if np.isfinite(values["standard_deviation"]).all():
                at.values[model.pose] = values
            else:
                run.leave_out(model, REASONS.index(BAND))
                lost = True
    except KeyboardInterrupt:
        if not any(at.values for at in blocks):
            raise
        interrupted = 1
    # What varies may differ from block to block: in the one there it has no band.
    filled = [at for at in blocks if at.values]
    sources = {
        name: source
        for at in filled
        for name, source in zip(at.variables.names, at.variables.sources, strict=True)
    }
    if blocks and not sources and not lost:
        raise RequestError(_nothing_varies(run.machine.file))
    names, groups = list(sources), list(dict.fromkeys(sources.values()))
    correlated = any(at.variables.drawing.linked.size for at in filled)
    schema = {**SCHEMA, **CORRELATED} if correlated else SCHEMA
    run.begin(schema, parameter=len(names), source=len(groups))
    for at in filled:
        places = {
            "parameter": [names.index(name) for name in at.variables.names],
            "source": [groups.index(name) for name in at.variables.sets],
        }
        lengths = {"parameter": len(names), "source": len(groups)}
        poses = sorted(at.values)
        stacked = {
            name: np.stack([np.asarray(at.values[pose][name]) for pose in poses])
            for name in at.values[poses[0]]
        }
        whole = {
            # Where nothing is correlated at this block, no Shapley share was worked out.
            name: _whole(variable, stacked.get(name, stacked["total"] * np.nan), places, lengths)
            for name, variable in schema.items()
        }
        run.fill(at.block, np.array(poses, np.intp), whole)
    coords = _coords(names, list(sources.values()), groups)
    result = run.dataset(coords)
    # Poses that were not come to are neither used nor left out.
    return result.assign_attrs(
        plan.attrs,
        interrupted=interrupted,
        poses_left_out=result.sizes["left_out"],
        not_assembled=lost_text(result["failed"], _drawn(result, plan)),
    )


def _drawn(result: xr.Dataset, plan: _Plan) -> Indices:
    """(n_pose,) or () base samples: Shapley shares draw as many once more."""
    times = np.ones(result["failed"].shape, np.intp)
    if "shapley" in result:
        times += result["shapley"].notnull().any(("parameter", "component")).values
    return plan.samples * times


def _whole(
    variable: Variable,
    values: np.ndarray,
    at: Mapping[str, Sequence[int]],
    lengths: Mapping[str, int],
) -> np.ndarray:
    """Values (n_pose, ...) over everything that varies anywhere, from those `at` what varies."""
    along = variable.dims[1] if len(variable.dims) > 1 else None
    if along not in at:
        return values
    assert along is not None
    if list(at[along]) == list(range(lengths[along])):
        return values
    # A component that does not vary at all has no share of anything: all of it is NaN.
    nothing = np.where(np.isnan(values).all(axis=1), np.nan, 0.0)
    whole = np.repeat(nothing[:, np.newaxis], lengths[along], axis=1)
    whole[:, at[along]] = values
    return whole


def _coords(
    names: Sequence[str], sources: Sequence[str], groups: Sequence[str]
) -> dict[str, xr.Variable]:
    return {
        "parameter": label("parameter", list(names), "variable: what varies by itself"),
        "parameter_source": label("parameter", list(sources), "error source of the variable"),
        "source": label("source", list(groups), "error source"),
    }


def _of_function(model: FunctionModel, plan: _Plan) -> xr.Dataset:
    if not any(given.half for given in model.inputs.values()):
        raise RequestError(_nothing_varies(None))
    variables = _Variables.of(model, plan)
    floor = ROUNDING * np.abs(model.linear().value)
    values = _at_one_pose(model, variables, floor)
    schema = {
        name: variable for name, variable in {**SCHEMA, **CORRELATED}.items() if name in values
    }
    coords = _coords(model.names, model.sources, list(variables.sets))
    result = function_dataset(schema, values, model, coords=coords)
    lost = lost_text(result["failed"], _drawn(result, plan), plain=True)
    return result.assign_attrs(plan.attrs, not_assembled=lost)


def _nothing_varies(file: str | None) -> Problem:
    return Problem(
        code="nothing-varies",
        message="there is no variance to share",
        file=file,
        found="no variable with a band: every deviation is known",
        expected="a tolerance, a resolution, or another deviation that is not known",
        hint="`truepose budget` compares errors that are known",
    )


__all__ = ["CORRELATED", "SCHEMA", "first_to_tighten", "over_position", "shares"]
