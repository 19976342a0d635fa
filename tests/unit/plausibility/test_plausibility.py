"""What looks odd: every blunder is named by its rule, and nothing is said of what is sound."""

from __future__ import annotations

import copy
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import truepose as tp
from build_machine import MACHINES
from command_line import call
from generators import DOCS, generator
from machine_file import File, file_at, loaded, text_of
from made_oddities import BLUNDERS, Blunder
from sound_machines import FAMILIES, sound_machine
from sweeps import sweep
from truepose.machine import library
from truepose.plausibility import RULES

FEW, ALL = 48, 1000
"""Sound machines in the quick suite, and in all."""

AT_ONCE = 50


def _codes(file: File) -> list[str]:
    return [oddity.code for oddity in tp.oddities(loaded(file))]


def test_there_are_thirty_blunders_and_every_rule_has_one() -> None:
    assert len({blunder.name for blunder in BLUNDERS}) == len(BLUNDERS) >= 30
    assert {blunder.code for blunder in BLUNDERS} == {rule.code for rule in RULES}


@pytest.mark.parametrize("blunder", BLUNDERS, ids=lambda blunder: blunder.name)
def test_a_blunder_is_named_by_its_rule(blunder: Blunder) -> None:
    machine = loaded(blunder.file)
    named = {oddity.code: oddity for oddity in tp.oddities(machine)}
    assert blunder.code in named
    assert named[blunder.code].parts


@pytest.mark.parametrize("kind", library.kinds())
def test_nothing_is_odd_about_the_library(kind: str) -> None:
    assert len(library.kinds()) >= 20
    assert tp.oddities(tp.load(MACHINES / f"{kind}.toml")) == ()


def _nothing_odd(numbers: range) -> None:
    odd = {
        (machine.number, machine.family): oddities
        for machine in map(sound_machine, numbers)
        if (oddities := tp.oddities(machine.loaded))
    }
    assert odd == {}


def test_nothing_is_odd_about_a_few_sound_machines() -> None:
    _nothing_odd(range(FEW))


@sweep
@pytest.mark.parametrize("first", range(FEW, ALL, AT_ONCE))
def test_nothing_is_odd_about_sound_machines(first: int) -> None:
    _nothing_odd(range(first, min(first + AT_ONCE, ALL)))


def test_sound_machines_are_of_many_kinds() -> None:
    """The generator draws what it says it draws, or nothing odd about them says nothing."""
    machines = [sound_machine(number) for number in range(FEW)]
    assert len({machine.family for machine in machines}) > 0.7 * len(FAMILIES)
    sizes = [_span(machine.loaded) for machine in machines]
    assert min(sizes) < 0.1
    assert max(sizes) > 3.0
    temperatures = [machine.loaded.condition.default_temperature for machine in machines]
    assert min(temperatures) < 273.15 - 10.0
    assert max(temperatures) > 273.15 + 50.0
    assert {machine.file["units"]["length"] for machine in machines} == {"mm", "m", "in", "cm"}
    axes = [
        drive["axis"][2]
        for machine in machines
        for drive in machine.file["drive"]
        if "axis" in drive
    ]
    assert min(axes) < -0.9 < 0.9 < max(axes)


def _span(machine: tp.Machine) -> float:
    points = machine.kernel.joint_centres(*machine.kernel.place(machine.poses())[:2])
    return float(np.linalg.norm(np.ptp(points.reshape(-1, 3), axis=0)))


