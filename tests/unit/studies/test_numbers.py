"""Each number of a variant is the command's on the file so set; a block is a pure function."""

from __future__ import annotations

import json
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import truepose as tp
from command_line import MACHINES, PLANAR, call
from sweeps import thinned
from truepose._kernel import instruction_set
from truepose.files.ratio import read_ratio
from truepose.studies import study as studies
from truepose.studies.block import BlockTask, evaluate_block
from truepose.studies.constraints import Constraints
from truepose.studies.quantities import QUICK_NAMES, SOURCE_NAMES
from truepose.verdict.answer import STATES
from truepose.verdict.coverage import QUICK, QUICK_DRAWS, QUICK_POSES

Capture = pytest.CaptureFixture[str]
SMALL = {"workspace.grid.x": "[-4, 4, 3]", "workspace.grid.y": "[-4, 4, 2]"}
CASES: dict[str, tuple[Path, dict[str, str], list[str]]] = {
    "planar": (PLANAR, {}, ["strut.*.length=500:560:2 mm", "condition.temperature=20,33.3 degC"]),
    "hexapod": (
        MACHINES / "hexapod.toml", SMALL,
        ["strut.*.stiffness=30:120:2 N/um", "strut.*.material=steel,invar"],
    ),
    "coverage": (PLANAR, {"accuracy.at": "95 %"}, ["condition.temperature=20,33.3 degC"]),
    "nothing asked": (
        MACHINES / "rotary_delta.toml", {"accuracy.target": "1 m"},
        ["strut.*.length_tolerance=[-0.1,0.1],[-0.2,0.2]", "each:strut.a?.mass=0.1,0.2 kg"],
    ),
    "path": (
        PLANAR, {"workspace": '{path={points=[[200,100],[400,300],[200,300]],step=100}}'},
        ["drive.*.backlash.play=10,20 um"],
    ),
}  # fmt: skip


def commanded(capsys: Capture, command: str, machine: Path, settings: list[str]) -> Any:
    arguments = [word for setting in settings for word in ("--set", setting)]
    outcome = call(capsys, command, machine, *arguments, "--format", "json")
    assert outcome.code in (0, 1), outcome.err
    return json.loads(outcome.out)


@pytest.mark.parametrize("case", thinned(CASES, quick={"planar", "hexapod", "path"}))
def test_each_number_is_the_commands(case: str, capsys: Capture) -> None:
    machine, settings, vary = CASES[case]
    study = tp.study(machine, vary, settings=settings)
    assert (study["status"] == "ok").all(), study["reason"].values
    base = [f"{key}={value}" for key, value in settings.items()]
    for variant in study["variant"].values.tolist():
        own = study["setting"].values[variant].tolist()
        given = base + [f"{k}={v}" for k, v in zip(study["variable"].values, own, strict=True)]
        loaded = tp.load(machine, given)
        kinds = study["quantity"].values.tolist()
        units = {kind: loaded.file_units["length" if kind == "position" else "angle"]
                 for kind in kinds}  # fmt: skip
        row = study.isel(variant=variant)

        answers = commanded(capsys, "check", machine, given)["answers"]
        assert len(answers) == len(kinds) * len(STATES)
        for answer in answers:
            at = row.sel(quantity=answer["quantity"], state=answer["state"])
            assert at["answer"].item() == (answer["answer"] or "")
            for name in ("witness", "linear", "bound"):
                in_file = units[answer["quantity"]].to_file(at[name].item())
                assert answer[name] == (in_file if np.isfinite(in_file) else None)

        budget = commanded(capsys, "budget", machine, given)
        variables, sources = budget["variables"], budget["coordinates"]["source"]["values"]
        linear = np.array(variables["linear_maximum"]["values"], float).max(axis=0)
        error = tp.budget(loaded)["overall_error"].values
        for number, kind in enumerate(kinds):
            at = row.sel(quantity=kind)
            assert units[kind].to_file(at["linear_maximum"].item()) == linear[number]
            turning = [name.startswith("r") for name in loaded.components]
            part = error[:, np.array(turning) == (kind == "orientation")]
            known = np.sqrt((part**2).sum(axis=1)).max()
            assert at["known"].item() == pytest.approx(known, rel=1e-14)
            for source in SOURCE_NAMES:
                expected = 0.0
                if source in sources:
                    highest = variables["highest"]["values"][sources.index(source)][number]
                    expected = float(highest)
                assert units[kind].to_file(at["highest"].sel(source=source).item()) == expected
        for source in SOURCE_NAMES:
            share = 0.0
            if source in sources:
                share = variables["share"]["values"][sources.index(source)]
            assert row["share"].sel(source=source).item() == share


