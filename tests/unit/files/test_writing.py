"""A file is written whole or not at all."""

from __future__ import annotations

import os
import signal
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

from truepose.errors import RequestError
from truepose.files.writing import (
    kind_of,
    replacing,
    require_new,
    require_writable,
    standing_for,
    written_together,
)


def test_the_file_takes_its_place_at_the_end(tmp_path: Path) -> None:
    file = tmp_path / "a.json"
    file.write_text("old")
    with replacing(file) as temporary:
        temporary.write_text("new")
        assert temporary.parent == tmp_path
        assert temporary.suffix == ".json"
        assert file.read_text() == "old"
    assert file.read_text() == "new"
    assert list(tmp_path.iterdir()) == [file]


@pytest.mark.parametrize("failure", [KeyboardInterrupt, ValueError, MemoryError])
def test_a_failure_changes_nothing(failure: type[BaseException], tmp_path: Path) -> None:
    file = tmp_path / "a.json"
    file.write_text("old")
    with pytest.raises(failure), replacing(file) as temporary:  # noqa: PT012
        temporary.write_text("half")
        raise failure
    assert file.read_text() == "old"
    assert list(tmp_path.iterdir()) == [file]


def test_a_link_stays_a_link(tmp_path: Path) -> None:
    target, link = tmp_path / "target.json", tmp_path / "link.json"
    target.write_text("old")
    link.symlink_to(target)
    with replacing(link) as temporary:
        temporary.write_text("new")
    assert link.is_symlink()
    assert target.read_text() == "new"


def test_a_folder_that_goes_away_meanwhile(tmp_path: Path) -> None:
    folder = tmp_path / "folder"
    folder.mkdir()
    with pytest.raises(RequestError) as caught, replacing(folder / "a.json") as temporary:  # noqa: PT012
        folder.rmdir()
        temporary.write_text("new")
    assert caught.value.problems[0].code == "output-not-writable"


def test_what_can_be_written_is_not_refused(tmp_path: Path) -> None:
    require_writable(tmp_path / "new.JSON", [".json"], [tmp_path / "input.toml"])


def test_what_must_be_new_is_refused_where_something_stands(tmp_path: Path) -> None:
    require_new(tmp_path / "free.toml")
    (tmp_path / "taken.toml").write_text("mine")
    (tmp_path / "broken.toml").symlink_to(tmp_path / "nowhere.toml")
    for name in ("taken.toml", "broken.toml"):
        with pytest.raises(RequestError) as caught:
            require_new(tmp_path / name)
        assert caught.value.problems[0].code == "output-exists"
    assert (tmp_path / "taken.toml").read_text() == "mine"


@pytest.fixture
def pair(tmp_path: Path) -> tuple[Path, Path]:
    files = tmp_path / "a.json", tmp_path / "b.json"
    for file in files:
        file.write_text("old")
    return files


def test_files_of_a_set_take_their_places_together(pair: tuple[Path, Path]) -> None:
    with written_together():
        for file in pair:
            with replacing(file) as temporary:
                temporary.write_text("new")
            assert [other.read_text() for other in pair] == ["old", "old"]
            assert standing_for(file).read_text() == "new"
    assert [file.read_text() for file in pair] == ["new", "new"]
    assert sorted(pair[0].parent.iterdir()) == sorted(pair)


@pytest.mark.parametrize("failure", [KeyboardInterrupt, ValueError, MemoryError])
def test_a_set_that_fails_changes_none_of_its_files(
    failure: type[BaseException], pair: tuple[Path, Path]
) -> None:
    with pytest.raises(failure), written_together():  # noqa: PT012
        with replacing(pair[0]) as temporary:
            temporary.write_text("new")
        with replacing(pair[1]) as temporary:
            temporary.write_text("half")
            raise failure
    assert [file.read_text() for file in pair] == ["old", "old"]
    assert sorted(pair[0].parent.iterdir()) == sorted(pair)


def test_a_file_that_failed_is_not_half_in_the_set(pair: tuple[Path, Path]) -> None:
    with written_together():
        with pytest.raises(ValueError, match="half"), replacing(pair[0]) as temporary:  # noqa: PT012
            temporary.write_text("half")
            raise ValueError("half")
        with replacing(pair[1]) as temporary:
            temporary.write_text("new")
    assert [file.read_text() for file in pair] == ["old", "new"]


