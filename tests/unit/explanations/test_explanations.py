"""Every code is explained, and every example gives its code."""

from __future__ import annotations

from pathlib import Path

import pytest

from explained import codes_of
from truepose.errors import CATALOGUE
from truepose.explanations import TOPICS, Explanation, explanations

EVERY = explanations()


def test_every_code_of_the_catalogue_is_explained() -> None:
    assert sorted(CATALOGUE.keys() - EVERY.keys()) == []


@pytest.mark.parametrize("explanation", EVERY.values(), ids=EVERY)
def test_the_example_gives_the_code(
    explanation: Explanation,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert explanation.code in codes_of(explanation, tmp_path, capsys)
