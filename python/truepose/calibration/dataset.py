"""A calibration as labelled data: what was found, how sure it is, every residual, the verdict.

`docs/results.md` is the schema in words; a test holds the two together.
"""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from truepose.arrays import Flags, Floats
from truepose.calibration.acceptance import sentences
from truepose.calibration.identification.equations import Equations
from truepose.calibration.identification.problem import Prior
from truepose.calibration.observables import UNITS, column_name
from truepose.machine import Machine
from truepose.runs.dataset import (
    Schema,
    Variable,
    component_units,
    label,
    labelled_dataset,
    provenance,
    quantity_coords,
    units_of,
)
from truepose.runs.quantities import POSITIONS, quantities

if TYPE_CHECKING:
    import xarray as xr

    from truepose.calibration.acceptance import Reason
    from truepose.calibration.acceptance.tool_uncertainty import ToolUncertainty
    from truepose.calibration.calibrate import Calibration
    from truepose.calibration.measurements import Measurements

SCHEMA: Schema = {
    # --- unknowns of the machine ---
    "value": Variable(
        ("unknown",), "unknown", "value found: change of the parameter that it moves most"
    ),
    "standard_uncertainty": Variable(
        ("unknown",), "unknown", "standard uncertainty of the value, as the calibration gives it"
    ),
    "data_uncertainty": Variable(
        ("unknown",), "unknown", "standard uncertainty from the measurements alone"
    ),
    "prior_uncertainty": Variable(
        ("unknown",), "unknown", "standard uncertainty before: of the tolerance"
    ),
    "prior_mean": Variable(("unknown",), "unknown", "value expected before: middle of the band"),
    "prior_half": Variable(("unknown",), "unknown", "half band before"),
    "data_share": Variable(("unknown",), "1", "how much of the value comes from the measurements"),
    "nominal": Variable(
        ("unknown",), "unknown", "parameter before, where the unknown is that of one size"
    ),
    "identified": Variable(("unknown",), "unknown", "parameter after, where there is one before"),
    "correlation": Variable(
        ("unknown", "other_unknown"), "1", "correlation of two values that were found"
    ),
    # --- unknowns of the instruments ---
    "instrument_value": Variable(
        ("instrument_unknown",), "instrument_unknown", "value found, from where it was looked for"
    ),
    "instrument_uncertainty": Variable(
        ("instrument_unknown",), "instrument_unknown", "standard uncertainty of the value"
    ),
    # --- parameters of the machine ---
    "parameter_nominal": Variable(("parameter",), "parameter", "parameter before"),
    "parameter_identified": Variable(("parameter",), "parameter", "parameter after"),
    "parameter_uncertainty": Variable(
        ("parameter",), "parameter", "standard uncertainty of the parameter after"
    ),
    # --- observations ---
    "measured": Variable(("observation",), "observation", "what was read"),
    "uncertainty": Variable(("observation",), "observation", "its stated standard uncertainty"),
    "residual_before": Variable(
        ("observation",), "observation", "predicted minus measured, of the machine as filed"
    ),
    "residual_after": Variable(
        ("observation",), "observation", "predicted minus measured, of the calibrated machine"
    ),
    "normalised_before": Variable(
        ("observation",), "1", "residual before over the stated uncertainty"
    ),
    "normalised_after": Variable(
        ("observation",), "1", "residual after over the stated uncertainty"
    ),
    "standardised": Variable(
        ("observation",), "1", "residual after over its own standard deviation after the fit"
    ),
    "weight": Variable(("observation",), "1", "weight of the robust loss, 1 where it is full"),
    "minimal_detectable_bias": Variable(
        ("observation",), "observation", "size of an error of its own that is named"
    ),
    "held_out_before": Variable(
        ("observation",),
        "1",
        "normalised residual of the machine as filed, its row not used by the fit",
    ),
    "held_out_after": Variable(
        ("observation",),
        "1",
        "normalised residual of the calibrated machine, its row not used by the fit",
    ),
    # --- the tool over the workspace ---
    "tool_before": Variable(
        ("pose", "component"), "component", "standard uncertainty of the tool before"
    ),
    "tool_after": Variable(
        ("pose", "component"), "component", "standard uncertainty of the tool after"
    ),
    "tool_size_before": Variable(
        ("pose", "quantity"), "quantity", "root sum of squares of the components before"
    ),
    "tool_size_after": Variable(
        ("pose", "quantity"), "quantity", "root sum of squares of the components after"
    ),
}
"""Every variable: its dims, what has its unit, what it is."""


