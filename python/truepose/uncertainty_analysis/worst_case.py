"""Worst case: the most that everything together can do, to first order and exactly.

    linear[c] = largest |error at the shifts + sum over variables of effect[c] t|
    exact[c] = the largest |error| at a corner of what the variables lie in

Both are of all sources together. The linear one is quick and may fall short of the truth, since the
error bends; the exact one is a corner that the machine can be at. Neither is a proof: `bounds` is.
A variable lies in [-1, 1], or as far either way as its listed values do; the components of a
direction that is not known lie on their sphere together, and every point of it is a corner. A
correlation does not narrow the worst case: every corner is taken to happen.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, overload

import numpy as np
from numpy.typing import ArrayLike

from truepose.arrays import Floats, Indices
from truepose.error_budget.largest import largest
from truepose.error_budget.worst import worst
from truepose.errors import Problem, RequestError
from truepose.machine import Condition, Machine
from truepose.probability.domain import Domain
from truepose.runs.arguments import checked
from truepose.runs.dataset import (
    Schema,
    Variable,
    quantity_coords,
)
from truepose.runs.displacement import at_shifts
from truepose.runs.first_order import ExactError, first_order
from truepose.runs.poses import (
    OK,
    Progress,
    of_band,
)
from truepose.runs.quantities import quantities
from truepose.runs.run import Run
from truepose.runs.variables import variables_at
from truepose.uncertainty_analysis.corners import WorstCorners, worst_corners
from truepose.uncertainty_analysis.functions.dataset import function_dataset
from truepose.uncertainty_analysis.functions.inputs import Input
from truepose.uncertainty_analysis.model import FunctionModel
from truepose.uncertainty_analysis.truncation import Endless

if TYPE_CHECKING:
    import xarray as xr

_EACH = ("pose", "component")
_SIZE = ("pose", "quantity")

SCHEMA: Schema = {
    "linear": Variable(_EACH, "component", "worst case to first order, of either sign"),
    "exact": Variable(_EACH, "component", "largest |error| at a corner of the bands"),
    "exact_lower": Variable(_EACH, "component", "least error at a corner of the bands"),
    "exact_upper": Variable(_EACH, "component", "largest error at a corner of the bands"),
    "magnitude_linear": Variable(_SIZE, "quantity", "linear maximum: largest error to first order"),
    "magnitude_exact": Variable(_SIZE, "quantity", "largest norm at a corner of the bands"),
    "search": Variable(("pose",), "1", "every vertex or directed: how corners were found", object),
    "vertices": Variable(("pose",), "1", "corners evaluated", np.intp),
}


@overload
def worst_case(
    model: Machine,
    poses: ArrayLike | None = None,
    condition: Condition | None = None,
    *,
    progress: Progress | None = None,
) -> xr.Dataset: ...


@overload
def worst_case(
    model: Callable[..., Any],
    poses: Mapping[str, Input] | None = None,
    *,
    inputs: Mapping[str, Input] | None = None,
) -> xr.Dataset: ...


@checked
def worst_case(
    model: Machine | Callable[..., Any],
    poses: Any = None,
    condition: Condition | None = None,
    *,
    inputs: Mapping[str, Input] | None = None,
    progress: Progress | None = None,
) -> xr.Dataset:
    """The most that all sources together can do: to first order, and exactly at the bands' corners.

    Of a machine: `poses` (..., n_commanded), SI, default the file's workspace; `condition`, default
    the file's; `progress` is called with (poses done, poses in all). Of a plain function: its
    `inputs`, as the second argument or by name. The Dataset, SI, is described in docs/results.md.

    Every corner is evaluated where at most 12 variables have a band and none is of a direction that
    is not known, else a directed search finds the worst it can (`search` says which). A
    distribution without ends, such as a normal one, is taken at its band of k standard deviations,
    which the attribute `unbounded` lists. Values in between the corners are not looked at, but for
    the shifts themselves. A pose at which a machine at one of the corners cannot be assembled is
    left out as `band`.

    Raises `RequestError`: bad-poses, no-workspace, no-source, no-pose-left; not-finite where the
    function is not finite at a corner; `TrueposeError` as the sources do.
    """
    if isinstance(model, Machine):
        given = model.condition if condition is None else condition
        return _of_machine(model, poses, given, progress)
    return _of_function(model, poses if inputs is None else inputs)


def _of_machine(
    machine: Machine, poses: ArrayLike | None, condition: Condition, progress: Progress | None
) -> xr.Dataset:
    run = Run(machine, poses, condition, progress)
    rows = run.begin(SCHEMA)
    kinds = list(quantities(machine.components).values())
    endless = Endless()
    for block in run:
        variables = variables_at(machine, block, run.sources)
        value, effects, status = first_order(machine, block, variables)
        shifted = at_shifts(machine, block, variables.alone, variables.shift)
        usable = run.keep(block.indices, shifted, status)
        corners = worst_corners(
            _only(usable, ExactError(machine, block, variables)),
            value[usable],
            effects[usable],
            variables.domain,
            kinds,
        )
        values = _values(corners, value[usable], effects[usable], variables.domain, kinds)
        run.fill(block.select(usable), values, of_band(corners.status))
        endless.note(variables.names, variables.distributions)
    result = run.dataset(
        over_all={"search": np.array(rows.arrays["search"], np.str_)},
        coords=quantity_coords(machine, "what the norm is taken of"),
    )
    return result.assign_attrs(unbounded=str(endless))


def _only(
    usable: np.ndarray, exact_error: Callable[[Indices, Floats], tuple[Floats, np.ndarray]]
) -> Callable[[Indices, Floats], tuple[Floats, np.ndarray]]:
    """The exact error with poses counted among the usable ones."""
    numbers = np.flatnonzero(usable)
    return lambda poses, t: exact_error(numbers[poses], t)


def _values(
    corners: WorstCorners,
    value: Floats,
    effects: Floats,
    domain: Domain,
    quantities: Sequence[Indices],
) -> dict[str, np.ndarray]:
    """Every variable over n poses, from exact values (n, m) and effects (n, m, v) at the shifts."""
    n_pose, n_output, _ = effects.shape
    upper, lower = corners.most[:, :n_output], -corners.most[:, n_output : 2 * n_output]
    return {
        "linear": worst(value, domain.reach(effects)),
        "exact": np.maximum(np.abs(lower), np.abs(upper)),
        "exact_lower": lower,
        "exact_upper": upper,
        "magnitude_linear": largest(value, effects, domain, quantities).length,
        "magnitude_exact": corners.most[:, 2 * n_output :],
        "search": np.full(n_pose, corners.search, object),
        "vertices": corners.evaluated,
    }


def _of_function(function: Callable[..., Any], inputs: Any) -> xr.Dataset:
    model = FunctionModel(function, inputs)
    law = model.linear()

    def evaluate(poses: Indices, t: Floats) -> tuple[Floats, np.ndarray]:
        outputs, fine = model.evaluate(t)
        return outputs, np.where(fine, OK, OK + 1).astype(np.uint8)

    domain = Domain.of(model.distributions)
    corners = worst_corners(evaluate, law.value[np.newaxis], law.effects[np.newaxis], domain)
    if corners.status[0] != OK:
        raise RequestError(
            Problem(
                "not-finite",
                "the function has no finite value at a corner of the bands",
                found=f"not finite at some of {corners.evaluated[0]} corners",
                expected="finite values wherever the inputs can be",
                hint="narrow the bands, or keep them off where the function is not defined",
            )
        )
    values = _values(corners, law.value[np.newaxis], law.effects[np.newaxis], domain, [])
    schema = {
        name: variable for name, variable in SCHEMA.items() if "quantity" not in variable.dims
    }
    endless = Endless()
    endless.note(model.names, model.distributions)
    result = function_dataset(schema, {name: values[name][0] for name in schema}, model)
    return result.assign_attrs(unbounded=str(endless))
