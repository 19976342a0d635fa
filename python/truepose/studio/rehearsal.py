"""All answers of a small machine, once, before any is asked: imported where processes fork from.

What is imported, and what is worked out once for all (nodes of integration, tables of quantiles),
is then there in each process that answers. Python imports this module in the process from which the
others fork (`evaluation`), and nowhere else.
"""

from __future__ import annotations

from pathlib import Path

from truepose.machine import library
from truepose.studio.answers import ANSWERS
from truepose.studio.jobs import Job, answer
from truepose.studio.settings import Settings

MACHINE = "planar_two_slider"


def rehearse() -> int:
    """Answer everything of a machine of the library; how many answers that were."""
    text = library.text_of(MACHINE)
    every = tuple(kind.name for kind in ANSWERS)
    job = Job(0, Path(f"{MACHINE}.toml"), text, Settings(), every)
    return sum(given.problems is None for given in answer(job, lambda: False) if given.last)


rehearse()

__all__ = ["rehearse"]
