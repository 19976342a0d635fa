"""Angles of another convention: turned the other way, or about the axes in another order."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import permutations

import numpy as np

from truepose.calibration.data_checks._base import Hypothesis, HypothesisKind, MeasuredColumn, View
from truepose.spatial import euler_to_matrix_in_order, matrix_to_euler

OURS = "zyx"
"""R = Rz(c) Ry(b) Rx(a): extrinsic x y z, which is intrinsic z y x."""


def propose_sign(view: View) -> Iterator[Hypothesis]:
    """Angles of the inverse rotation; all angles, or one, of the other sign."""
    columns = _angles(view)
    names = tuple(column.name for column in columns)
    if len(columns) == 3:
        table = view.by_row(columns)
        turned = view.readings.value.copy()
        turned[table] = matrix_to_euler(
            np.swapaxes(euler_to_matrix_in_order(view.readings.value[table], OURS), 1, 2)
        )
        words = "a, b and c are of the inverse rotation (base in the platform's axes)"
        yield Hypothesis(words, names, view.suppose(turned))
        yield view.negated(columns, "a, b and c are turned the other way")
    for column in columns:
        yield view.negated([column], f"{column.name} is turned the other way")


def propose_order(view: View) -> Iterator[Hypothesis]:
    """Angles multiplied in another order: R = Rx(a) Ry(b) Rz(c), and the other four."""
    columns = _angles(view)
    if len(columns) != 3:
        return
    table = view.by_row(columns)
    for order in permutations("xyz"):
        word = "".join(order)
        if word == OURS:
            continue
        value = view.readings.value.copy()
        value[table] = matrix_to_euler(euler_to_matrix_in_order(view.readings.value[table], word))
        product = " ".join(f"R{axis}({'abc'['xyz'.index(axis)]})" for axis in word)
        words = f"a, b and c are of R = {product} instead of R = Rz(c) Ry(b) Rx(a)"
        yield Hypothesis(words, ("a", "b", "c"), view.suppose(value))


def _angles(view: View) -> list[MeasuredColumn]:
    columns = [column for column in view.columns if column.name in ("a", "b", "c")]
    sizes = {column.observations.size for column in columns}
    return columns if len(sizes) == 1 else []


SIGN = HypothesisKind(
    "rotation-sign", "angles turned the other way", propose_sign, of_readings="numbers"
)
ORDER = HypothesisKind(
    "axis-order", "angles about the axes in another order", propose_order, of_readings="numbers"
)
