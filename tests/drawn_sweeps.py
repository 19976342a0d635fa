"""Which of the random machines (random_machines.py) a law with costly members takes where."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from random_machines import DRAWN, EACH, DrawnMachine
from sweeps import long_member, thinned

QUICK = DRAWN[::20]
OFTEN = {each for turn, each in enumerate(DRAWN) if turn % EACH == turn // EACH % EACH}
"""One in the neighbourhood of each machine shipped, by turns another."""


def spread(machines: Sequence[DrawnMachine]) -> list[Any]:
    """Params of a fixture: some for `make test`, of each machine shipped one for the CI."""
    often = [each for each in machines if each in OFTEN or each in QUICK]
    others = [each for each in machines if each not in often]
    return [*thinned(often, QUICK), *map(long_member, others)]