def dataset_of(calibration: Calibration) -> xr.Dataset:
    """Everything that a calibration found, SI; `docs/results.md` has the schema."""
    import xarray as xr

    machine = calibration.machine
    values = {
        **_unknown_values(calibration),
        **_observation_values(calibration),
        **_tool_values(calibration),
    }
    coords = {
        **_unknown_coords(calibration),
        **_row_coords(machine, calibration.measurements),
        **_tool_coords(calibration),
    }
    units = {
        name.removesuffix("_units"): coords[name].values.tolist()
        for name in coords
        if name.endswith("_units")
    }
    data = {
        name: xr.Variable(
            variable.dims,
            values[name],
            {"long_name": variable.long_name, **units_of(variable.units, units)},
        )
        for name, variable in SCHEMA.items()
    }
    return labelled_dataset(data, coords, _attrs(calibration))


def verdict_of(calibration: Calibration) -> str:
    """Yes or no with its reasons, the remedy and the warnings; and what might go unnoticed."""
    return calibration.gate.words + _unnoticed(calibration)


def answer_of(calibration: Calibration) -> str:
    """The verdict without its warnings and the remedy, which are shown elsewhere."""
    return calibration.gate.answer + _unnoticed(calibration)


def _unnoticed(calibration: Calibration) -> str:
    """How far a wrong reading that is not named may move the tool, where the answer is yes."""
    unnamed = calibration.external_reliability
    if not calibration.accepted or unnamed is None:
        return ""
    if not np.isfinite(unnamed.position):
        return " Some readings are checked by no other: whether they are right is not known."
    size = sentences.quantity(unnamed.position, "m", units=calibration.machine.shown)
    return f" A wrong reading that is not named moves the tool by at most {size}."


# --- values --------------------------------------------------------------------------------------


def _unknown_values(calibration: Calibration) -> dict[str, Floats]:
    fit, gate = calibration.fit, calibration.gate
    unknowns = fit.unknowns
    n = unknowns.n_machine
    machine = calibration.machine
    nominal = unknowns.nominal_sizes(machine)
    for number, identified in unknowns.properties.items():
        nominal[number] = identified.start(machine)
    covariance = covariance_of(calibration)
    open_ = ~np.isfinite(np.diagonal(covariance))
    covariance = np.where(np.isfinite(covariance), covariance, 0.0)
    deviations = np.sqrt(np.diagonal(covariance))
    scale = np.where(deviations > 0.0, deviations, 1.0)
    correlation = covariance / np.outer(scale, scale)
    # What is not determined is correlated with nothing that could be stated.
    correlation[open_, :] = correlation[:, open_] = np.nan
    np.fill_diagonal(correlation, 1.0)
    columns = unknowns.columns
    before = machine.nominal[columns]
    effects = unknowns.effects[:, :n]
    parameter = np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", effects, covariance, effects), 0.0))
    parameter[(effects[:, open_] != 0.0).any(axis=1)] = np.inf
    return {
        "value": gate.values,
        "standard_uncertainty": gate.standard,
        "data_uncertainty": gate.standard_data,
        "prior_uncertainty": gate.standard_prior,
        "prior_mean": np.asarray(unknowns.prior_mean[:n]),
        "prior_half": unknowns.half[:n],
        "data_share": gate.share,
        "nominal": nominal,
        "identified": nominal + gate.values,
        "correlation": correlation,
        "instrument_value": fit.values[n:],
        "instrument_uncertainty": fit.deviations[n:],
        "parameter_nominal": before,
        "parameter_identified": before + unknowns.parameter_change(fit.values),
        "parameter_uncertainty": parameter,
    }


def covariance_of(calibration: Calibration) -> Floats:
    """(n_machine, n_machine) of the machine's unknowns, SI; infinite where one is not determined.

    The uncertainties of the readings are multiplied by what the residuals say of them, where that
    is more than one, as the gate does.
    """
    fit = calibration.fit
    n = fit.unknowns.n_machine
    covariance = determined_covariance(calibration)
    open_ = ~(np.isfinite(fit.deviations[:n]) & np.isfinite(calibration.gate.standard))
    covariance[open_, :] = covariance[:, open_] = np.inf
    return covariance


