"""A home pose that the machine cannot have."""

from __future__ import annotations

from collections.abc import Iterator

from truepose._kernel import STATUS
from truepose.language import say
from truepose.plausibility._base import MachineAtHome, Remark, Rule
from truepose.runs.poses import faults_text, reason_text

NAMED = 2
"""Parts whose fault is told."""


def inspect(view: MachineAtHome) -> Iterator[Remark]:
    """Whether all drives reach home; which part fails by how much."""
    if view.is_reached:
        return
    machine = view.machine
    faults = machine.kernel.explain(view.pose[0])
    because = faults_text(machine, faults[:NAMED])
    if len(faults) > NAMED:
        because += " " + say("and {count} more", count=len(faults) - NAMED)
    why = reason_text(STATUS[view.placed[2]])
    yield (
        say(
            "home cannot be used ({why}); usual is a home inside the workspace. Look "
            "at [workspace] home, without which it is the middle of the grid, and at units and "
            "travels. If it is meant, leave it",
            why=f"{why}: {because}" if because else why,
        ),
        ("workspace.home",),
    )


RULE = Rule(
    "home-out-of-reach",
    "the machine cannot be at its home pose",
    "No threshold. Forward solutions start at home, and where it is out of reach all other rules "
    "see the machine only in part.",
    inspect,
)
