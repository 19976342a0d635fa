"""What holds of every reader of a controller's files, and of how files are included."""

from __future__ import annotations

from pathlib import Path

import pytest

import truepose as tp
from truepose.controllers import READERS, ControllerFile, reader
from truepose.errors import MachineFileError, ReadingError, RequestError
from truepose.files.limits import MOST_INCLUDED

DELTA = """\
[printer]
kinematics: delta
delta_radius: 174.75
[stepper_a]
position_endstop: 297.05
arm_length: 333.0
"""


def at(folder: Path, name: str = "printer.cfg", text: str = DELTA) -> Path:
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, "utf-8")
    return path


def codes(error: pytest.ExceptionInfo[MachineFileError | RequestError]) -> list[str]:
    return [problem.code for problem in error.value.problems]


@pytest.mark.parametrize("name", READERS)
def test_a_reader_says_what_it_is(name: str) -> None:
    found = reader(name)
    assert found.name == name
    assert found.doc
    assert "\n" not in found.doc
    assert all(setting.doc for setting in found.settings.values())
    assert not found.recognises("")
    assert not found.recognises("what nobody's controller reads\n")


@pytest.mark.parametrize("name", READERS)
def test_a_setting_that_nothing_takes_is_refused(name: str, tmp_path: Path) -> None:
    with pytest.raises(RequestError) as refused:
        tp.import_machine(at(tmp_path), name, {"no.such": "1"})
    assert codes(refused) == ["bad-setting"]


def test_a_machine_and_its_text_are_the_same(tmp_path: Path) -> None:
    found = tp.import_machine(at(tmp_path))
    assert found.kind == "klipper"
    path = at(tmp_path, "printer.toml", found.text)
    assert tp.load(path) == found.machine
    assert tp.load(path).file_hash == found.machine.file_hash
    assert found.holds["printer.delta_radius"] == "174.75"
    assert found.measurements is None
    # What is assumed stands in the text, in a line that says so.
    assert found.assumptions
    assert any("assumed" in line for line in found.text.splitlines())
    assert "klipper" in repr(found)


def test_whose_file_it_is_has_to_be_told(tmp_path: Path) -> None:
    with pytest.raises(MachineFileError) as refused:
        tp.import_machine(at(tmp_path, text="nothing of the kind\n"))
    assert codes(refused) == ["import-unrecognised"]
    with pytest.raises(RequestError) as unknown:
        tp.import_machine(at(tmp_path), "klippr")
    assert codes(unknown) == ["unknown-controller"]
    assert 'did you mean "klipper"?' in str(unknown.value)


def test_files_beside_and_below_are_included_in_the_order_of_their_names(tmp_path: Path) -> None:
    file = ControllerFile.at(at(tmp_path))
    for name in ("b.cfg", "a.cfg", "below/c.cfg"):
        at(tmp_path, name, name)
    assert [found.text for found in file.included("[ab].cfg")] == ["a.cfg", "b.cfg"]
    assert [found.text for found in file.included("below/../below/*.cfg")] == ["below/c.cfg"]
    assert file.included("none*.cfg") == ()
    # A file below includes beside itself, and may go up as far as the folder.
    (below,) = file.included("below/c.cfg")
    assert [found.text for found in below.included("../a.cfg")] == ["a.cfg"]


def test_a_folder_may_have_the_name_of_a_pattern(tmp_path: Path) -> None:
    file = ControllerFile.at(at(tmp_path, "[x]/printer.cfg"))
    at(tmp_path, "[x]/a.cfg", "in it")
    at(tmp_path, "x/a.cfg", "beside it")
    assert [found.text for found in file.included("a*.cfg")] == ["in it"]


@pytest.mark.parametrize(
    "pattern", ["../secret.cfg", "*/../../secret.cfg", "/etc/passwd", "~/x", "a\0b", "none.cfg"]
)
def test_nothing_outside_of_the_folder_is_read(pattern: str, tmp_path: Path) -> None:
    at(tmp_path, "secret.cfg", "secret")
    file = ControllerFile.at(at(tmp_path, "mine/printer.cfg"))
    with pytest.raises(ReadingError) as refused:
        file.included(pattern)
    assert refused.value.code == "import-include"
    assert "secret" not in (refused.value.found or "")


def test_a_link_out_of_the_folder_is_not_followed(tmp_path: Path) -> None:
    at(tmp_path, "secret.cfg", "secret")
    file = ControllerFile.at(at(tmp_path, "mine/printer.cfg"))
    (tmp_path / "mine" / "link.cfg").symlink_to(tmp_path / "secret.cfg")
    (tmp_path / "mine" / "up").symlink_to(tmp_path)
    for pattern in ("link.cfg", "*.cfg", "up/secret.cfg", "*/secret.cfg"):
        with pytest.raises(ReadingError) as refused:
            file.included(pattern)
        assert refused.value.code == "import-include"


def test_a_file_that_includes_itself_ends(tmp_path: Path) -> None:
    path = at(tmp_path, text=f"{DELTA}[include b.cfg]\n")
    at(tmp_path, "b.cfg", "[include printer.cfg]\n")
    with pytest.raises(MachineFileError) as refused:
        tp.import_machine(path)
    (problem,) = refused.value.problems
    assert (problem.code, Path(problem.file or "").name, problem.line) == (
        "import-include",
        "b.cfg",
        1,
    )


def test_files_that_double_end(tmp_path: Path) -> None:
    """Each includes the next one twice: 2 to the 30th files."""
    path = at(tmp_path, text=f"{DELTA}[include 0.cfg]\n")
    for number in range(30):
        at(tmp_path, f"{number}.cfg", f"[include {number + 1}.cfg]\n" * 2)
    at(tmp_path, "30.cfg", "")
    with pytest.raises(MachineFileError) as refused:
        tp.import_machine(path)
    assert set(codes(refused)) == {"import-include"}
    assert str(MOST_INCLUDED) in str(refused.value)
