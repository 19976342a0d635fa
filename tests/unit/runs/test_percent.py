"""Percent of the coordinate, and where it says nothing."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from truepose.runs.percent import coordinates, per_error, percent

BODY: Any = SimpleNamespace(components=("x", "y", "z", "rx", "ry", "rz"), characteristic_length=0.5)
PLACEMENTS = np.array([[0.2, -0.4, 4e-7, 1, 0, 0, 0], [0.0, 6e-7, -1.0, 1, 0, 0, 0]], float)


def test_a_rotation_and_a_coordinate_about_zero_have_none() -> None:
    values, defined = coordinates(BODY, PLACEMENTS)
    assert values[0, :3].tolist() == [0.2, -0.4, 4e-7]
    # 1e-6 of 0.5 m is the smallest coordinate.
    assert defined.tolist() == [
        [True, True, False, False, False, False],
        [False, True, True, False, False, False],
    ]


def test_percent_is_of_absolute_values_and_missing_where_not_defined() -> None:
    values, defined = coordinates(BODY, PLACEMENTS)
    error = np.tile([-1e-3, 2e-3, 1e-3, 1e-3, 1e-3, 1e-3], (2, 1))
    found = percent(error, per_error(values, defined))
    assert np.allclose(found[0, :2], [0.5, 0.5], rtol=1e-15)
    assert np.isclose(found[1, 2], 0.1, rtol=1e-15)
    assert np.isnan(found[~defined]).all()
    assert not np.isnan(found[defined]).any()
