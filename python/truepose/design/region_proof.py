"""Whether a design is proven at every pose of the box, not at some: by interval derivatives.

The bounds of `truepose.bounds` over the box of the workspace, in each condition, divided until they
are below the targets, or a pose is met with a machine inside the bands that is above one, or no
further. What is only searched is no proof: without this a design is proven at poses.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from truepose.design.judged_poses import JudgedPoses
from truepose.errors import RequestError
from truepose.machine import Condition, Machine
from truepose.runs.poses import Progress, pose_in_words
from truepose.uncertainty_analysis.bounds import PROVEN
from truepose.uncertainty_analysis.bounds_over_region import bounds_over_region
from truepose.uncertainty_analysis.truncation import Ends

_LEAST_GAP = 1e-3
"""The finest that `truepose.bounds` takes."""

_MOST_GAP = 0.05
_OF_ROOM = 0.9
"""Of the room between what is reached and the target, how much the gap may take up."""


@dataclass(frozen=True)
class RegionWitness:
    """In which `condition` and quantity, and at which pose (n_commanded,), an `error` is reached.

    m and rad.
    """

    condition: str
    quantity: str
    pose: tuple[float, ...]
    error: float

    def in_words(self, machine: Machine) -> str:
        """Such as "in hot a machine inside its bands has a position error of 0.2 mm at x = ..."."""
        size = machine.shown.error(self.quantity).text(self.error, 5)
        return (
            f"in {self.condition} a machine inside its bands has a {self.quantity} error of {size} "
            f"at {pose_in_words(machine, self.pose)}"
        )


@dataclass(frozen=True)
class RegionProof:
    """Whether the targets are `kept` all over the box, and `why` not, empty where they are.

    `bound`: the largest proven by quantity over all conditions, m or rad; infinite of none.
    `boxes`: parts of the box that were looked at. `witness`: where a machine inside the bands was
    met that is above a target, if one was.
    """

    kept: bool
    why: str
    bound: Mapping[str, float]
    boxes: int
    witness: RegionWitness | None = None


def prove_region(
    machine: Machine,
    conditions: Mapping[str, Condition],
    targets: Mapping[str, float],
    largest: Mapping[str, float],
    progress: Progress | None = None,
) -> RegionProof:
    """Of a design's `machine`; `largest`: errors found, by quantity.

    From them it follows how close bounds have to be, and so along which freedom parts are divided.
    Before compensation. `progress` as of `truepose.bounds`.
    """
    places = JudgedPoses.of(machine)
    bound = dict.fromkeys(targets, float("inf"))
    if places.listed is not None:
        return RegionProof(False, "the workspace lists poses, and has no box", bound, 0)
    sides = zip(places.lower.tolist(), places.upper.tolist(), strict=True)
    region = dict(zip(machine.commanded, sides, strict=True))
    room = min(
        (target / largest[kind] - 1.0 for kind, target in targets.items() if largest[kind] > 0.0),
        default=_MOST_GAP,
    )
    gap = min(max(_OF_ROOM * room, _LEAST_GAP), _MOST_GAP)
    boxes, reached = 0, dict.fromkeys(targets, 0.0)
    for name, condition in conditions.items():
        try:
            proof = bounds_over_region(
                machine, condition, region, gap, Ends.of(None), None, progress, targets
            )
        except RequestError as refusal:
            problem = refusal.problems[0]
            return RegionProof(False, f"{problem.message} ({problem.found})", bound, boxes)
        boxes += int(proof["boxes"])
        for kind, target in targets.items():
            of = proof.sel(quantity=kind)
            if float(of["reached_magnitude"]) > target:
                pose, error = of["where_magnitude"].values.tolist(), float(of["reached_magnitude"])
                met = RegionWitness(name, kind, tuple(pose), error)
                return RegionProof(False, met.in_words(machine), bound, boxes, met)
        if str(proof["status"].values) != PROVEN:
            why = f"{str(proof['status'].values).replace('_', ' ')} in {name}"
            return RegionProof(False, why, bound, boxes)
        for kind in targets:
            size = float(proof["magnitude"].sel(quantity=kind))
            reached[kind] = max(reached[kind], size)
        beyond = [kind for kind, target in targets.items() if not reached[kind] <= target]
        if beyond:
            ended = "it was interrupted" if proof.attrs["interrupted"] else "parts ran out"
            why = f"the bound of the {beyond[0]} in {name} is above its target, and {ended}"
            return RegionProof(False, why, reached, boxes)
    return RegionProof(True, "", reached, boxes)


__all__ = ["RegionProof", "RegionWitness", "prove_region"]
