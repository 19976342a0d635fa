"""A whole face of the workspace out of reach."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from truepose._kernel import STATUS
from truepose.language import grouped, say
from truepose.plausibility._base import OK, MachineAtHome, Remark, Rule
from truepose.runs.poses import reason_text


def inspect(view: MachineAtHome) -> Iterator[Remark]:
    """Poses on each face of the grid; all poses, where none can be used."""
    usable = view.status == OK
    if not usable.size:
        return
    if not usable.any():
        yield (
            say(
                "none of the workspace's {count} poses can be used ({status}); usual is all. Look "
                "at the unit of the workspace, at travels and working modes. No accuracy can be "
                "answered for it",
                count=grouped(usable.size),
                status=_why(view.status),
            ),
            ("workspace",),
        )
        return
    machine = view.machine
    assert machine.workspace is not None
    for at, axis in enumerate(machine.workspace.axes):
        if axis.count < 2:
            continue
        for end in (axis.start, axis.stop):
            face = view.poses[:, at] == end
            if usable[face].any():
                continue
            unit = machine.shown.pose(axis.name)
            yield (
                say(
                    "the whole face {name} = {end} of the workspace is out of reach: none of its "
                    "{count} poses can be used ({status}); usual is that a workspace is what is "
                    "reached. Look at that end of the grid. If it is meant, leave it: these poses "
                    "are left out",
                    name=axis.name,
                    end=unit.text(end),
                    count=grouped(int(face.sum())),
                    status=_why(view.status[face]),
                ),
                (f"workspace.grid.{axis.name}",),
            )


def _why(status: np.ndarray) -> str:
    codes, counts = np.unique(status, return_counts=True)
    return say("most often {status}", status=reason_text(STATUS[codes[np.argmax(counts)]]))


RULE = Rule(
    "workspace-face",
    "no pose of a face of the workspace, or of the whole of it, can be used",
    "No threshold: every pose on that end of one axis of the grid was tried.",
    inspect,
)
