"""`--set key=value`."""

from __future__ import annotations

from pathlib import Path

import pytest

import truepose as tp
from machine_texts import HEXAPOD, PLANAR, edited, load_text
from truepose.errors import MachineFileError, RequestError


def value_of(machine, name: str) -> float:
    return machine.nominal[machine.parameters.index(name)]


def test_a_strut_by_its_name(tmp_path: Path) -> None:
    machine = load_text(tmp_path, PLANAR, "strut.1.length=501")
    assert value_of(machine, "strut.1.length") == pytest.approx(0.501)
    assert value_of(machine, "strut.2.length") == pytest.approx(0.500)
    assert machine.settings == {"strut.1.length": "501"}


def test_the_hash_stays_that_of_the_file(tmp_path: Path) -> None:
    plain, changed = load_text(tmp_path, PLANAR), load_text(tmp_path, PLANAR, "machine.name=other")
    assert changed.name == "other"
    assert changed.file_hash == plain.file_hash
    assert plain.settings == {}


def test_settings_as_a_mapping(tmp_path: Path) -> None:
    import truepose

    path = tmp_path / "machine.toml"
    path.write_text(PLANAR)
    machine = truepose.load(path, {"strut.1.length": "501 mm", "accuracy.target": "0.1"})
    assert value_of(machine, "strut.1.length") == pytest.approx(0.501)
    assert machine.accuracy.target == pytest.approx(1e-4)


@pytest.mark.parametrize(
    ("setting", "name", "expected"),
    [
        ("strut.*.length=0.6 m", "strut.2.length", 0.6),
        ("strut.1.base.x=3", "strut.1.base.x", 0.003),
        ("drive.d2.origin=[610, 0, 0]", "drive.d2.origin.x", 0.61),
        ("drive.d1.offset = 5", "drive.d1.offset", 0.005),
        ("machine.tool=[0, 1, 0]", "tool.y", 0.001),
    ],
)
def test_parameters(setting: str, name: str, expected: float, tmp_path: Path) -> None:
    machine = load_text(tmp_path, PLANAR, setting)
    assert value_of(machine, name) == pytest.approx(expected, abs=1e-15)


def test_tables_that_the_file_does_not_have(tmp_path: Path) -> None:
    machine = load_text(
        tmp_path,
        HEXAPOD,
        "strut.*.material=steel",
        "strut.*.stiffness=1 N/um",
        "accuracy.target=0.2",
        'condition.temperature="30 degC"',
        'condition.force.z="-20 N"',
    )
    assert machine.accuracy.target == pytest.approx(2e-4)
    assert machine.condition.force == (0, 0, -20)
    assert machine.condition.temperature_rise("strut.1") == pytest.approx(10)


def test_a_part_of_a_table_of_temperatures(tmp_path: Path) -> None:
    text = edited(PLANAR, ("temperature = 35", 'temperature = { default = 30, "strut.1" = 40 }'))
    machine = load_text(tmp_path, text, "condition.temperature.strut.1=50",
                        "condition.temperature.strut.2=60")  # fmt: skip
    rises = [machine.condition.temperature_rise(f"strut.{i}") for i in (1, 2)]
    assert rises == pytest.approx([30, 40])


def test_a_pattern_in_the_tolerance_table(tmp_path: Path) -> None:
    machine = load_text(tmp_path, PLANAR, "tolerance.strut.*.base.x=0.02")
    (tolerance,) = (source for source in machine.sources if source.name == "tolerance")
    assert len(tolerance.bands.parameters) == 3
    assert load_text(tmp_path, PLANAR, "workspace.grid.x=[200, 300, 2]").poses().shape == (6, 2)


def test_a_setting_below_one_that_is_no_table(tmp_path: Path) -> None:
    with pytest.raises(RequestError, match="tolerance is not a table"):
        load_text(tmp_path, PLANAR, "tolerance=3", "tolerance.strut.1.length=0.1")


def test_a_later_setting_wins(tmp_path: Path) -> None:
    machine = load_text(tmp_path, PLANAR, "strut.1.length=501", "strut.1.length=502")
    assert value_of(machine, "strut.1.length") == pytest.approx(0.502)
    assert machine.settings == {"strut.1.length": "502"}


