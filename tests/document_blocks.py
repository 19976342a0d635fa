r"""The code blocks of the documents, and what each is run as.

A block is run by its language: `sh` line by line, `python` as a script, `toml` as a machine file
or as a part of one, `csv` as measurements, a temperature log or a table of a source; `text` that
begins with `$ command` is compared with what the command prints. The blocks of a page share a
folder, which has the checkout's machines/ and examples/. Comments in the page, before a block:

    <!-- first: truepose init hexapod --output mine.toml -->   a command to be run before it
    <!-- copy: machine.toml = machines/hexapod.toml -->        a file of the checkout to be there
    <!-- with: part.ngc = G21\nM2\n -->                          a file to be there
    <!-- not run: why -->                                      the reason to leave the block out
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
LANGUAGES = ("sh", "python", "toml", "csv", "c", "text")
"""Of fenced blocks. `text` without a `$` is a formula or a figure of characters: nothing to run."""

FENCE = re.compile(
    r"^(?P<indent> *)```(?P<language>[^\n`]*)\n(?P<text>.*?)^(?P=indent)```", re.M | re.S
)
COMMENT = re.compile(r"<!-- (first|copy|with|not run): (.+?) -->\n")
INLINE = re.compile(r"`(truepose [a-z][^`]*)`")


@dataclass(frozen=True)
class Block:
    """One fenced block of a page: its first line's number, language and text."""

    page: Path
    line: int
    language: str
    text: str
    first: tuple[str, ...] = ()
    files: dict[str, str] = field(default_factory=dict)
    not_run: str | None = None

    @property
    def is_code(self) -> bool:
        """Whether there is anything to run."""
        return self.language != "text" or self.text.startswith("$ ")

    @property
    def place(self) -> str:
        """Page and line, to be found by."""
        return f"{self.page.relative_to(ROOT)}:{self.line}"


RUN_ELSEWHERE = (ROOT / "docs" / "errors.md",)
"""Its examples are made of what `tests/unit/explanations` runs."""


def pages() -> list[Path]:
    """README, documents beside it, and all of docs/ that is not run elsewhere or by the site."""
    top = [ROOT / name for name in ("README.md", "ARCHITECTURE.md", "CONTRIBUTING.md")]
    docs = sorted(set((ROOT / "docs").rglob("*.md")) - set(RUN_ELSEWHERE))
    return [*top, *(page for page in docs if not is_notebook(page))]


def is_notebook(page: Path) -> bool:
    """Whether the site runs the page: it begins with what Jupytext calls a kernel."""
    return page.read_text("utf-8").startswith("---\nfile_format: mystnb")


def blocks_of(page: Path) -> list[Block]:
    """The fenced blocks of a page in their order."""
    text = page.read_text("utf-8")
    found = []
    end = 0
    for fence in FENCE.finditer(text):
        if fence["language"].startswith("{"):  # what Sphinx is told
            continue
        first: list[str] = []
        files: dict[str, str] = {}
        reason = None
        # Comments count for the block that they stand directly in front of.
        for comment in COMMENT.finditer(text, end, fence.start()):
            if re.search(r"^(?!<!-- ).*\S", text[comment.end() : fence.start()], re.M):
                continue
            word, said = comment.groups()
            if word == "first":
                first.append(said)
            elif word == "copy":
                name, _, source = said.partition(" = ")
                files[name] = (ROOT / source).read_text("utf-8")
            elif word == "with":
                name, _, content = said.partition(" = ")
                files[name] = content.replace("\\n", "\n")
            else:
                reason = said
        line = text.count("\n", 0, fence.start()) + 1
        language, inner = fence["language"].strip(), fence["text"]
        found.append(Block(page, line, language, inner, tuple(first), files, reason))
        end = fence.end()
    return found
