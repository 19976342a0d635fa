"""The answers of one job in their order, and how a newer question ends them."""

from __future__ import annotations

from pathlib import Path

import pytest

from command_line import MACHINES, PLANAR
from truepose.studio.answers import VERDICT
from truepose.studio.jobs import AskedTab, Job, answer
from truepose.studio.settings import Settings
from truepose.studio.shared_state import EVERY


def job(*asked: str | AskedTab, text: str | None = None) -> Job:
    return Job(3, PLANAR, PLANAR.read_text("utf-8") if text is None else text, Settings(), asked)


def test_all_in_order_each_with_its_end() -> None:
    given = list(answer(job(*EVERY, AskedTab("budget")), lambda: False))
    assert all(one.number == 3 and one.problems is None for one in given)
    names = [getattr(one.asked, "name", one.asked) for one in given if one.last]
    assert names == [*EVERY, "budget"]
    # What holds as commanded is told before what holds compensated is known.
    states = [len(one.value or ()) for one in given if one.asked == VERDICT]
    assert states == [1, 2, 0]


def test_a_newer_question_ends_it_between_answers_and_between_blocks() -> None:
    asked = 0

    def at_the(nth: int) -> list[str]:
        nonlocal asked
        asked = 0

        def superseded() -> bool:
            nonlocal asked
            asked += 1
            return asked > nth

        return [str(one.asked) for one in answer(job(*EVERY), superseded) if one.last]

    assert at_the(0) == []
    ends = [at_the(nth) for nth in range(12)]
    assert all(list(EVERY[: len(end)]) == end for end in ends)
    assert ends == sorted(ends, key=len)
    # It is looked at more often than once an answer.
    assert ends.count([]) > 1
    assert len(ends[-1]) >= 2


def test_what_cannot_be_answered_says_why_and_the_rest_goes_on() -> None:
    lines = PLANAR.read_text("utf-8").splitlines(keepends=True)
    nowhere = "".join(line for line in lines if not line.startswith(("[workspace]", "grid")))
    given = {one.asked: one for one in answer(job(*EVERY, text=nowhere), lambda: False)}
    assert {one.problems[0]["code"] for one in given.values() if one.problems} == {"no-workspace"}
    assert all(one.last for one in given.values())
    sure = PLANAR.read_text("utf-8").replace("length_tolerance = [-0.3, 0.3]\n", "")
    given = {one.asked: one for one in answer(job("known", "shares", text=sure), lambda: False)}
    assert given["known"].problems is None
    assert given["shares"].problems is not None
    assert given["shares"].problems[0]["code"] == "nothing-varies"


def test_a_text_that_is_no_machine_any_more(tmp_path: Path) -> None:
    """A data file of it was taken away since it was edited."""
    text = PLANAR.read_text("utf-8").replace("\ntemperature = 35", '\ntemperature_log = "gone.csv"')
    gone = Job(1, tmp_path / "m.toml", text, Settings(), EVERY)
    given = list(answer(gone, lambda: False))
    assert [one.asked for one in given] == list(EVERY)
    assert {one.problems[0]["code"] for one in given if one.problems} == {"file-missing"}


@pytest.mark.parametrize("name", sorted(path.stem for path in MACHINES.glob("*.toml")))
def test_every_machine_of_the_library_has_a_known_answer(name: str) -> None:
    path = MACHINES / f"{name}.toml"
    asked = Job(1, path, path.read_text("utf-8"), Settings(), ("known",))
    value, end = answer(asked, lambda: False)
    assert value.value is not None
    assert end.last