@pytest.mark.parametrize(
    ("setting", "code", "words"),
    [
        ("strut.1.lenght=501", "unknown-key", 'did you mean "length"?'),
        ("acuracy.target=1", "unknown-key", 'did you mean "accuracy"?'),
        ("strut.1.length=-501", "not-positive", "given by --set strut.1.length=-501"),
        ("strut.1.length=3 N", "wrong-dimension", "expected a length, found a force"),
        ("accuracy.at=best", "unknown-choice", "given by --set accuracy.at=best"),
        ("accuracy.at=95", "bad-probability", '95 % is written "95 %" or 0.95'),
        ("condition.temperature=4O", "unknown-unit", "4O"),
        ("workspace.grid.x=[200, 400, 0]", "grid-count", "one or more"),
        ("schema=2", "unsupported-schema", "--set schema=2"),
    ],
)
def test_a_bad_value_is_the_settings_fault(
    setting: str, code: str, words: str, tmp_path: Path
) -> None:
    with pytest.raises(MachineFileError) as caught:
        load_text(tmp_path, PLANAR, setting)
    (problem,) = caught.value.problems
    assert problem.code == code
    assert problem.line is None
    assert words in str(problem)
    assert f"--set {setting}" in problem.message


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ("strut.1.length", "key=value"),
        ("=3", "key=value"),
        ("strut..length=3", "key=value"),
        ("strut.3.length=3", "strut.1, strut.2"),
        ("drive.d11.offset=3", "did you mean drive.d1?"),
        ("strut.1=3", "a key of one strut is wanted"),
        ("strut=3", "a key of one strut is wanted"),
        ("condition.temperature.strut.1=40", "condition.temperature is not a table"),
        ("strut.1.length.x=3", "strut.1.length is not a table"),
        ("strut.1.base.w=3", "strut.1.base is not a table"),
        ("strut.1.length=3\nschema = 1", "one line"),
    ],
)
def test_a_setting_that_leads_nowhere(setting: str, words: str, tmp_path: Path) -> None:
    with pytest.raises(RequestError) as caught:
        load_text(tmp_path, PLANAR, setting, "also bad")
    problems = caught.value.problems
    assert [problem.code for problem in problems] == ["bad-setting", "bad-setting"]
    assert words in str(problems[0])
    assert problems[1].found == "also bad"


@pytest.mark.parametrize("key", ['"strut.*.base.*"', "'strut.*.base.*'", "strut.*.base.*"])
def test_a_key_may_stand_in_quotation_marks_as_in_the_file(key: str, tmp_path: Path) -> None:
    machine = load_text(tmp_path, PLANAR, f"tolerance.{key}=0.01")
    again = tp.load(tmp_path / "machine.toml", {f"tolerance.{key}": "0.01"})
    assert again.settings == machine.settings
    assert again == machine
    (bands,) = (source.bands for source in machine.sources if source.name == "tolerance")
    named = {machine.parameters[column] for column in bands.parameters}
    assert "strut.1.base.x" in named


@pytest.mark.parametrize(
    ("setting", "code", "hint"),
    [
        ("each.strut.section_area=1 mm^2", "bad-setting", "strut.*.section_area"),
        ("tolerance.strut.1*.length=0.01", "tolerance-without-effect", "length_tolerance"),
    ],
)
def test_what_would_change_nothing_is_refused(
    setting: str, code: str, hint: str, tmp_path: Path
) -> None:
    with pytest.raises((RequestError, MachineFileError)) as raised:
        load_text(tmp_path, PLANAR, setting)
    (problem,) = raised.value.problems
    assert problem.code == code
    assert hint in str(problem.hint)


def test_what_some_row_leaves_to_the_others_may_be_set(tmp_path: Path) -> None:
    text = PLANAR.replace("length_tolerance = [-0.3, 0.3]\n", "", 1)
    assert load_text(tmp_path, text, "each.strut.length_tolerance=0.01").settings
