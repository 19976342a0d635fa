"""What `--vary` says: values, ranges, units, patterns and members."""

from __future__ import annotations

import numpy as np
import pytest

import truepose as tp
from command_line import MACHINES, PLANAR
from truepose.errors import RequestError
from truepose.machine import Machine
from truepose.studies.varied_keys import VariedKey, read_varied


@pytest.fixture(scope="module")
def hexapod() -> Machine:
    return tp.load(MACHINES / "hexapod.toml")


def one(text: str, machine: Machine) -> VariedKey:
    (variable,) = read_varied([text], machine)
    return variable


@pytest.mark.parametrize(
    ("values", "levels", "numbers", "unit"),
    [
        ("30:120:4 N/um", ["30 N/um", "60 N/um", "90 N/um", "120 N/um"], [30, 60, 90, 120], "N/um"),
        ("30 N/um : 120 N/um : 2", ["30 N/um", "120 N/um"], [30, 120], "N/um"),
        ("30:120 N/um:2", ["30 N/um", "120 N/um"], [30, 120], "N/um"),
        ("5:5:1 mm", ["5 mm"], [5], "mm"),
        ("0:0.3:4", ["0", "0.1", "0.2", "0.3"], [0, 0.1, 0.2, 0.3], ""),
        ("-1e-3:1e-3:3 mm", ["-0.001 mm", "0 mm", "0.001 mm"], [-1e-3, 0, 1e-3], "mm"),
        ("30,60.5 N/um", ["30 N/um", "60.5 N/um"], [30, 60.5], "N/um"),
        ("30 N/um, 60 N/um", ["30 N/um", "60 N/um"], [30, 60], "N/um"),
        ("30N/um", ["30 N/um"], [30], "N/um"),
        ("1.1e-5,1.2e-5 1/K", ["1.1e-05 1/K", "1.2e-05 1/K"], [1.1e-5, 1.2e-5], "1/K"),
        ("90,95 %", ["90 %", "95 %"], [90, 95], "%"),
        ("steel,cast iron", ["steel", "cast iron"], [], ""),
        ("rigid,30 N/um", ["rigid", "30 N/um"], [], ""),
        ("6061-T6", ["6061-T6"], [], ""),
        ("[-1,1],[-2,2]", ["[-1,1]", "[-2,2]"], [], ""),
        ("{x=1,y=2},{x=2,y=1}", ["{x=1,y=2}", "{x=2,y=1}"], [], ""),
        ("'a,b:c',d", ["'a,b:c'", "d"], [], ""),
        ("C:\\log.csv,other.csv", ["C:\\log.csv", "other.csv"], [], ""),
    ],
)
def test_values(
    values: str, levels: list[str], numbers: list[float], unit: str, hexapod: Machine
) -> None:
    variable = one(f"strut.1.stiffness={values}", hexapod)
    assert list(variable.levels) == levels
    assert list(variable.numbers) == numbers
    assert variable.unit == unit
    assert not variable.is_continuous
    texts, at = variable.at_levels(np.arange(len(levels)))
    assert texts == levels
    assert at.tolist() == numbers if numbers else np.isnan(at).all()


def test_a_number_is_written_as_the_number_that_it_is(hexapod: Machine) -> None:
    variable = one("strut.1.stiffness=0.1:7.3:23 N/um", hexapod)
    for text, number in zip(variable.levels, variable.numbers, strict=True):
        assert float(text.split()[0]) == number


def test_from_one_end_to_the_other(hexapod: Machine) -> None:
    variable = one("strut.1.stiffness=30:120 N/um", hexapod)
    assert variable.is_continuous
    texts, values = variable.at_shares(np.array([0.0, 0.5, 0.75]))
    assert texts == ["30 N/um", "75 N/um", "97.5 N/um"]
    assert values.tolist() == [30.0, 75.0, 97.5]


def test_a_pattern_is_one_variable_and_each_of_its_members_another(hexapod: Machine) -> None:
    variable = one("strut.*.stiffness=30,60 N/um", hexapod)
    assert variable.key == "strut.*.stiffness"
    assert variable.changes == tuple(f"strut.{n}.stiffness" for n in range(1, 7))
    members = read_varied(["each:strut.[123].stiffness=30,60 N/um"], hexapod)
    assert [member.key for member in members] == [f"strut.{n}.stiffness" for n in (1, 2, 3)]
    assert {member.levels for member in members} == {("30 N/um", "60 N/um")}
    bands = read_varied(["each:tolerance.strut.1.base.*=1,2 um"], hexapod)
    assert [band.key for band in bands] == [f"tolerance.strut.1.base.{axis}" for axis in "xyz"]


