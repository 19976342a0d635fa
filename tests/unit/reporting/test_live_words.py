"""What a live page says of the sources: in the page's language, also why one is not live."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

import truepose
from truepose.language import languages, speaking
from truepose.reporting.live.labels import WHY_NOT, sources_said
from truepose.sources import REGISTRY

OTHERS = languages()[1:]


def reasons() -> set[str]:
    """Every text that the package raises `NoLawError` with."""
    found = set()
    for path in Path(truepose.__file__).parent.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if (
                isinstance(node, ast.Call)
                and isinstance(node.func, ast.Name)
                and node.func.id == "NoLawError"
            ):
                (text,) = node.args
                assert isinstance(text, ast.Constant), f"{path}: the text has to be one"
                found.add(str(text.value))
    return found


def test_every_reason_stands_in_the_table_of_what_is_said() -> None:
    assert reasons() == set(WHY_NOT.values()), "WHY_NOT in reporting/live/labels.py"


@pytest.mark.parametrize("code", OTHERS)
def test_sources_are_said_in_the_language(code: str) -> None:
    docs = [source.doc for source in REGISTRY]
    sources = [
        {"name": f"source {number}", "doc": docs[number % len(docs)], "why": why}
        for number, why in enumerate(WHY_NOT.values())
    ]
    english = sources_said(sources)
    assert [said["why"] for said in english.values()] == list(WHY_NOT.values())
    with speaking(code):
        spoken = sources_said(sources)
    for name, said in english.items():
        assert spoken[name].keys() == said.keys() == {"doc", "why"}
        for key, text in said.items():
            assert spoken[name][key] != text, (name, key)


def test_what_is_no_reason_of_the_table_stays_as_it_is() -> None:
    with speaking("de"):
        said = sources_said([{"name": "a", "doc": "its own", "why": "for another reason"}])
        assert said == {"a": {"doc": "its own", "why": "for another reason"}}
        assert list(sources_said([{"name": "a", "doc": "its own"}])["a"]) == ["doc"]
