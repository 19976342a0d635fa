"""The report in other languages: whole, with the same numbers, and English without Babel."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from inspect import unwrap
from pathlib import Path
from types import ModuleType

import pytest

import truepose as tp
import truepose.language
from command_line import PLANAR, call
from generators import generator
from truepose.language import languages, say, say_counted, speaking
from truepose.reporting import assembly, page
from truepose.reporting.table import Table

OTHERS = languages()[1:]

ALIKE = {
    "de": {"CSV", "Live", "Position: {rest}", "Shapley", "Shapley, %", "dominant", "in", "linear",
           "linear, %", "relevant"},
    "pt": {"CSV", "Shapley", "Shapley, %", "linear", "linear, %", "nominal", "pose", "poses",
           "singular", "total", "total, %", "{count} pose"},
}  # fmt: skip
"""Translations that read as in English, on purpose."""

WORDS = re.compile(r"[^\W\d_]{2}")
NUMBER = re.compile(r"[−±<]?\d[\d.,]*(e[-+]\d+)?")


@pytest.fixture(scope="module")
def written() -> ModuleType:
    return generator("languages")


@pytest.fixture(scope="module")
def pages() -> dict[str, tuple[str, list[Table]]]:
    """The planar machine's page and its tables, by language."""
    made = {}
    for code in languages():
        with speaking(code):
            text, contents = page.rendered(assembly.study(tp.load(PLANAR)))
        made[code] = (text, contents.tables)
    return made


def test_german_and_portuguese_are_there() -> None:
    assert {"de", "pt"} <= set(OTHERS)


@pytest.mark.parametrize("code", OTHERS)
def test_nothing_is_untranslated_and_nothing_stale(written: ModuleType, code: str) -> None:
    assert written.untranslated(code) == [], "translate these in the language's file"
    file = written.LANGUAGES / f"{code}.po"
    expected = written.text_of(code)
    assert file.read_text("utf-8") == expected, "run: python docs/generate_languages.py"


@pytest.mark.parametrize("code", OTHERS)
def test_a_translation_has_the_places_and_the_plural_forms(written: ModuleType, code: str) -> None:
    catalogue = written.catalogue(code)
    for message in written.said():
        string = catalogue.get(message.key).string
        forms = [string] if message.plural is None else list(string)
        if message.plural is not None:
            assert frozenset(written.NAMED.findall("".join(forms))) == message.places, message
        assert len(forms) == (1 if message.plural is None else catalogue.num_plurals), message
        for form in forms:
            places = frozenset(written.NAMED.findall(form))
            # A single one may be said without its number, and has no sum.
            assert places <= message.places, (message, form)
            assert message.plural or places == message.places, (message, form)
            assert form.count("{") == form.count("}") == len(written.NAMED.findall(form)), form


@pytest.mark.parametrize("code", OTHERS)
def test_no_english_is_left_by_accident(written: ModuleType, code: str) -> None:
    catalogue = written.catalogue(code)
    alike = set()
    for message in written.said():
        string = catalogue.get(message.key).string
        forms = [string] if message.plural is None else string
        bare = written.NAMED.sub("", message.text)
        if WORDS.search(bare) and {message.text, message.plural} & set(forms):
            alike.add(message.text)
    assert alike == ALIKE[code]


@pytest.mark.parametrize("code", OTHERS)
def test_the_whole_page_is_in_the_language(
    written: ModuleType, pages: dict[str, tuple[str, list[Table]]], code: str
) -> None:
    text, _ = pages[code]
    english, _ = pages["en"]
    assert f'<html lang="{code}">' in text
    catalogue = written.catalogue(code)
    seen = 0
    for message in written.said():
        if message.plural or message.places or message.text.count(" ") < 2:
            continue
        if f">{message.text}<" in english:
            assert f">{catalogue.get(message.text).string}<" in text, message.text
            assert f">{message.text}<" not in text
            seen += 1
    assert seen > 20


@pytest.mark.parametrize("code", OTHERS)
def test_numbers_are_the_same_digits_and_units_the_same(
    pages: dict[str, tuple[str, list[Table]]], code: str
) -> None:
    tables, english = pages[code][1], pages["en"][1]
    assert [table.name for table in tables] == [table.name for table in english]
    numbers = 0
    for table, first in zip(tables, english, strict=True):
        for cell, of in zip(_cells(table), _cells(first), strict=True):
            if NUMBER.fullmatch(of):
                assert cell == of.translate(str.maketrans(".,", ",.")), table.name
                numbers += "." in of
        for cell, of in zip(table.header, first.header, strict=True):
            unit = of.rpartition(", ")[2]
            if unit in ("µm", "mdeg", "mm", "%"):
                assert cell.endswith(unit), (cell, of)
    assert numbers > 50


def _cells(table: Table) -> Iterator[str]:
    for row in table.rows:
        yield from row


def test_plural_forms_are_those_of_the_language() -> None:
    said = {}
    for code in languages():
        with speaking(code):
            said[code] = [say_counted("{count} pose", "{count} poses", n) for n in (0, 1, 2, 1234)]
    assert said["en"] == ["0 poses", "1 pose", "2 poses", "1,234 poses"]
    assert said["de"] == ["0 Posen", "1 Pose", "2 Posen", "1.234 Posen"]
    assert said["pt"] == ["0 pose", "1 pose", "2 poses", "1.234 poses"]  # no French rule by chance


def test_what_is_said_has_to_be_a_text(written: ModuleType, tmp_path: Path) -> None:
    module = tmp_path / "module.py"
    head = "from truepose.language import say\n"
    module.write_text(head + 'TABLE = {1: "of a table"}\nsay("a text")\nsay(TABLE[key])\n')
    texts = [message.text for message in written.messages(tmp_path)]
    assert texts == ["a text", "of a table"]
    for wrong in ('say(f"{n} poses")', 'say("a" + name)', "say(text)"):
        module.write_text(head + wrong)
        with pytest.raises(ValueError, match=r"module\.py, line 2"):
            written.messages(tmp_path)
    (tmp_path / "module.py").unlink()
    (tmp_path / "page.jinja").write_text('{{ say("on a page") }}{{ say(drawn.title) }}')
    assert [message.text for message in written.messages(tmp_path)] == ["on a page"]
    (tmp_path / "page.jinja").write_text("{{ say(text) }}")
    with pytest.raises(ValueError, match="has to be a text"):
        written.messages(tmp_path)


def test_english_needs_no_babel(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "babel", None)
    monkeypatch.setattr(truepose.language, "_language", unwrap(truepose.language._language))  # noqa: SLF001
    with speaking("en"):
        assert say("{names} and {last}", names="a", last="b") == "a and b"
    outcome = call(capsys, "report", PLANAR, "--language", "de", "--output", tmp_path / "p.html")
    assert (outcome.code, outcome.codes) == (2, ["extra-missing"])
    assert "pip install 'truepose[report]'" in outcome.err
    assert list(tmp_path.iterdir()) == []


def test_a_language_that_there_is_not(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    outcome = call(capsys, "report", PLANAR, "--language", "xx", "--output", tmp_path / "p.html")
    assert (outcome.code, outcome.codes) == (2, ["unknown-language"])
    assert "en, de, pt" in outcome.err


def test_the_command_prints_in_the_language(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    outcome = call(capsys, "report", PLANAR, "--language", "de", "--output", tmp_path / "p.html")
    assert outcome.code == 0
    assert "NICHT erfüllt" in outcome.out
    assert "682,5 µm" in outcome.out
    assert '<html lang="de">' in (tmp_path / "p.html").read_text("utf-8")
    assert say("met") == "met"  # and English is spoken again
