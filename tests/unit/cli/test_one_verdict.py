"""Each state's verdict is one and the same in every command that judges it."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import truepose as tp
from build_machine import MACHINES
from command_line import Outcome, call
from one_number import asking, settings_of
from sweeps import thinned
from truepose.verdict.answer import AFTER, BEFORE, STATES, Answer

COMMANDS = {
    BEFORE: ("check", "budget", "compensate", "bounds"),
    AFTER: ("check", "compensate"),
}
"""Commands that show a state's answers."""

JUDGING = {BEFORE: ("check", "budget", "bounds"), AFTER: ("compensate",)}
"""Commands whose exit code is of that state."""

OTHER = 0.05
"""m or rad, asked of the quantity that is not looked at."""


def answers_of(outcome: Outcome, state: str) -> list[str]:
    """The answers of a state as they are printed first, each in one line."""
    first = " ".join(outcome.out.partition("\n\n")[0].split())
    where, *told = re.split(r"(?<=between them\.) |(?<=what lies between\.) ", first, maxsplit=1)
    assert where.startswith("At ")
    first = " ".join(told)
    pieces = re.split(r"(?=\b(?:NOT met|met|undecided|not asked) (?:position|orientation) )", first)
    # "met" of "NOT met" begins no answer.
    found, whole = [], ""
    for piece in pieces:
        if piece == "NOT ":
            whole = piece
            continue
        found.append((whole + piece).strip())
        whole = ""
    return [each for each in found if re.search(rf"^\S.* (position|orientation) {state}:", each)]


def asked(answers: tuple[Answer, ...], of: Answer, target: float) -> list[str]:
    """Settings that ask `target` of one quantity, and of the other what is always kept."""
    settings = ["--set", "accuracy.at=worst"]
    for answer in answers:
        if answer.state == of.state:
            value = target if answer is of else OTHER
            settings += ["--set", settings_of(answer, value)]
    return settings


@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize(
    "name", thinned(["planar_two_slider", "tricept", "3prs", "hexapod", "linear_delta"])
)
def test_all_commands_say_the_same(
    name: str, state: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """For targets below the witness, between it and the bound, and above the bound."""
    path = MACHINES / f"{name}.toml"
    answers = tp.accuracy(asking(tp.load(path)))
    (of,) = [each for each in answers if (each.state, each.quantity) == (state, "position")]
    witness, bound = of.witness.value, of.bound.value
    for target in (0.98 * witness, 0.5 * (witness + bound), 1.02 * bound):
        settings = asked(answers, of, target)
        (answer, *_) = tp.accuracy(tp.load(path, settings=settings[1::2]), states=(state,))
        codes, said = {}, {}
        for command in COMMANDS[state]:
            required = [] if command == "check" else ["--require-accuracy"]
            outcome = call(capsys, command, path, *settings, *required)
            codes[command], said[command] = outcome.code, answers_of(outcome, state)
        first = said[COMMANDS[state][0]]
        assert len(first) == len({each.quantity for each in answers})
        assert first[0].startswith(f"{answer.answer} position {state}: ")
        for command in COMMANDS[state]:
            assert said[command][: len(first)] == first, command
        for command in JUDGING[state]:
            assert codes[command] == int(answer.answer != "met"), command


def test_the_report_has_it_too(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Its exit code is that of what compensation leaves, and both answers are on its page."""
    path = MACHINES / "planar_two_slider.toml"
    for target, code in (("0.5 mm", 1), ("0.51 mm", 0)):
        page = tmp_path / "page.html"
        setting = ["--set", f"accuracy.target={target}", "--require-accuracy"]
        outcome = call(capsys, "report", path, *setting, "-o", page)
        assert outcome.code == code
        other = call(capsys, "compensate", path, *setting)
        assert other.code == code
        for state in STATES:
            assert answers_of(outcome, state) == answers_of(other, state) != []
        text = page.read_text(encoding="utf-8")
        assert "NOT met" in text
        assert "682.5" in text
        assert "500.2" in text
