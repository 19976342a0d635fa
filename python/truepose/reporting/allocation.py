"""Tables of an allocation: what was chosen, what the error is made of, where it binds."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import isfinite
from typing import TYPE_CHECKING

from truepose.design.cost_curve import options_text
from truepose.design.result import REGION, THESE_POSES
from truepose.files.wording import counted
from truepose.reporting.display import column, pose_text
from truepose.reporting.table import Table
from truepose.verdict.answer import BEFORE

if TYPE_CHECKING:
    from truepose.design.cost_curve import CostCurve
    from truepose.design.result import Allocation, ChosenGrade

MOST_DIFFERS = 4
"""Differences of another design that are shown."""

MOST_WORST = 8
"""Worst poses that are shown; the data have all that are kept."""


def tables(result: Allocation) -> Iterator[Table]:
    """Everything of an allocation for people."""
    if result.options:
        yield options(result)
    if result.grades:
        yield grades(result)
    if result.alternatives:
        yield alternatives(result)
    yield contributions(result)
    yield worst_poses(result)


def money(result: Allocation, cost: float) -> str:
    """A cost with its unit."""
    return (
        f"{cost:.4g} {result.unit}".strip()
        if cost < 1000.0
        else f"{cost:.0f} {result.unit}".strip()
    )


def options(result: Allocation) -> Table:
    """The option of every choice."""
    return Table(
        "options",
        "Options",
        ("choice", "parts", "option", _header("cost", result.unit)),
        tuple(
            (one.choice, ", ".join(one.parts), one.option, f"{one.cost:.6g}")
            for one in result.options
        ),
        words=3,
    )


def grades(result: Allocation) -> Table:
    """The grades, those of one row of the file that are alike in one line."""
    rows = []
    by_grade: dict[tuple[str, str], list[ChosenGrade]] = {}
    for one in result.grades:
        by_grade.setdefault((one.of, one.grade), []).append(one)
    for (of, grade), alike in by_grade.items():
        names = ", ".join(one.name for one in alike)
        rows.append((of, names, grade, f"{sum(one.cost for one in alike):.6g}"))
    return Table(
        "grades",
        "Tolerances",
        ("row", "what has one grade", "grade (half width)", _header("cost", result.unit)),
        tuple(rows),
        words=3,
    )


def alternatives(result: Allocation) -> Table:
    """Other designs, and what they cost."""
    return Table(
        "alternatives",
        "Other designs",
        ("in what it differs", _header("cost", result.unit)),
        tuple((_few(one.differs), f"{one.cost:.6g}") for one in result.alternatives),
    )


def _few(differs: Sequence[str]) -> str:
    """The first of them, and how many more there are."""
    shown = list(differs[:MOST_DIFFERS])
    if len(differs) > MOST_DIFFERS:
        shown.append(f"and {counted(len(differs) - MOST_DIFFERS, 'grade')} more")
    return "; ".join(shown)


def contributions(result: Allocation) -> Table:
    """What the worst error is made of, as filed and designed."""
    units = result.machine.shown
    header = ["what adds to the worst error"]
    columns = []
    kinds = dict.fromkeys(one.quantity for one in result.contributions)
    for kind in kinds:
        unit = units.error(kind)
        own = [one for one in result.contributions if one.quantity == kind]
        for word, values in (
            ("as filed", [one.before for one in own]),
            ("designed", [one.after for one in own]),
        ):
            header.append(f"{kind} {word}, {unit.label}")
            columns.append(column([*(v * unit.per_si for v in values), sum(values) * unit.per_si]))
    names = list(dict.fromkeys(one.name for one in result.contributions))
    return Table(
        "contributions",
        "What the largest error is made of",
        tuple(header),
        tuple(zip([*names, "together"], *columns, strict=True)),
        note="To first order, along the largest error at the worst pose of each."
        if result.kept is None
        else "What the mean error does, and of the rest the parts of the variance, at the worst "
        "pose of each.",
    )


def worst_poses(result: Allocation) -> Table:
    """Where the design errs most."""
    units = result.machine.shown
    rows = []
    for one in result.worst_poses[:MOST_WORST]:
        unit = units.error(one.quantity)
        cells = column([one.error * unit.per_si, one.limit * unit.per_si])
        pose = pose_text(one.pose, result.machine.commanded, units)
        rows.append((one.case, pose, f"{one.quantity}, {unit.label}", *cells))
    return Table(
        "worst",
        "Where it binds",
        ("condition", "pose", "error of", "largest", "limit"),
        tuple(rows),
        words=3,
        note="The largest error found there, solved exactly; the limit is the target less the "
        "reserve."
        if result.kept is None
        else "The error that the share asked of the machines drawn there is within; the limit is "
        "the target less the reserve.",
    )


def sentences(result: Allocation) -> Iterator[str]:
    """What the allocation comes to."""
    if result.kept is None:
        yield (
            f"Cost {money(result, result.cost)}; at least {money(result, result.lower_bound)} by "
            f"the linear model at the target less {100.0 * result.reserve:.3g} %, so that the gap "
            f"is {_percent(result.gap)} %."
        )
    else:
        yield f"Cost {money(result, result.cost)}; no bound is claimed for a share of all machines."
    units = result.machine.shown
    region = result.region_proof
    witness = None if region is None else region.witness
    for kind, target in result.targets.items():
        unit = units.error(kind)
        largest = max(
            (one.error for one in result.worst_poses if one.quantity == kind), default=0.0
        )
        size = f"{largest * unit.per_si:.4g} {unit.label}"
        yield (
            f"The {kind} {_when(result)} {'is' if witness is None else 'was to be'} within "
            f"{target * unit.per_si:.4g} {unit.label}: "
            + (
                f"the largest error found is {size}"
                if result.share is None
                else f"at the worst pose {100.0 * result.share:.6g} % of the machines are within "
                f"{size}"
            )
            + (f", in {counted(len(result.cases), 'condition')}." if len(result.cases) > 1 else ".")
        )
    yield from _shares(result)
    if isfinite(result.one_grade):
        at_grade, at_width = money(result, result.one_grade), money(result, result.one_width)
        yield (
            "With all tolerances at the same place of their lists it would cost "
            f"{at_grade}, between two grades {at_width}."
        )
    saved = sum(one.price for one in result.worst_poses) / 100.0
    if saved > 0.0:
        yield f"Targets 1 % wider would save some {money(result, saved)}, between grades."
    if region is not None and witness is not None:
        yield (
            f"NOT kept all over the box: {region.why}. A larger --reserve leaves more room between "
            "the poses that are searched."
        )
    elif region is not None and result.proven != REGION:
        yield f"All over the box nothing is proven: {region.why}."
    if region is not None and result.proven == REGION:
        boxes = counted(region.boxes, "part")
        yield f"Region proven: at every pose of the box, in {boxes}."
    elif result.proven == THESE_POSES:
        yield (
            f"Proven at the {counted(result.poses_proven, 'worst pose')} found; between poses it "
            "is searched, not proven."
        )
    elif result.kept is None:
        yield "Not proven; `truepose check` says what is found and what is known."
    if result.impossible:
        yield (
            f"{result.impossible} of {counted(result.combinations, 'combination')} of options "
            "cannot keep the target at their finest."
        )
    if result.left_out:
        yield f"{counted(result.left_out, 'pose')} looked at cannot be taken, and do not count."


def _shares(result: Allocation) -> Iterator[str]:
    """Which share of the machines keeps the targets, where that was asked."""
    kept = result.kept
    if kept is None:
        return
    at_one, at_all = (
        f"{100.0 * share:.2f} % (standard error {100.0 * error:.2f} %)"
        for share, error in (
            (kept.each_pose, kept.each_pose_error),
            (kept.all_poses, kept.all_poses_error),
        )
    )
    asked = "at all poses" if result.all_poses else "at each pose"
    yield (
        f"Of machines drawn anew {at_one} are within the targets at the worst pose, {at_all} at "
        f"all of {counted(kept.poses, 'pose')} at once; asked were "
        f"{100.0 * (result.share or 0.0):g} % {asked}."
    )


def curve(result: CostCurve) -> Table:
    """What the machine costs against its position target."""
    assert result.machine.costs is not None
    unit, money_of = result.machine.shown.error("position"), result.machine.costs.unit
    return Table(
        "curve",
        "Cost against target",
        (
            f"target, {unit.label}",
            _header("cost", money_of),
            _header("at least", money_of),
            "options",
        ),
        tuple(
            (
                f"{point.target * unit.per_si:.6g}",
                f"{point.cost:.6g}" if isfinite(point.cost) else "out of reach",
                f"{point.lower_bound:.6g}" if isfinite(point.lower_bound) else "",
                options_text(point),
            )
            for point in result.points
        ),
        words=0,
        note="Position targets; all else as the file has it.",
    )


def interrupted(result: Allocation) -> str:
    """What Ctrl-C left of the search."""
    programmes = counted(result.rounds, "programme")
    return f"Interrupted after {programmes}: the design is the best of those judged clean by then."


def _percent(share: float) -> str:
    return "0" if share < 5e-5 else f"{100.0 * share:.2g}"


def _when(result: Allocation) -> str:
    return "before compensation" if result.state == BEFORE else "after compensation"


def _header(name: str, unit: str) -> str:
    return f"{name}, {unit}" if unit else name
