"""What an allocation comes to: the design, its cost and bound, where it binds, what it changed."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from truepose.arrays import Floats
from truepose.files.dimensions import BY_UNIT
from truepose.machine import Machine
from truepose.representation import Facts, Represented
from truepose.runs.dataset import (
    Variable,
    commanded_units,
    data_variable,
    label,
    labelled_dataset,
    provenance,
    quantity_coords,
)
from truepose.runs.quantities import quantities

if TYPE_CHECKING:
    import xarray as xr

    from truepose.design.region_proof import RegionProof
    from truepose.design.shares_kept import SharesKept

NOT_PROVEN, THESE_POSES, REGION = "none", "these poses", "region"
"""How far a design is proven."""

KNOWN, OTHERS = "known deviations", "other bands"
"""What adds to an error besides the rows of the file."""


@dataclass(frozen=True)
class ChosenGrade:
    """The grade of a tie: its `name`, the row `of` the file, `features` with `halves`, SI."""

    name: str
    of: str
    grade: str
    cost: float
    features: tuple[str, ...]
    halves: tuple[float, ...]
    unit: str


@dataclass(frozen=True)
class ChosenOption:
    """The option of a choice, for all of its parts or for one."""

    choice: str
    parts: tuple[str, ...]
    option: str
    cost: float


@dataclass(frozen=True, eq=False)
class WorstPose:
    """Where the design errs most: in which `case`, at which `pose`, SI.

    `error` of the worst machine found there, solved exactly, `linear` to first order, and the
    `limit`, target less reserve; m or rad. `direction` unit vector, of the quantity's components.
    `price`: by how much the cost of the relaxation falls where the limit rises by all of itself;
    0 where another pose decides.
    """

    case: str
    quantity: str
    pose: Floats
    direction: Floats
    error: float
    linear: float
    limit: float
    price: float


@dataclass(frozen=True)
class Contribution:
    """What a row of `[[cost.tolerance]]`, or what is not chosen, adds to the worst error.

    To first order, along its direction at the worst pose of the machine as filed, and of the
    design; m or rad. Signed for what is known.
    """

    quantity: str
    name: str
    before: float
    after: float


@dataclass(frozen=True)
class Alternative:
    """Another design that keeps the targets, what it costs, and in what it differs.

    `differs`: what it has, and what the design has instead, such as "rods: steel, not carbon".
    """

    cost: float
    options: tuple[ChosenOption, ...]
    grades: tuple[ChosenGrade, ...]
    differs: tuple[str, ...]


@dataclass(frozen=True, eq=False, repr=False)
class Allocation(Represented):
    """The cheapest design found for a machine, as `truepose.allocate` returns it.

    `designed`: the machine with it. `cost`, and `lower_bound` of what any design costs that keeps
    target less reserve to first order, in `unit`; `gap` between them, of the cost. `targets` by
    quantity, m or rad, kept in `state` with a share `reserve` left. `proven`: "these poses" where
    the verdict proves the targets at the worst poses, the number of them `poses_proven`, "region"
    where `truepose.bounds` proves them all over the box (`region_proof` says of that, where it was
    asked for, and with a witness refutes them), else "none". `worst_poses`: the worst first.
    `one_grade`: what it would cost with all ties at the same place of their lists, `one_width` also
    between two grades; infinite where that keeps nothing, or there is one tie. `alternatives`:
    other designs, the cheapest first.
    `combinations` of options, of which some are `impossible`; `rounds`: programmes solved. Of a
    design for a `share` of all machines `kept` says which share keeps the targets, at each pose
    and at all; with `all_poses` the latter was asked. Nothing of it is proven, and `lower_bound`
    and `gap` are missing (NaN). `left_out`: poses that were looked at and that the machine cannot
    take. `interrupted`: Ctrl-C came before the gap was reached.
    """

    machine: Machine
    designed: Machine
    state: str
    cases: tuple[str, ...]
    unit: str
    cost: float
    lower_bound: float
    targets: Mapping[str, float]
    reserve: float
    options: tuple[ChosenOption, ...]
    grades: tuple[ChosenGrade, ...]
    worst_poses: tuple[WorstPose, ...]
    contributions: tuple[Contribution, ...]
    proven: str
    poses_proven: int
    combinations: int
    impossible: int
    one_grade: float
    one_width: float
    rounds: int
    left_out: int
    interrupted: bool
    gap_asked: float
    alternatives: tuple[Alternative, ...] = ()
    region_proof: RegionProof | None = None
    share: float | None = None
    all_poses: bool = False
    kept: SharesKept | None = None
    changes: tuple[str, ...] = field(default=(), repr=False)
    """What the options set, key=value."""

    def _facts(self) -> Facts:
        yield "machine", self.machine.name
        yield "cost", f"{self.cost:.6g} {self.unit}".strip()
        if self.kept is None:
            yield "lower bound", self.lower_bound
            yield "gap", f"{100.0 * self.gap:.2g} %"
        else:
            yield "share of machines at each pose", self.kept.each_pose
            yield "share of machines at all poses", self.kept.all_poses
        yield "options", ", ".join(f"{one.choice}: {one.option}" for one in self.options) or None
        yield "proven", self.proven
        yield "interrupted", self.interrupted

    @property
    def gap(self) -> float:
        """By which share of the cost a cheaper design is not excluded."""
        if math.isnan(self.lower_bound):
            return math.nan
        return 0.0 if self.cost <= 0.0 else max(0.0, 1.0 - self.lower_bound / self.cost)

    @property
    def distinct_grades(self) -> int:
        """How many different grades there are, of each row of the file by itself."""
        return len({(one.of, one.grade) for one in self.grades})

    def text(self, beside: str | Path | None = None) -> str:
        """The machine file with the design in it, all else as it stands in the file.

        `beside`: the file that it is for, to which names of data files are made relative. Raises
        `RequestError` (bad-allocation) for a tolerance that cannot be written.
        """
        from truepose.design.design_file import design_text

        return design_text(self, beside)

    def save(self, path: str | Path) -> None:
        """Write `text` to a file, whole or not at all."""
        from truepose.files.writing import replacing

        target = Path(path)
        text = self.text(target)
        with replacing(target) as temporary:
            temporary.write_text(text, encoding="utf-8", newline="\n")

    @cached_property
    def dataset(self) -> xr.Dataset:
        """All of it as labelled data, SI; `docs/allocation.md` names the variables."""
        return _dataset(self)


def money_unit(unit: str) -> str:
    """The unit of a cost in a result: one that is called like a length would be converted."""
    return "1" if not unit or unit in BY_UNIT else unit


def _dataset(result: Allocation) -> xr.Dataset:
    machine = result.machine
    kinds = list(quantities(machine.components))
    rows = [(one, at) for one in result.grades for at in range(len(one.features))]
    commanded = commanded_units(machine)
    worst = result.worst_poses
    names = list(dict.fromkeys(one.name for one in result.contributions))
    contributed = np.full((2, len(names), len(kinds)), np.nan)
    for one in result.contributions:
        at = names.index(one.name), kinds.index(one.quantity)
        contributed[:, at[0], at[1]] = one.before, one.after
    sizes = np.full((3, len(worst), len(kinds)), np.nan)
    for number, witness in enumerate(worst):
        at_kind = kinds.index(witness.quantity)
        sizes[:, number, at_kind] = witness.error, witness.linear, witness.limit
    targets = [result.targets.get(kind, np.nan) for kind in kinds]
    units = {
        "feature": [one.unit for one, _ in rows],
        "quantity": [str(unit) for unit in quantity_coords(machine)["quantity_units"].values],
    }

    def variable(dims: tuple[str, ...], values: object, unit: str, meaning: str) -> xr.Variable:
        return data_variable(Variable(dims, unit, meaning), values, units)

    money = money_unit(result.unit)
    halves = np.array([one.halves[at] for one, at in rows], np.float64)
    over = ("worst", "quantity")
    data = {
        "half": variable(("feature",), halves, "feature", "half width of the tolerance chosen"),
        "cost": variable((), result.cost, money, "cost of the design"),
        "lower_bound": variable(
            (), result.lower_bound, money, "bound of the cost to first order, target less reserve"
        ),
        "cost_one_grade": variable((), result.one_grade, money, "cost with one grade for all ties"),
        "cost_one_width": variable(
            (), result.one_width, money, "cost with one place for all ties, also between grades"
        ),
        "grade_cost": variable(
            ("tie",), [one.cost for one in result.grades], money, "cost of the grade"
        ),
        "option_cost": variable(
            ("choice",), [one.cost for one in result.options], money, "cost of the option"
        ),
        "target": variable(("quantity",), targets, "quantity", "largest error allowed"),
        "error": variable(over, sizes[0], "quantity", "largest error found there, exact"),
        "error_linear": variable(over, sizes[1], "quantity", "the same to first order"),
        "limit": variable(over, sizes[2], "quantity", "target less reserve"),
        "price": variable(
            ("worst",),
            [one.price for one in worst],
            money,
            "by how much the relaxation's cost falls where the limit rises by all of itself",
        ),
        "alternative_cost": variable(
            ("alternative",),
            [one.cost for one in result.alternatives],
            money,
            "cost of the other design",
        ),
        "contribution_before": variable(
            ("contributor", "quantity"), contributed[0], "quantity", "at the worst pose as filed"
        ),
        "contribution_after": variable(
            ("contributor", "quantity"), contributed[1], "quantity", "at the worst pose designed"
        ),
    }
    text = np.array
    labels = {
        "feature": label("feature", [one.features[at] for one, at in rows], "parameter"),
        "feature_units": label("feature", units["feature"], "unit of the parameter's deviation"),
        "feature_tie": label("feature", [one.name for one, _ in rows], "tie of the parameter"),
        "tie": label("tie", [one.name for one in result.grades], "what has one grade together"),
        "tie_of": label("tie", [one.of for one in result.grades], "row of the file"),
        "grade": label("tie", [one.grade for one in result.grades], "grade chosen"),
        "choice": label(
            "choice", text([_label(one) for one in result.options], dtype=object), "choice"
        ),
        "option": label(
            "choice", text([one.option for one in result.options], dtype=object), "option chosen"
        ),
        "worst": label("worst", np.arange(len(worst)), "number of the pose, the worst first"),
        "worst_case": label("worst", [one.case for one in worst], "condition"),
        "worst_quantity": label("worst", [one.quantity for one in worst], "what errs so much"),
        "alternative": label(
            "alternative",
            text(["; ".join(one.differs) for one in result.alternatives], dtype=object),
            "in what the other design differs",
        ),
        "contributor": label("contributor", names, "what adds to the worst error"),
        **quantity_coords(machine),
    }
    for column, freedom in enumerate(machine.commanded):
        values = [float(one.pose[column]) for one in worst]
        labels[f"worst_{freedom}"] = label("worst", values, f"{freedom} of it", commanded[column])
    attrs = provenance(machine, machine.condition)
    attrs |= {
        "state": result.state,
        "cases": ", ".join(result.cases),
        "cost_unit": result.unit,
        "gap": result.gap,
        "gap_asked": result.gap_asked,
        "reserve": result.reserve,
        "proven": result.proven,
        "poses_proven": result.poses_proven,
        "combinations": result.combinations,
        "combinations_impossible": result.impossible,
        "rounds": result.rounds,
        "distinct_grades": result.distinct_grades,
        "poses_left_out": result.left_out,
        "options_set": "; ".join(result.changes),
        "interrupted": int(result.interrupted),
    }
    if result.region_proof is not None:
        attrs |= {
            "region_unproven": result.region_proof.why,
            "region_boxes": result.region_proof.boxes,
        }
    if result.kept is not None:
        attrs |= {
            "share": result.share or 0.0,
            "at_all_poses": int(result.all_poses),
            "share_each_pose": result.kept.each_pose,
            "share_each_pose_error": result.kept.each_pose_error,
            "share_all_poses": result.kept.all_poses,
            "share_all_poses_error": result.kept.all_poses_error,
            "share_poses": result.kept.poses,
        }
    return labelled_dataset(data, labels, attrs)


def _label(option: ChosenOption) -> str:
    return option.choice if len(option.parts) != 1 else f"{option.choice}: {option.parts[0]}"


__all__ = [
    "KNOWN",
    "NOT_PROVEN",
    "OTHERS",
    "REGION",
    "THESE_POSES",
    "Allocation",
    "Alternative",
    "ChosenGrade",
    "ChosenOption",
    "Contribution",
    "WorstPose",
    "money_unit",
]
