"""What corrects commands asks which geometry the controller works with; what shows does not."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from command_line import Outcome, call
from machine_texts import PLANAR, load_text
from truepose.compensation.commands import corrected_poses
from truepose.compensation.compensate import against_nominal
from truepose.errors import RequestError

DATA = Path(__file__).parents[3] / "examples" / "data"
DRAWING = DATA / "delta_printer.toml"
POSITIONS = DATA / "delta_positions.csv"
PROGRAM = "G21 G90\nG1 X10 Y10 Z20 F1000\nG1 X-20 Y5 Z20\nM2\n"
NOTHING = "there is nothing to correct, the error before is below rounding"

Capture = pytest.CaptureFixture[str]


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Both forms, `drawing.toml` and `calibrated.toml`; without [controller]; and one gone wrong.

    `former_calibrated.toml` is what earlier versions wrote by default, `former_drawing.toml` what
    they wrote with --as-shifts.
    """
    folder = tmp_path_factory.mktemp("files")
    found = tp.calibrate(tp.load(DRAWING), POSITIONS)
    for holds in ("drawing", "calibrated"):
        path = folder / f"{holds}.toml"
        found.save(path, original=DRAWING, date="2026-01-31", controller_holds=holds)  # type: ignore[arg-type]
        text = path.read_text("utf-8")
        table = f'[controller]\nholds = "{holds}"\n'
        assert text.count(table) == 1
        former = text.replace(table, "")
        (folder / f"former_{holds}.toml").write_text(former, encoding="utf-8")
        if holds == "calibrated":
            wrong = text.replace('holds = "calibrated"', 'holds = "drawing"')
            (folder / "wrong.toml").write_text(wrong, encoding="utf-8")
    (folder / "program.ngc").write_text(PROGRAM, encoding="ascii")
    return folder


COMMANDS = ("compensate", "gcode", "pose-map")


def run(capsys: Capture, command: str, path: Path, *more: str) -> Outcome:
    arguments: dict[str, tuple[object, ...]] = {
        "compensate": ("compensate", path),
        "gcode": ("gcode", path, path.parent / "program.ngc", "-o", path.parent / "corrected.ngc"),
        "pose-map": ("export", "pose-map", path, "--option", "count=2"),
    }
    (path.parent / "corrected.ngc").unlink(missing_ok=True)
    return call(capsys, *arguments[command], *more)


@pytest.mark.parametrize("command", COMMANDS)
def test_what_is_known_is_corrected(command: str, files: Path, capsys: Capture) -> None:
    done = run(capsys, command, files / "drawing.toml")
    assert done.code == 0
    assert NOTHING not in done.out + done.err


@pytest.mark.parametrize("command", COMMANDS)
def test_a_file_that_does_not_say_is_refused_with_both_ways(
    command: str, files: Path, capsys: Capture
) -> None:
    for form, hint in (
        ("drawing", '--set controller.holds="drawing" says so'),
        ("calibrated", "calibrate delta_printer.toml with delta_positions.csv again"),
    ):
        path = files / f"former_{form}.toml"
        done = run(capsys, command, path)
        assert (done.code, done.out) == (2, "")
        assert f"{path.name}: error[controller-unsaid]" in done.err
        assert 'holds = "drawing" where the controller was not touched' in done.err
        assert 'holds = "calibrated" where the nominal geometry of this file was loaded' in done.err
        assert hint in done.err
        assert not (files / "corrected.ngc").exists()
        # As the message says: either in the file, or by --set.
        settings = ("--set", f'controller.holds="{form}"')
        said = run(capsys, command, path, *settings)
        known = run(capsys, command, files / f"{form}.toml")
        assert said.code == known.code
        assert (NOTHING in said.err) == (NOTHING in known.err) == (form == "calibrated")


@pytest.mark.parametrize("command", COMMANDS)
def test_the_wrong_word_is_no_way_round(command: str, files: Path, capsys: Capture) -> None:
    """The geometry found is nominal: that the controller holds the drawing cannot be."""
    done = run(capsys, command, files / "wrong.toml")
    assert (done.code, done.out) == (2, "")
    assert "wrong.toml: error[controller-contradicted]" in done.err
    assert "calibrate delta_printer.toml with delta_positions.csv again" in done.err


@pytest.mark.parametrize("name", ["former_drawing.toml", "former_calibrated.toml"])
def test_functions_refuse_alike(name: str, files: Path) -> None:
    machine = tp.load(files / name)
    source, target = files / "program.ngc", files / "never.ngc"
    for function in (
        lambda: tp.compensate(machine),
        lambda: tp.correct_program(machine, source, target),
        lambda: tp.export(machine, "pose-map", {"count": "2"}),
        lambda: corrected_poses(machine, machine.poses()[:2]),
    ):
        with pytest.raises(RequestError) as refused:
            function()
        (problem,) = refused.value.problems
        assert (problem.code, problem.path) == ("controller-unsaid", "controller.holds")
    assert not target.exists()


