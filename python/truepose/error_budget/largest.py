"""The largest error at a pose: the largest length of a set of errors, to first order.

    error = value + effects t,    t in the domain of the variables

is a set: a point, plus a segment for each variable (a group is one), plus an ellipsoid for each
direction that is not known. Its largest length is the largest of its support function over unit
directions (`crates/kernel/src/largest`): closed from above by cones of directions, reached from
below by climbing. One machine can do that; all worst components together are no machine's.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from truepose._kernel import largest as largest_lengths
from truepose.arrays import Floats, Indices
from truepose.probability.domain import Domain


@dataclass(frozen=True)
class Largest:
    """The largest lengths of q quantities at n poses.

    `length` (n, q): from above, at most 0.05 % too large, and but for ellipsoids exact but for
    rounding; `reached` (n, q): of a point of the set; `direction` (n, q, 3): unit vector along
    which that point lies farthest, in the components of the quantity, zeros after them.
    """

    length: Floats
    reached: Floats
    direction: Floats

    @property
    def opposite(self) -> Largest:
        """The same with the opposite directions: what lies farthest there is the other end."""
        return dataclasses.replace(self, direction=-self.direction)

    def maximiser(self, effects: Floats, domain: Domain, quantities: Sequence[Indices]) -> Floats:
        """(n, q, v) the variables at which each is reached, from the same arguments."""
        maximisers = np.empty((*self.length.shape, effects.shape[2]))
        for at, columns in enumerate(quantities):
            along = self.direction[:, at, np.newaxis, : columns.size]
            maximisers[:, at] = domain.most_along((along @ effects[:, columns])[:, 0])
        return maximisers


def largest(
    value: Floats, effects: Floats, domain: Domain, quantities: Sequence[Indices]
) -> Largest:
    """The largest lengths of errors `value` (n, m) + `effects` (n, m, v) t, t in the `domain`.

    `quantities`: components of each length, at most three. Missing (NaN) where a number of a pose
    is not finite.
    """
    bounds = largest_lengths(
        value,
        effects,
        domain.middle.tolist(),
        domain.half.tolist(),
        [members.tolist() for members in domain.directions],
        [columns.tolist() for columns in quantities],
    )
    return Largest(bounds[..., 0], bounds[..., 1], bounds[..., 2:])


def lengths(error: Floats, quantities: Sequence[Indices]) -> Floats:
    """(n, q) lengths of errors (n, m) that are known: sets of one point."""
    longest = np.empty((len(error), len(quantities)))
    for at, columns in enumerate(quantities):
        of_kind = error[:, columns]
        longest[:, at] = np.sqrt(np.einsum("nc,nc->n", of_kind, of_kind))
    return longest


__all__ = ["Largest", "largest", "lengths"]
