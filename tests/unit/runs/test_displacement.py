"""Deviations of several causes become one move of each parameter."""

from __future__ import annotations

import numpy as np

from truepose.runs.displacement import sum_deviations


def test_each_parameter_moves_once_by_the_sum() -> None:
    columns, values = sum_deviations(
        [
            (np.array([5, 2]), np.array([[1.0, 2.0]])),
            (np.array([2, 9, 2]), np.array([[10.0, 20.0, 100.0], [30.0, 40.0, 300.0]])),
        ]
    )
    assert columns.tolist() == [2, 5, 9]
    assert values.tolist() == [[112.0, 1.0, 20.0], [332.0, 1.0, 40.0]]


def test_one_cause_that_names_each_parameter_once_is_handed_on() -> None:
    given = (np.array([5, 2]), np.array([[1.0, 2.0]]))
    columns, values = sum_deviations([given])
    assert dict(zip(columns.tolist(), values[0].tolist(), strict=True)) == {5: 1.0, 2: 2.0}
    columns, values = sum_deviations([(np.array([5, 5]), np.array([[1.0, 2.0]]))])
    assert (columns.tolist(), values.tolist()) == ([5], [[3.0]])


def test_no_cause_moves_nothing() -> None:
    columns, values = sum_deviations([])
    assert columns.size == 0
    assert values.shape == (1, 0)