def determined_covariance(calibration: Calibration) -> Floats:
    """The same over what is determined: nothing along what is not."""
    fit = calibration.fit
    unknowns, n = fit.unknowns, fit.unknowns.n_machine
    prior = Prior.of(unknowns, tolerances=fit.use_prior)
    rows = np.sqrt(fit.weights)[:, np.newaxis] * fit.jacobian / calibration.gate.birge
    covariance: Floats = Equations.of(rows, prior, unknowns).covariance[:n, :n]
    return covariance


def _observation_values(calibration: Calibration) -> dict[str, Floats]:
    fit, data = calibration.fit, calibration.measurements
    fitted = _fitted(data)
    sigma = data.uncertainty

    def over_all(values: Floats) -> Floats:
        everywhere = np.full(data.n_observation, np.nan)
        everywhere[fitted] = values
        return everywhere

    before, after = over_all(fit.before), over_all(fit.residual)
    checked = calibration.validation
    nothing = np.full(data.n_observation, np.nan)
    return {
        "measured": data.value,
        "uncertainty": sigma,
        "residual_before": before * sigma,
        "residual_after": after * sigma,
        "normalised_before": before,
        "normalised_after": after,
        "standardised": over_all(fit.standardised),
        "weight": over_all(fit.weights),
        "minimal_detectable_bias": nothing
        if calibration.external_reliability is None
        else over_all(calibration.external_reliability.minimal_detectable_bias),
        "held_out_before": nothing if checked is None else checked.before,
        "held_out_after": nothing if checked is None else checked.after,
    }


def _fitted(data: Measurements) -> Flags:
    """(n_observation,) which readings the fit used: all but those of rows kept from it."""
    flags: Flags = ~data.held_out[data.row]
    return flags


def _tool_values(calibration: Calibration) -> dict[str, Floats]:
    gate = calibration.gate
    usable = calibration.usable
    values: dict[str, Floats] = {}
    for when, tool in (("before", gate.before), ("after", gate.after)):
        components = np.full((len(usable), len(calibration.machine.components)), np.nan)
        sizes = np.full((len(usable), len(quantities(calibration.machine.components))), np.nan)
        if tool is not None:
            components[usable] = tool.standard
            sizes[usable] = _sizes(tool, calibration.machine)
        values[f"tool_{when}"], values[f"tool_size_{when}"] = components, sizes
    return values


def _sizes(tool: ToolUncertainty, machine: Machine) -> Floats:
    """(n_pose, n_quantity) of position and orientation, those that the machine has."""
    by_name = {"position": tool.position, "orientation": tool.rotation}
    return np.stack([by_name[kind] for kind in quantities(machine.components)], axis=-1)


# --- coordinates ---------------------------------------------------------------------------------


def _unknown_coords(calibration: Calibration) -> dict[str, xr.Variable]:
    machine, unknowns = calibration.machine, calibration.fit.unknowns
    n = unknowns.n_machine
    names, units, labels = unknowns.names, unknowns.units, unknowns.labels
    own, others, columns = "unknown", "instrument_unknown", unknowns.columns.tolist()
    return {
        own: label(own, list(names[:n]), "unknown of the machine"),
        "unknown_label": label(own, list(labels[:n]), "the unknown in words"),
        "unknown_units": label(own, list(units[:n]), "unit of the unknown"),
        "other_unknown": label("other_unknown", list(names[:n]), "unknown of the machine"),
        others: label(others, _texts(names[n:]), "unknown of an instrument"),
        "instrument_unknown_label": label(others, _texts(labels[n:]), "the unknown in words"),
        "instrument_unknown_units": label(others, _texts(units[n:]), "unit of the unknown"),
        "parameter": label(
            "parameter",
            _texts([machine.parameters[column] for column in columns]),
            "parameter of the machine that unknowns move",
        ),
        "parameter_units": label(
            "parameter", _texts([machine.units[column] for column in columns]), "unit of it"
        ),
    }


def _texts(values: Any) -> np.ndarray:
    """Words, also none of them: an empty list has no type by itself."""
    return np.array(list(values), dtype=np.str_)


