"""`truepose export`: files for a controller, written whole or not at all."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

import truepose as tp
from command_line import MACHINES, call
from truepose import controllers

PLANAR = str(MACHINES / "planar_two_slider.toml")


def test_every_controller_is_listed(capsys: pytest.CaptureFixture[str]) -> None:
    done = call(capsys, "export", "--list")
    assert done.code == 0
    for name in controllers.REGISTRY:
        assert name in done.out
        assert controllers.controller(name).doc.split()[0] in done.out


def test_files_are_written_into_a_new_folder(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    folder = tmp_path / "deep" / "er"
    done = call(capsys, "export", "c", PLANAR, "-o", str(folder))
    assert done.code == 0
    assert sorted(path.name for path in folder.iterdir()) == [
        "planar_two_slider.c",
        "planar_two_slider.h",
    ]
    assert done.err.count("wrote ") == 2


def test_without_a_folder_the_files_are_printed(capsys: pytest.CaptureFixture[str]) -> None:
    done = call(capsys, "export", "c", PLANAR)
    assert done.code == 0
    assert "==> planar_two_slider.h <==" in done.out
    assert "planar_two_slider_compensate(" in done.out


def test_the_condition_can_be_changed(capsys: pytest.CaptureFixture[str]) -> None:
    texts = []
    for kelvin in ("20", "40"):
        setting = f"condition.temperature={kelvin}"
        done = call(capsys, "export", "pose-map", PLANAR, "--set", setting)
        assert done.code == 0
        texts.append(done.out)
    assert texts[0] != texts[1]


@pytest.mark.parametrize("arguments", [[], ["c"]])
def test_a_controller_and_a_machine_are_asked_for(
    arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    done = call(capsys, "export", *arguments)
    assert done.code == 2
    assert "Give a CONTROLLER" in done.err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["klippr", PLANAR], ["unknown-controller", 'did you mean "klipper"?']),
        (["klipper", PLANAR], ["controller-cannot"]),
        (["c", PLANAR, "--option", "witout=elastic"], ["bad-option", "without"]),
        (["linuxcnc", PLANAR, "--option", "clamp=1 N"], ["bad-option", "a length"]),
        (["c", "nowhere.toml"], ["file-missing"]),
    ],
)
def test_what_cannot_be_is_refused(
    arguments: list[str], words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    done = call(capsys, "export", *arguments)
    assert done.code == 2
    for word in words:
        assert word in done.err


def stands_in_the_way(kind: str, place: Path) -> Path:
    """A path of a folder that cannot be written into."""
    if kind == "file":
        place.write_text("kept")
    elif kind == "below a file":
        place.write_text("kept")
        return place / "folder"
    elif kind == "link to nothing":
        place.symlink_to(place.parent / "nothing")
    elif kind == "proc":
        return Path("/proc/truepose")
    else:
        return place.parent / ("n" * 300)
    return place


@pytest.mark.parametrize("kind", ["file", "below a file", "link to nothing", "proc", "long name"])
def test_a_folder_that_cannot_be_written_into(
    kind: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    folder = stands_in_the_way(kind, tmp_path / "out")
    done = call(capsys, "export", "c", PLANAR, "-o", str(folder))
    assert done.code == 2
    assert "output-not-writable" in done.err
    kept = tmp_path / "out"
    assert not kept.is_file() or kept.read_text() == "kept"


def test_all_files_are_written_or_none(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    (tmp_path / "planar_two_slider.c").mkdir()
    done = call(capsys, "export", "c", PLANAR, "-o", str(tmp_path))
    assert done.code == 2
    assert "output-not-writable" in done.err
    assert [path.name for path in tmp_path.iterdir()] == ["planar_two_slider.c"]


def test_a_file_that_fails_takes_the_others_with_it(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Header and source of two exports must never stand together."""
    given = controllers.Export({"one.h": "whole", "two.c": "\udc80 is no text"})
    monkeypatch.setattr(controllers, "export", lambda *_: given)
    (tmp_path / "one.h").write_text("of before")
    outcome = call(capsys, "export", "c", PLANAR, "-o", str(tmp_path))
    assert outcome.code == 70
    assert "UnicodeEncodeError" in outcome.err
    assert [path.name for path in tmp_path.iterdir()] == ["one.h"]
    assert (tmp_path / "one.h").read_text() == "of before"


def test_what_is_written_is_what_the_api_gives(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    arguments = ["pose-map", PLANAR, "--option", "count=3", "-o", str(tmp_path)]
    assert call(capsys, "export", *arguments).code == 0
    files = controllers.export(tp.load(PLANAR), "pose-map", {"count": "3"}).files
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == files
    assert any(json.loads(text) for name, text in files.items() if name.endswith(".json"))


@pytest.mark.parametrize(
    "controller", ["c", "linuxcnc", "linuxcnc-lineardelta", "klipper", "marlin", "pose-map"]
)
def test_names_of_files_are_plain(
    controller: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    machine = tmp_path / "-1a b;$(x)<u>é.toml"
    machine.write_bytes((MACHINES / "linear_delta.toml").read_bytes())
    done = call(capsys, "export", controller, machine, "-o", tmp_path / "out")
    assert done.code == 0, done.err
    written = [path.name for path in (tmp_path / "out").iterdir()]
    assert written
    for name in written:
        assert re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9._-]*", name), name
