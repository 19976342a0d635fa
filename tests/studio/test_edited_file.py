"""What is saved differs in the changed keys alone, and is written nowhere but beside the file."""

from __future__ import annotations

from pathlib import Path

import pytest

import truepose as tp
from command_line import MACHINES, PLANAR
from truepose.errors import RequestError, TrueposeError
from truepose.files.toml_text import parse_toml
from truepose.studio.edited_file import OpenedFile

EVERY = sorted(MACHINES.glob("*.toml"))
HEXAPOD = MACHINES / "hexapod.toml"


def changed_lines(file: OpenedFile, text: str) -> list[str]:
    return [line.rstrip("\n") for line in list(file.difference(text))[2:] if line[0] in "+-"]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    inside = tmp_path / "machines"
    inside.mkdir()
    (inside / "m.toml").write_bytes(PLANAR.read_bytes())
    return inside


def test_lines_that_were_not_changed_stay_to_the_letter() -> None:
    file = OpenedFile.read(HEXAPOD)
    text = file.edited(
        (
            ("drive.d1.travel", "[22, 38]"),
            ("strut.2.base.x", "22.96"),
            ("strut.3.mass", "1 kg"),
            ("condition.force.x", "250"),
            ("tolerance.strut.*.base.*", "0.0004"),
        )
    )
    assert changed_lines(file, text) == [
        "-travel = [22.5, 37.5] # the joint coordinate is the whole length of the strut",
        "+travel = [22, 38] # the joint coordinate is the whole length of the strut",
        "-base = [22.95, 13.25, 0]",
        "+base = [22.96, 13.25, 0]",
        '+mass = "1 kg"',
        '-"strut.*.base.*" = 0.0002',
        '+"strut.*.base.*" = 0.0004',
        "-force = { x = 300, y = 200, z = -150 }",
        "+force = { x = 250, y = 200, z = -150 }",
    ]


@pytest.mark.parametrize("path", EVERY, ids=lambda path: path.stem)
def test_one_key_of_every_machine(path: Path) -> None:
    """Also of files whose tables of one name do not stand together."""
    file = OpenedFile.read(path)
    text = file.edited((("accuracy.target", "0.31 mm"),))
    lines = changed_lines(file, text)
    assert [line[0] for line in lines] == ["-", "+"]
    assert lines[1].startswith('+target = "0.31 mm"')
    data = parse_toml(file.text)
    data["accuracy"]["target"] = "0.31 mm"
    assert parse_toml(text) == data


def test_without_edits_it_is_the_file() -> None:
    file = OpenedFile.read(HEXAPOD)
    assert file.edited(()) == HEXAPOD.read_text("utf-8")
    assert list(file.difference(file.text)) == []


def test_a_new_table_goes_to_the_end(folder: Path) -> None:
    file = OpenedFile.read(folder / "m.toml")
    text = file.edited((("platform.mass", "2 kg"),))
    assert changed_lines(file, text)[-2:] == ["+[platform]", '+mass = "2 kg"']
    assert text.startswith(file.text.rstrip("\n"))


def test_line_ends_and_a_byte_order_mark_stay(folder: Path) -> None:
    windows = b"\xef\xbb\xbf" + PLANAR.read_bytes().replace(b"\n", b"\r\n")
    (folder / "m.toml").write_bytes(windows)
    file = OpenedFile.read(folder / "m.toml")
    file.save_as("n.toml", file.edited((("accuracy.target", "0.7 mm"),)))
    expected = windows.replace(b'target = "0.5 mm"', b'target = "0.7 mm"')
    assert (folder / "n.toml").read_bytes() == expected


def test_values_that_the_file_does_not_take() -> None:
    file = OpenedFile.read(HEXAPOD)
    with pytest.raises(TrueposeError) as failure:
        file.edited((("strut.1.stiffness", "-3 N/um"),))
    assert failure.value.problems[0].code == "not-positive"
    with pytest.raises(RequestError) as failure:
        file.edited((("strut.9.length", "3"),))
    assert failure.value.problems[0].code == "bad-setting"


def test_the_saved_file_is_the_machine_that_was_answered(folder: Path) -> None:
    file = OpenedFile.read(folder / "m.toml")
    edits = (("strut.1.length", "501"), ("condition.temperature", "31.5"))
    file.save_as("n.toml", file.edited(edits))
    saved, set_there = tp.load(folder / "n.toml"), tp.load(folder / "m.toml", dict(edits))
    assert saved.nominal.tolist() == set_there.nominal.tolist()
    assert saved.condition == set_there.condition
    assert (folder / "m.toml").read_bytes() == PLANAR.read_bytes()


@pytest.mark.parametrize(
    "name",
    ["../n.toml", "/tmp/n.toml", "deeper/n.toml", "..", "", ".", "a\0.toml", "link.toml"],  # noqa: S108
)
def test_nothing_is_written_outside_of_the_folder(name: str, folder: Path) -> None:
    (folder / "deeper").mkdir()
    outside = folder.parent / "outside.toml"
    (folder / "link.toml").symlink_to(outside)
    file = OpenedFile.read(folder / "m.toml")
    before = sorted(folder.parent.rglob("*"))
    with pytest.raises(RequestError) as failure:
        file.save_as(name, file.text, replace=True)
    assert failure.value.problems[0].code == "output-not-writable"
    assert sorted(folder.parent.rglob("*")) == before
    assert not outside.exists()


def test_other_files_are_not_written_over_unasked(folder: Path) -> None:
    file = OpenedFile.read(folder / "m.toml")
    (folder / "other.toml").write_text("mine")
    for name, replace, code in (
        ("other.toml", False, "output-exists"),
        ("m.toml", True, "output-is-input"),
        ("other.csv", True, "output-ending"),
    ):
        with pytest.raises(RequestError) as failure:
            file.save_as(name, file.text, replace=replace)
        assert failure.value.problems[0].code == code
    assert (folder / "other.toml").read_text() == "mine"
    file.save_as("other.toml", file.text, replace=True)
    assert (folder / "other.toml").read_text("utf-8") == file.text
    assert sorted(one.name for one in folder.iterdir()) == ["m.toml", "other.toml"], (
        "no temporary file is left"
    )


def test_a_folder_that_is_a_link_is_the_machines_folder(folder: Path) -> None:
    link = folder.parent / "link"
    link.symlink_to(folder)
    file = OpenedFile.read(link / "m.toml")
    file.save_as("n.toml", file.text)
    assert (folder / "n.toml").exists()
