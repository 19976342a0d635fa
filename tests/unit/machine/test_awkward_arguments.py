"""What a user may slip into a call instead of a machine or of values gets a sentence."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import truepose
from truepose.errors import ArgumentError, PoseError, RequestError

PLANAR = Path(__file__).parents[3] / "machines" / "planar_two_slider.toml"


@pytest.mark.parametrize(
    "call",
    [
        truepose.accuracy,
        truepose.bounds,
        truepose.budget,
        truepose.compensate,
        truepose.over_time,
        truepose.strain,
        lambda file: truepose.calibrate(file, file),
        lambda file: truepose.correct_program(file, file, None),
        lambda file: truepose.export(file, "c"),
        lambda file: truepose.plan(file, (), 5),
    ],
)
def test_file_in_place_of_a_machine(call: Any) -> None:
    with pytest.raises(TypeError, match=r"a machine, as truepose\.load returns it") as raised:
        call(str(PLANAR))
    assert isinstance(raised.value, ArgumentError)
    assert [problem.code for problem in raised.value.problems] == ["bad-argument"]


def test_nan_in_a_pose_or_a_joint_is_named() -> None:
    machine = truepose.load(PLANAR)
    with pytest.raises(PoseError, match="x is NaN, which is no finite number"):
        machine.inverse([float("nan"), 0.0])
    with pytest.raises(PoseError, match="the joint of d2 is inf, which is no finite number"):
        machine.forward([0.2, float("inf")])


def test_masked_numbers_are_refused() -> None:
    machine = truepose.load(PLANAR)
    masked = np.ma.masked_array([[0.3, 0.2]], [[True, False]])
    for call in (machine.inverse, machine.stiffness):
        with pytest.raises(ArgumentError, match=r"masked|real numbers"):
            call(masked)
    whole = np.ma.masked_array([[0.3, 0.2]])
    assert (machine.inverse(whole) == machine.inverse([[0.3, 0.2]])).all()


@pytest.mark.parametrize(
    "force", [5, "abc", None, [1.0], [1, 2, "x"], np.zeros((1, 3)), [1j, 0, 0]]
)
def test_a_force_that_is_none(force: Any) -> None:
    condition = truepose.load(PLANAR).condition
    if force is None:
        assert condition.replace(force=force) == condition
        return
    with pytest.raises(RequestError, match="cannot have this force"):
        condition.replace(force=force)


@pytest.mark.parametrize("values", [5, None, ["strut.1.length"]])
def test_values_that_name_no_parameter(values: Any) -> None:
    with pytest.raises(TypeError, match="by the names of parameters"):
        truepose.load(PLANAR).replace(values)


@pytest.mark.parametrize("value", ["0.5", None, True, [0.5], 1j])
def test_value_that_is_no_number(value: Any) -> None:
    with pytest.raises(RequestError) as raised:
        truepose.load(PLANAR).replace({"strut.1.length": value})
    assert [problem.code for problem in raised.value.problems] == ["wrong-type"]
