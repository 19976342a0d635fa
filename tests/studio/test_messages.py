"""The messages: what is none is refused in a sentence, none is too large, the schema is theirs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from truepose.errors import RequestError
from truepose.studio.messages import (
    MOST_SENT,
    EditMessage,
    fits,
    in_place_of,
    pieces,
    received,
    schema_text,
    written,
)

SCHEMA = Path(__file__).parents[2] / "docs" / "studio_messages.schema.json"

GOOD: list[dict[str, Any]] = [
    {"type": "edit", "edits": [["strut.1.length", "501"], ["a.b", None]], "joins": True},
    {"type": "show", "pose": [0.1, 0.2]},
    {"type": "show", "condition": {"temperature": {"strut.1": 300.0}, "wrench": [0.0] * 6}},
    {"type": "show", "pose": None, "condition": None},
    {"type": "undo"},
    {"type": "redo"},
    {"type": "reset"},
    {"type": "tab", "name": "budget"},
    {"type": "tab", "name": None},
    {"type": "tab", "name": "calibration", "options": {"file": 1}},
    {"type": "difference"},
    {"type": "save", "name": "a.toml", "replace": True},
    {"type": "reload", "edits": "drop"},
    {"type": "forget", "file": 3},
]

BAD = [
    "",
    "no JSON",
    "[" * 100_000,
    "null",
    "3",
    "[]",
    "{}",
    '{"type": "nothing"}',
    '{"type": "edit"}',
    '{"type": "edit", "edits": []}',
    '{"type": "edit", "edits": [["a"]]}',
    '{"type": "edit", "edits": [["a", 3]]}',
    '{"type": "edit", "edits": [["a", "1", "2"]]}',
    '{"type": "undo", "more": 1}',
    '{"type": "show", "pose": [1e999]}',
    '{"type": "show", "pose": [NaN]}',
    '{"type": "show", "pose": "home"}',
    '{"type": "show", "condition": {"temperature": {}, "wrench": [0]}}',
    '{"type": "save", "name": 3}',
    '{"type": "reload", "edits": "some"}',
    '{"type": "forget", "file": "1"}',
    json.dumps({"type": "edit", "edits": [["a", "1"]] * 500}),
    json.dumps({"type": "edit", "edits": [["a", "1" * 5000]]}),
]


@pytest.mark.parametrize("message", GOOD, ids=lambda message: message["type"])
def test_messages_of_the_page(message: dict[str, Any]) -> None:
    assert received(json.dumps(message)).type == message["type"]
    jsonschema.validate(message, json.loads(SCHEMA.read_text("utf-8")))


@pytest.mark.parametrize("text", BAD, ids=range(len(BAD)))
def test_what_is_no_message(text: str) -> None:
    with pytest.raises(RequestError) as failure:
        received(text)
    (problem,) = failure.value.problems
    assert problem.code == "bad-argument"
    assert problem.found
    assert "\n" not in problem.found


def test_an_edit_of_no_key() -> None:
    message = received('{"type": "edit", "edits": [[null, "1"]]}')
    assert isinstance(message, EditMessage)
    with pytest.raises(RequestError):
        message.pairs()


def test_of_several_values_that_wait_the_last() -> None:
    def edit(*pairs: list[Any], joins: bool = False) -> Any:
        return received(json.dumps({"type": "edit", "edits": pairs, "joins": joins}))

    one, two = edit(["a", "1"]), edit(["a", "2"], ["b", "3"], joins=True)
    both = in_place_of(one, two)
    assert isinstance(both, EditMessage)
    assert both.edits == two.edits
    assert not both.joins, "the first begins a step"
    assert in_place_of(two, one) is None, "b would be lost"
    show = [
        received(json.dumps({"type": "show", **of})) for of in ({"pose": [1.0]}, {"pose": None})
    ]
    assert in_place_of(show[0], show[1]) == show[1]
    assert in_place_of(show[0], received('{"type": "show", "condition": null}')) is None
    assert in_place_of(received('{"type": "undo"}'), received('{"type": "undo"}')) is None


def test_the_schema_is_fresh() -> None:
    assert SCHEMA.read_text("utf-8") == schema_text(), (
        "run: python docs/generate_studio_messages.py"
    )


def test_an_answer_that_is_too_large_is_told_as_a_problem() -> None:
    large = {"type": "answer", "number": 3, "name": "machine", "value": {"a": "µ" * MOST_SENT}}
    assert not fits(large)
    text = written(large)
    assert len(text.encode()) < MOST_SENT
    message = json.loads(text)
    assert (message["number"], message["name"]) == (3, "machine")
    assert message["problems"][0]["code"] == "file-too-large"
    small = large | {"value": {"a": "µ"}}
    assert fits(small)
    assert json.loads(written(small)) == small


def test_pieces_hold_all_rows_in_order() -> None:
    rows = [{"key": "µ" * (number % 50), "number": number} for number in range(1000)]
    lists = pieces(rows, 2000)
    assert [row for piece in lists for row in piece] == rows
    assert all(len(json.dumps(piece, ensure_ascii=False).encode()) <= 4000 for piece in lists)
    assert len(lists) > 10
    assert pieces([], 2000) == [[]]
    assert pieces([{"a": "x" * 5000}], 2000) == [[{"a": "x" * 5000}]]
