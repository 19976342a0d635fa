"""What every command over poses does: the poses asked for, the sources that act, the result's rows.

A command takes the blocks of a `Run`, computes its variables there, and fills them in:

    run = Run(machine, poses, condition, progress)
    run.begin(SCHEMA)
    for block in run:
        values, status = ...
        run.fill(block, values, status)
    return run.dataset()
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from truepose.arrays import Flags
from truepose.errors import RequestError
from truepose.machine import Condition, Machine
from truepose.runs.dataset import DatasetRows, Schema, assemble, sizes
from truepose.runs.displacement import at_shifts
from truepose.runs.poses import (
    PoseRun,
    Progress,
    is_path,
    no_pose_left,
    requested_poses,
    required_sources,
)
from truepose.runs.variables import Variables, variables_at
from truepose.sources import PoseBlock, Source

if TYPE_CHECKING:
    import xarray as xr


class Run(PoseRun):
    """The blocks of usable poses of one command, and the rows of its result."""

    rows: DatasetRows
    """What was filled in, from `begin` on."""

    def __init__(
        self,
        machine: Machine,
        poses: ArrayLike | None = None,
        condition: Condition | None = None,
        progress: Progress | None = None,
        *,
        sources: Sequence[Source] | None = None,
    ) -> None:
        """`poses` (..., n_commanded), SI, and `condition`, default the file's.

        `sources`: by default those that act. `progress` is called with (poses done, poses in all).

        Raises `RequestError`: bad-poses, no-workspace, no-source, unknown-part.
        """
        given = machine.condition if condition is None else condition
        self._table = requested_poses(machine, poses)
        self.sources = required_sources(machine, given) if sources is None else tuple(sources)
        self._of_file = poses is None
        path = self._of_file and is_path(machine)
        super().__init__(machine, self._table, given, progress, path=path)

    def begin(self, schema: Schema, **others: int) -> DatasetRows:
        """Make room for a result of `schema`; `others`: lengths of dims of its own."""
        self._schema = schema
        lengths = sizes(self.machine, len(self.poses), **others)
        self.rows = DatasetRows(self.machine, schema, lengths)
        return self.rows

    def with_variables(self) -> Iterator[tuple[PoseBlock, Variables]]:
        """The poses that belong to the run (`runs.poses`), with the sources' variables there."""
        for block in self:
            variables = variables_at(self.machine, block, self.sources)
            shifted = at_shifts(self.machine, block, variables.alone, variables.shift)
            usable = self.keep(block.indices, shifted)
            if usable.all():
                yield block, variables
            elif usable.any():
                yield block.select(usable), variables.select(usable)

    def fill(
        self, block: PoseBlock, values: Mapping[str, np.ndarray], *statuses: np.ndarray
    ) -> Flags:
        """Write `values` (n, ...) of poses where every status is ok; which these are, (n,).

        The others are set aside, as by `keep`.
        """
        usable = self.keep(block.indices, *statuses)
        self.rows.append(block, values, usable)
        return usable

    def dataset(
        self,
        *,
        over_all: Mapping[str, Any] | None = None,
        coords: Mapping[str, xr.Variable] | None = None,
    ) -> xr.Dataset:
        """The result: the rows filled, `over_all` what has no pose, and further `coords`.

        Raises `RequestError` (no-pose-left) where no pose was filled.
        """
        if self.rows.count == 0:
            raise self.no_pose_left()
        return assemble(
            self.machine,
            self.condition,
            self._schema,
            self.rows,
            self._table,
            self.left_out,
            over_all=over_all,
            coords=coords,
        )

    def no_pose_left(self) -> RequestError:
        """The error where no pose can be used."""
        return no_pose_left(self.machine, self.poses, self.left_out.counts(), of_file=self._of_file)


def in_parts(
    block: PoseBlock, variables: Variables, n_pose: int
) -> Iterator[tuple[PoseBlock, Variables]]:
    """A block and its variables, `n_pose` poses at a time."""
    numbers = np.arange(block.indices.size) // n_pose
    for number in range(numbers[-1] + 1):
        chosen = numbers == number
        yield block.select(chosen), variables.select(chosen)
