"""Where a newcomer finds things: the answers to twenty questions are files that exist."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
QUESTIONS = tomllib.loads((Path(__file__).parent / "questions.toml").read_text("utf-8"))["question"]
TO_BE_WRITTEN = "sources/humidity.py"
"""The file of an addition, which is not there."""


def test_there_are_twenty() -> None:
    assert len({question["ask"] for question in QUESTIONS}) == 20


@pytest.mark.parametrize("question", QUESTIONS, ids=lambda question: question["ask"][:40])
def test_an_answer_is_a_file(question: dict[str, list[str]]) -> None:
    for path in question["now"]:
        if path.endswith(TO_BE_WRITTEN):
            assert (ROOT / path).parent.is_dir()
        else:
            assert (ROOT / path).is_file()
