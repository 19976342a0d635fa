"""A strut that was copied and not changed."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import numpy as np

from truepose.language import say
from truepose.plausibility._base import MachineAtHome, Remark, Rule

SAME = 1e-6
"""Of the machine's size."""


def inspect(view: MachineAtHome) -> Iterator[Remark]:
    """Pairs of struts with both joint centres in common, at home."""
    for one, other in combinations(range(len(view.machine.struts)), 2):
        apart = np.abs(view.centres[one] - view.centres[other]).max()
        if apart < SAME * view.size:  # not where one is unknown
            names = view.machine.struts[one].part, view.machine.struts[other].part
            yield (
                say(
                    "{one} and {other} have both joint centres in common; usual is that no two "
                    "struts do, as the second holds nothing that the first does not. Look whether "
                    "one was copied and its points not changed. If it is meant, leave it",
                    one=names[0],
                    other=names[1],
                ),
                names,
            )


RULE = Rule(
    "doubled-strut",
    "two struts have both joint centres in common",
    "A millionth of the machine's size: two closures that are one make every pose singular, unless "
    "there are more closures than freedoms.",
    inspect,
)
