"""What outlives a studio: readable by its owner alone, whole or as it was."""

from __future__ import annotations

import json
import os
import stat
from pathlib import Path
from typing import Any

import pytest

from truepose.studio.settings import History, Settings
from truepose.studio.state_file import KeptState, read_state, state_path, write_state

HISTORY = History(Settings((("strut.1.length", "501"),), (0.1, 0.2)), ((),), ())


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    return tmp_path


def test_it_is_kept_and_is_its_owners_alone(home: Path) -> None:
    before = os.umask(0)
    try:
        path = state_path(home / "m.toml")
        kept = KeptState(port=8770, history=HISTORY)
        write_state(path, kept)
        write_state(path, kept)
    finally:
        os.umask(before)
    assert read_state(path) == kept
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert stat.S_IMODE(path.parent.stat().st_mode) == 0o700
    assert list(path.parent.iterdir()) == [path], "no temporary file is left"


def test_one_for_each_machine_file(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (home / "m.toml").write_text("")
    (home / "link.toml").symlink_to(home / "m.toml")
    assert state_path(home / "link.toml") == state_path(home / "m.toml")
    assert state_path(home / "n.toml") != state_path(home / "m.toml")
    monkeypatch.chdir(home)
    assert state_path(Path("m.toml")) == state_path(home / "m.toml")
    monkeypatch.setenv("XDG_STATE_HOME", "relative")  # which the specification has ignored
    monkeypatch.setenv("HOME", str(home))
    assert state_path(home / "m.toml").is_relative_to(home / ".local" / "state")


def test_without_one_there_is_a_new_token(home: Path) -> None:
    one, other = (read_state(home / "none.json") for _ in range(2))
    assert one.token != other.token
    assert (one.port, one.history) == (None, History())


def test_a_state_that_others_could_read_is_none(home: Path) -> None:
    path = state_path(home / "m.toml")
    kept = KeptState()
    write_state(path, kept)
    path.chmod(0o640)
    assert read_state(path).token != kept.token


GOOD = KeptState(port=8770, token="t" * 43, history=HISTORY).to_json()


@pytest.mark.parametrize(
    "wrong",
    [
        "",
        "{",
        "[]",
        "null",
        "[" * 5000,
        json.dumps(GOOD | {"schema": 2}),
        json.dumps(GOOD | {"token": "short"}),
        json.dumps(GOOD | {"token": 3}),
        json.dumps(GOOD | {"port": 70_000}),
        json.dumps(GOOD | {"port": "8768"}),
        json.dumps(GOOD | {"history": {}}),
        json.dumps({key: GOOD[key] for key in ("token", "port")}),
    ],
)
def test_what_is_no_state(wrong: Any, home: Path) -> None:
    path = home / "state.json"
    path.write_text(wrong)
    path.chmod(0o600)
    assert read_state(path).history == History()


def test_a_folder_that_takes_none_leaves_nothing(home: Path) -> None:
    (home / "state").write_text("a file where the folder would be")
    with pytest.raises(OSError, match=r".+"):
        write_state(state_path(home / "m.toml"), KeptState())
    path = home / "deep" / "m.json"
    path.mkdir(parents=True)
    with pytest.raises(OSError, match=r".+"):
        write_state(path, KeptState())
    assert list(path.parent.iterdir()) == [path]
