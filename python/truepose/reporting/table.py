"""A table for people, of which nothing is known but its text: ready for a terminal or a page."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import isfinite
from typing import TYPE_CHECKING

from truepose.language import say

if TYPE_CHECKING:  # `init --list` shows a table without numpy
    from truepose.arrays import Floats


@dataclass(frozen=True)
class Table:
    """A table ready to be shown: every cell is text, `words` leading columns are words.

    The other columns are numbers and stand to the right. `says`: one sentence of what it shows.
    `largest`: row and column of the cells that are to stand out, the largest of what they compare.
    """

    name: str
    title: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    words: int = 1
    note: str = ""
    says: str = ""
    largest: frozenset[tuple[int, int]] = frozenset()


def largest_cells(values: Floats, first: int) -> frozenset[tuple[int, int]]:
    """The cells of the largest of `values` (n_row, n_column) by size, one a column.

    `first`: column of the table in which the first of them stands. A column of one row, or of
    which no row is larger than another, has none.
    """
    cells = []
    for column, sizes in enumerate(abs(values).T.tolist()):
        known = {row: size for row, size in enumerate(sizes) if isfinite(size)}
        if known and max(known.values()) > min(known.values()):
            cells.append((max(known, key=known.__getitem__), first + column))
    return frozenset(cells)


def with_not_included(table: Table, parts: str) -> Table:
    """The table, whose note also names what is not in the results, where anything is not.

    `parts`: as the attribute `not_included` of a result has them, `frame (no material)`.
    """
    if not parts:
        return table
    return replace(table, note=f"{table.note} {say('Not included: {parts}.', parts=parts)}")
