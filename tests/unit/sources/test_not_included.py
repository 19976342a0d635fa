"""Parts that are warm and taken as rigid, since nobody says how they expand, are named."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from build_machine import MACHINES, machine_files
from command_line import call
from machine_texts import HEXAPOD, PLANAR, edited, load_text
from truepose.machine.temperature_log import TemperatureLog
from truepose.sources import not_included, not_included_text

STEEL = 'expansion = "1.2e-5 1/K"\n'
POSE = [[0.3, 0.2]]


def test_what_is_warm_and_says_nothing_is_named(tmp_path: Path) -> None:
    machine = load_text(tmp_path, PLANAR)  # 35 degC; struts alone say how they grow
    assert not_included(machine, machine.condition) == ("frame", "drive.d1", "drive.d2")
    said = "frame, drive.d1, drive.d2 (no material)"
    assert not_included_text(machine, machine.condition) == said
    assert tp.budget(machine, POSE).attrs["not_included"] == said
    assert tp.compensate(machine, POSE).attrs["not_included"] == said
    assert tp.monte_carlo(machine, POSE, samples=16).attrs["not_included"] == said


def test_at_the_reference_everything_is_included(tmp_path: Path) -> None:
    machine = load_text(tmp_path, PLANAR, "condition.temperature=20")
    assert not_included_text(machine, machine.condition) == ""
    assert tp.budget(machine, POSE).attrs["not_included"] == ""
    # In another condition of the same machine it is not.
    warm = machine.condition.replace(temperature=300.0)
    assert tp.budget(machine, POSE, warm).attrs["not_included"].startswith("frame, drive.d1")


@pytest.mark.parametrize("said", ['expansion = "0 1/K"', 'material = "steel"'])
def test_what_is_said_is_included_be_it_zero(said: str, tmp_path: Path) -> None:
    text = PLANAR.replace('kind = "slider"\n', f'kind = "slider"\n{said}\n') + f"[frame]\n{said}\n"
    machine = load_text(tmp_path, text)
    assert not_included(machine, machine.condition) == ()


def test_a_gradient_or_a_log_makes_a_part_warm(tmp_path: Path) -> None:
    machine = load_text(tmp_path, PLANAR, "condition.temperature=20")
    log = TemperatureLog([0.0, 60.0], {"default": [293.15, 303.15]})
    logged = machine.condition.replace(temperature_log=log, time=0.0)
    assert "frame" in not_included(machine, logged), "it is, later in the log"
    found = tp.over_time(machine, POSE, logged)
    assert found.attrs["not_included"].startswith("frame")


def test_arms_of_carriages_and_the_platforms_points(tmp_path: Path) -> None:
    with_arm = PLANAR.replace("base = [0, 0, 0]", "base = [20, 0, 0]", 1)
    text = (
        edited(with_arm, ('name = "planar"\n', 'name = "planar"\ntool = [0, 5, 0]\n'))
        + f"[frame]\n{STEEL}"
    )
    text = text.replace('kind = "slider"\n', f'kind = "slider"\n{STEEL}')
    machine = load_text(tmp_path, text)
    # The carriage of d2 has its joint at its own point; the tool is away from the platform's.
    assert not_included(machine, machine.condition) == ("platform", "tool", "carriage.d1")
    held = load_text(tmp_path, text + f"[platform]\n{STEEL}")
    assert not_included(held, held.condition) == ("carriage.d1",), "the tool is of the platform"
    made = text.replace('name = "d1"\n', f'name = "d1"\ncarriage = {{ {STEEL.strip()} }}\n', 1)
    machine = load_text(tmp_path, made + f"[platform]\n{STEEL}")
    assert not_included(machine, machine.condition) == ()


def test_a_telescopic_strut_is_its_own_measure(tmp_path: Path) -> None:
    text = HEXAPOD.replace("platform = [", f"{STEEL}platform = [") + f"[frame]\n{STEEL}"
    machine = load_text(tmp_path, text)
    warm = machine.condition.replace(temperature=300.0)
    assert not_included(machine, warm) == ("platform",)


def test_a_crank_has_an_arm() -> None:
    text = (MACHINES / "five_bar.toml").read_text(encoding="utf-8")
    assert text.count('material = "aluminium"') == 2
    machine = tp.load(MACHINES / "five_bar.toml", ["drive.left.expansion=0 1/K"])
    assert not_included(machine, machine.condition) == ()


def test_an_arm_that_says_nothing_is_named(tmp_path: Path) -> None:
    text = (MACHINES / "five_bar.toml").read_text(encoding="utf-8")
    path = tmp_path / "machine.toml"
    path.write_text(text.replace('material = "aluminium"', ""), encoding="utf-8")
    machine = tp.load(path)
    assert not_included(machine, machine.condition) == ("drive.left", "drive.right")


@pytest.mark.parametrize("path", machine_files(), ids=lambda path: path.stem)
def test_machines_shipped_say_how_all_of_them_grows(path: Path) -> None:
    machine = tp.load(path)
    assert machine.frame.expansion is not None
    warm = machine.condition.replace(temperature=machine.condition.reference_temperature + 10)
    assert not_included(machine, warm) == ()


def test_the_command_line_says_so_once(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    machine = tmp_path / "machine.toml"
    text = PLANAR.replace('kind = "slider"\n', f'kind = "slider"\n{STEEL}')
    machine.write_text(text, encoding="utf-8")
    for command in ("check", "budget"):
        shown = call(capsys, command, machine).out
        assert shown.count("Not included: frame (no material).") == 1, command
    document = json.loads(call(capsys, "check", machine, "--format", "json").out)
    assert document["not_included"] == [{"part": "frame", "why": "no material"}]
    rows = csv.DictReader(io.StringIO(call(capsys, "check", machine, "--format", "csv").out))
    assert {row["not_included"] for row in rows} == {"frame (no material)"}
    budget = json.loads(call(capsys, "budget", machine, "--format", "json").out)
    assert budget["attributes"]["not_included"] == "frame (no material)"
    page = tmp_path / "page.html"
    call(capsys, "report", machine, "--output", page)
    assert page.read_text(encoding="utf-8").count("Not included: frame (no material).") == 1
    machine.write_text(text + f"[frame]\n{STEEL}", encoding="utf-8")
    for command in ("check", "budget"):
        assert "ot included" not in call(capsys, command, machine).out, command


def test_a_warm_frame_spreads_the_towers_of_a_delta() -> None:
    """In its enclosure at 45 degC the rods alone do 1 to 2 um; the frame does 70."""
    rigid = ["each.drive.expansion", "each.drive.carriage.expansion", "platform.expansion"]
    machine = tp.load(MACHINES / "linear_delta.toml", [f"{key}=0 1/K" for key in rigid])
    found = tp.budget(machine, [[0.0, 0.0, 0.1]]).error.sel(source="thermal").values[0]
    # Aluminium about the bed's middle, rods of carbon fibre: by Pythagoras, sizes of the file.
    tower, effector, rod = 0.20475, 0.03, 0.333
    before = np.sqrt(rod**2 - (tower - effector) ** 2)
    wide, short = tower * (1 + 23e-6 * 25) - effector, rod * (1 - 0.2e-6 * 25)
    rise = before - np.sqrt(short**2 - wide**2)
    assert rise == pytest.approx(74.5e-6, abs=0.5e-6)
    # Its towers and rods are told to 0.1 um, and differ by as much.
    assert np.allclose(found, [0, 0, rise, 0, 0, 0], rtol=0, atol=1e-9)
    whole = tp.budget(machine, machine.poses()[::5])
    assert str(whole.verdict.sel(source="thermal").values) != "negligible"
