"""What to know before the numbers are used: said once, by every command that has it."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from command_line import PLANAR, call
from guided_machines import guided

GUIDED = guided("3prs")
FEW = ["--set", "workspace.grid={z = [0, 100, 2], a = [0, 10, 2]}"]
WARNING = re.compile(
    r"^warning\[guide-taken-rigid\]: guides are taken as rigid: g1 carries .*$", re.M
)


@pytest.mark.parametrize("command", ["check", "budget", "compensate"])
@pytest.mark.parametrize("form", ["table", "json", "csv"])
def test_a_warning_is_on_stderr_once(
    command: str, form: str, capsys: pytest.CaptureFixture[str]
) -> None:
    outcome = call(capsys, command, GUIDED, *FEW, "--format", form)
    assert len(WARNING.findall(outcome.err)) == outcome.err.count("guide-taken-rigid") == 1
    assert outcome.codes == []


def test_a_warning_changes_no_exit_code(capsys: pytest.CaptureFixture[str]) -> None:
    loose = ["--set", "accuracy.target=5 mm", "--set", "accuracy.angle_target=5 deg"]
    assert call(capsys, "check", GUIDED, *FEW, *loose).code == 0
    assert call(capsys, "budget", GUIDED, *FEW, *loose, "--require-accuracy").code == 0


def test_programs_find_it_in_json(capsys: pytest.CaptureFixture[str]) -> None:
    checked = json.loads(call(capsys, "check", GUIDED, *FEW, "--format", "json").out)
    (warning,) = checked["warnings"]
    assert warning["code"] == "guide-taken-rigid"
    budget = json.loads(call(capsys, "budget", GUIDED, *FEW, "--format", "json").out)
    assert json.loads(budget["attributes"]["warnings"]) == [warning]


def test_the_report_lists_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    page = tmp_path / "page.html"
    outcome = call(capsys, "report", GUIDED, *FEW, "--output", page)
    assert len(WARNING.findall(outcome.err)) == 1
    text = page.read_text(encoding="utf-8")
    assert 'id="table-warnings"' in text
    assert "Guides are taken as rigid: g1 carries up to" in text


def test_nothing_is_said_where_there_is_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    outcome = call(capsys, "check", PLANAR, "--format", "json")
    assert "warning" not in outcome.err
    assert json.loads(outcome.out)["warnings"] == []
    unloaded = ["--set", "condition.force=[0, 0, 0]"]
    assert "warning" not in call(capsys, "budget", GUIDED, *FEW, *unloaded).err
