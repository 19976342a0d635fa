"""How a variable varies: which runs, poses and visits of one machine share its value.

At a single pose every variable has the distribution that its column states, whatever it varies
with; what differs is what two poses of one machine have in common.

    with the machine    one value for all that the machine does
    with the run        one value for all poses of a run
    with position       t(q) at the joint coordinate q of a drive, from one phase for the machine
    with direction      the flank by the way into the pose; before the drive moves one value
    with each visit     another value at every pose that is gone to

The two laws of position, with the phase u in [0, 1) as likely anywhere:

    ripple      t = sin(2 pi (q / period + u))                              arcsine
    rounding    t = 2 (r(q / step - u) - (q / step - u)),   r: nearest      uniform

`docs/variation.md` has the reasons.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from truepose.arrays import Floats
from truepose.errors import Fault
from truepose.files import varies
from truepose.files.quantity import refuse
from truepose.probability.distributions import ARCSINE, UNIFORM, Distribution


@dataclass(frozen=True)
class Ripple:
    """A sine of unknown phase of the coordinate of joint number `joint`; `period` in m or rad."""

    joint: int
    period: float

    @property
    def distribution(self) -> Distribution:
        """Of t at a single coordinate, the phase as likely anywhere."""
        return ARCSINE

    def at(self, q: Floats, phase: Floats) -> Floats:
        """t at joint coordinates q and phases in [0, 1); their shapes broadcast."""
        t: Floats = np.sin(math.tau * (q / self.period + phase))
        return t


@dataclass(frozen=True)
class Rounding:
    """The coordinate of joint number `joint` rounded to a grid of `step`, m or rad, at any origin.

    t is the rounded coordinate less the true one, in half steps.
    """

    joint: int
    step: float

    @property
    def distribution(self) -> Distribution:
        """Of t at a single coordinate, the grid's origin as likely anywhere."""
        return UNIFORM

    def at(self, q: Floats, phase: Floats) -> Floats:
        """t at joint coordinates q and origins in [0, 1) of a step; their shapes broadcast."""
        steps = q / self.step - phase
        t: Floats = np.rint(steps)
        t -= steps
        t *= 2.0
        return t


Law = Ripple | Rounding


@dataclass(frozen=True)
class Variation:
    """What the variable of a column varies with; `law`: of one that varies with position."""

    word: str
    law: Law | None = None

    @property
    def along_the_way(self) -> bool:
        """Whether two poses of one run of one machine may have two values of the variable."""
        return self.word in (varies.POSITION, varies.VISIT)


WITH_MACHINE = Variation(varies.MACHINE)
"""One value for all that the machine does."""

WITH_RUN = Variation(varies.RUN)
"""One value for all poses of a run."""

WITH_DIRECTION = Variation(varies.DIRECTION)
"""The source takes the flank from the way; where that is not known yet, one value."""

WITH_VISIT = Variation(varies.VISIT)
"""Another value at every pose that is gone to."""

_OF_WORD: Mapping[str, Variation] = {
    one.word: one for one in (WITH_MACHINE, WITH_RUN, WITH_DIRECTION, WITH_VISIT)
}


def with_position(law: Law) -> Variation:
    """By a law of a joint's coordinate."""
    return Variation(varies.POSITION, law)


def variation(word: str | None, default: Variation) -> Variation:
    """What the file's `word` says, in place of `default`; None: it says nothing.

    "position" is only what a source has a law for, its `default` then.
    """
    return default if word in (None, default.word) else _OF_WORD[str(word)]


def refuse_without_band(key: str, because: str, found: str, expected: str) -> None:
    """Refuse `key` of something that has no band, so that nothing varies in it."""
    refuse(
        Fault(
            "excluding-keys",
            f"{key} says what varies, and {because}",
            found=found,
            expected=expected,
            hint=varies.HINT,
        )
    )
