"""Uncertainty: the GUM's linear answer of all sources together, and whether it may be used.

    lower, upper = value -+ k u

u by the law of propagation (`error_budget.propagation`), k of Student's distribution for the
effective degrees of freedom, which takes a Student variable by its scale; the distribution taken
has the standard deviation u, so that k of one alone is its own. Correlated inputs of finite degrees
of freedom have no effective ones (NaN). Whether the interval may be used is for the comparison with
sampling to say (JCGM 101:2008, clause 8; `truepose.uncertainty_analysis.validity`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, overload

import numpy as np
from numpy.typing import ArrayLike

from truepose.arrays import Floats, Indices
from truepose.error_budget.bands import FEW
from truepose.error_budget.propagation import combine, coverage_factor
from truepose.machine import Condition, Machine
from truepose.runs.arguments import checked
from truepose.runs.dataset import (
    Schema,
    Variable,
    component_units,
    label,
)
from truepose.runs.displacement import at_shifts
from truepose.runs.first_order import first_order
from truepose.runs.poses import (
    OK,
    Progress,
)
from truepose.runs.run import Run
from truepose.runs.variables import variables_at
from truepose.sources.deviation import Distribution
from truepose.uncertainty_analysis.arguments import required_digits, required_probability
from truepose.uncertainty_analysis.failed_samples import lost_text
from truepose.uncertainty_analysis.functions.dataset import function_dataset
from truepose.uncertainty_analysis.functions.inputs import Input
from truepose.uncertainty_analysis.functions.second_order_terms import second_order_uncertainty
from truepose.uncertainty_analysis.model import FunctionModel
from truepose.uncertainty_analysis.monte_carlo import monte_carlo
from truepose.uncertainty_analysis.validity import LinearAnswer, Sampled, compare

if TYPE_CHECKING:
    import xarray as xr

ROUNDING = 1e-12
"""Of the machine's characteristic length, or rad, or an output: what solving a pose leaves."""

NOT_SAMPLED = "the pose was not sampled"
"""The reason where there is nothing to compare with."""

_EACH = ("pose", "component")

SCHEMA: Schema = {
    "value": Variable(_EACH, "component", "error from all sources at their shifts, exact"),
    "standard_uncertainty": Variable(_EACH, "component", "standard uncertainty, first order"),
    "effective_dof": Variable(
        _EACH, "1", "effective degrees of freedom, by Welch-Satterthwaite; none of correlated ones"
    ),
    "coverage_factor": Variable(_EACH, "1", "half coverage interval in standard uncertainties"),
    "lower": Variable(_EACH, "component", "lower end of the coverage interval"),
    "upper": Variable(_EACH, "component", "upper end of the coverage interval"),
    "covariance": Variable(
        ("pose", "component", "other_component"), "covariance", "covariance, first order"
    ),
}

SECOND_ORDER: Schema = {
    "second_order_uncertainty": Variable(
        _EACH, "component", "standard uncertainty with the terms of next order"
    )
}
"""What the result of a plain function has besides."""

VALIDATION: Schema = {
    "sampled_lower": Variable(_EACH, "component", "lower end of the sampled coverage interval"),
    "sampled_upper": Variable(_EACH, "component", "upper end of the sampled coverage interval"),
    "difference_lower": Variable(_EACH, "component", "|lower - sampled_lower|"),
    "difference_upper": Variable(_EACH, "component", "|upper - sampled_upper|"),
    "tolerance": Variable(_EACH, "component", "what a difference may be"),
    "valid": Variable(_EACH, "1", "whether the linear interval is valid here", np.bool_),
    "reason": Variable(("pose",), "1", "why it is not, empty where it is", object),
}
"""What a result has besides that is compared with sampling."""


@dataclass(frozen=True)
class _Options:
    """The coverage probability, and what the answer is to be compared with, to so many digits."""

    probability: float
    digits: int
    sampled: xr.Dataset | None = None

    def against(self, sampled: xr.Dataset) -> _Options:
        """The same, to be compared with the result of `monte_carlo`."""
        return replace(self, sampled=sampled)

    def schema(self, others: Schema | None = None) -> Schema:
        """What the result has."""
        schema = {**SCHEMA, **(others or {})}
        return schema if self.sampled is None else {**schema, **VALIDATION}

    @property
    def attrs(self) -> dict[str, float | int]:
        """What the result says of how it was made."""
        attrs: dict[str, float | int] = {"probability": self.probability}
        if self.sampled is not None:
            attrs |= {"digits": self.digits, "seed": self.sampled.attrs["seed"]}
        return attrs


