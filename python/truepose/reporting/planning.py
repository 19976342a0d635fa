"""Tables of a plan: what each further pose buys, where the poses are, what stays unmeasured."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from truepose.calibration.planning.plan import DOMINATED
from truepose.files.wording import counted
from truepose.reporting.display import column
from truepose.reporting.result import in_file_units, pose_si
from truepose.reporting.table import Table
from truepose.reporting.tables import MOST_LISTED

if TYPE_CHECKING:
    from truepose.calibration.planning.comparison import Comparison
    from truepose.calibration.planning.plan import Plan
    from truepose.files.shown_units import Shown

NAMED = 6
"""Unknowns that are named; the others are counted."""


def tables(plan: Plan) -> Iterator[Table]:
    """Everything of a plan for people."""
    yield curve(plan)
    yield poses(plan)


def curve(plan: Plan) -> Table:
    """The uncertainty at the tool after every further pose, and what that pose buys."""
    count = len(plan.poses)
    # All of a short plan; of a long one the beginning, then ever wider steps, and the end.
    shown = np.arange(count + 1)
    if count > MOST_LISTED:
        wide = np.geomspace(MOST_LISTED // 2, count, MOST_LISTED // 2).round().astype(int)
        shown = np.unique(np.concatenate([np.arange(MOST_LISTED // 2), wide]))
    number_of = np.empty(count + 1, np.intp)
    number_of[0] = 0
    number_of[plan.rank] = np.arange(1, count + 1)
    header = ["poses", "pose added"]
    columns = [
        [str(count) for count in shown],
        ["" if n == 0 else str(number_of[n]) for n in shown],
    ]
    for at, (name, unit) in enumerate(_quantities(plan)):
        header += [f"{name} rms, {unit.label}", f"highest, {unit.label}"]
        columns += [
            _numbers(plan.rms[shown, at] * unit.per_si),
            _numbers(plan.highest[shown, at] * unit.per_si),
        ]
    unit = _quantities(plan)[0][1]
    with np.errstate(invalid="ignore"):
        bought = np.diff(plan.rms[shown, 0], prepend=np.nan) * -unit.per_si
    bought[~np.isfinite(bought)] = np.nan  # from undetermined to a number
    header.append(f"buys, {unit.label} rms")
    columns.append(_numbers(bought))
    return Table(
        "curve",
        "What each further pose buys",
        tuple(header),
        tuple(zip(*columns, strict=True)),
        words=0,
        note="Standard uncertainty of the calibrated machine at the tool, over its workspace; the "
        "poses in the order in which they buy most."
        + (
            "\nWithout where the whole machine stands, which an instrument in an unknown frame "
            "cannot tell."
            if plan.relative
            else ""
        ),
    )


def poses(plan: Plan) -> Table:
    """The poses in the order of measuring."""
    machine = plan.machine
    units = [in_file_units(machine, 0.0, pose_si(name))[1] for name in machine.commanded]
    header = ["pose", *(f"{n}, {u}" for n, u in zip(machine.commanded, units, strict=True))]
    rows = []
    for number, pose in enumerate(plan.poses[:MOST_LISTED]):
        cells = [
            f"{in_file_units(machine, float(value), pose_si(name))[0]:.6g}"
            for name, value in zip(machine.commanded, pose, strict=True)
        ]
        rows.append((str(number + 1), *cells, str(plan.rank[number])))
    more = len(plan.poses) - len(rows)
    return Table(
        "poses",
        "Poses to measure, in the order of a short way",
        (*header, "rank"),
        tuple(rows),
        words=0,
        note="Rank: the place in the table above.\n"
        f"Chosen from {plan.n_candidate:,} poses; {plan.left_out:,} cannot be used or lie "
        "near a singularity."
        + (f"\nAnd {counted(more, 'more pose')}: --output writes all." if more else "")
        + ("\nThere were fewer candidates than poses: some are measured again." * plan.repeated),
    )


def interrupted(plan: Plan) -> str:
    """What Ctrl-C left of the search."""
    starts = counted(plan.searches, "start")
    return f"Interrupted after {starts}: the plan is the best of what these came to."


def sentences(plan: Plan) -> Iterator[str]:
    """What the plan comes to."""
    name, unit = _quantities(plan)[0]
    first, last = plan.rms[[0, -1], 0] * unit.per_si
    worst = plan.highest[-1, 0] * unit.per_si
    readings = counted(len(plan.poses), "pose")
    if not np.isfinite(last):
        yield (
            f"After {readings} the {name} of the tool is not determined: measure more, or with "
            "another instrument, or give tolerances."
        )
    else:
        before = f"from {_number(first)} to" if np.isfinite(first) else "from unknown to"
        takes = "takes" if len(plan.poses) == 1 else "take"
        yield (
            f"{readings} {takes} the uncertainty of the tool's {name} {before} {_number(last)} "
            f"{unit.label} rms, {_number(worst)} {unit.label} at the worst pose."
        )
    of_machine = list(range(plan.unknowns.n_machine))
    open_ = [at for at in of_machine if not np.isfinite(plan.after[at])]
    weak = [at for at in of_machine if plan.from_data[at] < DOMINATED and at not in open_]
    for those, what in (
        (open_, "are not determined"),
        (weak, "stay known mainly from their tolerances"),
    ):
        if those:
            labels = [plan.unknowns.labels[at] for at in those[:NAMED]]
            more = f" and {len(those) - NAMED} more" if len(those) > NAMED else ""
            yield (
                f"{len(those)} of {len(of_machine)} unknowns of the machine {what}: "
                f"{', '.join(labels)}{more}."
            )


def compared(comparison: Comparison) -> Iterator[str]:
    """How many readings of one instrument do what those of another do."""
    for sentence in comparison.sentences:
        yield sentence[0].upper() + sentence[1:] + "."


def _quantities(plan: Plan) -> list[tuple[str, Shown]]:
    units = plan.machine.shown
    turns = any(name.startswith("r") for name in plan.machine.components)
    moves = any(not name.startswith("r") for name in plan.machine.components)
    return [
        *[("position", units.error("position"))] * moves,
        *[("orientation", units.error("orientation"))] * turns,
    ]


def _numbers(values: np.ndarray) -> list[str]:
    """A column; infinite values in words, missing ones blank."""
    finite = np.isfinite(values)
    cells = iter(column(values[finite]) if finite.any() else ())
    return [
        next(cells) if good else "" if np.isnan(value) else "undetermined"
        for value, good in zip(values, finite, strict=True)
    ]


def _number(value: float) -> str:
    return f"{value:.3g}" if value < 1000 else f"{value:.0f}"
