"""What the documents at the top promise: their examples run, their links lead somewhere."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parent.parent.parent
README = ROOT / "README.md"
DOCUMENTS = [README, *(ROOT / name for name in ("ARCHITECTURE.md", "CONTRIBUTING.md"))]


def blocks(language: str) -> list[str]:
    """The README's code blocks of one language."""
    return re.findall(rf"```{language}\n(.*?)```", README.read_text("utf-8"), re.DOTALL)


def test_the_python_example_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    (example,) = blocks("python")
    names: dict[str, object] = {}
    exec(example, names)  # noqa: S102 the README is ours
    machine, budget, corrected = names["m"], names["budget"], names["corrected"]
    assert machine.forward(names["q"]) == pytest.approx([0.3, 0.2], abs=1e-12)
    assert budget.sizes["pose"] == corrected.sizes["pose"] == len(machine.poses())


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