@dataclass(frozen=True)
class _Variables:
    """The variables (v,) that an answer is made of, and the outputs (m,) that it is about."""

    names: Sequence[str]
    distributions: Sequence[Distribution]
    correlation: Floats | None
    dofs: Floats
    outputs: Sequence[str]
    units: Sequence[str]
    rounding: Floats

    @property
    def scales(self) -> Floats:
        """(v,) scale of a Student variable in its standard deviation, else 1."""
        return np.array([distribution.scale for distribution in self.distributions], np.float64)

    @property
    def sigmas(self) -> Floats:
        """(v,) half band of each variable in standard deviations."""
        return np.array([distribution.sigmas for distribution in self.distributions], np.float64)


@overload
def uncertainty(
    model: Machine,
    poses: ArrayLike | None = None,
    condition: Condition | None = None,
    *,
    probability: float = 0.95,
    validate: bool = False,
    digits: int = 2,
    seed: int = 0,
    samples: int | None = None,
    progress: Progress | None = None,
) -> xr.Dataset: ...


@overload
def uncertainty(
    model: Callable[..., Any],
    poses: Mapping[str, Input] | None = None,
    *,
    inputs: Mapping[str, Input] | None = None,
    correlation: Any = None,
    probability: float = 0.95,
    validate: bool = False,
    digits: int = 2,
    seed: int = 0,
    samples: int | None = None,
) -> xr.Dataset: ...


@checked
def uncertainty(
    model: Machine | Callable[..., Any],
    poses: Any = None,
    condition: Condition | None = None,
    *,
    inputs: Mapping[str, Input] | None = None,
    correlation: Any = None,
    probability: float = 0.95,
    validate: bool = False,
    digits: int = 2,
    seed: int = 0,
    samples: int | None = None,
    progress: Progress | None = None,
) -> xr.Dataset:
    """The linear law of the GUM: standard uncertainty, covariance and coverage interval.

    Of a machine: `poses` (..., n_commanded), SI, default the file's workspace; `condition`, default
    the file's; `progress` is called with (poses done, poses in all). Of a plain function: its
    `inputs`, as the second argument or by name, and their `correlation`. The interval of coverage
    `probability` is symmetric about the error from all sources at their shifts, or the function at
    its estimates. The Dataset, SI, is described in docs/results.md.

    `validate` compares with `samples` samples (default: as many as JCGM 101's adaptive rule takes)
    drawn from `seed`, to so many significant `digits` of the standard uncertainty: `valid` says
    where the linear interval may be used, `reason` why not (JCGM 101:2008, clause 8).

    Raises `RequestError`: bad-probability, bad-digits, bad-poses, no-workspace, no-source,
    no-pose-left; `TrueposeError` as the sources do, and as `FunctionModel` does.
    """
    asked = _Options(required_probability(probability), required_digits(digits))
    drawn: dict[str, Any] = {
        "probability": probability,
        "samples": samples,
        "seed": seed,
        "digits": digits,
    }
    if isinstance(model, Machine):
        given = model.condition if condition is None else condition
        if validate:
            asked = asked.against(
                monte_carlo(model, poses, condition=given, progress=progress, **drawn)
            )
        return _of_machine(model, poses, given, None if validate else progress, asked)
    of = FunctionModel(model, poses if inputs is None else inputs, correlation)
    if validate:
        asked = asked.against(monte_carlo(model, of.inputs, correlation=correlation, **drawn))
    return _of_function(of, asked)


def _of_machine(
    machine: Machine,
    poses: ArrayLike | None,
    condition: Condition,
    progress: Progress | None,
    asked: _Options,
) -> xr.Dataset:
    run = Run(machine, poses, condition, progress)
    rows = run.begin(asked.schema())
    units = component_units(machine)
    scale = np.array([machine.characteristic_length if unit == "m" else 1.0 for unit in units])
    for block in run:
        moves = variables_at(machine, block, run.sources)
        variables = _Variables(
            moves.names,
            moves.distributions,
            moves.correlation,
            np.array([distribution.degrees for distribution in moves.distributions], np.float64),
            machine.components,
            units,
            ROUNDING * scale,
        )
        room = rows.room(block.indices.size)
        status = at_shifts(machine, block, moves.alone, moves.shift)
        for start in range(0, block.indices.size, FEW):
            some = slice(start, start + FEW)
            value, effects, regular = first_order(machine, block, moves, some)
            status[some] = np.where(status[some] == OK, regular, status[some])
            answer = _answer(value, effects, variables, asked)
            if asked.sampled is not None:
                numbers = asked.sampled.indexes["pose"].get_indexer(block.indices[some])
                answer |= _compared(answer, effects, variables, asked, asked.sampled, numbers)
            for name, values in answer.items():
                room[name][some] = values
        run.fill(block, room, status)
    result = run.dataset(
        over_all={"reason": np.array(rows.arrays["reason"], np.str_)} if asked.sampled else {},
        coords={
            "other_component": label(
                "other_component", list(machine.components), "the other component of a covariance"
            )
        },
    )
    return result.assign_attrs(asked.attrs)


