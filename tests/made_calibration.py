"""A calibration made by hand for tests of tables and figures: no kernel, no fit.

Numbers mean nothing; shapes, names and units are those of docs/results.md.
"""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from truepose.calibration.dataset import SCHEMA

Array = NDArray[np.float64]

UNKNOWNS = {
    "strut.1.length": ("length of strut 1", "m"),
    "strut.2.length": ("length of strut 2", "m"),
    "drive.a.axis.u": ("tilt u of drive a", "rad"),
    "strut.1.expansion": ("expansion of strut 1", "1/K"),
}


def calibration(machine: Any, poses: Array, *, accepted: bool = True, rows: int = 7) -> xr.Dataset:
    """What `dataset_of` gives, of a tracker that read x and an angle at `rows` of the poses."""
    rng = np.random.default_rng(3)
    count, measured = len(UNKNOWNS), 2 * rows
    units = [unit for _, unit in UNKNOWNS.values()]
    size = np.array([1e-4, 1e-4, 2e-4, 1e-6])
    observation_units = ["m", "rad"] * rows
    sigma = np.array([1e-5, 2e-5] * rows)
    residual = rng.normal(size=measured) * sigma
    kinds = ["position", *(["orientation"] if "rx" in machine.components else [])]
    tool = 1e-5 * (1.0 + np.arange(len(poses)))
    correlation = np.full((count, count), 0.3)
    correlation[0, 1] = correlation[1, 0] = -0.97
    np.fill_diagonal(correlation, 1.0)
    values: dict[str, Any] = {
        "value": np.array([2e-4, -5e-5, 1e-4, np.nan]) if not accepted else size * 0.5,
        "standard_uncertainty": np.array([1e-5, 2e-5, 1e-4, np.inf]),
        "data_uncertainty": np.array([1e-5, 2e-5, np.inf, np.inf]),
        "prior_uncertainty": np.append(size[:3] / np.sqrt(3.0), np.inf),
        "prior_mean": np.zeros(count),
        "prior_half": np.append(size[:3], np.inf),
        "data_share": np.array([0.96, 0.8, 0.25, 0.0]),
        "nominal": np.array([0.5, 0.5, np.nan, 1.2e-5]),
        "identified": np.array([0.5002, 0.49995, np.nan, 1.25e-5]),
        "correlation": correlation,
        "instrument_value": np.array([1e-3]),
        "instrument_uncertainty": np.array([np.inf]),
        "parameter_nominal": np.array([0.5, 0.5]),
        "parameter_identified": np.array([0.5002, 0.49995]),
        "parameter_uncertainty": np.array([1e-5, 2e-5]),
        "measured": rng.normal(size=measured),
        "uncertainty": sigma,
        "residual_before": 10.0 * residual,
        "residual_after": residual,
        "normalised_before": 10.0 * residual / sigma,
        "normalised_after": residual / sigma,
        "standardised": residual / sigma,
        "weight": np.ones(measured),
        "minimal_detectable_bias": 8.0 * sigma,
        "held_out_before": 11.0 * residual / sigma,
        "held_out_after": 1.1 * residual / sigma,
        "tool_before": np.outer(3.0 * tool, np.ones(len(machine.components))),
        "tool_after": np.outer(tool, np.ones(len(machine.components))),
        "tool_size_before": np.outer(4.0 * tool, np.ones(len(kinds))),
        "tool_size_after": np.outer(2.0 * tool, np.ones(len(kinds))),
    }
    of = {
        "unknown": units,
        "instrument_unknown": ["m"],
        "parameter": ["m", "m"],
        "observation": observation_units,
        "component": ["m" if name in "xyz" else "rad" for name in machine.components],
        "quantity": ["m" if kind == "position" else "rad" for kind in kinds],
    }
    names = list(UNKNOWNS)
    labels = [label for label, _ in UNKNOWNS.values()]
    at = poses[np.arange(rows) % len(poses)]
    coords: dict[str, tuple[str, Any, str]] = {
        "unknown": ("unknown", names, "1"),
        "unknown_label": ("unknown", labels, "1"),
        "other_unknown": ("other_unknown", names, "1"),
        "instrument_unknown": ("instrument_unknown", ["tracker.frame.x"], "1"),
        "instrument_unknown_label": ("instrument_unknown", ["frame of tracker, origin x"], "1"),
        "parameter": ("parameter", names[:2], "1"),
        "row": ("row", np.arange(rows), "1"),
        "row_line": ("row", np.arange(rows) + 9, "1"),
        "row_instrument": ("row", ["tracker"] * rows, "1"),
        "row_held_out": ("row", np.zeros(rows, np.bool_), "1"),
        **{
            f"row_{name}": ("row", at[:, index], "m" if name in "xyz" else "rad")
            for index, name in enumerate(machine.commanded)
        },
        "observation": ("observation", np.arange(measured), "1"),
        "observation_row": ("observation", np.repeat(np.arange(rows), 2), "1"),
        "observation_what": ("observation", ["x", "c"] * rows, "1"),
        "component": ("component", list(machine.components), "1"),
        "quantity": ("quantity", kinds, "1"),
        "pose": ("pose", np.arange(len(poses)), "1"),
        **{
            f"pose_{name}": ("pose", poses[:, index], "m" if name in "xyz" else "rad")
            for index, name in enumerate(machine.commanded)
        },
        **{f"{dim}_units": (dim, each, "1") for dim, each in of.items()},
    }
    return xr.Dataset(
        {
            name: (variable.dims, values[name], _units(variable.units, variable.long_name, of))
            for name, variable in SCHEMA.items()
        },
        {
            name: (dim, each, {"units": unit, "long_name": name})
            for name, (dim, each, unit) in coords.items()
        },
        _attrs(accepted, measured),
    )