def test_what_is_not_on_the_disk_gets_no_name(
    pair: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    order: list[str] = []
    fsync, replace = os.fsync, Path.replace

    def synced(handle: int) -> None:
        order.append("fsync")
        fsync(handle)

    def renamed(self: Path, target: Path) -> Path:
        order.append("rename")
        return replace(self, target)

    monkeypatch.setattr(os, "fsync", synced)
    monkeypatch.setattr(Path, "replace", renamed)
    with written_together():
        for file in pair:
            with replacing(file) as temporary:
                temporary.write_text("new")
    assert order == ["fsync", "fsync", "rename", "rename", "fsync"]  # the last: of the folder


def test_mode_and_owner_stay(tmp_path: Path) -> None:
    file = tmp_path / "a.json"
    file.write_text("old")
    file.chmod(0o640)
    owner = (12345, 54321) if os.geteuid() == 0 else (os.getuid(), os.getgid())
    os.chown(file, *owner)
    with replacing(file) as temporary:
        temporary.write_text("new")
    state = file.stat()
    assert file.read_text() == "new"
    assert state.st_mode & 0o7777 == 0o640
    assert (state.st_uid, state.st_gid) == owner


def test_a_read_only_file_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "a.json"
    file.write_text("old")
    file.chmod(0o444)
    for write in (lambda: require_writable(file, [".json"]), lambda: replacing(file).__enter__()):
        with pytest.raises(RequestError) as caught:
            write()
        assert caught.value.problems[0].code == "output-not-writable"
        assert caught.value.problems[0].found == "a file that is read-only"
    assert file.read_text() == "old"
    assert list(tmp_path.iterdir()) == [file]


@pytest.fixture(params=["a pipe", "a socket", "a device"])
def unusual(
    request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[tuple[Path, str]]:
    place = tmp_path / "a.json"
    if request.param == "a pipe":
        os.mkfifo(place)
        yield place, request.param
    elif request.param == "a socket":
        with socket.socket(socket.AF_UNIX) as listening:
            monkeypatch.chdir(tmp_path)  # the name of a socket is short
            listening.bind("a.json")
            yield place, request.param
    else:
        place.symlink_to("/dev/null")
        yield place, request.param


def test_what_is_no_file_is_no_target(unusual: tuple[Path, str]) -> None:
    place, kind = unusual
    before = place.stat()
    for write in (lambda: require_writable(place, [".json"]), lambda: replacing(place).__enter__()):
        with pytest.raises(RequestError) as caught:
            write()
        problem = caught.value.problems[0]
        assert (problem.code, problem.found) == ("output-not-writable", kind)
    assert kind_of(place.stat().st_mode) == kind
    assert place.stat().st_ino == before.st_ino


def test_two_names_of_one_file_are_not_both_of_a_set(tmp_path: Path) -> None:
    real, link = tmp_path / "a.hal", tmp_path / "a.c"
    real.write_text("old")
    link.symlink_to(real)
    with pytest.raises(RequestError) as caught, written_together():  # noqa: PT012
        with replacing(link) as temporary:
            temporary.write_text("c")
        with replacing(real) as temporary:
            temporary.write_text("hal")
    assert caught.value.problems[0].code == "output-twice"
    assert real.read_text() == "old"
    assert sorted(tmp_path.iterdir()) == sorted([real, link])


@pytest.mark.parametrize("there", [True, False])
def test_a_rename_that_fails_brings_back_those_before_it(
    there: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pair = tmp_path / "a.json", tmp_path / "b.json"
    if there:
        for file in pair:
            file.write_text("old")
    replace = Path.replace

    def refused(self: Path, target: Path) -> Path:
        if target == pair[1]:
            raise OSError(16, "Device or resource busy")
        return replace(self, target)

    monkeypatch.setattr(Path, "replace", refused)
    with pytest.raises(RequestError) as caught, written_together():  # noqa: PT012
        for file in pair:
            with replacing(file) as temporary:
                temporary.write_text("new")
    assert caught.value.problems[0].found == "Device or resource busy"
    left = {path.name: path.read_text() for path in tmp_path.iterdir()}
    assert left == ({"a.json": "old", "b.json": "old"} if there else {})


def test_ctrl_c_waits_until_all_have_their_places(
    pair: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    replace = Path.replace

    def interrupted(self: Path, target: Path) -> Path:
        os.kill(os.getpid(), signal.SIGINT)
        return replace(self, target)

    monkeypatch.setattr(Path, "replace", interrupted)
    with pytest.raises(KeyboardInterrupt), written_together():  # noqa: PT012
        for file in pair:
            with replacing(file) as temporary:
                temporary.write_text("new")
    assert [file.read_text() for file in pair] == ["new", "new"]
    assert sorted(pair[0].parent.iterdir()) == sorted(pair)


def test_long_names_can_be_written(tmp_path: Path) -> None:
    file = tmp_path / ("n" * 250 + ".json")
    with replacing(file) as temporary:
        temporary.write_text("new")
    assert file.read_text() == "new"


@pytest.mark.parametrize("name", ["n" * 300 + ".json", "n" * 300 + "/a.json", "a\0.json"])
def test_a_name_that_no_file_has_is_refused(name: str, tmp_path: Path) -> None:
    with pytest.raises(RequestError) as caught:
        require_writable(tmp_path / name, [".json"])
    assert caught.value.problems[0].code == "output-not-writable"
