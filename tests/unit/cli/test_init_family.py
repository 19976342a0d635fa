"""`truepose init KIND --radius 138 ...` and `truepose check --expand`: files of a family."""

from __future__ import annotations

import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from command_line import call
from family_machines import KINDS, family_of, library_file
from sweeps import thinned
from truepose.machine.families import REGISTRY
from truepose.machine.library import machine_of
from truepose.machine.template import commented
from truepose.sources import REGISTRY as SOURCES

DELTA = ["--radius", "138", "--effector-radius", "33", "--rod", "217", "--spacing", "45"]


def options(kind: str, scale: float = 1.0) -> list[str]:
    """The parameters of the library's machine, its lengths `scale` times as long."""
    family = next(family for family in REGISTRY if family.kind == kind)
    unit = library_file(kind)["units"]["length"]
    words = []
    for key, value in family.example.items():
        angle = key.endswith("angle")
        words += [f"--{key.replace('_', '-')}", f"{value}" if angle else f"{value * scale} {unit}"]
    return words


@pytest.mark.parametrize("kind", thinned(KINDS, quick={"linear_delta", "3rps", "hexapod"}))
@pytest.mark.parametrize("scale", [1.0, 0.4])
def test_the_file_is_complete_and_check_answers(
    kind: str, scale: float, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    file = tmp_path / "mine.toml"
    outcome = call(capsys, "init", kind, *options(kind, scale), "-o", file)
    assert (outcome.code, outcome.out, outcome.err) == (0, "", f"wrote {file}\n")
    written = tomllib.loads(file.read_text("utf-8"))
    assert written["family"]["kind"] == kind
    assert "strut" not in written
    machine = tp.load(file)
    assert not machine.inverse(machine.poses(), status=True)[1].any()
    assert machine.sources
    if scale == 1.0:
        library = library_file(kind)
        assert machine.parameters == tp.load(_library(tmp_path, kind)).parameters
        assert machine.condition.force == tp.load(_library(tmp_path, kind)).condition.force
        assert written["accuracy"] == library["accuracy"]
    # Joint centres go with the size: that the library's are those of the family is told elsewhere.
    assert call(capsys, "check", file).code in (0, 1)


def _library(folder: Path, kind: str) -> Path:
    path = folder / f"library_{kind}.toml"
    path.write_text(machine_of(kind).text, encoding="utf-8")
    return path


def test_travels_take_in_the_workspace_and_a_tenth(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    file = tmp_path / "mine.toml"
    assert call(capsys, "init", "linear_delta", *DELTA, "-o", file).code == 0
    machine = tp.load(file)
    joints = machine.inverse(machine.poses())
    (travel,) = {drive.travel for drive in machine.drives}
    span = joints.max() - joints.min()
    assert travel[0] < joints.min() - 0.09 * span
    assert travel[1] > joints.max() + 0.09 * span
    assert travel[1] - travel[0] < 1.3 * span
    # 105 of 174.75 mm: the bed of the library's machine is 160 mm wide.
    assert machine.poses()[:, 0].max() == pytest.approx(0.08 * 105 / 174.75, rel=2e-3)


@pytest.mark.parametrize("kind", ["linear_delta", "hexapod", "five_bar"])
def test_help_has_the_parameters_and_the_drawing(
    kind: str, capsys: pytest.CaptureFixture[str]
) -> None:
    family = next(family for family in REGISTRY if family.kind == kind)
    for words in (("init", kind, "--help"), ("init", "-h", kind)):
        shown = call(capsys, *words).out
        for key in family.model_fields:
            assert f"--{key.replace('_', '-')}" in shown
        assert all(f"  {line}".rstrip() in shown for line in family.drawing.splitlines())


BAD = [
    (("--radius", "-138"), "not-positive", "--radius: expected a length above zero"),
    (("--radius", "138 N"), "wrong-dimension", "--radius"),
    (("--rod", "[217, 218]"), "wrong-type", "--rod"),
    (("--rod", "100"), "home-unreachable", "reaches nothing"),
]


@pytest.mark.parametrize(("words", "code", "told"), BAD)
def test_bad_parameters_are_told_by_their_option(
    words: tuple[str, ...],
    code: str,
    told: str,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
) -> None:
    file = tmp_path / "mine.toml"
    outcome = call(capsys, "init", "linear_delta", *DELTA, *words, "-o", file)
    assert (outcome.code, outcome.codes) == (2, [code])
    assert told in outcome.err
    assert not file.exists()


def test_missing_parameters_are_all_told(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    outcome = call(capsys, "init", "linear_delta", "--rod", "217", "-o", tmp_path / "m.toml")
    assert (outcome.code, outcome.codes) == (2, ["missing-key"] * 3)
    for option in ("--radius", "--effector-radius", "--spacing"):
        assert f"{option}: missing" in outcome.err


@pytest.mark.parametrize("kind", ["pentapod", "no_such_kind"])
def test_what_is_no_family_has_no_such_option(
    kind: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    outcome = call(capsys, "init", kind, "--radius", "3", "-o", tmp_path / "m.toml")
    assert outcome.code == 2
    assert "No such option" in outcome.err


def test_the_list_and_a_template_import_nothing_more() -> None:
    program = (
        "import sys; from truepose.cli import run; code = run(sys.argv[1:]); "
        "heavy = ('numpy', 'pydantic', 'truepose._kernel', 'tomlkit', 'truepose.machine.families');"
        "sys.exit(code or ','.join(name for name in heavy if name in sys.modules) or 0)"
    )
    for words in (["init", "--list", "--format", "csv"],):
        done = subprocess.run(
            [sys.executable, "-c", program, *words], capture_output=True, text=True, check=False
        )
        assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("kind", thinned(KINDS, quick={"rotary_delta", "tricept", "hexapod"}))
def test_the_expanded_file_is_the_same_machine(
    kind: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    file, out = tmp_path / "mine.toml", tmp_path / "expanded.toml"
    assert call(capsys, "init", kind, *options(kind), "-o", file).code == 0
    assert call(capsys, "check", file, "--expand", "-o", out).code == 0
    shown = call(capsys, "check", file, "--expand")
    assert (shown.code, shown.out) == (0, out.read_text("utf-8"))
    one, other = tp.load(file), tp.load(out)
    assert one.parameters == other.parameters
    np.testing.assert_allclose(one.nominal, other.nominal, rtol=0, atol=1e-15)
    # Also without the family: then the rows are all there is.
    text = out.read_text("utf-8")
    start = text.index("[family]")
    end = text.index("\n[", start)
    out.write_text(text[:start] + text[end:], "utf-8")
    other = tp.load(out)
    assert other.family is None
    assert (one.parameters, one.commanded) == (other.parameters, other.commanded)
    np.testing.assert_allclose(one.nominal, other.nominal, rtol=0, atol=1e-15)
    np.testing.assert_allclose(one.home, other.home, rtol=0, atol=1e-15)
    poses = one.poses()[::5]
    np.testing.assert_allclose(one.inverse(poses), other.inverse(poses), rtol=0, atol=1e-12)


def test_settings_are_in_the_expanded_file(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    file = tmp_path / "mine.toml"
    assert call(capsys, "init", "linear_delta", *DELTA, "-o", file).code == 0
    out = tmp_path / "rod.toml"
    words = ("--set", "family.rod=220", "--expand", "-o", out)
    assert call(capsys, "check", file, *words).code == 0
    written = tomllib.loads(out.read_text("utf-8"))
    assert written["family"]["rod"] == 220
    assert written["strut"][3]["length"] == 220
    # A joint centre that is set by itself is of no family any more.
    out = tmp_path / "point.toml"
    words = ("--set", "strut.a2.base.x=12", "--expand", "-o", out)
    assert call(capsys, "check", file, *words).code == 0
    written = tomllib.loads(out.read_text("utf-8"))
    assert "family" not in written
    assert written["strut"][1]["base"][0] == 12
    machine = tp.load(out)
    assert machine.nominal[machine.parameters.index("strut.a2.base.x")] == 0.012


def test_a_file_without_a_family_has_nothing_to_expand(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    file = _library(tmp_path, "hexapod")
    outcome = call(capsys, "check", file, "--expand")
    assert (outcome.code, outcome.out, outcome.codes) == (2, "", ["no-family"])
    assert call(capsys, "check", file, "--expand", "--strict").code == 2


def test_the_library_of_the_family_stays_as_it_is(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    file = tmp_path / "mine.toml"
    assert call(capsys, "init", "linear_delta", "-o", file).code == 0
    assert file.read_text("utf-8") == commented(machine_of("linear_delta").text, SOURCES)
    assert family_of("hexapod")["kind"] == "hexapod"
