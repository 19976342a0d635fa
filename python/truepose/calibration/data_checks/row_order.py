"""Readings that belong to other rows: all one row too early or too late, or some exchanged."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from truepose.calibration.data_checks._base import Hypothesis, HypothesisKind, View


def propose_shifted(view: View) -> Iterator[Hypothesis]:
    """Every reading one row later or earlier than it stands; the row without one is left out."""
    table = view.table
    if table is None or len(table) < 4:
        return
    for early, words in ((0, "one row too late"), (1, "one row too early")):
        # Reading of row i + 1 belongs to row i, or the reverse.
        into, out = (table[:-1], table[1:]) if early == 0 else (table[1:], table[:-1])
        value = view.readings.value.copy()
        value[into] = view.readings.value[out]
        kept = np.sort(into.ravel())
        shifted = f"the readings stand {words} beside what was commanded"
        yield Hypothesis(shifted, view.column_names, view.suppose(value, kept=kept), kept)


def propose_exchanged(view: View) -> Iterator[Hypothesis]:
    """Each row given the readings that lie nearest to what it should show, if none is given twice.

    An outlier has no row of its own that it would fit better, so that it is no exchange.
    """
    table = view.table
    if table is None or len(table) < 4:
        return
    expected = (view.readings.value - view.as_given.residual)[table]
    scale, value = view.readings.scale[table], view.readings.value[table]
    gaps = (value[np.newaxis] - expected[:, np.newaxis]) / scale[:, np.newaxis]
    nearest = (gaps**2).sum(axis=2).argmin(axis=1)
    exchanged = np.flatnonzero(nearest != np.arange(len(table)))
    if not exchanged.size or np.unique(nearest).size != len(table):
        return
    reordered = view.readings.value.copy()
    reordered[table] = value[nearest]
    rows = tuple(view.rows[exchanged].tolist())
    words = f"the readings of {view.named_rows(rows)} stand in each other's place"
    supposed = view.suppose(reordered)
    yield Hypothesis(words, view.column_names, supposed, trimmed=False, rows=rows)


SHIFTED = HypothesisKind(
    "shifted-rows", "readings stand one row beside their commands", propose_shifted
)
EXCHANGED = HypothesisKind("exchanged-rows", "readings stand in other rows", propose_exchanged)
