"""`truepose explain`: what a code means, what to do, an example; near codes for an unknown one."""

from __future__ import annotations

import sys

import pytest

from command_line import PLANAR, call
from truepose.explanations import TOPICS, explanations

EVERY = explanations()
Capture = pytest.CaptureFixture[str]


@pytest.mark.parametrize("code", EVERY)
def test_every_code(code: str, capsys: Capture) -> None:
    outcome = call(capsys, "explain", code)
    assert (outcome.code, outcome.err) == (0, "")
    lines = outcome.out.splitlines()
    assert lines[0] == code
    said = " ".join(outcome.out.split())
    explanation = EVERY[code]
    assert explanation.meaning[1:] in said
    assert " ".join(explanation.advice.split()) in said
    if explanation.example is not None:
        for command in explanation.example.commands:
            assert f"    truepose {command.strip()}" in lines


def test_without_a_code_all_are_listed_by_topic(capsys: Capture) -> None:
    outcome = call(capsys, "explain")
    assert outcome.code == 0
    places = [outcome.out.index(f"{title}\n\n") for title in TOPICS.values()]
    assert places == sorted(places)
    for code, explanation in EVERY.items():
        assert any(
            line.split() == [code, *explanation.meaning.split()]
            for line in outcome.out.splitlines()
        )


def test_several_and_as_they_were_copied(capsys: Capture) -> None:
    outcome = call(capsys, "explain", "error[no-unit]:", "NOT-TOML", "no-unit")
    assert outcome.code == 0
    assert outcome.out.startswith("no-unit\n")
    assert outcome.out.count("\nno-unit\n") == 0
    assert "\n\nnot-toml\n" in outcome.out


def test_an_unknown_code_is_told_with_near_ones(capsys: Capture) -> None:
    outcome = call(capsys, "explain", "no-unot", "xyzzy")
    assert (outcome.code, outcome.codes, outcome.out) == (2, ["unknown-code"] * 2, "")
    assert 'did you mean "no-unit"?' in outcome.err
    assert call(capsys, "explain", "").code == 2


def test_a_terminal_is_told_how_to_read_more(
    capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = ("check", PLANAR, "--set", "strut.1.lenght=5", "--set", 'strut.2.modulus="5 N"')
    assert "truepose explain" not in call(capsys, *asked).err
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    monkeypatch.setenv("TERM", "dumb")
    said = call(capsys, *asked).err
    assert said.endswith("More, with an example: truepose explain unknown-key wrong-dimension\n")
