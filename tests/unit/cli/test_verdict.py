"""What commands say of the accuracy asked beyond numbers: witnesses, coverages, words."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import truepose
from command_line import MACHINES, PLANAR, call

FEW = ["--set", "workspace.grid={ x = [250, 350, 2], y = [200, 200, 1] }"]
SHARE = ["--set", "accuracy.at=95 %"]
COMMANDS = ("check", "budget", "compensate")


def answers(capsys: pytest.CaptureFixture[str], *asked: object) -> list[dict[str, Any]]:
    found = call(capsys, "check", *asked, "--format", "json")
    return json.loads(found.out)["answers"]  # type: ignore[no-any-return]


@pytest.mark.parametrize("command", COMMANDS)
def test_a_witness_is_a_machine_file_with_the_number(
    command: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    file = tmp_path / "witness.toml"
    outcome = call(capsys, command, PLANAR, "--witness", file)
    assert outcome.code == int(command == "check")
    assert f"wrote {file}" in outcome.err
    state = "after" if command == "compensate" else "before"
    judged = next(a for a in answers(capsys, PLANAR) if a["state"].startswith(state))
    found = truepose.budget(truepose.load(file))
    size = np.linalg.norm(found["overall_error"].values, axis=1)
    assert size * 1e3 == pytest.approx([judged["witness"]], rel=1e-9)
    # The machine is no more than itself: what it is asked is answered by its one error.
    again = call(capsys, "check", file, "--format", "json")
    before, _ = json.loads(again.out)["answers"]
    assert before["linear"] == pytest.approx(judged["witness"], rel=1e-9)
    assert (again.code, before["answer"]) == (1, "NOT met")


def test_where_all_is_met_there_is_no_witness(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    file = tmp_path / "witness.toml"
    outcome = call(capsys, "check", PLANAR, "--set", "accuracy.target=2 mm", "--witness", file)
    assert (outcome.code, outcome.codes) == (2, ["no-witness"])
    assert "after compensation, position: met" in outcome.err
    assert not file.exists()


@pytest.mark.parametrize("command", COMMANDS)
def test_where_nothing_is_asked_there_is_no_witness(
    command: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    machine = tmp_path / "machine.toml"
    machine.write_text(PLANAR.read_text().partition("[accuracy]")[0])
    outcome = call(capsys, command, machine, "--witness", tmp_path / "witness.toml")
    assert (outcome.code, outcome.codes, outcome.out) == (2, ["no-witness"], "")
    assert '--set accuracy.target="0.5 mm"' in outcome.err


def test_a_coverage_has_no_witness(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    asked = [PLANAR, *FEW, *SHARE, "--set", "accuracy.target=0.1 mm"]
    outcome = call(capsys, "check", *asked, "--witness", tmp_path / "witness.toml")
    assert (outcome.code, outcome.codes) == (2, ["no-witness"])
    assert "accuracy.at=worst" in outcome.err


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize(
    ("name", "code"),
    [
        ("nowhere/witness.toml", "output-not-writable"),
        ("witness.json", "output-ending"),
        ("machine.toml", "output-is-input"),
        ("folder.toml", "output-not-writable"),
    ],
)
def test_a_place_for_the_witness_is_refused_before_the_work(
    command: str,
    name: str,
    code: str,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    machine = tmp_path / "machine.toml"
    machine.write_bytes(PLANAR.read_bytes())
    (tmp_path / "folder.toml").mkdir()
    monkeypatch.setattr(truepose, "load", None)  # nothing is even read
    outcome = call(capsys, command, machine, "--witness", tmp_path / name)
    assert (outcome.code, outcome.codes, outcome.out) == (2, [code], "")
    assert machine.read_bytes() == PLANAR.read_bytes()


@pytest.mark.parametrize("name", ["both.json", "both.toml"])
def test_witness_and_output_are_two_files(
    name: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    file = tmp_path / name
    outcome = call(capsys, "check", PLANAR, "--witness", file, "--output", file)
    assert (outcome.code, outcome.codes, outcome.out) == (2, ["output-twice"], "")
    assert not file.exists()


def test_a_coverage_is_the_quantile_at_the_worst_pose(capsys: pytest.CaptureFixture[str]) -> None:
    before, after = answers(capsys, PLANAR, *FEW, *SHARE)
    found = truepose.monte_carlo(truepose.load(PLANAR, FEW[1:]), samples=200_000, seed=5)
    quantile = found["magnitude_upper"].values[:, 0].max() * 1e3
    assert before["highest"] == before["linear"] == pytest.approx(quantile, rel=0.01)
    for answer in (before, after):
        # Beside the number stand the ends of its confidence interval.
        assert answer["witness"] < answer["linear"] < answer["bound"]
        assert "machines drawn at the worst pose, seed 0" in answer["rests_on"]
        assert answer["example"] is None
    assert after["linear"] < before["linear"]


@pytest.mark.parametrize("command", [*COMMANDS, "bounds", "report"])
def test_the_exit_code_turns_at_the_quantile(
    command: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    before, after = answers(capsys, PLANAR, *FEW, *SHARE)
    judged = after if command in ("compensate", "report") else before
    required = [] if command == "check" else ["--require-accuracy"]
    if command == "report":
        required += ["--output", str(tmp_path / "page.html")]
    for target, word in ((judged["witness"] * 0.99, "NOT met"), (judged["bound"] * 1.01, "met")):
        asked = ["--set", f"accuracy.target={target!r} mm", *FEW, *SHARE, *required]
        outcome = call(capsys, command, PLANAR, *asked)
        line = next(each for each in outcome.out.splitlines() if judged["state"] in each)
        assert line.startswith(f"{word}  "), (command, line)
        assert "95 % within " in line
        assert outcome.code == int(word == "NOT met")


def test_the_table_at_a_coverage_names_its_ends(capsys: pytest.CaptureFixture[str]) -> None:
    outcome = call(capsys, "budget", PLANAR, *FEW, *SHARE)
    assert "confidence, lower end" in outcome.out
    assert "95 % quantile" in outcome.out


@pytest.mark.parametrize(
    ("setting", "code"),
    [
        ("accuracy.at=wurst", "unknown-choice"),
        ("accuracy.at=100 %", "bad-probability"),
        ("accuracy.at=0", "bad-probability"),
        ("accuracy.at=-0.5", "bad-probability"),
        ("accuracy.target=0 mm", "not-positive"),
    ],
)
def test_what_cannot_be_asked(setting: str, code: str, capsys: pytest.CaptureFixture[str]) -> None:
    outcome = call(capsys, "check", PLANAR, "--set", setting)
    assert (outcome.code, outcome.codes, outcome.out) == (2, [code], "")


@pytest.mark.parametrize("command", COMMANDS)
def test_programs_see_no_words_for_people(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    outcome = call(capsys, command, PLANAR, *FEW, "--format", "json")
    json.loads(outcome.out)
    assert not re.search(r"^(NOT )?met ", outcome.out, re.M)


def test_every_machine_has_its_answers_first(capsys: pytest.CaptureFixture[str]) -> None:
    machine = MACHINES / "linear_delta.toml"
    first = call(capsys, "check", machine).out.splitlines()
    starts = [line for line in first[:12] if re.match(r"(NOT met|met|undecided|not asked)  ", line)]
    assert [" ".join(line.split()[:1]) for line in starts] == ["NOT", "met", "NOT", "met"]
    assert first[0].strip().startswith("At all 125 poses of the workspace")
    assert first[1].startswith("NOT met  position before compensation: 348.9 µm, asked 0.2 mm")
