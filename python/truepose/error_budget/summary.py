"""The budget of any number of poses: what is highest, where, and how the sources compare.

No row of a pose is kept, so that memory does not grow with the poses; parts of them may be
evaluated by other processes.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from truepose.arrays import Flags, Floats, Indices
from truepose.cluster.evaluator import TaskEvaluator
from truepose.error_budget.at_poses import SCHEMA, evaluate_block
from truepose.error_budget.comparison import Highest
from truepose.error_budget.tally import Tally
from truepose.machine import Condition, Machine
from truepose.machine.workspace import PoseTable
from truepose.runs.dataset import (
    DatasetRows,
    Schema,
    Variable,
    label,
    overall_dataset,
    sizes,
)
from truepose.runs.divided import RunPart, in_parts
from truepose.runs.poses import (
    BLOCK,
    PoseRun,
    Progress,
    is_path,
    no_pose_left,
    requested_table,
    required_sources,
)
from truepose.runs.quantities import quantities
from truepose.sources import PoseBlock, Source

if TYPE_CHECKING:
    import xarray as xr

_PEAKS: Mapping[str, str] = {
    "highest_error": "error",
    "highest_reach": "reach",
    "overall_highest_error": "overall_error",
}
"""What is highest over poses beside what every budget says, and of which variable."""

SUMMARY: Schema = {
    **{name: variable for name, variable in SCHEMA.items() if "pose" not in variable.dims},
    "highest_error": Variable(("source", "component"), "component", "highest |error| over poses"),
    "highest_reach": Variable(("source", "component"), "component", "highest reach over poses"),
    "overall_highest_error": Variable(
        ("component",), "component", "highest |overall_error| over poses"
    ),
    "highest_linear_maximum": Variable(
        ("quantity",), "quantity", "highest linear_maximum over poses"
    ),
    "highest_at": Variable(
        ("quantity", "commanded"), "commanded", "first pose with the highest linear_maximum"
    ),
    "left_out_count": Variable(("reason",), "1", "poses that cannot be used", np.intp),
}
"""Variables of a budget of which no pose is kept."""


@dataclass(frozen=True)
class _Common:
    """What the parts of a summary have in common."""

    machine: Machine
    poses: PoseTable
    condition: Condition
    path: bool
    sources: tuple[Source, ...]

    def run(self) -> PoseRun:
        """The walk over the poses, from the first on."""
        return PoseRun(self.machine, self.poses, self.condition, path=self.path)


class _Summary:
    """The summary of some poses, added up part by part."""

    def __init__(self, machine: Machine, n_source: int) -> None:
        n_component, n_quantity = len(machine.components), len(quantities(machine.components))
        self.tally = Tally(machine, n_source)
        self.left_out: Counter[str] = Counter()
        self._peaks = {
            name: Highest((n_source, n_component)[name.startswith("overall") :]) for name in _PEAKS
        }
        self._highest = np.full(n_quantity, -1.0)
        self._at: Indices = np.zeros(n_quantity, np.intp)

    def add(self, block: PoseBlock, values: Mapping[str, np.ndarray], usable: Flags) -> None:
        """The poses of a block where `usable` (n,), which the tally has."""
        if not usable.any():
            return
        for name, running in self._peaks.items():
            running.add(values[_PEAKS[name]][usable])
        lengths, numbers = values["linear_maximum"][usable], block.indices[usable]
        rows = lengths.argmax(axis=0)
        self._raise_to(lengths[rows, np.arange(rows.size)], numbers[rows])

    def join(self, later: _Summary) -> None:
        """The poses that follow."""
        self.tally.join(later.tally)
        self.left_out.update(later.left_out)
        for name, running in self._peaks.items():
            running.raise_to(later._peaks[name].value)
        self._raise_to(later._highest, later._at)

    def _raise_to(self, highest: Floats, at: Indices) -> None:
        higher = highest > self._highest
        self._highest = np.where(higher, highest, self._highest)
        self._at = np.where(higher, at, self._at)

    def over_all(self, poses: PoseTable) -> dict[str, Any]:
        """Every variable of `SUMMARY`; `poses`: all that were asked for."""
        return {
            **self.tally.over_all(),
            **{name: running.value for name, running in self._peaks.items()},
            "highest_linear_maximum": self._highest,
            "highest_at": poses[self._at],
            "left_out_count": np.array(list(self._reasons.values()), np.intp),
        }

    @property
    def _reasons(self) -> dict[str, int]:
        return dict(sorted(self.left_out.items()))

    @property
    def reasons(self) -> list[str]:
        """Why poses are left out."""
        return list(self._reasons)


def summary(
    machine: Machine,
    poses: ArrayLike | None,
    condition: Condition | None,
    progress: Progress | None,
    evaluator: TaskEvaluator,
) -> xr.Dataset:
    """The Dataset of `SUMMARY`; arguments and errors are those of `truepose.budget`."""
    given = machine.condition if condition is None else condition
    table = requested_table(machine, poses)
    sources = required_sources(machine, given)
    common = _Common(machine, table, given, poses is None and is_path(machine), sources)

    def told(done: int) -> None:
        if progress is not None:
            progress(done, len(table))

    whole = _Summary(machine, len(sources))
    for part in in_parts(common.run(), _summarised, common, evaluator, told):
        whole.join(part)
    if whole.tally.count == 0:
        raise no_pose_left(machine, table, whole.left_out, of_file=poses is None)
    coords = {
        "source": label("source", [source.name for source in sources], "error source"),
        "distribution": label(
            "source", whole.tally.distributions(), "distribution inside the band"
        ),
        "reason": label("reason", whole.reasons, "why poses cannot be used"),
    }
    result = overall_dataset(machine, given, SUMMARY, whole.over_all(table), coords)
    return result.assign_attrs(
        poses_used=whole.tally.count,
        poses_left_out=len(table) - whole.tally.count,
        warnings=json.dumps(whole.tally.warnings()),
    )


def _summarised(common: _Common, part: RunPart) -> _Summary:
    """The summary of a part of the poses."""
    run = common.run()
    run.arrive(part.travel)
    n_source = len(common.sources)
    room = sizes(common.machine, min(BLOCK, part.stop - part.start), source=n_source)
    rows = DatasetRows(common.machine, SCHEMA, room)
    made = _Summary(common.machine, n_source)
    for block in run.between(part.start, part.stop):
        values = rows.room(block.indices.size)
        usable = evaluate_block(run, common.sources, block, values, made.tally)
        made.add(block, values, usable)
    made.left_out = run.left_out.counts()
    return made


__all__ = ["SUMMARY", "summary"]
