"""`truepose export --against`: the user's own file with other numbers, and nothing else changed."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

import truepose as tp
from build_machine import MACHINES
from command_line import call
from klipper_printer import LINEAR, ROTARY, as_saved
from truepose.controllers import READERS, difference, export
from truepose.controllers._registry import EDITORS
from truepose.errors import RequestError

FILES = Path(__file__).parents[2] / "controller_files"

SAVED = """\
[printer]
delta_radius: 174.75

[stepper_a]
angle: 210.1
arm_length: 333
"""

CASES = {
    "klipper": ("linear_delta", "printer.cfg", "# mine\n" + LINEAR.config()),
    "klipper-saved": (
        "linear_delta",
        "printer.cfg",
        "[printer]\nkinematics: delta ; mine\n#delta_radius: 1\n[stepper_a]\nposition_endstop = 9"
        "   # by hand\n[stepper_b]\n[stepper_c]\n" + as_saved(SAVED),
    ),
    "klipper-rotary": ("rotary_delta", "printer.cfg", ROTARY.config()),
    "marlin": ("linear_delta", "m503.txt", (FILES / "marlin/m503.txt").read_text("utf-8")),
    "marlin-commands": (
        "linear_delta", "startup.g", "G28 ; home\nM665 L215 R106.2 H232 ; mine\nG29\n",
    ),
    "marlin-configuration": (
        "linear_delta",
        "Configuration.h",
        (FILES / "marlin/Configuration.h").read_text("utf-8"),
    ),
    "reprap": ("linear_delta", "config.g", (FILES / "reprap/config.g").read_text("utf-8")),
    "linuxcnc-genhexkins": (
        "hexapod", "hexapod.hal", (FILES / "linuxcnc/hexapod.hal").read_text("utf-8"),
    ),
    "linuxcnc-lineardelta": (
        "linear_delta",
        "delta.hal",
        "loadrt lineardeltakins\nsetp lineardeltakins.R 100 # mine\nsetp lineardeltakins.L 250\n",
    ),
    "linuxcnc-lineardelta-ini": (
        "linear_delta",
        "delta.ini",
        "[KINS]\nKINEMATICS = lineardeltakins\n[JOINT_0]\nMIN_LIMIT = 0\nMAX_LIMIT = 9\n"
        "[JOINT_1]\nHOME = 1\n[JOINT_2]\nHOME = 2\n[HAL]\nHALFILE = delta.hal\n",
    ),
}  # fmt: skip


def controller(case: str) -> str:
    return next(name for name in sorted(EDITORS, key=len, reverse=True) if case.startswith(name))


def patched(folder: Path, name: str, changes: str) -> str:
    """The file once the program that everybody has was told the difference."""
    program = shutil.which("patch")
    if program is None:
        pytest.skip("there is no patch")
    subprocess.run([program, "--quiet", name], input=changes, text=True, check=True, cwd=folder)
    return (folder / name).read_text("utf-8")


@pytest.mark.parametrize("case", CASES)
def test_the_file_holds_the_numbers_then(case: str, tmp_path: Path) -> None:
    machine_name, name, text = CASES[case]
    path = tmp_path / name
    path.write_text(text, "utf-8")
    machine = tp.load(MACHINES / f"{machine_name}.toml")
    exported = export(machine, controller(case))
    changes = difference(controller(case), exported, path)
    assert changes
    assert path.read_text("utf-8") == text
    after = patched(tmp_path, name, changes)
    assert difference(controller(case), exported, path) == ""
    # Lines keep their order; a line that went has one that came in its place, with its comment.
    gone = [line[1:] for line in changes.splitlines() if line.startswith("-")][1:]
    came = [line[1:] for line in changes.splitlines() if line.startswith("+")][1:]
    kept = [line for line in text.splitlines() if line not in gone]
    assert [line for line in after.splitlines() if line not in came] == kept
    for mark in ("# mine", "; mine", "# by hand", "// (mm)", "; delta geometry"):
        assert after.count(mark) == text.count(mark)


def test_a_pin_that_a_signal_drives_is_not_set(tmp_path: Path) -> None:
    _, name, text = CASES["linuxcnc-genhexkins"]
    assert "net tool-offset genhexkins.tool-offset <= motion.tooloffset.z" in text
    (tmp_path / name).write_text(text, "utf-8")
    exported = export(tp.load(MACHINES / "hexapod.toml"), "linuxcnc-genhexkins")
    changes = difference("linuxcnc-genhexkins", exported, tmp_path / name)
    assert "+setp genhexkins.base.0.x" in changes
    assert "+setp genhexkins.tool-offset" not in changes


@pytest.mark.parametrize("case", ["klipper", "klipper-saved", "klipper-rotary", "reprap"])
def test_what_is_read_of_it_is_what_was_exported(case: str, tmp_path: Path) -> None:
    """By the reader of that format: the same numbers, printed again."""
    machine_name, name, text = CASES[case]
    (tmp_path / name).write_text(text, "utf-8")
    exported = export(tp.load(MACHINES / f"{machine_name}.toml"), controller(case))
    patched(tmp_path, name, difference(controller(case), exported, tmp_path / name))
    machine = tp.import_machine(tmp_path / name, controller(case)).machine
    again = export(machine, controller(case))
    assert fitted(again.files) == fitted(exported.files)


def fitted(files: dict[str, str]) -> list[list[str]]:
    """Words of what was fitted: not of the workspace, whose radius is the file's own.

    Nor the tilt of M666, A and B: no machine has it, so that the reader tells it as lost.
    """
    lines = [line for text in files.values() for line in text.splitlines()]
    of_workspace = ("#", ";", "print_radius", "minimum_z")
    words = [line.split() for line in lines if line and not line.startswith(of_workspace)]
    left_out = {"M665": "B", "M666": "AB"}
    return [[word for word in line if word[0] not in left_out.get(line[0], "")] for line in words]


def test_what_is_included_is_changed_where_it_stands(tmp_path: Path) -> None:
    (tmp_path / "printer.cfg").write_text("[include steppers.cfg]\n", "utf-8")
    (tmp_path / "steppers.cfg").write_text(LINEAR.config(), "utf-8")
    exported = export(tp.load(MACHINES / "linear_delta.toml"), "klipper")
    changes = difference("klipper", exported, tmp_path / "printer.cfg")
    assert f"--- {tmp_path / 'steppers.cfg'}" in changes
    assert f"--- {tmp_path / 'printer.cfg'}" not in changes


def test_a_number_over_several_lines_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "printer.cfg"
    path.write_text(LINEAR.config().replace("delta_radius: ", "delta_radius:\n  "), "utf-8")
    exported = export(tp.load(MACHINES / "linear_delta.toml"), "klipper")
    with pytest.raises(RequestError) as refused:
        difference("klipper", exported, path)
    assert [problem.code for problem in refused.value.problems] == ["no-difference"]


@pytest.mark.parametrize("end", ["\r\n", "\n"])
@pytest.mark.parametrize("last", ["", "end"])
def test_line_ends_are_the_files_own(end: str, last: str, tmp_path: Path) -> None:
    path = tmp_path / "delta.hal"
    lines = ["setp lineardeltakins.L 250", "setp lineardeltakins.R 100"]
    path.write_bytes((end.join(lines) + (end if last else "")).encode())
    exported = export(tp.load(MACHINES / "linear_delta.toml"), "linuxcnc-lineardelta")
    changes = difference("linuxcnc-lineardelta", exported, path)
    ends = {line[-2:] == "\r\n" for line in changes.splitlines(True) if line[:2] in ("+s", "-s")}
    assert changes.count("\\ No newline at end of file") == (0 if last else 2)
    if last:
        assert ends == {end == "\r\n"}


def test_a_file_of_another_kind_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "printer.cfg"
    path.write_text(ROTARY.config(), "utf-8")
    machine = tp.load(MACHINES / "linear_delta.toml")
    for name in EDITORS:
        try:
            exported = export(machine, name)
        except RequestError:
            continue
        if name == "reprap":  # any text may be one of commands
            continue
        with pytest.raises(RequestError) as refused:
            difference(name, exported, path)
        assert [problem.code for problem in refused.value.problems] == ["no-difference"]
    with pytest.raises(RequestError) as whole:
        difference("c", export(machine, "c"), path)
    assert [problem.code for problem in whole.value.problems] == ["no-difference"]


def test_every_controller_with_numbers_of_its_own_has_lines(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    assert set(EDITORS) <= set(READERS)
    path = tmp_path / "printer.cfg"
    path.write_text(LINEAR.config(), "utf-8")
    machine = str(MACHINES / "linear_delta.toml")
    done = call(capsys, "export", "klipper", machine, "--against", str(path))
    assert done.code == 0
    assert done.out.startswith(f"--- {path}\n")
    assert "left over with these numbers" in done.err
    (tmp_path / "printer.cfg").write_text(patched(tmp_path, "printer.cfg", done.out), "utf-8")
    again = call(capsys, "export", "klipper", machine, "--against", str(path))
    assert again.out == ""
    assert "nothing to change" in again.err
    refused = call(
        capsys, "export", "klipper", machine, "--against", str(path), "-o", str(tmp_path / "out")
    )
    assert refused.code == 2
    assert "--against prints a difference" in refused.err
    assert not (tmp_path / "out").exists()