def _row_coords(machine: Machine, data: Measurements) -> dict[str, xr.Variable]:
    names = [instrument.name for instrument in data.instruments]
    poses = machine.kernel.pose_of(data.placements)
    poses[~data.posed] = np.nan
    coords = {
        "row": label("row", np.arange(data.n_row), "number of the row, from 0"),
        "row_line": label("row", data.lines, "line of the file, 0 where there is none"),
        "row_instrument": label(
            "row", _texts(names[at] for at in data.instrument.tolist()), "instrument that measured"
        ),
        "row_held_out": label("row", data.held_out, "whether the row was kept from the fit"),
    }
    for at, freedom in enumerate(machine.dof):
        unit = "m" if freedom in POSITIONS else "rad"
        coords[f"row_{freedom}"] = label(
            "row", poses[:, at], f"pose {freedom} of the nominal machine at the row", unit
        )
    observation = "observation"
    read = zip(data.observable.tolist(), data.strut.tolist(), strict=True)
    columns = (column_name(machine, code, strut) for code, strut in read)
    return {
        **coords,
        observation: label(
            observation, np.arange(data.n_observation), "number of the reading, from 0"
        ),
        "observation_row": label(observation, data.row, "number of the row that it stands in"),
        "observation_what": label(observation, _texts(columns), "what was read"),
        "observation_units": label(
            observation, _texts(UNITS[code] for code in data.observable.tolist()), "unit of it"
        ),
    }


def _tool_coords(calibration: Calibration) -> dict[str, xr.Variable]:
    machine, poses = calibration.machine, calibration.poses
    coords = {
        "pose": label("pose", np.arange(len(poses)), "number of the pose of the workspace, from 0"),
        "component": label(
            "component",
            list(machine.components),
            "component of a small displacement of the tool point and a rotation vector, base frame",
        ),
        "component_units": label("component", component_units(machine), "unit of the component"),
        **quantity_coords(machine),
    }
    for at, freedom in enumerate(machine.commanded):
        unit = "m" if freedom in POSITIONS else "rad"
        coords[f"pose_{freedom}"] = label("pose", poses[:, at], f"pose {freedom}, commanded", unit)
    return coords


# --- attributes ----------------------------------------------------------------------------------


def _attrs(calibration: Calibration) -> dict[str, str | int | float]:
    gate, fit, data = calibration.gate, calibration.fit, calibration.measurements
    checked, seen = calibration.validation, calibration.gate.observability
    attrs = provenance(calibration.machine, calibration.machine.condition)
    attrs |= {
        "seed": calibration.seed,
        "measurements": data.file,
        "measurements_hash": data.file_hash,
        "verdict": verdict_of(calibration),
        "answer": answer_of(calibration),
        "accepted": int(calibration.accepted),
        "reasons": _json([_said(reason) for reason in gate.reasons]),
        "warnings": _json([_said(warning) for warning in gate.warnings]),
        "undetermined": _json(list(gate.sentences)),
        "suspicions": _json([_finite(asdict(suspicion)) for suspicion in calibration.suspicions]),
        "outliers": _json(
            [{**asdict(outlier), "sentence": outlier.sentence} for outlier in calibration.outliers]
        ),
        "remedy": "" if gate.remedy is None else _json(_finite(asdict(gate.remedy))),
        "rank": gate.rank,
        "unseen": gate.n_null,
        **{name.upper(): float(getattr(seen, name)) for name in ("o1", "o2", "o3", "o4", "o5")},
        "condition_number": float(seen.condition),
        "rms_before": gate.rms_before,
        "rms_after": gate.rms,
        "birge": gate.birge,
        "degrees_of_freedom": gate.degrees_of_freedom,
        "use_prior": int(fit.use_prior),
        "margin": gate.margin,
        "relative": int(gate.relative),
        "position_within": gate.after.within[0],
        "rotation_within": gate.after.within[1],
        **_reliability(calibration),
        "observations": fit.measurements.n_observation,
        "validation": "none" if checked is None else checked.kind,
        "folds": 0 if checked is None else checked.folds,
    }
    if checked is not None and checked.used.any():
        attrs["rms_held_out_before"] = checked.rms_before
        attrs["rms_held_out_after"] = checked.rms_after
    return attrs


def _reliability(calibration: Calibration) -> dict[str, float]:
    reliability = calibration.external_reliability
    if reliability is None:
        return {}
    return {"position_unnoticed": reliability.position, "rotation_unnoticed": reliability.rotation}


def _said(reason: Reason) -> dict[str, str]:
    return {"code": reason.code, "sentence": reason.sentence}


def _json(value: object) -> str:
    return json.dumps(value, ensure_ascii=False)


def _finite(fields: dict[str, Any]) -> dict[str, Any]:
    """Numbers that are not finite as None: JSON has no word for them."""
    return {
        name: None if isinstance(value, float) and not np.isfinite(value) else value
        for name, value in fields.items()
    }


__all__ = ["SCHEMA", "answer_of", "covariance_of", "dataset_of", "verdict_of"]
