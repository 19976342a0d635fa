"""Bad input: all problems on stderr, exit code 2, no traceback, no file touched."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

from command_line import PLANAR, call

OUT_OF_REACH = "workspace.grid.x=[-900, 700, 9]"
NOWHERE = "workspace.grid.x=[5000, 6000, 3]"


def test_a_missing_file(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    for command in ("check", "budget", "compensate", "report"):
        outcome = call(capsys, command, tmp_path / "nothing.toml")
        assert outcome.code == 2
        assert "file-missing" in outcome.codes
        assert "Traceback" not in outcome.err
        assert outcome.out == ""


def test_all_problems_of_a_file_at_once_for_people_and_for_programs(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    file = tmp_path / "machine.toml"
    text = PLANAR.read_text().replace("length = 500", "lenght = 500").replace("210 GPa", "210 N")
    file.write_text(text)
    outcome = call(capsys, "budget", file, "--format", "json")
    problems = json.loads(outcome.out)["problems"]
    assert outcome.code == 2
    assert {"unknown-key", "wrong-dimension"} <= {problem["code"] for problem in problems}
    for problem in problems:
        assert problem["file"].endswith("machine.toml")
        assert isinstance(problem["line"], int)
        assert problem["code"] in outcome.codes


@pytest.mark.parametrize(
    ("setting", "code"), [("nonsense", "bad-setting"), ("strut.1.lenght=5", "unknown-key")]
)
def test_a_setting_that_leads_nowhere(
    setting: str, code: str, capsys: pytest.CaptureFixture[str]
) -> None:
    outcome = call(capsys, "budget", PLANAR, "--set", setting)
    assert outcome.code == 2
    assert outcome.codes == [code]


def test_no_pose_left(capsys: pytest.CaptureFixture[str]) -> None:
    outcome = call(capsys, "budget", PLANAR, "--set", NOWHERE)
    assert outcome.code == 2
    assert "no-pose-left" in outcome.codes
    line = 1 + PLANAR.read_text().splitlines().index("[workspace]")
    assert f"planar_two_slider.toml:{line}:" in outcome.err
    assert "strut" in outcome.err


def test_strict_names_the_poses_that_cannot_be_used(capsys: pytest.CaptureFixture[str]) -> None:
    lenient = call(capsys, "budget", PLANAR, "--set", OUT_OF_REACH, "--format", "json")
    strict = call(capsys, "budget", PLANAR, "--set", OUT_OF_REACH, "--strict")
    assert (lenient.code, strict.code) == (0, 2)
    first = json.loads(lenient.out)["left_out"][0]
    assert "unusable-pose" in strict.codes
    shown = f"x \N{MINUS SIGN}{-first['x']:g} mm, y {first['y']:g} mm"
    assert f"pose {first['pose']} cannot be used: {shown}" in strict.err
    # At x = -900 mm the guideways at 0 and 600 mm are 900 and 1500 mm away, the struts 500 long.
    assert "unreachable: strut 1 misses by 400 mm; strut 2 misses by 1000 mm" in strict.err
    checked = call(capsys, "check", PLANAR, "--set", OUT_OF_REACH, "--strict").err
    assert checked.endswith(strict.err)
    above = checked.removesuffix(strict.err).splitlines()
    assert above
    assert all(line.startswith("looks odd[") for line in above)


@pytest.mark.parametrize("command", ["check", "budget", "compensate", "report"])
@pytest.mark.parametrize(
    ("name", "code"),
    [
        ("result.xml", "output-ending"),
        ("result", "output-ending"),
        ("missing/result.{}", "output-not-writable"),
        ("folder.{}", "output-not-writable"),
    ],
)
def test_an_output_that_cannot_be_written_is_refused_before_the_work(
    command: str, name: str, code: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    ending = "html" if command == "report" else "json"
    for each in ("json", "html"):
        (tmp_path / f"folder.{each}").mkdir()
    # The machine file is missing too: the output is looked at first.
    outcome = call(capsys, command, "no.toml", "--output", tmp_path / name.format(ending))
    assert outcome.code == 2
    assert outcome.codes == [code]


def test_an_output_that_is_the_machine_file(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    # Named .json so that its ending is one that could be written.
    file = tmp_path / "machine.json"
    file.write_text(PLANAR.read_text())
    link = tmp_path / "link.json"
    link.symlink_to(file)
    for output in (file, link):
        outcome = call(capsys, "budget", file, "--output", output)
        assert outcome.code == 2
        assert "output-is-input" in outcome.codes
    assert file.read_text() == PLANAR.read_text()


def test_a_folder_without_permission(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Nothing is forbidden to root, under whom tests may run: the system's answer is played.
    monkeypatch.setattr("os.access", lambda path, mode: Path(path) != tmp_path)
    outcome = call(capsys, "budget", PLANAR, "--output", tmp_path / "result.json")
    assert outcome.code == 2
    assert "output-not-writable" in outcome.codes
    assert f"no write permission for {tmp_path}" in outcome.err


@pytest.mark.parametrize("package", ["jinja2", "plotly"])
def test_packages_that_are_not_installed(
    package: str,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for module in ("page", "shell"):  # imported anew, whatever ran before
        monkeypatch.delitem(sys.modules, f"truepose.reporting.{module}", raising=False)
        monkeypatch.delattr(f"truepose.reporting.{module}", raising=False)
    monkeypatch.setitem(sys.modules, package, None)
    outcome = call(capsys, "report", PLANAR, "--output", tmp_path / "page.html")
    assert outcome.code == 2
    assert "extra-missing" in outcome.codes
    assert "pip install 'truepose[report]'" in outcome.err
    assert list(tmp_path.iterdir()) == []


def test_a_terminal_gets_the_same_problems_in_colour(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    monkeypatch.setenv("TERM", "xterm")
    outcome = call(capsys, "check", "no.toml")
    assert outcome.code == 2
    assert "file-missing" in outcome.err
    assert "no.toml" in outcome.err
