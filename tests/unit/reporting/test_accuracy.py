"""Answers in words: what stands first on the screen, and how its numbers are rounded."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from made_study import MADE_UNITS, planar_study
from truepose.machine.workspace import Accuracy
from truepose.reporting.accuracy import Told, gains
from truepose.reporting.study import Study
from truepose.verdict.answer import AFTER, MET, NOT_MET, UNDECIDED, Answer
from truepose.verdict.coverage import CoverageAnswer

TARGET = 9.3e-4
"""m, of the machines made here."""


@pytest.fixture(scope="module")
def study() -> Study:
    made = planar_study()
    made.machine.accuracy = Accuracy(TARGET, None, "0.93 mm")
    return made


def told(study: Study, answer: str | None, witness: float, linear: float, bound: float) -> Told:
    """An answer with these numbers, µm."""
    given = study.accuracy[0]
    numbers = {
        name: replace(getattr(given, name), value=value * 1e-6)
        for name, value in (("witness", witness), ("linear", linear), ("bound", bound))
    }
    asked = None if answer is None else TARGET
    return Told(study.machine, replace(given, asked=asked, answer=answer, **numbers))


@pytest.mark.parametrize(
    ("answer", "numbers", "line"),
    [
        (MET, (800.0, 812.34, 812.41), "at most 812.5 µm, asked 0.93 mm (930 µm), at"),
        (MET, (800.0, 929.0, 930.0), "at most 930.0 µm, asked"),
        # As close to the target as makes no difference to a tenth: so many digits that it does.
        (MET, (800.0, 929.0, 929.96), "at most 929.96 µm, asked"),
        (MET, (800.0, 929.0, 929.9991), "at most 929.9991 µm, asked"),
        (NOT_MET, (930.0004, 930.0, 931.0), "930.0004 µm, asked"),
        (NOT_MET, (1234.56, 1200.0, math.inf), "1234.6 µm, asked"),
        (UNDECIDED, (929.99, 930.0, 930.01), "between 929.9 and 930.1 µm, asked"),
        (UNDECIDED, (929.99, 930.0, math.inf), "929.9 µm or more, asked"),
        (NOT_MET, (math.inf, 930.0, math.inf), "a machine that cannot be assembled, asked"),
        (None, (800.0, 812.34, 813.0), "812.3 µm, at"),
    ],
)
def test_a_number_never_looks_like_the_other_side_of_the_target(
    answer: str | None, numbers: tuple[float, float, float], line: str, study: Study
) -> None:
    found = told(study, answer, *numbers)
    assert found.line.startswith(f"position before compensation: {line} ")
    assert found.line.count("rests on") == int(answer != UNDECIDED)
    assert found.line.endswith("what is made up")


def test_each_answer_has_its_word_and_colour(study: Study) -> None:
    words = {
        answer: (found.word, found.colour)
        for answer in (MET, NOT_MET, UNDECIDED, None)
        for found in [told(study, answer, 1.0, 2.0, 3.0)]
    }
    assert words == {
        MET: ("met", "met"),
        NOT_MET: ("NOT met", "missed"),
        UNDECIDED: ("undecided", "open"),
        None: ("not asked", "none"),
    }


def test_the_target_is_said_once_where_it_is_in_the_answer_s_unit() -> None:
    study = planar_study()
    study.machine.accuracy = Accuracy(TARGET, None, "930 um")
    assert told(study, MET, 1.0, 2.0, 3.0).asked == "930 um"
    assert MADE_UNITS.error("position").label == "µm"


def test_a_coverage_is_said_with_its_interval(study: Study) -> None:
    found = told(study, MET, 701.96, 705.0, 708.01)
    sampled = CoverageAnswer(
        "position", 0.95, TARGET, "met", 7.05e-4, 7e-4, 7.1e-4, 0, 20_000, 0, 0, 1, 1, 1
    )
    share = replace(found, answer=replace(found.answer, coverage=sampled))
    assert share.size == "95 % within 705.0 µm (99 % confidence: between 701.9 and 708.1 µm)"
    lost = replace(share.answer, linear=replace(share.answer.linear, value=math.inf))
    assert replace(share, answer=lost).size == "fewer than 95 % of all machines can be assembled"


@pytest.mark.parametrize(
    ("after", "sentence"),
    [
        (0.73, "position: reduced by 27 % by compensation."),
        (0.9951, "position: nothing to gain by compensation: what is left is unknown."),
        (1.0049, "position: nothing to gain by compensation: what is left is unknown."),
        (1.25, "position: made 25 % larger by compensation: it corrects commanded freedoms by "),
        (math.inf, "position: what compensation does cannot be said."),
    ],
)
def test_what_compensation_gains_is_a_sentence(after: float, sentence: str, study: Study) -> None:
    before = told(study, NOT_MET, 900.0, 1000.0, 1010.0).answer
    linear = replace(before.linear, value=after * before.linear.value)
    pair: tuple[Answer, ...] = (before, replace(before, state=AFTER, linear=linear))
    (said,) = gains(pair)
    assert said.startswith(sentence)
    assert gains((before,)) == ()
