"""Every code is explained, and every example gives its code."""

from __future__ import annotations

import re
import sys
import tomllib
from pathlib import Path

import pytest
import scipy.stats

import truepose.explanations
from explained import codes_of
from generators import DOCS, generator
from truepose._kernel import STATUS
from truepose.calibration import data_checks, residual_checks
from truepose.calibration.acceptance.reasons import SENTENCES
from truepose.errors import CATALOGUE
from truepose.explanations import TOPICS, explanations
from truepose.plausibility import RULES

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
    # An example may leave a module out; all tests after it have what they had.
    monkeypatch.setitem(sys.modules, "scipy.stats", scipy.stats)
    example = EXAMPLES[code]
    assert example is not None
    assert code in codes_of(example, tmp_path, capsys)


def test_codes_of_suspicions_and_reasons_are_explained() -> None:
    others = {rule.code for rule in RULES}
    others |= {*data_checks.CODES, *residual_checks.CODES, *SENTENCES}
    others |= {"other-assembly-mode", "exact-stops", "parasitic-remains", "nothing-to-correct"}
    others |= {*STATUS, "band"} - {"ok"}
    assert sorted(others - EVERY.keys()) == []
    assert sorted(EVERY.keys() - others - CATALOGUE.keys()) == []


def test_every_topic_has_a_table_and_every_table_a_topic() -> None:
    folder = Path(truepose.explanations.__file__).parent
    assert {path.stem for path in folder.glob("*.toml")} == TOPICS.keys()
    assert {explanation.topic for explanation in EVERY.values()} == TOPICS.keys()


def test_a_code_is_explained_once() -> None:
    folder = Path(truepose.explanations.__file__).parent
    tables = [tomllib.loads(path.read_text("utf-8")) for path in folder.glob("*.toml")]
    assert sum(map(len, tables)) == len(EVERY)


def test_a_meaning_of_the_catalogue_is_not_written_again() -> None:
    folder = Path(truepose.explanations.__file__).parent
    for path in folder.glob("*.toml"):
        for code, entry in tomllib.loads(path.read_text("utf-8")).items():
            assert ("means" in entry) == (code not in CATALOGUE), code


def test_sentences_are_sentences() -> None:
    for explanation in EVERY.values():
        assert explanation.advice.endswith("."), explanation.code
        assert explanation.advice[0].isupper() or explanation.advice[0].isdigit()
        assert not explanation.meaning.endswith(".")


def test_the_page_is_fresh() -> None:
    written = (DOCS / "errors.md").read_text("utf-8")
    assert written == generator("errors").page(), "run: python docs/generate_errors.py"
    # Every code has a heading of its own, which is what a link to it leads to.
    headings = re.findall(r"^### (\S+)$", written, re.MULTILINE)
    assert headings == list(EVERY)
