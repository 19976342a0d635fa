"""An error that grows in proportion with a drive's travel, as columns of its scale and offset."""

from __future__ import annotations

from typing import TYPE_CHECKING

from truepose.sources._columns import Columns
from truepose.sources.variation import WITH_MACHINE, Variation

if TYPE_CHECKING:
    from truepose.machine import Band, Machine


def add_scale_error(
    columns: Columns,
    machine: Machine,
    drive: str,
    error: Band,
    zero_at: float,
    variation: Variation = WITH_MACHINE,
) -> None:
    """An error that grows in proportion with the travel from `zero_at` (m or rad) of a drive.

    `drive`: its path. Scale and offset share one variable: they turn the line of position over
    joint coordinate about the point at `zero_at`.
    """
    scale = machine.parameters.index(f"{drive}.scale")
    per_error = float(machine.nominal[scale])
    group = columns.new_group()
    for parameter, reach in (
        (scale, per_error),
        (machine.parameters.index(f"{drive}.offset"), -per_error * zero_at),
    ):
        # Neither goes to its edge: the offset is here but the other half of a scale.
        if reach != 0.0:
            columns.add(
                parameter,
                error.shift * reach,
                error.half * reach,
                group=group,
                edge=False,
                variation=variation,
            )
