"""Tables of the division: ends of pieces, pieces, and points inside them that were looked at."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from truepose.arrays import Flags, Floats, Indices
from truepose.compensation.commands import PoseDeviations


@dataclass(frozen=True, eq=False)
class Nodes:
    """Ends of pieces: on which move, at which share of it; its point of the program, (n, 9).

    `asked` (n, n_commanded) there, SI; the corrected `joints` and `commands` for it.
    """

    move: Indices
    share: Floats
    points: Floats
    asked: Floats
    joints: Floats
    commands: Floats

    def and_more(self, other: Nodes) -> Nodes:
        """These and, after them, others."""
        joined = {
            name: np.concatenate([value, getattr(other, name)])
            for name, value in vars(self).items()
        }
        return Nodes(**joined)


@dataclass(frozen=True, eq=False)
class Pieces:
    """Pieces: the nodes at which they begin and end, their size, m, and weight of their points."""

    begin: Indices
    end: Indices
    size: Floats
    weight: Floats

    def select(self, which: Flags) -> Pieces:
        """Those of (n,) flags; the table itself where they are all."""
        return self if which.all() else self.rows(which)

    def rows(self, which: Flags | Indices | slice) -> Pieces:
        """Some of them."""
        return Pieces(self.begin[which], self.end[which], self.size[which], self.weight[which])


@dataclass(frozen=True, eq=False)
class SamplePoints:
    """Points inside pieces that were accepted: the piece's end node, share, pose, what is known."""

    end: Indices
    share: Floats
    weight: Floats
    poses: Floats
    known: PoseDeviations | None


def joined(pieces: list[Pieces]) -> Pieces:
    """Several tables of pieces as one."""
    if len(pieces) == 1:
        return pieces[0]
    none = np.empty(0)
    table = [*pieces, Pieces(none.astype(np.intp), none.astype(np.intp), none, none)]
    return Pieces(
        np.concatenate([pieces.begin for pieces in table]),
        np.concatenate([pieces.end for pieces in table]),
        np.concatenate([pieces.size for pieces in table]),
        np.concatenate([pieces.weight for pieces in table]),
    )


def selected(known: PoseDeviations, which: Flags) -> PoseDeviations:
    """What is known at some of the poses (n,), all of which have joints."""
    columns, values = known.moved
    moved = values if len(values) == 1 else np.ascontiguousarray(values[which])
    return PoseDeviations(
        known.block.select(which), (columns, moved), known.status[which], known.followed
    )


__all__ = ["Nodes", "Pieces", "SamplePoints", "joined", "selected"]
