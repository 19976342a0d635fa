"""What a user may slip into a call instead of a machine or of values gets a sentence."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import truepose
from truepose.errors import RequestError

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
    with pytest.raises(TypeError, match=r"a machine, as truepose\.load returns it"):
        call(str(PLANAR))


@pytest.mark.parametrize("values", [5, None, ["strut.1.length"]])
def test_values_that_name_no_parameter(values: Any) -> None:
    with pytest.raises(TypeError, match="by the names of parameters"):
        truepose.load(PLANAR).replace(values)


@pytest.mark.parametrize("value", ["0.5", None, True, [0.5], 1j])
def test_value_that_is_no_number(value: Any) -> None:
    with pytest.raises(RequestError) as raised:
        truepose.load(PLANAR).replace({"strut.1.length": value})
    assert [problem.code for problem in raised.value.problems] == ["wrong-type"]
