"""The Dataset of a part: over state and characteristic, SI."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from truepose.arrays import Floats
from truepose.runs.dataset import (
    Schema,
    Variable,
    data_variable,
    label,
    labelled_dataset,
    provenance,
)
from truepose.workpiece.evaluation import Characteristic, PartEvaluation, QuantityAnswer

if TYPE_CHECKING:
    import xarray as xr

_EACH = ("state", "characteristic")
_OF = ("characteristic",)
_SOURCE = ("state", "characteristic", "source")

SCHEMA: Schema = {
    "nominal": Variable(_OF, "characteristic", "value that the drawing asks for"),
    "lower_limit": Variable(_OF, "characteristic", "lower limit, -inf where there is none"),
    "upper_limit": Variable(_OF, "characteristic", "upper limit, inf where there is none"),
    "programmed": Variable(_OF, "characteristic", "value of the path that the program asks for"),
    "known": Variable(_EACH, "characteristic", "value where every source is at its known shift"),
    "standard_uncertainty": Variable(
        _EACH, "characteristic", "standard uncertainty, where `uncertainty_stated`"
    ),
    "uncertainty_stated": Variable(
        _OF, "1", "0 of a form, which at its best is 0: no standard uncertainty", np.int64
    ),
    "lower": Variable(_EACH, "characteristic", "lower end of the coverage interval"),
    "upper": Variable(_EACH, "characteristic", "upper end of the coverage interval"),
    "reached_lower": Variable(_EACH, "characteristic", "least value that a machine was found for"),
    "reached_upper": Variable(
        _EACH, "characteristic", "largest value that a machine was found for"
    ),
    "bound_lower": Variable(_EACH, "characteristic", "what no machine is below, where `proven`"),
    "bound_upper": Variable(_EACH, "characteristic", "what no machine is above, where `proven`"),
    "proven": Variable(_EACH, "1", "whether the bounds are proven", np.int64),
    "effort": Variable(_EACH, "1", "machines that were tried for what is reached", np.int64),
    "probability_out": Variable(_EACH, "1", "share of the samples out of tolerance"),
    "verdict": Variable(_EACH, "1", "met, NOT met or undecided", np.str_),
    "why": Variable(_EACH, "1", "what the verdict rests on", np.str_),
    "source_known": Variable(_SOURCE, "characteristic", "what a source alone is known to add"),
    "source_half": Variable(
        _SOURCE, "characteristic", "half the 95 % interval of what a source alone leaves unknown"
    ),
}


_LABELS: tuple[tuple[str, Callable[[Characteristic], str], str], ...] = (
    ("feature", lambda one: one.feature.name, "feature of the part"),
    ("kind", lambda one: one.feature.kind, "kind of the feature"),
    ("quantity", lambda one: one.quantity.name, "quantity of the feature"),
    ("characteristic_units", lambda one: one.quantity.si, "unit of the quantity"),
    ("operator", lambda one: one.quantity.operator, "how it is evaluated"),
    ("filter", lambda one: one.quantity.filter, "filter of the points"),
)


def dataset(evaluation: PartEvaluation) -> xr.Dataset:
    """The answers as labelled data."""
    characteristics, states = evaluation.characteristics, evaluation.states
    quantities = [one.quantity for one in characteristics]

    def each(value: Callable[[QuantityAnswer], float]) -> Floats:
        return np.array([[value(answer) for answer in one.answers] for one in states])

    values = {
        "nominal": np.array([one.nominal for one in quantities]),
        "lower_limit": np.array([one.lower for one in quantities]),
        "upper_limit": np.array([one.upper for one in quantities]),
        "programmed": states[0].programmed,
        "known": each(lambda a: a.known),
        "standard_uncertainty": each(lambda a: a.uncertainty),
        "uncertainty_stated": np.array([not one.is_form for one in quantities], np.int64),
        "lower": each(lambda a: a.interval[0]),
        "upper": each(lambda a: a.interval[1]),
        "reached_lower": each(lambda a: a.search.lower.value),
        "reached_upper": each(lambda a: a.search.upper.value),
        "bound_lower": each(lambda a: a.above.lower),
        "bound_upper": each(lambda a: a.above.upper),
        "proven": each(lambda a: a.above.proven).astype(np.int64),
        "effort": each(lambda a: a.search.effort).astype(np.int64),
        "probability_out": each(lambda a: a.out),
        "source_known": np.array([[b.known for b in one.blame] for one in states]).swapaxes(1, 2),
        "source_half": np.array([[b.half for b in one.blame] for one in states]).swapaxes(1, 2),
    }
    values["verdict"] = np.array([[a.verdict for a in one.answers] for one in states])
    values["why"] = np.array([[a.why for a in one.answers] for one in states])
    units = {"characteristic": [one.si for one in quantities]}
    data = {name: data_variable(SCHEMA[name], value, units) for name, value in values.items()}
    coords = {
        "state": label("state", [one.state.name for one in states], "what is commanded"),
        "characteristic": label(
            "characteristic", [one.label for one in characteristics], "feature and quantity"
        ),
        "source": label("source", [source.name for source in evaluation.sources], "error source"),
        **{
            name: label("characteristic", [of(one) for one in characteristics], words)
            for name, of, words in _LABELS
        },
    }
    return labelled_dataset(data, coords, attributes(evaluation))


def attributes(evaluation: PartEvaluation) -> dict[str, Any]:
    """What the answers rest on: the machine, the condition, how it was drawn, the whole path."""
    return provenance(evaluation.machine, evaluation.condition) | {
        "seed": evaluation.seed,
        "samples": evaluation.samples,
        "probability": evaluation.probability,
        "rule": evaluation.rule,
        "alignment": evaluation.alignment.kind,
        "path_points": evaluation.walked.points,
        "path_known_largest": evaluation.walked.largest,
        "path_known_largest_line": evaluation.walked.largest_line,
        "path_known_rms": evaluation.walked.rms,
    }


__all__ = ["SCHEMA", "attributes", "dataset"]
