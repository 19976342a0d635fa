"""Every registered source has its page, its row in the list of pages, and the form of a source."""

from __future__ import annotations

from pathlib import Path

import pytest
from pydantic import BaseModel

from truepose.sources import REGISTRY, Source

DOCS = Path(__file__).parents[3] / "docs" / "sources"


@pytest.mark.parametrize("source", REGISTRY, ids=lambda source: source.name)
def test_a_source_has_its_page_and_its_row(source: type[Source]) -> None:
    page = (DOCS / f"{source.name}.md").read_text(encoding="utf-8")
    assert page.startswith(f"# {source.name}: ")
    assert "## Reference" in page
    assert f"| [{source.name}]({source.name}.md) |" in (DOCS / "README.md").read_text("utf-8")


@pytest.mark.parametrize("source", REGISTRY, ids=lambda source: source.name)
def test_a_source_says_what_it_is_and_which_keys_it_reads(source: type[Source]) -> None:
    assert source.doc
    assert all(issubclass(model, BaseModel) for model in source.tables.values())
    assert isinstance(source.sets_overall_edges, bool)


def test_every_page_is_of_a_source() -> None:
    pages = {page.stem for page in DOCS.glob("*.md")} - {"README"}
    assert pages == {source.name for source in REGISTRY}
