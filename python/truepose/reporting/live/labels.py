"""What the live part of a page says, by the names that its scripts have for it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from truepose.language import say

PLAIN = {
    "all_parts": "All parts",
    "as_commanded": "as commanded",
    "asked": "asked: {target}",
    "banded": "What it leaves unknown is left out, too.",
    "compensated": "compensated",
    "drawn": "{count} machines drawn at random, each solved exactly.",
    "each_part": "Each part",
    "factors": "Tolerances and stiffness",
    "failed": "not computed",
    "force_along": "force {axis}",
    "here": "Now: {low} to {high}.",
    "load": "Load on the tool",
    "magnified": "Errors are drawn {factor} times larger than they are.",
    "moment": "Moment",
    "moment_about": "moment {axis}",
    "not_live": "{source} is not live: {why}. In the condition of the file it makes up to {size} "
    "alone.",
    "pose": "Commanded pose",
    "source": "source",
    "stiffness": "stiffness",
    "temperature": "Temperature",
    "together": "all together",
    "up_to": "{quantity} up to",
    "waiting": "computing",
}

VERDICTS = {
    "computing": "computing",
    "met": "met",
    "missed": "NOT met",
    "none": "no verdict: a source is not live",
    "open": "undecided",
    "unasked": "no accuracy asked",
}

LINES = {
    "asked": "asked",
    "found": "a machine found",
    "known": "known error",
    "likely": "95 % of machines below",
    "proven": "proven: none above",
}

EXPLAINED = {
    "asked": "What the machine file asks for.",
    "found": "One machine inside its tolerances, solved exactly: none that was found is farther "
    "off.",
    "known": "The error of the machine at its known deviations, without what tolerances leave "
    "open.",
    "likely": "Of machines drawn at random within their tolerances.",
    "proven": "No machine inside its tolerances is farther off: a proof, not a sample.",
}

STATUSES = {
    "branch_lost": "Beyond a singular pose: the machine would have to be assembled otherwise.",
    "joint_limit": "Out of reach: a strut leans beyond the limit of one of its joints.",
    "not_converged": "No pose was found for these drives.",
    "out_of_travel": "Out of reach: a drive is beyond its travel.",
    "singular": "Singular pose: a freedom of the platform is not held.",
    "unreachable": "Out of reach: a strut is too short or too long for this pose.",
}

BOUNDS = {
    "box_too_wide": "tolerances too wide",
    "near_singular": "too near a singular pose",
    "no-proof": "not of an over-constrained machine",
}

# What `NoLawError` says, which the bundle has in English.
WHY_NOT = {
    "bands": "has bands that follow from the temperature or the wrench",
    "dead_zones": "has other dead zones than it says",
    "envelope": "follows from a force of unknown direction",
    "parts": "follows from temperatures in another way than part by part",
    "pose": "follows from the pose",
    "proportion": "is not in proportion to the temperature",
    "student": "has correlated variables of Student's distribution",
    "wrench": "follows from the wrench",
}

QUANTITIES = {"orientation": "orientation", "position": "position"}


def labels() -> dict[str, Any]:
    """All of it, in the language spoken."""
    return {
        **{name: say(PLAIN[name]) for name in PLAIN},
        "verdicts": {name: say(VERDICTS[name]) for name in VERDICTS},
        "lines": {name: say(LINES[name]) for name in LINES},
        "line_explained": {name: say(EXPLAINED[name]) for name in EXPLAINED},
        "statuses": {name: say(STATUSES[name]) for name in STATUSES},
        "bound_statuses": {name: say(BOUNDS[name]) for name in BOUNDS},
        "quantities": {name: say(QUANTITIES[name]) for name in QUANTITIES},
    }


def sources_said(sources: Sequence[Mapping[str, Any]]) -> dict[str, dict[str, str]]:
    """By name of each of a bundle's sources its `doc`, and `why` it is not live, as spoken."""
    reasons = {WHY_NOT[name]: say(WHY_NOT[name]) for name in WHY_NOT}
    said = {}
    for source in sources:
        doc, why = source["doc"], source.get("why")
        said[source["name"]] = {"doc": say(doc)}
        if why is not None:
            said[source["name"]]["why"] = reasons.get(why, why)
    return said