def test_95_percent_is_that_of_the_report() -> None:
    study = tp.study(PLANAR, ["condition.temperature=25,35 degC"], quantities=["coverage"])
    from truepose.verdict.accuracy import at_coverage
    from truepose.verdict.states import Population

    assert list(study.data_vars)[-2:] == ["coverage_95", "done"]
    for variant, text in enumerate(["25 degC", "35 degC"]):
        population = Population(tp.load(PLANAR, [f"condition.temperature={text}"]))
        for at, state in enumerate(STATES):
            answer = at_coverage(
                population, state, "position", QUICK, None,
                most_poses=QUICK_POSES, most_draws=QUICK_DRAWS,
            )  # fmt: skip
            assert study["coverage_95"].values[variant, at, 0] == answer.linear.value


def prepared(path: Path, vary: list[str], **asked: Any) -> studies.PreparedStudy:
    usual = {"design": "factorial", "count": None, "seed": 0, "settings": (), "reach": 1.0}
    return studies.prepare(path, vary, **{**usual, "quantities": QUICK_NAMES, **asked})


def task_of(study: studies.PreparedStudy) -> BlockTask:
    plan = study.plan()
    variants = tuple(plan.of_variant(row) for row in range(len(plan)))
    return BlockTask(0, study.base, variants, study.quantities, Constraints(), instruction_set())


def test_a_block_needs_no_file_and_is_the_same_wherever_it_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "here"
    folder.mkdir()
    machine = folder / "machine.toml"
    text = PLANAR.read_text().replace("\ntemperature = 35", '\ntemperature_log = "log.csv"', 1)
    machine.write_text(text)
    (folder / "log.csv").write_text("time (s),default (degC)\n0,20\n60,30\n")
    (folder / "other.csv").write_text("time (s),default (degC)\n0,25\n60,45\n")
    task = task_of(prepared(machine, ["condition.temperature_log=log.csv,other.csv"]))
    here = evaluate_block(task)
    assert set(here["status"]) == {"ok"}
    assert here["known"][0] != here["known"][1]
    assert set(task.base.data_hashes) == {"log.csv", "other.csv"}
    sent = pickle.dumps(task)
    assert len(sent) < 20_000
    (folder / "log.csv").write_text("time (s),default (degC)\n0,99\n")
    (folder / "other.csv").unlink()
    machine.unlink()
    monkeypatch.chdir("/")
    there = evaluate_block(pickle.loads(sent))  # noqa: S301
    for name, values in here.items():
        assert there[name].tobytes() == values.tobytes() or values.dtype == object
        np.testing.assert_array_equal(there[name], values)


@pytest.mark.parametrize("name", ["scalar", "portable"])
def test_a_block_is_computed_with_the_instructions_of_its_task(name: str) -> None:
    from dataclasses import replace

    task = task_of(prepared(PLANAR, ["condition.temperature=25,35 degC"], quantities=["error"]))
    before = instruction_set()
    told: list[str] = []
    evaluate_block(replace(task, instruction_set=name), lambda _: told.append(instruction_set()))
    assert told == [name, name]
    assert instruction_set() == before


def test_a_machine_is_its_file_and_its_settings(tmp_path: Path) -> None:
    file = tmp_path / "m.toml"
    file.write_text(PLANAR.read_text())
    vary = {"strut.*.length": "500,520 mm"}
    machine = tp.load(file, ["condition.temperature=25"])
    of_machine = tp.study(machine, vary)
    of_file = tp.study(file, vary, settings=["condition.temperature=25"])
    assert of_machine.identical(of_file)
    assert tp.study(tp.load(file), vary, settings=["condition.temperature=25"]).identical(of_file)
    pulled = machine.condition.replace(force=(1.0, 0.0, 0.0))
    for other in (machine.replace({"tool.x": 1e-3}), machine.with_condition(pulled)):
        with pytest.raises(tp.errors.RequestError, match="machine-file-changed"):
            tp.study(other, vary)
    file.write_text(PLANAR.read_text() + "# changed\n")
    with pytest.raises(tp.errors.RequestError, match="machine-file-changed"):
        tp.study(machine, vary)


def test_a_share_is_read_as_one() -> None:
    from truepose.cli._options import read_share
    from truepose.files.units import UnitSystem

    for text in ("98 %", "0.98", "98%"):
        share = read_share("--reach", text, code="bad-reach", expected="a share")
        assert share == pytest.approx(0.98)
        assert share == read_ratio(text, UnitSystem({}))
