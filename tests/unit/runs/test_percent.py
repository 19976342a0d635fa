"""Percent of the coordinate, and where it says nothing."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from truepose.runs.percent import defined, smallest

BODY: Any = SimpleNamespace(components=("x", "y", "z", "rx", "ry", "rz"), characteristic_length=0.5)
PLACEMENTS = np.array([[0.2, -0.4, 4e-7, 1, 0, 0, 0], [0.0, 6e-7, -1.0, 1, 0, 0, 0]], float)


def test_a_rotation_and_a_coordinate_about_zero_have_none() -> None:
    assert smallest(BODY) == 5e-7
    assert defined(BODY, PLACEMENTS).tolist() == [
        [True, True, False, False, False, False],
        [False, True, True, False, False, False],
    ]
