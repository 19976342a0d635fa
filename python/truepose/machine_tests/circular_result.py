"""The Dataset of a circular test, SI."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from truepose.machine_tests.circular_quantities import DIRECTIONS, QUANTITIES, STANDARD
from truepose.runs.dataset import (
    Schema,
    Variable,
    data_variable,
    label,
    labelled_dataset,
    provenance,
)
from truepose.verdict.states import STATES

if TYPE_CHECKING:
    import xarray as xr

    from truepose.machine_tests.circular_diagnosis import RadialCause
    from truepose.machine_tests.circular_measured import ComparedReadings
    from truepose.machine_tests.circular_prediction import CircularTest

_EACH = ("state", "quantity")
_AT = ("state", "direction", "angle")

SCHEMA: Schema = {
    "known": Variable(_EACH, "m", "quantity where every source is at its known shift"),
    "standard_uncertainty": Variable(_EACH, "m", "standard deviation of the machines drawn"),
    "lower": Variable(_EACH, "m", "lower end of the coverage interval"),
    "upper": Variable(_EACH, "m", "upper end of the coverage interval"),
    "radial_known": Variable(_AT, "m", "radial deviation F of the known error"),
    "radial_lower": Variable(_AT, "m", "lower end of the coverage interval of F"),
    "radial_upper": Variable(_AT, "m", "upper end of the coverage interval of F"),
    "eccentricity": Variable(
        ("state", "axis"), "m", "middle of the known circle from the commanded centre, base frame"
    ),
    "known_form": Variable(("known_cause",), "m", "G(b) of the cause alone"),
    "known_radius": Variable(("known_cause",), "m", "D of the cause alone"),
    "known_share": Variable(("known_cause",), "1", "share of F's sum of squares"),
    "uncertain_form": Variable(
        ("uncertain_cause",), "m", "standard uncertainty of F without D, root mean square"
    ),
    "uncertain_radius": Variable(("uncertain_cause",), "m", "standard uncertainty of D"),
    "uncertain_share": Variable(("uncertain_cause",), "1", "share of the variance of F"),
    "turn_angle": Variable(("turn",), "rad", "where a drive turns round"),
    "turn_step": Variable(("turn",), "m", "known step of F there, outwards"),
}

MEASURED: Schema = {
    "measured": Variable(("quantity",), "m", "quantity measured, mean of the pairs of paths"),
    "read_lower": Variable(("quantity",), "m", "lower end of the interval of a quantity as read"),
    "read_upper": Variable(("quantity",), "m", "upper end of the interval of a quantity as read"),
    "radial_measured": Variable(("reading",), "m", "measured radial deviation F"),
    "explained_value": Variable(("explanation",), "explanation", "deviation that would explain it"),
    "explained_share": Variable(
        ("explanation",), "1", "share of the difference's sum of squares that it explains"
    ),
    "explained_bands": Variable(
        ("explanation",), "1", "the same in standard uncertainties, NaN without a band"
    ),
}


def dataset(test: CircularTest, compared: ComparedReadings | None) -> xr.Dataset:
    """The result of a test, with readings where there are."""
    path = test.path
    intervals = [test.interval(test.quantities(at)) for at in range(len(STATES))]
    bands = [test.interval(test.deviations(at)) for at in range(len(STATES))]
    spread = [np.nanstd(test.quantities(at), axis=0) for at in range(len(STATES))]
    known, uncertain, turns = test.known_causes, test.uncertain_causes, test.steps
    values: dict[str, Any] = {
        "known": np.stack([seen.nominal.values[0] for seen in test.seen]),
        "standard_uncertainty": np.stack(spread),
        "lower": np.stack([low for low, _ in intervals]),
        "upper": np.stack([high for _, high in intervals]),
        "radial_known": np.stack([seen.deviations for seen in test.seen]),
        "radial_lower": np.stack([low for low, _ in bands]),
        "radial_upper": np.stack([high for _, high in bands]),
        "eccentricity": np.stack([seen.state.known_error.mean(axis=0) for seen in test.seen]),
        **_of_causes("known", known),
        **_of_causes("uncertain", uncertain),
        "turn_angle": np.array([step.angle for step in turns]),
        "turn_step": np.array([step.size for step in turns]),
    }
    labels = {
        "state": label("state", list(STATES), "as commanded, and after compensation"),
        "quantity": label("quantity", list(QUANTITIES), "quantity of the test"),
        "quantity_name": label("quantity", list(QUANTITIES.values()), "what it is"),
        "direction": label("direction", list(DIRECTIONS), "way round"),
        "angle": label("angle", path.angles, "angle on the circle", "rad"),
        "axis": label("axis", ["x", "y", "z"], "axis of the base frame"),
        "known_cause": label("known_cause", [one.name for one in known], "cause"),
        "known_shape": label("known_cause", [one.shape for one in known], "what it looks like"),
        "uncertain_cause": label("uncertain_cause", [one.name for one in uncertain], "variable"),
        "turn_drive": label("turn", [step.drive for step in turns], "drive that turns round"),
        "turn_direction": label("turn", [DIRECTIONS[step.direction] for step in turns], "way"),
    }
    attrs: dict[str, Any] = provenance(path.machine, test.condition) | {
        "test": "circular",
        "standard": STANDARD,
        "plane": path.plane,
        "radius": path.radius,
        "centre": path.middle.tolist(),
        "start": float(path.angles[path.first]),
        "overshoot": path.overshoot,
        "step": 2.0 * np.pi / path.count,
        "samples": len(test.quantities(0)),
        "failed": int(sum(one.failed for one in test.sampled)),
        "exact": int(all(one.exact for one in test.sampled)),
        "probability": test.probability,
        "seed": test.seed,
    }
    schema, units = dict(SCHEMA), {}
    if compared is not None:
        schema |= MEASURED
        more, named, told = _measured(compared)
        values, labels, attrs = values | more, labels | named, attrs | told
        units = {"explanation": [one.unit for one in compared.explanations]}
    data = {name: data_variable(one, values[name], units) for name, one in schema.items()}
    return labelled_dataset(data, labels, attrs)


def _of_causes(kind: str, causes: list[RadialCause]) -> Mapping[str, Any]:
    return {
        f"{kind}_form": np.array([one.form for one in causes]),
        f"{kind}_radius": np.array([one.radius for one in causes]),
        f"{kind}_share": np.array([one.share for one in causes]),
    }


def _measured(
    compared: ComparedReadings,
) -> tuple[dict[str, Any], dict[str, xr.Variable], dict[str, Any]]:
    low, high = compared.intervals
    farthest, distance = compared.measured_statistics
    explanations = compared.explanations
    values = {
        "measured": compared.values,
        "read_lower": low,
        "read_upper": high,
        "radial_measured": compared.deviations,
        "explained_value": np.array([one.value for one in explanations]),
        "explained_share": np.array([one.share for one in explanations]),
        "explained_bands": np.array([one.bands for one in explanations]),
    }
    ways = [DIRECTIONS[int(way)] for way in compared.ways]
    labels = {
        "reading": label("reading", np.arange(compared.angles.size), "number of the reading"),
        "reading_angle": label("reading", compared.angles, "angle of the reading", "rad"),
        "reading_direction": label("reading", ways, "way round"),
        "explanation": label(
            "explanation", [one.names[0] for one in explanations], "parameter that is off"
        ),
        "explanation_alike": label(
            "explanation",
            [", ".join(one.names[1:]) for one in explanations],
            "what this test cannot tell from it",
        ),
        "explanation_units": label("explanation", [one.unit for one in explanations], "unit"),
    }
    attrs = {
        "measured_file": compared.readings.file,
        "measured_readings": compared.readings.count,
        "reading_uncertainty": compared.uncertainty,
        "within": int(compared.within),
        "farthest": float(farthest),
        "farthest_limit": float(compared.limits[0]),
        "distance": float(distance),
        "distance_limit": float(compared.limits[1]),
        "share_as_far_off": compared.share,
        "share_outside": compared.outside,
        "explained_within_bands": compared.explained,
    }
    return values, labels, attrs
