"""A file is written whole or not at all."""

from __future__ import annotations

from pathlib import Path

import pytest

from truepose.errors import RequestError
from truepose.files.writing import replacing, require_new, require_writable


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