def _units(kind: str, long_name: str, of: dict[str, list[str]]) -> dict[str, str]:
    attrs = {"long_name": long_name, "units": ", ".join(dict.fromkeys(of.get(kind, [kind])))}
    return {**attrs, "units_by": f"{kind}_units"} if "," in attrs["units"] else attrs


def _attrs(accepted: bool, observations: int) -> dict[str, Any]:
    why = "rods and radius cannot be told apart by a flat bed"
    remedy = {
        "names": ["probe: x and y"], "cost": 20.0, "sentence": "probe in x and y too",
        "position": 1.2e-5, "rotation": None,
    }  # fmt: skip
    suspected = {
        "code": "swapped-columns", "sentence": "tracker: it looks as if x and y were exchanged",
        "instrument": "tracker", "where": ["x"], "rows": [], "lines": [], "before": 0.1,
        "after": 1e-5, "factor": 1e4, "unit": "m", "refuses": True,
    }  # fmt: skip
    outlier = {"row": 2, "line": 11, "instrument": "tracker", "what": "x", "sigmas": -12.3,
               "sentence": "line 11: x of tracker is 12.3 sigma off"}  # fmt: skip
    answer = "Yes: the tool's position becomes known to 12 µm." if accepted else f"No: {why}."
    return {
        "truepose_version": "0.0.0",
        "measurements": "tracker.csv",
        "measurements_hash": "ab" * 32,
        "verdict": answer,
        "answer": answer,
        "accepted": int(accepted),
        "reasons": "[]" if accepted else json.dumps([{"code": "no-gain", "sentence": why}]),
        "warnings": json.dumps([{"code": "gauge", "sentence": "the frame is unknown"}]),
        "undetermined": "[]" if accepted else json.dumps([why]),
        "suspicions": "[]" if accepted else json.dumps([suspected]),
        "outliers": json.dumps([outlier]),
        "remedy": "" if accepted else json.dumps(remedy),
        "rank": 3,
        "unseen": 1,
        "condition_number": float("inf"),
        "relative": 1,
        "observations": observations,
        "validation": "folds",
        "folds": 5,
    }
