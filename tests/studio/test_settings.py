"""The state of a studio: edits in their order, steps back and forward, what JSON keeps of it."""

from __future__ import annotations

import json
from typing import Any

import pytest

import truepose as tp
from command_line import PLANAR
from truepose.studio.settings import MOST_UNDONE, History, Settings, ShownCondition

WARM = ShownCondition((("strut.1", 300.0),), (1.0, 2.0, 0.0, 0.0, 0.0, 0.0))


def edits(*pairs: tuple[str, str]) -> Settings:
    return Settings(pairs)


def test_a_key_is_edited_once_and_the_last_acts_last() -> None:
    settings = Settings().edited([("strut.*.length", "501"), ("strut.1.length", "502")])
    assert settings.edits == (("strut.*.length", "501"), ("strut.1.length", "502"))
    again = settings.edited([("strut.*.length", "503")])
    assert again.edits == (("strut.1.length", "502"), ("strut.*.length", "503"))
    assert again.edited([("strut.1.length", None)]).edits == (("strut.*.length", "503"),)
    assert again.edited([("accuracy.target", None)]) == again


def test_steps_back_and_forward() -> None:
    history = History()
    for value in "123":
        history = history.changed(history.now.edited([("strut.1.length", value)]))
    assert len(history.past) == 3
    two = history.undone()
    assert two.now == edits(("strut.1.length", "2"))
    assert two.redone() == history
    assert two.redone().redone() == history
    assert two.undone().undone().undone().now == Settings()
    other = two.changed(two.now.edited([("strut.1.length", "9")]))
    assert other.redone() == other, "what was undone is gone after another edit"
    assert other.reset().now == Settings()
    assert other.reset().undone().now == other.now


def test_what_is_shown_is_no_step() -> None:
    history = History().changed(edits(("strut.1.length", "1")))
    shown = history.changed(Settings(history.now.edits, (0.3, 0.2), WARM))
    assert shown.past == history.past
    assert shown.undone().now == Settings((), (0.3, 0.2), WARM)


def test_a_dragged_slider_is_one_step() -> None:
    history = History().changed(edits(("strut.1.length", "1")))
    for value in "234":
        dragged = history.now.edited([("strut.1.length", value)])
        history = history.changed(dragged, joins=True)
    assert history.now == edits(("strut.1.length", "4"))
    assert history.undone().now == Settings()
    # After a step back there is nothing to belong to.
    back = history.undone()
    assert back.changed(edits(("strut.1.length", "7")), joins=True).past == ((),)


def test_not_more_steps_than_are_kept() -> None:
    history = History()
    for value in range(MOST_UNDONE + 5):
        history = history.changed(edits(("strut.1.length", str(value))))
    assert len(history.past) == MOST_UNDONE


def test_json_keeps_all_of_it() -> None:
    history = History(Settings((("a.b", "1"),), (0.1, 0.2), WARM), ((), (("c", "2"),)), ((),))
    kept = json.loads(json.dumps(history.to_json()))
    assert History.from_json(kept) == history
    assert History.from_json(json.loads(json.dumps(History().to_json()))) == History()


@pytest.mark.parametrize(
    "wrong",
    [
        {"edits": [["a"]]},
        {"edits": [[1, "2"]]},
        {"edits": 3},
        {"pose": ["x"]},
        {"pose": [float("nan")]},
        {"condition": {"temperature": {}, "wrench": [1.0]}},
        {"past": [[["a", None]]]},
        {"future": None},
    ],
)
def test_what_is_no_history(wrong: dict[str, Any]) -> None:
    with pytest.raises((ValueError, TypeError, KeyError)):
        History.from_json(History().to_json() | wrong)


def test_a_condition_in_place_of_the_files() -> None:
    condition = WARM.of(tp.load(PLANAR).condition)
    assert condition.temperature("strut.1") == 300.0
    assert condition.temperature("strut.2") == tp.load(PLANAR).condition.temperature("strut.2")
    assert condition.wrench.tolist() == list(WARM.wrench)