@pytest.mark.parametrize("command", ["check", "budget", "report", "compare", "c", "marlin"])
def test_other_commands_read_former_files(
    command: str, files: Path, tmp_path: Path, capsys: Capture
) -> None:
    for form in ("drawing", "calibrated"):
        former, now = files / f"former_{form}.toml", files / f"{form}.toml"
        asked = {
            "report": ("--output", tmp_path / "page.html"),
            "compare": (now,),
        }.get(command, ())
        words = ("export", command) if command in ("c", "marlin") else (command,)
        done = call(capsys, *words, former, *asked)
        assert done.code == 0
        assert "controller-unsaid" not in done.err


def test_nothing_to_correct_is_said_with_its_reason(files: Path, capsys: Capture) -> None:
    path = files / "calibrated.toml"
    why = 'the file says that the controller holds the calibrated geometry (holds = "calibrated")'
    for command in COMMANDS:
        done = run(capsys, command, path)
        assert f"{NOTHING}: {why}" in done.err
        assert "calibrate delta_printer.toml with delta_positions.csv again" in done.err
    shown = json.loads(run(capsys, "gcode", path, "--format", "json").out)
    (warning,) = shown["warnings"]
    assert warning["code"] == "nothing-to-correct"
    shown = json.loads(run(capsys, "compensate", path, "--format", "json").out)
    assert json.loads(shown["attributes"]["warnings"]) == [warning]
    printed = run(capsys, "pose-map", path).out
    assert f"# WARNING: {NOTHING}" in printed
    # In another condition there is: the controller does not know of the heat.
    warm = ("--set", 'each.strut.material="steel"', "--set", 'condition.temperature="40 degC"',
            "--set", 'condition.reference_temperature="20 degC"')  # fmt: skip
    for command in COMMANDS:
        done = run(capsys, command, path, *warm)
        assert done.code == 0
        assert NOTHING not in done.err


def test_a_machine_of_which_nothing_is_known(tmp_path: Path) -> None:
    """Bands about zero, no load and no heat: no error before, and the reason is another."""
    still = ("condition.temperature=20", "condition.force.x=0", "condition.force.y=0")
    for word, why in (
        ((), "the file knows no deviation from its nominal geometry"),
        (("controller.holds=drawing",), "no deviation from the geometry of the drawing"),
    ):
        found = tp.compensate(load_text(tmp_path, PLANAR, *still, *word))
        (warning,) = json.loads(found.attrs["warnings"])
        assert why in warning["sentence"]
        machine = load_text(tmp_path, PLANAR, *word)
        assert "warnings" not in tp.compensate(machine).attrs
        statement = tp.export(machine, "pose-map", {"count": "2"}).statement
        assert not any(NOTHING in line for line in statement)


def test_what_shows_a_machine_asks_nothing(files: Path) -> None:
    """The report draws before and after of any file, as of a machine with nominal commands."""
    former, now = tp.load(files / "former_drawing.toml"), tp.load(files / "drawing.toml")
    poses = now.poses()[:3]
    ours, known = against_nominal(former, poses), tp.compensate(now, poses)
    assert np.array_equal(ours["joint_corrected"], known["joint_corrected"])


@pytest.mark.parametrize(
    "name", ["marlin", "reprap", "klipper", "linuxcnc-lineardelta", "c", "linuxcnc", "pose-map"]
)
def test_an_export_says_what_the_controller_holds_with_it(
    name: str, files: Path, capsys: Capture, tmp_path: Path
) -> None:
    own = {
        "drawing": "no more with drawing.toml, but with the file that truepose calibrate writes "
        "with --controller-holds calibrated",
        "calibrated": 'with calibrated.toml, which says so (holds = "calibrated")',
        "former_calibrated": 'with a file that says so, [controller] holds = "calibrated"',
    }
    loaded = "once this is loaded the controller holds the calibrated geometry: correct programs"
    alone = "with its compensated joints the controller holds the calibrated geometry: programs"
    for stem, how in own.items():
        path = files / f"{stem}.toml"
        if name == "pose-map":  # that is a correction, no geometry
            if not stem.startswith("former"):
                done = call(capsys, "export", name, path, "--option", "count=2")
                assert "holds the calibrated geometry: " not in done.err
            continue
        done = call(capsys, "export", name, path, "-o", tmp_path / stem)
        assert done.code == 0
        written = "".join(each.read_text("utf-8") for each in (tmp_path / stem).iterdir())
        if name in ("c", "linuxcnc"):
            assert f"{alone} that are corrected as well are corrected twice" in done.out
            assert "Compensated joints hold the calibrated geometry" in written
        else:
            assert f"{loaded} for it {how}" in done.out
            assert f"{loaded} for it {how}" in written
    done = call(capsys, "export", name, DRAWING)
    assert done.code == 0
    assert "calibrated" not in done.out + done.err
