"""Every number that the studio answers is the one that the command prints for the saved file."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import truepose as tp
from command_line import MACHINES, call
from sweeps import thinned
from truepose.cli import run
from truepose.live import bundle
from truepose.reporting.result import in_file_units
from truepose.studio.answers import (
    ANSWERS,
    Question,
    changed,
    known,
    machine_of_page,
    shares_at_pose,
    verdict,
)
from truepose.studio.edited_file import OpenedFile
from truepose.studio.jobs import KINDS
from truepose.studio.settings import Settings, ShownCondition
from truepose.studio.tabs import TABS

Capture = pytest.CaptureFixture[str]

EDITS: dict[str, tuple[tuple[str, str], ...]] = {
    "planar_two_slider": (
        ("strut.1.length", "500.5"),
        ("condition.temperature", "31"),
        ("strut.2.length_tolerance", "[-0.1, 0.2]"),
    ),
    "hexapod": (
        ("strut.1.stiffness", "25 N/um"),
        ("tolerance.strut.*.base.*", "0.0003"),
        ("condition.force.z", "-300"),
        ("workspace.grid.z", "[18, 22, 2]"),
    ),
    "linear_delta": (
        ("strut.a1.length_tolerance", "0.05"),
        ("drive.b.origin.z", "0.1"),
        ("condition.temperature", "38"),
    ),
}


@dataclass(frozen=True)
class Saved:
    """A machine with edits, and the file in which they are saved."""

    question: Question
    path: Path

    @property
    def machine(self) -> tp.Machine:
        return self.question.machine


@pytest.fixture(params=thinned(EDITS, {"planar_two_slider", "hexapod"}))
def saved(request: pytest.FixtureRequest, tmp_path: Path) -> Saved:
    name = request.param
    (tmp_path / f"{name}.toml").write_bytes((MACHINES / f"{name}.toml").read_bytes())
    file = OpenedFile.read(tmp_path / f"{name}.toml")
    text = file.edited(EDITS[name])
    file.save_as("saved.toml", text)
    machine = OpenedFile(file.path, "", text).machine()
    return Saved(Question(machine), tmp_path / "saved.toml")


def printed(saved: Saved, *arguments: object, capsys: Capture) -> Any:
    command, *options = arguments
    outcome = call(capsys, command, saved.path, "--format", "json", *options)
    assert outcome.code == 0, outcome.err
    return json.loads(outcome.out)


def in_units(saved: Saved, kind: str, value: float | None) -> float:
    assert value is not None
    unit = {"position": "m", "orientation": "rad"}[kind]
    return in_file_units(saved.machine, value, unit)[0]


def test_known_error_and_linear_maximum(saved: Saved, capsys: Capture) -> None:
    document = printed(saved, "budget", capsys=capsys)
    variables = document["variables"]
    told = known(saved.question)
    poses = saved.machine.poses()
    assert (told["poses"], told["left_out"]) == (len(poses), 0)
    kinds = document["coordinates"]["quantity"]["values"]
    linear = np.array(variables["linear_maximum"]["values"])
    for at, kind in enumerate(kinds):
        peak = told["highest"][kind]
        assert in_units(saved, kind, peak["value"]) == linear[:, at].max()
        assert linear[peak["number"], at] == linear[:, at].max()
        assert peak["pose"] == poses[peak["number"]].tolist()
    there = int(np.flatnonzero((poses == told["pose"]).all(axis=1))[0])
    errors = np.array(variables["overall_error"]["values"])
    components = document["coordinates"]["component"]["values"]
    for at, name in enumerate(components):
        kind = "position" if name in "xyz" else "orientation"
        assert in_units(saved, kind, told["error"][at]) == errors[there, at]
    alone = np.array(variables["error"]["values"])
    highest = np.array(variables["highest"]["values"])
    names = document["coordinates"]["source"]["values"]
    assert [source["name"] for source in told["sources"]] == names
    for row, source in enumerate(told["sources"]):
        assert in_units(saved, "position", source["error"][0]) == alone[there, row, 0]
        for at, kind in enumerate(kinds):
            assert in_units(saved, kind, source["highest"][kind]) == highest[row, at]


def test_largest_known_error_is_at_a_pose_of_the_workspace(saved: Saved) -> None:
    told = known(saved.question)
    budget = tp.budget(saved.machine)
    columns = [n for n, name in enumerate(budget["component"].values) if name in ("x", "y", "z")]
    sizes = np.linalg.norm(budget["overall_error"].values[:, columns], axis=1)
    peak = told["largest"]["position"]
    assert (peak["value"], peak["number"]) == (sizes.max(), sizes.argmax())


def test_the_verdict_is_that_of_the_function_and_of_the_report(saved: Saved) -> None:
    *_, told = verdict(saved.question)
    first = next(iter(verdict(saved.question)))
    answers = tp.accuracy(tp.load(saved.path))
    assert [row["state"] for row in told] == [answer.state for answer in answers]
    assert told[: len(first)] == first
    for row, answer in zip(told, answers, strict=True):
        assert row["answer"] == answer.answer
        assert row["rests_on"] == answer.rests_on
        assert row["asked"] == answer.asked
        for name in ("witness", "linear", "bound"):
            number = getattr(answer, name)
            assert row[name]["value"] == number.value
            assert row[name]["pose"] == number.pose.tolist()


def test_the_witness_is_told_as_the_command_tells_it(saved: Saved, capsys: Capture) -> None:
    *_, told = verdict(saved.question)
    out = " ".join(call(capsys, "check", saved.path).out.split())
    not_met = [row for row in told if row["answer"] == "NOT met"]
    assert not_met
    for row in not_met:
        assert f"witness: {'; '.join(row['example']['causes'])}" in out
    for row, answer in zip(told, tp.accuracy(tp.load(saved.path)), strict=True):
        witness = answer.example
        assert witness is not None
        assert witness.joint_centres is not None
        assert row["example"]["causes"] == witness.words()[1:]
        assert row["example"]["status"] == "ok"
        assert row["example"]["centres"] == witness.joint_centres.tolist()
        moved = np.linalg.norm(row["example"]["moved"])
        if row["quantity"] == "position":
            assert moved == pytest.approx(row["witness"]["value"], rel=1e-14)
    json.dumps(told, allow_nan=False)


def test_a_machine_that_cannot_be_assembled_is_named_and_not_drawn() -> None:
    wide = tp.load(
        MACHINES / "planar_two_slider.toml", ["strut.1.length_tolerance=450", "accuracy.target=1 m"]
    )
    *_, told = verdict(Question(wide))
    lost = [row["example"] for row in told if row["witness"]["value"] is None]
    assert lost
    for example in lost:
        assert example["status"] != "ok"
        assert example["causes"]
        assert example["centres"] is example["moved"] is None


def test_shares_are_those_of_the_command_at_that_pose(saved: Saved, capsys: Capture) -> None:
    told = shares_at_pose(saved.question)
    pose = saved.question.pose()
    units = (("length" if name in "xyz" else "angle") for name in saved.machine.commanded)
    row = [
        float(saved.machine.file_units[unit].to_file_exactly(value))
        for unit, value in zip(units, pose, strict=True)
    ]
    settings = [f"workspace.{way}={value}" for way, value in (("poses", [row]),)]
    text = saved.path.read_text("utf-8").splitlines(keepends=True)
    saved.path.write_text("".join(line for line in text if not line.startswith("grid")))
    document = printed(saved, "shares", "--set", settings[0], capsys=capsys)
    names = document["coordinates"]["parameter"]["values"]
    total = np.array(document["variables"]["total"]["values"])[0]
    by_name = dict(zip(names, total.tolist(), strict=True))
    assert len(told["parameters"]) + told["left_out"] == len(names)
    for shown in told["parameters"]:
        for one, other in zip(shown["total"], by_name[shown["name"]], strict=True):
            assert one == other or one == pytest.approx(other, rel=1e-6, abs=1e-9)
    sizes = [max(value or 0.0 for value in row["total"]) for row in told["parameters"]]
    assert sizes == sorted(sizes, reverse=True)


def test_the_ranking_is_that_of_the_command(saved: Saved, capsys: Capture) -> None:
    variables = printed(saved, "budget", capsys=capsys)["variables"]
    (told,) = TABS["budget"].give(saved.question)
    for row in told["rows"]:
        at = variables["rank"]["values"].index(row["rank"])
        assert row["verdict"] == variables["verdict"]["values"][at]
        assert row["share"] == pytest.approx(variables["share"]["values"][at], rel=1e-14)
        assert (
            in_units(saved, "position", row["rms"]["position"])
            == (variables["rms"]["values"][at][0])
        )
    assert [row["rank"] for row in told["rows"]] == sorted(row["rank"] for row in told["rows"])


def test_the_page_gets_the_bundle_of_the_saved_file(saved: Saved) -> None:
    told = machine_of_page(saved.question)
    other = bundle(tp.load(saved.path))
    # The file that is answered is the one saved, but has no name of its own.
    assert {**told["bundle"], "file_hash": ""} == {**other, "file_hash": ""}
    assert told["bundle"]["workspace"]["home"] == saved.question.pose().tolist()


# --- what is shown


@cache
def planar() -> tp.Machine:
    return tp.load(MACHINES / "planar_two_slider.toml")


def test_at_another_pose_in_another_condition() -> None:
    condition = ShownCondition((("strut.1", 310.0),), (50.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    question = Question(planar(), Settings((), (0.31, 0.17), condition))
    there = tp.budget(planar(), [0.31, 0.17], condition.of(planar().condition))
    told = known(question)
    assert told["error"] == there["overall_error"].values[0].tolist()
    assert told["linear_maximum"]["position"] == float(there["linear_maximum"].values[0, 0])
    over = tp.budget(planar(), condition=condition.of(planar().condition))
    assert told["highest"]["position"]["value"] == float(over["linear_maximum"].values.max())
    (first, *_) = verdict(question)
    asked = tp.accuracy(planar(), condition=condition.of(planar().condition))
    assert first[0]["linear"]["value"] == asked[0].linear.value


def test_a_pose_out_of_reach_says_why() -> None:
    told = known(Question(planar(), Settings((), (5.0, 5.0), None)))
    assert told["error"] is None
    assert "reach" in told["status"]
    assert told["highest"]["position"]["value"] > 0.0
    assert json.loads(json.dumps(told, allow_nan=False)) == told


def test_nothing_infinite_is_told() -> None:
    """A bound that is not there is null: JSON has no infinity."""
    over = tp.load(MACHINES / "overconstrained.toml", ["accuracy.target=1 nm"])
    for value in verdict(Question(over)):
        json.dumps(value, allow_nan=False)


@pytest.mark.parametrize(
    ("after", "again"),
    [
        (Settings((), (1.0,), None), {"known", "shares"}),
        (Settings((("a", "1"),), None, None), {"known", "machine", "verdict", "shares"}),
        (
            Settings((), None, ShownCondition((), (0.0,) * 6)),
            {"known", "verdict", "shares"},
        ),
        (Settings(), set()),
    ],
)
def test_what_follows_from_what(after: Settings, again: set[str]) -> None:
    what = changed(Settings(), after)
    assert {kind.name for kind in ANSWERS if kind.follows & what} == again


# --- calibration


@pytest.fixture
def printer() -> Callable[[bytes], Question]:
    """A function: the printer of the examples, and a dropped file of measurements."""
    from truepose.studio.answers import DroppedFile

    machine = tp.load(MACHINES.parent / "examples" / "data" / "delta_printer.toml")

    def question(content: bytes) -> Question:
        files = {3: DroppedFile("dropped.csv", content)}
        return Question(machine, options={"file": 3}, files=files)

    return question


DATA = MACHINES.parent / "examples" / "data" / "delta_positions.csv"


def test_a_dropped_calibration_is_that_of_the_command(
    printer: Callable[[bytes], Question], tmp_path: Path, capsys: Capture
) -> None:
    (told,) = TABS["calibration"].give(printer(DATA.read_bytes()))
    machine = DATA.with_name("delta_printer.toml")
    document = json.loads(call(capsys, "calibrate", machine, DATA, "--format", "json").out)
    attributes = document["attributes"]
    assert told["accepted"] == bool(attributes["accepted"])
    assert told["answer"] == attributes["answer"]
    assert told["fit"]["birge"] == attributes["birge"]
    assert told["fit"]["rms_after"] == attributes["rms_after"]
    codes = [suspicion["code"] for suspicion in json.loads(attributes["suspicions"])]
    assert [suspicion["code"] for suspicion in told["suspicions"]] == codes
    residuals = np.abs(document["variables"]["normalised_after"]["values"])
    shown = [abs(row["residual"]) for row in told["residuals"]]
    assert shown == sorted(residuals.tolist(), reverse=True)[: len(shown)]
    assert len(told["unknowns"]) == document["sizes"]["unknown"]


def test_a_dropped_file_that_is_none(printer: Callable[[bytes], Question]) -> None:
    for content, code in ((b"x (mm)\n\xe4\n", "not-utf8"), (b"no, table\n1\n", "unknown-column")):
        with pytest.raises(tp.errors.RequestError) as failure:
            list(TABS["calibration"].give(printer(content)))
        assert failure.value.problems[0].code == code
        assert failure.value.problems[0].file == "dropped.csv"
    machine = printer(b"").machine
    assert list(TABS["calibration"].give(Question(machine))) == [{}]
    with pytest.raises(tp.errors.RequestError) as failure:
        list(TABS["calibration"].give(Question(machine, options={"file": 7})))
    assert failure.value.problems[0].code == "file-missing"


def test_every_tab_and_answer_has_a_name_of_its_own() -> None:
    assert not KINDS.keys() & TABS.keys()
    assert run(["studio", "--help"]) == 0
