"""Angles of another convention: turned the other way, or about the axes in another order."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import permutations

import numpy as np

from truepose.arrays import Indices
from truepose.calibration.data_checks._base import Hypothesis, MeasuredColumn, OfMend, View
from truepose.spatial import euler_to_matrix_in_order, matrix_to_euler

OURS = "zyx"
"""R = Rz(c) Ry(b) Rx(a): extrinsic x y z, which is intrinsic z y x."""


def suppose_sign(view: View) -> Iterator[Hypothesis]:
    """Angles of the inverse rotation; all angles, or one, of the other sign."""
    columns = _angles(view)
    names = tuple(column.name for column in columns)
    if len(columns) == 3:
        at = _table(view, columns)
        turned = view.readings.value.copy()
        turned[at] = matrix_to_euler(
            np.swapaxes(euler_to_matrix_in_order(view.readings.value[at], OURS), 1, 2)
        )
        words = "a, b and c are of the inverse rotation (base in the platform's axes)"
        yield Hypothesis(words, names, view.judge(turned))
        yield from _negative(view, columns, "a, b and c are turned the other way")
    for column in columns:
        yield from _negative(view, [column], f"{column.name} is turned the other way")


def suppose_order(view: View) -> Iterator[Hypothesis]:
    """Angles multiplied in another order: R = Rx(a) Ry(b) Rz(c), and the other four."""
    columns = _angles(view)
    if len(columns) != 3:
        return
    at = _table(view, columns)
    for order in permutations("xyz"):
        word = "".join(order)
        if word == OURS:
            continue
        value = view.readings.value.copy()
        value[at] = matrix_to_euler(euler_to_matrix_in_order(view.readings.value[at], word))
        product = " ".join(f"R{axis}({'abc'['xyz'.index(axis)]})" for axis in word)
        words = f"a, b and c are of R = {product} instead of R = Rz(c) Ry(b) Rx(a)"
        yield Hypothesis(words, ("a", "b", "c"), view.judge(value))


def _angles(view: View) -> list[MeasuredColumn]:
    columns = [column for column in view.columns if column.name in ("a", "b", "c")]
    sizes = {column.at.size for column in columns}
    return columns if len(sizes) == 1 else []


def _table(view: View, columns: list[MeasuredColumn]) -> Indices:
    """(m, 3) places of a b c among the observations, by row."""
    return np.stack([c.at[np.argsort(view.readings.row[c.at])] for c in columns], axis=1)


def _negative(view: View, columns: list[MeasuredColumn], words: str) -> Iterator[Hypothesis]:
    value = view.readings.value.copy()
    for column in columns:
        value[column.at] *= -1.0
    yield Hypothesis(words, tuple(column.name for column in columns), view.judge(value))


SIGN = OfMend("rotation-sign", "angles turned the other way", suppose_sign)
ORDER = OfMend("axis-order", "angles about the axes in another order", suppose_order)
