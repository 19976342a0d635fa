"""The pages of docs/decisions: each is in the index, complete, and names what there is."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent.parent
DECISIONS = ROOT / "docs" / "decisions"
INDEX = DECISIONS / "README.md"
PAGES = sorted(set(DECISIONS.glob("*.md")) - {INDEX})
HEADINGS = ["What", "Why", "What else was tried or considered", "Where"]


def indexed() -> list[tuple[str, str]]:
    """Title and file of every line of the index."""
    return re.findall(r"^\* \[(.+)\]\((.+)\)$", INDEX.read_text("utf-8"), re.MULTILINE)


def test_every_page_stands_once_in_the_index_under_its_title() -> None:
    titles = {page.name: page.read_text("utf-8").splitlines()[0] for page in PAGES}
    assert titles
    assert {name: f"# {title}" for title, name in indexed()} == titles
    assert len(indexed()) == len(titles)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_page_has_its_four_parts_and_names_what_exists(page: Path) -> None:
    text = page.read_text("utf-8")
    parts = re.split(r"^\*\*(.+)\.\*\*", text, flags=re.MULTILINE)
    assert parts[1::2] == HEADINGS
    assert all(part.strip() for part in parts[2::2])
    assert len(text.splitlines()) <= 30, "a decision is a short page"
    where = re.findall(r"`(.+?)`", parts[-1])
    assert where
    assert not [path for path in where if not (ROOT / path).exists()]