def _of_function(model: FunctionModel, asked: _Options) -> xr.Dataset:
    law = model.linear()
    value, effects = law.value[np.newaxis], law.effects[np.newaxis]
    variables = _Variables(
        model.names,
        model.distributions,
        model.correlation,
        model.dofs,
        model.outputs,
        model.output_units,
        ROUNDING * np.abs(law.value),
    )
    answer = _answer(value, effects, variables, asked)
    answer["second_order_uncertainty"] = second_order_uncertainty(model, law)[np.newaxis]
    if asked.sampled is not None:
        sampled = asked.sampled.expand_dims("pose")
        answer |= _compared(answer, effects, variables, asked, sampled, np.zeros(1, np.intp))
    schema = asked.schema(SECOND_ORDER)
    result = function_dataset(schema, {name: answer[name][0] for name in schema}, model)
    return result.assign_attrs(asked.attrs)


def _answer(
    value: Floats, effects: Floats, variables: _Variables, asked: _Options
) -> dict[str, np.ndarray]:
    """Every variable of `SCHEMA` for n poses, from `value` (n, m) and `effects` (n, m, v)."""
    law = combine(
        effects, variables.sigmas, variables.correlation, variables.dofs, variables.scales
    )
    factor = coverage_factor(law.scale_dof, asked.probability)
    half = factor * law.scale
    np.divide(half, law.standard_uncertainty, out=factor, where=law.standard_uncertainty > 0.0)
    return {
        "value": value,
        "standard_uncertainty": law.standard_uncertainty,
        "effective_dof": law.dof,
        "coverage_factor": factor,
        "lower": value - half,
        "upper": value + half,
        "covariance": law.covariance,
    }


def _compared(
    answer: Mapping[str, np.ndarray],
    effects: Floats,
    variables: _Variables,
    asked: _Options,
    sampled: xr.Dataset,
    numbers: Indices,
) -> dict[str, np.ndarray]:
    """Every variable of `VALIDATION` for n poses, which `sampled` has at `numbers` (n,), -1: not.

    A pose that was not sampled has no ends to compare with, and is not valid.
    """
    shape = answer["value"].shape
    comparison: dict[str, np.ndarray] = {
        name: np.full(
            shape[: len(variable.dims)], np.nan if variable.dtype is np.float64 else False
        )
        for name, variable in VALIDATION.items()
    }
    comparison["reason"] = np.full(len(numbers), NOT_SAMPLED, object)
    columns = {
        name: np.asarray(sampled[name]) for name in ("mean", "standard_deviation", "lower", "upper")
    }
    counts, failed = np.asarray(sampled["samples"]), np.asarray(sampled["failed"])
    plain = "function" in sampled.attrs
    for at in np.flatnonzero(numbers >= 0):
        drawn = {name: column[numbers[at]] for name, column in columns.items()}
        count, lost = int(counts[numbers[at]]), int(failed[numbers[at]])
        compared = compare(
            LinearAnswer(
                **{
                    name: answer[name][at]
                    for name in ("value", "standard_uncertainty", "coverage_factor")
                },
                lower=answer["lower"][at],
                upper=answer["upper"][at],
                effects=effects[at],
                sigmas=variables.sigmas,
                names=variables.names,
                distributions=variables.distributions,
            ),
            Sampled(samples=count, lost=lost_text(lost, lost + count, plain=plain), **drawn),
            variables.outputs,
            variables.units,
            probability=asked.probability,
            digits=asked.digits,
            rounding=variables.rounding,
        )
        comparison["sampled_lower"][at], comparison["sampled_upper"][at] = (
            drawn["lower"],
            drawn["upper"],
        )
        for name in ("difference_lower", "difference_upper", "tolerance", "valid", "reason"):
            comparison[name][at] = getattr(compared, name)
    return comparison
