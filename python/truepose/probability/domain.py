"""Where the variables of a set can lie, and the most that a linear function of them can be there.

A variable t lies between the ends of its distribution: -1 and 1, but for listed values that are not
symmetric about their mean. The two or three components of a direction that is not known lie on the
unit circle or sphere together. Over such a set

    h(a) = max of a . t = sum over single variables of max(a lower, a upper)
                          + sum over directions of the length of their part of a

is the support function (Rockafellar, Convex Analysis, 1970, section 13): a box, and round balls.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from truepose.arrays import Flags, Floats, Indices
from truepose.probability.distributions import Distribution
from truepose.representation import Represented


@dataclass(frozen=True, eq=False, repr=False)
class Domain(Represented):
    """`lower`, `upper` (v,): ends of each variable; `directions`: variables that are a unit vector.

    The variables of one of `directions` have the ends -1 and 1.
    """

    lower: Floats
    upper: Floats
    directions: tuple[Indices, ...] = ()

    @classmethod
    def of(cls, distributions: Sequence[Distribution], directions: Sequence[Indices] = ()) -> Self:
        """Of variables (v,) with these distributions."""
        ends = np.array([distribution.ends for distribution in distributions], np.float64).reshape(
            -1, 2
        )
        return cls(
            ends[:, 0].copy(),
            ends[:, 1].copy(),
            tuple(np.asarray(members, np.intp) for members in directions),
        )

    @cached_property
    def middle(self) -> Floats:
        """(v,) between the ends: 0 but for listed values that are not symmetric."""
        middle: Floats = 0.5 * (self.lower + self.upper)
        return middle

    @cached_property
    def half(self) -> Floats:
        """(v,) from the middle to either end."""
        half: Floats = 0.5 * (self.upper - self.lower)
        return half

    @cached_property
    def symmetric(self) -> bool:
        """Whether every variable lies in [-1, 1]."""
        return bool((self.lower == -1.0).all() and (self.upper == 1.0).all())

    @cached_property
    def single(self) -> Flags:
        """(v,) whether the variable is no component of a direction."""
        single = np.ones(self.lower.size, np.bool_)
        for members in self.directions:
            single[members] = False
        return single

    def support(self, slopes: Floats, scratch: Floats | None = None) -> Floats:
        """(...,) the most of slopes . t, from slopes (..., v).

        `scratch`: where what is on the way may go, such as `slopes` itself.
        """
        offset = None if self.symmetric else slopes @ self.middle
        lengths = [np.sqrt(np.square(slopes[..., at]).sum(axis=-1)) for at in self.directions]
        # A product with ones, which is several times as quick as a sum along a short axis.
        most: Floats = np.abs(slopes, out=scratch) @ np.where(self.single, self.half, 0.0)
        if offset is not None:
            most = most + offset
        for length in lengths:
            most = most + length
        return most

    def reach(self, slopes: Floats, scratch: Floats | None = None) -> tuple[Floats, Floats]:
        """How far slopes . t goes down and up, (...,) each and both counted positive.

        From slopes (..., v). Without listed values that are not symmetric the two are one.
        `scratch` as for `support`.
        """
        if self.symmetric:
            both = self.support(slopes, scratch)
            return both, both
        down = self.support(-slopes)
        return down, self.support(slopes, scratch)

    def most_along(self, slopes: Floats) -> Floats:
        """(..., v) the variables at which slopes . t, from slopes (..., v), is largest.

        Where a variable has no slope any value will do: its upper end, a direction's first axis.
        """
        t = np.where(slopes >= 0.0, self.upper, self.lower)
        for members in self.directions:
            t[..., members] = unit(slopes[..., members])
        return t


def unit(vectors: Floats) -> Floats:
    """(..., d) vectors of length one along `vectors`; the first axis where those are zero."""
    axis = np.zeros(vectors.shape[-1])
    axis[0] = 1.0
    # Divided by the largest component first: squares of tiny numbers are zero.
    largest = np.abs(vectors).max(axis=-1, keepdims=True)
    scaled = np.divide(vectors, largest, out=np.zeros_like(vectors), where=largest > 0.0)
    size = np.sqrt(np.square(scaled).sum(axis=-1, keepdims=True))
    along: Floats = np.where(
        size > 0.0, np.divide(scaled, size, out=np.zeros_like(scaled), where=size > 0.0), axis
    )
    return along


__all__ = ["Domain", "unit"]
