"""The Dataset of a plain function's result: its outputs as components, and no poses."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from truepose.runs.dataset import Schema, data_variable, label, labelled_dataset
from truepose.version import version

if TYPE_CHECKING:
    import xarray as xr

    from truepose.uncertainty_analysis.model import FunctionModel


def function_dataset(
    schema: Schema,
    values: Mapping[str, Any],
    model: FunctionModel,
    *,
    coords: Mapping[str, xr.Variable] | None = None,
) -> xr.Dataset:
    """The Dataset of a plain function: `values` by name, over its outputs as `component`.

    A variable of `schema` that has a dim pose has it not here.
    """
    # One text for all outputs: no coordinate has the unit of each.
    of_outputs = [", ".join(dict.fromkeys(model.output_units))]
    units = dict.fromkeys(("component", "covariance"), of_outputs)
    data = {}
    for name, variable in schema.items():
        at_no_pose = replace(variable, dims=tuple(dim for dim in variable.dims if dim != "pose"))
        data[name] = data_variable(at_no_pose, values[name], units)
    used = {dim for variable in data.values() for dim in variable.dims}
    labels = {
        dim: label(dim, list(model.outputs), meaning)
        for dim, meaning in (
            ("component", "output of the function"),
            ("other_component", "the other output of a covariance"),
        )
        if dim in used
    }
    attrs = {
        "truepose_version": version(),
        "function": getattr(model.function, "__name__", type(model.function).__name__),
        "inputs": json.dumps(
            {
                name: {
                    "centre": one.centre,
                    "half": one.half,
                    "distribution": str(one.distribution),
                    "dof": one.dof if np.isfinite(one.dof) else None,
                }
                for name, one in model.inputs.items()
            }
        ),
        "seed": "none",
    }
    return labelled_dataset(data, {**labels, **(coords or {})}, attrs)
