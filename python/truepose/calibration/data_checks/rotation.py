"""Angles of another convention: turned the other way, or about the axes in another order."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import permutations

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.calibration.data_checks._base import Hypothesis, MeasuredColumn, OfMend, View
from truepose.calibration.data_checks.nominal import angles_of

OURS = "zyx"
"""R = Rz(c) Ry(b) Rx(a): extrinsic x y z, which is intrinsic z y x."""


def suppose_sign(view: View) -> Iterator[Hypothesis]:
    """Angles of the inverse rotation; all angles, or one, of the other sign."""
    columns = _angles(view)
    names = tuple(column.name for column in columns)
    if len(columns) == 3:
        at = _table(view, columns)
        turned = view.readings.value.copy()
        turned[at] = angles_of(np.swapaxes(_rotation(view.readings.value[at], OURS), 1, 2))
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
        value[at] = angles_of(_rotation(view.readings.value[at], word))
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


def _rotation(angles: Floats, order: str) -> Floats:
    """(m, 3, 3) product of turns about the axes, left to right, by angles (m, 3) a b c."""
    result = np.broadcast_to(np.eye(3), (len(angles), 3, 3))
    for axis in order:
        k = "xyz".index(axis)
        i, j = (k + 1) % 3, (k + 2) % 3
        turn = np.zeros((len(angles), 3, 3))
        turn[:, k, k] = 1.0
        turn[:, i, i] = turn[:, j, j] = np.cos(angles[:, k])
        turn[:, j, i] = np.sin(angles[:, k])
        turn[:, i, j] = -turn[:, j, i]
        result = result @ turn
    return result


SIGN = OfMend("rotation-sign", "angles turned the other way", suppose_sign)
ORDER = OfMend("axis-order", "angles about the axes in another order", suppose_order)