def test_check_says_it_above_the_answer_and_ends_as_before(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "machine.toml"
    path.write_text(text_of(file_at(MACHINES / "3rpr.toml")), "utf-8")
    sound = call(capsys, "check", path)
    odd = call(capsys, "check", path, "--set", "condition.reference_temperature=22.5")
    assert (sound.code, odd.code) == (0, 0)
    assert "looks odd" not in sound.out + odd.out
    odd = call(capsys, "check", path, "--set", "strut.1.length_tolerance=1 nm", *_HOT)
    lines = odd.out.splitlines()
    places = [at for at, line in enumerate(lines) if line.startswith("looks odd[")]
    assert places[0] == 0
    answers = [at for at, line in enumerate(lines) if line.startswith(("met", "NOT met"))]
    assert max(places) < min(answers)
    assert odd.err == ""


_HOT = ("--set", "condition.temperature=308")


def test_the_exit_code_and_the_numbers_do_not_depend_on_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = ("check", MACHINES / "tripod.toml", *_HOT, "--format", "json")
    with_rules = call(capsys, *asked)
    monkeypatch.setattr("truepose.plausibility.RULES", ())
    without = call(capsys, *asked)
    assert with_rules.code == without.code
    one, other = json.loads(with_rules.out), json.loads(without.out)
    (oddity,) = one.pop("oddities")
    assert other.pop("oddities") == []
    assert one == other
    assert oddity["code"] == "odd-temperature"
    assert "308 °C" in oddity["sentence"]
    assert oddity["parts"] == ["condition.temperature"]


def test_without_an_answer_it_stands_above_the_error(capsys: pytest.CaptureFixture[str]) -> None:
    asked = ("check", MACHINES / "tripod.toml", "--set", "units.length=m")
    asked += ("--set", "strut.1.base=[-519, -300, 900000]")
    outcome = call(capsys, *asked)
    assert (outcome.code, outcome.out) == (2, "")
    assert "looks odd[machine-size]" in outcome.err
    assert outcome.err.index("looks odd[") < outcome.err.index("error[no-pose-left]")
    in_json = call(capsys, *asked, "--format", "json")
    assert [p["code"] for p in json.loads(in_json.out)["problems"]] == ["no-pose-left"]


def test_a_machine_of_one_pose_and_without_sources_is_looked_at() -> None:
    file = file_at(MACHINES / "tripod.toml")
    for table in ("tolerance", "condition", "accuracy", "frame"):
        file.pop(table, None)
    file["workspace"] = {"poses": [[0, 0, 450]]}
    for strut in file["strut"]:
        for key in ("length_tolerance", "stiffness", "material"):
            strut.pop(key)
    assert _codes(file) == []
    file["units"]["length"] = "m"
    assert _codes(file) == ["machine-size"]


def _changed(kind: str, **changes: Any) -> File:
    file = copy.deepcopy(file_at(MACHINES / f"{kind}.toml"))
    for path, value in changes.items():
        table, key = path.split("__")
        file[table][key] = value
    return file


@pytest.mark.parametrize(
    ("celsius", "odd"), [(-89.0, False), (-91.0, True), (119.0, False), (121.0, True)]
)
def test_both_sides_of_the_bounds_on_temperature(celsius: float, odd: bool) -> None:
    codes = _codes(_changed("pentapod", condition__temperature=celsius))
    assert ("odd-temperature" in codes) == odd


@pytest.mark.parametrize(("share", "odd"), [(0.0099, False), (0.0101, True)])
def test_both_sides_of_a_percent(share: float, odd: bool) -> None:
    file = file_at(MACHINES / "five_bar.toml")
    for strut in file["strut"]:
        strut["length_tolerance"] = 350 * share
    assert ("wide-tolerance" in _codes(file)) == odd


@pytest.mark.parametrize(("share", "odd"), [(0.9e-7, True), (1.1e-7, False)])
def test_both_sides_of_a_ten_millionth(share: float, odd: bool) -> None:
    file = file_at(MACHINES / "five_bar.toml")
    for strut in file["strut"]:
        strut["length_tolerance"] = 350 * share
    assert ("fine-tolerance" in _codes(file)) == odd


@pytest.mark.parametrize(("ratio", "odd"), [(4.9, False), (5.1, True)])
def test_both_sides_of_what_a_telescope_can(ratio: float, odd: bool) -> None:
    file = file_at(MACHINES / "tripod.toml")
    for drive in file["drive"]:
        drive["travel"] = [1000 / ratio, 1000]
    assert ("telescope-stroke" in _codes(file)) == odd


@pytest.mark.parametrize(("ratio", "odd"), [(1.2, False), (1.3, True)])
def test_both_sides_of_a_platform_as_wide_as_the_base(ratio: float, odd: bool) -> None:
    file = file_at(MACHINES / "3rpr.toml")
    for strut in file["strut"]:
        size = math.hypot(*strut["base"]) / math.hypot(*strut["platform"])
        strut["platform"] = [ratio * size * value for value in strut["platform"]]
    assert ("exchanged-ends" in _codes(file)) == odd


def test_carriages_that_hang_and_count_down_are_not_odd() -> None:
    file = file_at(MACHINES / "linear_delta.toml")
    for drive in file["drive"]:
        x, y, _ = drive["origin"]
        drive |= {"origin": [x, y, 580], "axis": [0, 0, -1], "working_mode": "-"}
    assert _codes(file) == []


def test_a_calibrated_pattern_is_not_odd() -> None:
    file = file_at(MACHINES / "tricept.toml")
    random = np.random.default_rng(1)
    for strut in file["strut"]:
        for end in ("base", "platform"):
            strut[end] = (np.array(strut[end]) + random.normal(0.0, 1.0, 3)).tolist()
    assert _codes(file) == []


def test_sentences_say_what_is_usual_and_what_to_do() -> None:
    for blunder in BLUNDERS:
        for oddity in tp.oddities(loaded(blunder.file)):
            assert "usual" in oddity.sentence or "would have" in oddity.sentence
            assert "Look" in oddity.sentence
            assert not oddity.sentence.endswith(".")
            assert "nan" not in oddity.sentence


def test_the_page_is_fresh() -> None:
    written = (DOCS / "looks_odd.md").read_text("utf-8")
    assert written == generator("looks_odd").page(), "run: python docs/generate_looks_odd.py"
