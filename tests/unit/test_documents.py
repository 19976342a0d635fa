"""What the documents at the top promise: their examples run, their links lead somewhere."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from generators import generator

ROOT = Path(__file__).parent.parent.parent
README = ROOT / "README.md"
DOCUMENTS = [README, *(ROOT / name for name in ("ARCHITECTURE.md", "CONTRIBUTING.md"))]


def test_the_example_of_how_sure_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    text = (ROOT / "docs" / "how_sure.md").read_text("utf-8")
    (example,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    names: dict[str, Any] = {}
    exec(example, names)  # noqa: S102 the page is ours
    assert (names["proven"]["status"] == "proven").all()
    assert names["whole"]["status"] == "proven"
    # What is reached and what is sampled stays within what is proven.
    most = names["proven"]["upper"]
    assert (names["worst"]["exact_upper"] <= most).all()
    assert (names["sampled"]["maximum"] <= most).all()


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_links_and_paths_lead_somewhere(document: Path) -> None:
    text = document.read_text("utf-8")
    links = re.findall(r"\]\(([^):]+)\)", text)
    # <name> in a path stands for a file to come.
    paths = re.findall(r"`((?:python|crates|docs|machines|tests|benchmarks)/[\w./-]+)`", text)
    missing = [path for path in (*links, *paths) if not (ROOT / path).exists()]
    assert links or paths
    assert not missing


def test_the_architecture_is_short_enough_to_be_read() -> None:
    assert len((ROOT / "ARCHITECTURE.md").read_text("utf-8").split()) <= 900


def test_the_picture_of_the_layers_is_fresh() -> None:
    written = (ROOT / "docs" / "architecture.svg").read_text("utf-8")
    assert written == generator("architecture_picture").picture(), (
        "run: python docs/generate_architecture_picture.py"
    )


def test_the_picture_of_the_readme_is_fresh() -> None:
    written = (ROOT / "docs" / "picture.svg").read_text("utf-8")
    drawn = generator("picture").picture()
    number = re.compile(r"\d+(?:\.\d+)?")
    assert number.sub("#", written) == number.sub("#", drawn), "run: make docs"
    # In px and µm; rounding may differ from processor to processor.
    shown = [[float(one) for one in number.findall(text)] for text in (written, drawn)]
    assert shown[0] == pytest.approx(shown[1], abs=0.11), "run: make docs"


def test_every_word_of_the_glossary_lives_somewhere() -> None:
    text = (ROOT / "docs" / "glossary.md").read_text("utf-8")
    rows = re.findall(r"^\| (.+) \| .+ \| (.+) \|$", text, re.MULTILINE)
    paths = [path for _, where in rows for path in re.findall(r"`(.+?)`", where)]
    roots = [ROOT / "python" / "truepose", ROOT / "crates"]
    missing = [
        path
        for path in (one.replace("kernel/", "kernel/src/", 1) for one in paths)
        if not any((root / path).exists() for root in roots)
    ]
    assert len(paths) >= len(rows) - text.count("| word |") > 0
    assert not missing