def test_quotation_marks_say_nothing_more(hexapod: Machine) -> None:
    assert one('tolerance."strut.1.base.x"=1,2 um', hexapod).key == "tolerance.strut.1.base.x"


@pytest.mark.parametrize(
    ("vary", "message"),
    [
        ([], "nothing is varied"),
        (["strut.1.stiffness"], "not a key and its values"),
        (["=3"], "not a key and its values"),
        (["strut.1.stiffness="], "not a key and its values"),
        (["strut..stiffness=3 N/um"], "not a key and its values"),
        (["strut.1.stiffness=30 N/um:0.1 kN/um:3"], "mixed units"),
        (["strut.1.stiffness=30 N/um:120:3"], "mixed units"),
        (["strut.1.stiffness=30 N/um,60"], "mixed units"),
        (["strut.1.stiffness=30 N/um,0.06 kN/um"], "mixed units"),
        (["strut.1.stiffness=30 N/um,60,90 N/um"], "mixed units"),
        (["strut.1.stiffness=30:120:2.5 N/um"], "whole number"),
        (["strut.1.stiffness=30:120:0 N/um"], "whole number"),
        (["strut.1.stiffness=30:120:1 N/um"], "two different ends"),
        (["strut.1.stiffness=30:30:2 N/um"], "equal ends"),
        (["strut.1.stiffness=120:30 N/um"], "reversed"),
        (["strut.1.stiffness=30:steel:2"], "not a range"),
        (["strut.1.stiffness=30:60:90:120 N/um"], "not a range"),
        (["strut.1.stiffness=30:120:1000000000 N/um"], "too many values"),
        (["strut.1.material=steel,,invar"], "an empty value"),
        (["strut.1.material=steel,steel"], "a value twice"),
        (["strut.1.stiffness=30,30.0 N/um"], "a value twice"),
        (["workspace.grid.x=[1,2,3]"], "base file"),
        (["each:strut.9*.stiffness=30,60 N/um"], "names nothing"),
        (["strut.1.mass=1 kg", "strut.1.mass=2 kg"], "two variables set strut.1.mass"),
        (["strut.*.mass=1 kg", "strut.3.mass=2 kg"], "two variables set strut.3.mass"),
    ],
)
def test_what_cannot_be_read(vary: list[str], message: str, hexapod: Machine) -> None:
    with pytest.raises(RequestError, match=message) as caught:
        read_varied(vary, hexapod)
    assert [problem.code for problem in caught.value.problems] == ["bad-vary"]


def test_all_that_is_wrong_is_said_at_once(hexapod: Machine) -> None:
    with pytest.raises(RequestError) as caught:
        read_varied(["a", "workspace.home.z=3 mm", "strut.1.mass=1 kg,2 lb"], hexapod)
    assert len(caught.value.problems) == 3


@pytest.mark.parametrize(
    ("vary", "code", "says"),
    [
        ("strut.*.lenght=500:520:3 mm", "unknown-key", 'did you mean "length"?'),
        ("strut.*.material=steel,invarr", "unknown-material", 'did you mean "invar"?'),
        ("strut.*.length=500:520:3 N", "wrong-dimension", "a length"),
        ("strut.*.length=500:520:3", "no-unit", "the values of a study say their unit"),
        ("strut.*.length=500,520", "no-unit", "after the last value"),
        ("strut.*.length=500:520:3 furlongg", "unknown-unit", "furlongg"),
        ("strut.7.length=500:520:3 mm", "bad-setting", "--vary strut.7.length"),
        ("condition.temperature_log=none.csv", "file-missing", "none.csv"),
    ],
)
def test_values_are_tried_on_the_base_file(vary: str, code: str, says: str) -> None:
    with pytest.raises(RequestError) as caught:
        tp.study(PLANAR, [vary])
    assert [problem.code for problem in caught.value.problems] == [code]
    assert says in str(caught.value)
    assert "--set" not in str(caught.value)


def test_a_number_that_has_no_unit_needs_none() -> None:
    result = tp.study(PLANAR, ["drive.d1.scale=0.999:1.001:3"], quantities=["error"])
    assert (result["status"] == "ok").all()
    assert result["setting"].values[:, 0].tolist() == ["0.999", "1", "1.001"]
