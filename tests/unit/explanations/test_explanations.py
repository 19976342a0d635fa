"""Every code is explained, and every example gives its code."""

from __future__ import annotations

from pathlib import Path

import pytest

from explained import codes_of
from truepose.errors import CATALOGUE
from truepose.explanations import explanations

EVERY = explanations()
EXAMPLES = {code: explanation.example for code, explanation in EVERY.items()}
WITHOUT = {
    "other-assembly-mode",
    "out-of-reach",
    "gain-unconfirmed",
    "not-confirmed",
    "one-sided",
    "not_converged",
    "band",
}
"""What takes more than a few lines to come about: tests of the calibration reach these."""


def test_every_code_of_the_catalogue_is_explained() -> None:
    assert sorted(CATALOGUE.keys() - EVERY.keys()) == []


def test_every_problem_has_an_example() -> None:
    assert {code for code, example in EXAMPLES.items() if example is None} == WITHOUT
    assert not WITHOUT & CATALOGUE.keys()


@pytest.mark.parametrize("code", [code for code in EVERY if code not in WITHOUT])
def test_the_example_gives_the_code(
    code: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    example = EXAMPLES[code]
    assert example is not None
    assert code in codes_of(example, tmp_path, capsys)
