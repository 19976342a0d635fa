"""The state that windows share: what a message changes, what it is told, what is refused."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from command_line import MACHINES, PLANAR
from truepose.errors import MachineFileError, RequestError, TrueposeError
from truepose.studio.jobs import AskedTab, Given
from truepose.studio.messages import MOST_SENT, SENT, received, written
from truepose.studio.settings import History, Settings
from truepose.studio.shared_state import (
    EVERY,
    LARGEST_FILE,
    MOST_FILES,
    Replies,
    SharedState,
    refused,
)

ALL = list(EVERY)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    file = tmp_path / "m.toml"
    file.write_bytes(PLANAR.read_bytes())
    return file


@pytest.fixture
def state(path: Path) -> SharedState:
    return SharedState.opened(path)


def say(state: SharedState, window: int = 1, **message: Any) -> Replies:
    """Send a message; everything that is told of it is a message of the schema."""
    told = state.receive(received(json.dumps(message)), window)
    for one in (*told.sender, *told.everyone, *state.fields(), state.difference()):
        SENT.validate_python(one)
        assert len(written(one).encode()) <= MOST_SENT
    return told


def edit(state: SharedState, *edits: list[str | None], **more: Any) -> Replies:
    return say(state, type="edit", edits=edits, **more)


def answer_all(state: SharedState) -> None:
    job = state.job()
    assert job is not None
    for asked in job.asked:
        state.given(Given(job.number, asked, {"of": job.number}))
        state.given(Given(job.number, asked))


def test_an_edit_is_a_new_state_with_other_fields(state: SharedState) -> None:
    told = edit(state, ["strut.1.length", "501"])
    (message,) = told.everyone
    assert (message["number"], message["edits"]) == (1, [["strut.1.length", "501"]])
    assert (message["undo"], message["redo"]) == (1, 0)
    assert told.ask
    assert told.fields
    changed = [f for part in state.fields() for f in part["fields"] if f["edited"]]
    assert [(f["key"], f["text"], f["file"]) for f in changed] == [("strut.1.length", "501", "500")]
    job = state.job()
    assert job is not None
    assert (job.number, job.asked) == (1, EVERY)
    assert "length = 501\n" in job.text


def test_a_refused_edit_changes_nothing(state: SharedState) -> None:
    edit(state, ["strut.1.length", "501"])
    before = (state.state(), state.text)
    for bad in (
        [["strut.1.length", "-5"]],
        [["strut.9.length", "5"]],
        [["strut.1.length", "502"], ["accuracy.target", "3 N"]],
        [["strut.1.length", "50\n1"]],
    ):
        with pytest.raises(TrueposeError) as failure:
            edit(state, *bad)
        assert (state.state(), state.text) == before, "all or none"
        SENT.validate_python(refused("text", failure.value))


def test_there_and_back_leaves_nothing(state: SharedState, path: Path) -> None:
    edit(state, ["strut.1.length", "501"])
    edit(state, ["strut.1.length", "500"])
    assert state.settings.edits == ()
    assert state.text == path.read_text("utf-8")
    assert state.difference()["text"] == ""
    edit(state, ["accuracy.target", "1 mm"])
    edit(state, ["accuracy.target", None])
    assert state.settings.edits == ()


def test_undo_redo_reset(state: SharedState) -> None:
    edit(state, ["strut.1.length", "501"])
    edit(state, ["strut.1.length", "502"])
    assert say(state, type="undo").ask
    assert state.settings.edits == (("strut.1.length", "501"),)
    assert "501" in state.text
    say(state, type="redo")
    assert state.settings.edits == (("strut.1.length", "502"),)
    say(state, type="reset")
    assert state.settings.edits == ()
    say(state, type="undo")
    assert state.settings.edits == (("strut.1.length", "502"),)
    number = state.number
    told = say(state, type="redo"), say(state, type="redo")
    assert (told[0].ask, told[1].ask) == (True, False)
    assert state.number == number + 1, "nothing to redo is no new state"


def test_what_holds_and_what_is_asked_again(state: SharedState) -> None:
    assert state.state()["holds"] == []
    answer_all(state)
    assert state.state()["holds"] == ALL
    assert state.job() is None
    (message,) = say(state, type="show", pose=[0.3, 0.2]).everyone
    assert message["holds"] == ["machine", "verdict"]
    job = state.job()
    assert job is not None
    assert job.asked == ("known", "shares")
    # What was due stays due, though another change does not touch it.
    edit(state, ["strut.1.length", "501"])
    (message,) = say(state, type="show", pose=[0.31, 0.2]).everyone
    assert message["holds"] == []


def test_an_answer_of_an_older_state_is_told_and_does_not_count(state: SharedState) -> None:
    edit(state, ["strut.1.length", "501"])
    ((windows, message),) = state.given(Given(0, "known", {"a": 1}))
    assert (windows, message["number"], message["value"]) == (None, 0, {"a": 1})
    assert state.given(Given(0, "known")) == []
    assert "known" not in state.state()["holds"]
    assert state.given(Given(1, "known")) == []
    assert "known" in state.state()["holds"]
    ((_, message),) = state.given(Given(1, "shares", problems=[]))
    assert message["problems"] == []
    assert "value" not in message


def test_a_new_window_is_told_what_is_there(state: SharedState) -> None:
    answer_all(state)
    greeting = state.greeting()
    assert [message["type"] for message in greeting[:2]] == ["state", "fields"]
    assert [message["name"] for message in greeting[2:]] == ALL


def test_each_window_has_a_tab_of_its_own(state: SharedState) -> None:
    answer_all(state)
    assert say(state, 1, type="tab", name="budget").ask
    say(state, 2, type="tab", name="calibration", options={"file": 1})
    job = state.job()
    assert job is not None
    budget, calibration = AskedTab("budget"), AskedTab("calibration", (("file", 1),))
    assert job.asked == (budget, calibration)
    ((windows, message),) = state.given(Given(0, budget, {"rows": []}))
    assert (windows, message["type"], message["name"]) == ([1], "tab", "budget")
    state.given(Given(0, budget))
    # The same tab in another window is told at once.
    told = say(state, 3, type="tab", name="budget")
    assert (told.sender, told.ask) == ((message,), False)
    edit(state, ["strut.1.length", "501"])
    again = state.job()
    assert again is not None
    assert again.asked == (*EVERY, budget, calibration)
    state.left(2)
    say(state, 1, type="tab", name=None)
    say(state, 3, type="tab", name=None)
    answer_all(state)
    assert state.job() is None
    with pytest.raises(RequestError):
        say(state, type="tab", name="nothing")


def test_a_pose_or_condition_of_another_machine(state: SharedState) -> None:
    before = state.state()
    part = {"temperature": {"strut.9": 300.0}, "wrench": [0.0] * 6}
    for wrong in ({"pose": [0.1]}, {"pose": [0.1] * 6}, {"condition": part}):
        with pytest.raises(TrueposeError):
            say(state, type="show", **wrong)
    zero = {"temperature": {"strut.1": 0.0}, "wrench": [0.0] * 6}
    with pytest.raises(RequestError):
        say(state, type="show", condition=zero)
    assert state.state() == before


def test_a_pose_stays_while_the_condition_is_shown(state: SharedState) -> None:
    say(state, type="show", pose=[0.3, 0.2])
    cold = {"temperature": {"strut.1": 280.0}, "wrench": [0.0] * 6}
    say(state, type="show", condition=cold)
    assert state.state()["pose"] == [0.3, 0.2]
    assert state.state()["condition"] == cold
    say(state, type="show", condition=None)
    assert state.state()["pose"] == [0.3, 0.2]
    assert state.state()["condition"] is None


def test_save_as(state: SharedState, path: Path) -> None:
    edit(state, ["strut.1.length", "501"])
    told = say(state, type="save", name="n.toml")
    (saved,) = told.sender
    assert (saved["type"], saved["name"]) == ("saved", "n.toml")
    assert path.with_name("n.toml").read_text("utf-8") == state.text
    with pytest.raises(RequestError) as failure:
        say(state, type="save", name="n.toml")
    assert failure.value.problems[0].code == "output-exists"
    assert say(state, type="save", name="n.toml", replace=True).sender


def test_a_file_that_changes_under_it(state: SharedState, path: Path) -> None:
    assert state.file_is(state.file.hash) == Replies()
    edit(state, ["strut.1.length", "501"])
    path.write_text(path.read_text().replace('target = "0.5 mm"', 'target = "0.9 mm"'))
    changed, message = state.file_is("another").everyone
    assert changed == {"type": "changed", "hash": "another"}
    assert message["file"]["changed"]
    # It goes on with the file that it has, until somebody reloads.
    assert "0.5 mm" in state.text
    told = say(state, type="reload")
    assert told.ask
    assert state.machine.accuracy.target == pytest.approx(0.9e-3)
    assert state.settings.edits == (("strut.1.length", "501"),)
    assert not state.state()["file"]["changed"]
    say(state, type="reload", edits="drop")
    assert state.settings.edits == ()
    gone, _ = state.file_is(None).everyone
    assert gone["hash"] is None
    back = state.file_is(state.file.hash)
    assert [message["type"] for message in back.everyone] == ["state"]


def test_a_file_that_does_not_take_the_edits_any_more(state: SharedState, path: Path) -> None:
    edit(state, ["strut.2.length", "501"])
    before = state.state()
    other = (MACHINES / "hexapod.toml").read_text().replace('name = "2"', 'name = "zwei"')
    path.write_text(other)
    with pytest.raises(TrueposeError):
        say(state, type="reload")
    assert state.state() == before
    say(state, type="show", pose=[0.3, 0.2])
    say(state, type="reload", edits="drop")
    assert len(state.machine.struts) == 6
    assert state.state()["pose"] is None, "that was another machine's"
    path.write_text("no TOML")
    with pytest.raises(MachineFileError):
        say(state, type="reload")


def test_dropped_files_are_held_and_the_oldest_go(state: SharedState) -> None:
    numbers = [state.drop(f"{n}.csv", b"x" * n) for n in range(MOST_FILES + 2)]
    held = state.state()["files"]
    assert [row["file"] for row in held] == numbers[2:]
    assert held[0] == {"file": numbers[2], "name": "2.csv", "size": 2}
    say(state, type="forget", file=numbers[2])
    say(state, type="forget", file=999)
    assert [row["file"] for row in state.state()["files"]] == numbers[3:]
    with pytest.raises(RequestError) as failure:
        state.drop("large", b"x" * (LARGEST_FILE + 1))
    assert failure.value.problems[0].code == "file-too-large"
    say(state, type="tab", name="calibration", options={"file": numbers[-1]})
    job = state.job()
    assert job is not None
    assert job.files[numbers[-1]].name == f"{MOST_FILES + 1}.csv"


def test_more_edits_than_a_message_holds(state: SharedState) -> None:
    fields = [field for message in state.fields() for field in message["fields"]]
    numbers = [field for field in fields if field["unit"]]
    assert len(numbers) * 3900 > MOST_SENT
    before, refusal = state.state(), None
    for field in numbers:
        try:
            edit(state, [field["key"], f"{field['text']} # {'y' * 3900}"])
        except RequestError as failure:
            (refusal,) = failure.problems
            break
        before = state.state()
    assert refusal is not None
    assert refusal.code == "bad-setting"
    assert "more edits" in refusal.message
    assert state.state() == before
    assert len(before["edits"]) > 5


def test_settings_that_were_kept(path: Path) -> None:
    kept = History(Settings((("strut.1.length", "501"),), (0.3, 0.2)), ((),))
    state = SharedState.opened(path, kept)
    assert state.history == kept
    assert "length = 501" in state.text
    # The file is another one since: it is opened all the same.
    wrong = History(Settings((("strut.7.length", "501"),)))
    assert SharedState.opened(path, wrong).history == History()
    nowhere = History(Settings(kept.now.edits, (0.3,)), ((),))
    assert SharedState.opened(path, nowhere).history == History(Settings(kept.now.edits), ((),))
    path.write_text("schema = 1\n")
    with pytest.raises(MachineFileError):
        SharedState.opened(path, kept)


@pytest.mark.parametrize("name", sorted(p.stem for p in MACHINES.glob("*.toml")))
def test_messages_of_every_machine_are_small_enough(name: str) -> None:
    state = SharedState.opened(MACHINES / f"{name}.toml")
    fields = state.fields()
    for message in (state.state(), *fields):
        SENT.validate_python(message)
        assert len(json.dumps(message, ensure_ascii=False).encode()) <= MOST_SENT
    assert sum(len(message["fields"]) for message in fields) == fields[0]["total"]
