"""All answers of a small machine, once, before any is asked: imported where processes fork from.

What is imported, and what is worked out once for all (nodes of integration, tables of quantiles),
is then there in each process that answers. Python imports this module in the process from which the
others fork (`evaluation`), and nowhere else.
"""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

from truepose.errors import TrueposeError
from truepose.files.units import UnitSystem
from truepose.machine import library
from truepose.studio.answers import ANSWERS
from truepose.studio.jobs import Job, answer
from truepose.studio.settings import Settings

MACHINE = "planar_two_slider"


SELDOM_READ = "1 furlong"
"""A length in a unit that is not among the common ones: reading it imports pint."""


def rehearse() -> int:
    """Answer everything of a machine of the library; how many answers that were."""
    UnitSystem({}).read(SELDOM_READ, "length")
    text = library.text_of(MACHINE)
    every = tuple(kind.name for kind in ANSWERS)
    job = Job(0, Path(f"{MACHINE}.toml"), text, Settings(), every)
    return sum(given.problems is None for given in answer(job, lambda: False) if given.last)


# Without it all is slower, and nothing is wrong: the answers themselves will say what is.
with suppress(TrueposeError):
    rehearse()

__all__ = ["rehearse"]
