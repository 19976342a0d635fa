"""What a kind of closures contributes to the remainder, in one form for all of them.

A closure is F(x, t) = 0, a function of the platform's displacement x and the variables t. Beyond
its linear part it has a part of second order and all the rest. Of the former what is large is told
exactly, with its sign, so that closures may cancel in what they do to the tool: products of linear
forms (`motion.py`), and of the platform's turn r with forms. The rest is bounded by a majorant
(`majorants.py`) of the movements, from which those products are taken away as they are bounded
there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from truepose.arrays import Flags, Floats

Rest = Callable[[Floats, Floats], Floats]
"""The rest (n, c) from how much further the platform moves than to first order: (n, 1) m, rad.

A power series in these without negative coefficients.
"""


@dataclass(frozen=True, eq=False)
class Products:
    """Sum over k of `coefficient` (n, c, k) times two forms (n, c, k, v + m)."""

    coefficient: Floats
    one: Floats
    other: Floats


@dataclass(frozen=True, eq=False)
class Closures:
    """c closures of one kind at n poses.

    `influence` (n, m, c): what a residual of 1 does to the components of the error. Of second
    order are `products`, r . T r with `turned` T (n, c, 3, 3), symmetric, and r . Q z with
    `carried` Q (n, c, 3, v + m), or None. `rest`: the most of all that is left. `closed` (n,):
    whether the machine stands where it is said to.
    """

    influence: Floats
    products: tuple[Products, ...]
    turned: Floats
    carried: Floats | None
    rest: Rest
    closed: Flags


def turned_about(arm: Floats, along: Floats) -> Floats:
    """(..., 3, 3) T of `along . (r x (r x arm)) / 2 = r . T r`."""
    outer = arm[..., :, np.newaxis] * along[..., np.newaxis, :]
    dot = (arm * along).sum(axis=-1)[..., np.newaxis, np.newaxis]
    matrix: Floats = 0.25 * (outer + np.swapaxes(outer, -1, -2)) - 0.5 * dot * np.eye(3)
    return matrix


__all__ = ["Closures", "Products", "Rest", "turned_about"]
