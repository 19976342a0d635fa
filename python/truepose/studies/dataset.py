"""A study as a Dataset: its plan and coordinates, and its results beside them."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from truepose.machine import Machine
from truepose.runs.dataset import (
    QUANTITY_UNITS,
    data_variable,
    label,
    labelled_dataset,
    provenance,
    quantity_coords,
)
from truepose.runs.quantities import quantities
from truepose.studies.block import Arrays, schema_of
from truepose.studies.plan import StudyPlan
from truepose.studies.quantities import SOURCE_NAMES
from truepose.verdict.answer import STATES

if TYPE_CHECKING:
    import xarray as xr

DONE = "done"
"""The variable that says which variants stand in a store, whole."""

COORDS = (
    "variant", "variable", "variable_units", "setting", "value", "quantity", "quantity_units",
    "state", "source",
)  # fmt: skip
"""All coordinates that a study may have, in their order."""

PLAN = ("setting", "value")
"""Those that are the plan."""

KEY, PLAN_HASH, BLOCK = "study", "plan_hash", "block"
"""Attributes: what makes it this study (JSON), SHA-256 of its plan, variants of a block."""


def labels_of(
    machine: Machine,
    plan: StudyPlan,
    names: tuple[str, ...],
    key: Mapping[str, Any],
    block: int,
) -> xr.Dataset:
    """The plan and the coordinates of a study of `machine`, with where it comes from."""
    import xarray as xr

    dims = {dim for variable in schema_of(names).values() for dim in variable.dims}
    table = ("variant", "variable")
    coords = {
        "variant": label("variant", np.arange(len(plan)), "number of the variant in the plan"),
        "variable": label("variable", np.array(plan.keys, object), "key of the machine file"),
        "variable_units": label(
            "variable", np.array(plan.units, object), "unit of the values, empty of words"
        ),
        "setting": xr.Variable(
            table, plan.settings, {"long_name": "value as --set takes it", "units": "1"}
        ),
        "value": xr.Variable(
            table,
            plan.values,
            {
                "long_name": "value as a number, missing of words",
                "units": ", ".join(dict.fromkeys(unit or "1" for unit in plan.units)),
                "units_by": "variable_units",
            },
        ),
    }
    if "quantity" in dims:
        coords |= quantity_coords(machine)
    if "state" in dims:
        coords["state"] = label("state", np.array(STATES, object), "state of the machine")
    if "source" in dims:
        coords["source"] = label("source", np.array(SOURCE_NAMES, object), "error source")
    attrs = provenance(machine, machine.condition)
    attrs |= {
        "seed": key["seed"],
        KEY: json.dumps(key),
        PLAN_HASH: plan.digest,
        BLOCK: block,
    }
    words = {
        name: one.copy(data=one.values.astype(object)) if one.dtype.kind == "U" else one
        for name, one in coords.items()
    }
    return labelled_dataset({}, words, attrs)


def results_of(machine: Machine, names: tuple[str, ...], arrays: Arrays) -> dict[str, xr.Variable]:
    """The results of a study as variables, with their units."""
    units: dict[str, Sequence[str]] = {
        "quantity": [QUANTITY_UNITS[kind] for kind in quantities(machine.components)]
    }
    return {
        name: data_variable(variable, arrays[name], units)
        for name, variable in schema_of(names).items()
    }


def done_variable(done: np.ndarray) -> xr.Variable:
    """Which variants are evaluated, (n_variant,)."""
    import xarray as xr

    return xr.Variable(
        ("variant",), done, {"long_name": "whether the variant is evaluated", "units": "1"}
    )


__all__ = [
    "BLOCK",
    "COORDS",
    "DONE",
    "KEY",
    "PLAN",
    "PLAN_HASH",
    "done_variable",
    "labels_of",
    "results_of",
]
