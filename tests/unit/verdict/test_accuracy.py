"""What may be asked of `truepose.accuracy`, and what is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import truepose as tp
from machine_texts import PLANAR, load_text
from truepose.errors import RequestError
from truepose.verdict.states import AFTER, BEFORE, STATES


def test_one_state_alone_is_the_same_as_among_both(tmp_path: Path) -> None:
    machine = load_text(tmp_path, PLANAR)
    both = tp.accuracy(machine)
    assert [answer.state for answer in both] == list(STATES)
    for state, answer in zip(STATES, both, strict=True):
        (alone,) = tp.accuracy(machine, states=(state, state))
        assert alone.state == state
        assert alone.answer == answer.answer
        assert alone.witness.value == answer.witness.value
        assert alone.bound.value == answer.bound.value


@pytest.mark.parametrize(
    ("states", "found"),
    [
        (("before",), "'before'"),
        ((BEFORE, "After compensation"), "'After compensation'"),
        (AFTER, "'after compensation'"),
        ((), "none"),
    ],
)
def test_other_states_are_refused(tmp_path: Path, states: Any, found: str) -> None:
    with pytest.raises(RequestError) as caught:
        tp.accuracy(load_text(tmp_path, PLANAR), states=states)
    (problem,) = caught.value.problems
    assert (problem.code, problem.found) == ("unknown-choice", found)
