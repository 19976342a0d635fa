"""Write docs/architecture.svg, the layers of the package and of the crates, from what checks them.

Run `python docs/generate_architecture_picture.py` after a change of the layers in pyproject.toml or
of the first line of a package's docstring; a test refuses a picture that is not what this writes.
"""

from __future__ import annotations

import ast
import re
import textwrap
import tomllib
from pathlib import Path
from typing import NamedTuple
from xml.sax.saxutils import escape

ROOT = Path(__file__).parent.parent
PACKAGE = ROOT / "python" / "truepose"

# All in pixels. A character is as wide as the widest usual fonts have it, on average.
WIDTH = 960
MARGIN = 24
ARROW = 48  # room at the left for the arrow
GAP = 10  # between boxes
PAD = 12  # between a box and its text
LINE = 17
CHARACTER = 6.9
NAME = 20  # height of a name above its words
ASIDE = 190  # width of a name beside its words

STYLE = """\
    text { font-family: system-ui, "Segoe UI", Helvetica, Arial, sans-serif; fill: #22303c }
    .name { font-size: 15px; font-weight: 600 }
    .words { font-size: 13px; fill: #4a5a68 }
    .heading { font-size: 13px; font-weight: 600; fill: #4a5a68 }
    .python { fill: #e8f0f8; stroke: #6f94b8 }
    .rust { fill: #f8eee4; stroke: #bd8f5f }
    .arrow { stroke: #4a5a68; stroke-width: 2; fill: none }
    .head { fill: #4a5a68 }"""


class Room(NamedTuple):
    """What a box shows: a module, package or crate, and its own first words."""

    name: str
    words: str


def first_sentence(text: str) -> str:
    """The first paragraph of a docstring on one line, without marks of code."""
    return " ".join(text.strip().split("\n\n")[0].split()).replace("`", "")


def package_layers() -> list[list[Room]]:
    """The layers of the import-linter contract, from the top; siblings side by side."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    (contract,) = (
        one for one in settings["tool"]["importlinter"]["contracts"] if one["type"] == "layers"
    )
    return [[room(name.strip()) for name in layer.split("|")] for layer in contract["layers"]]


def room(name: str) -> Room:
    """A module or package of truepose."""
    package, module = PACKAGE / name / "__init__.py", PACKAGE / f"{name}.py"
    tree = ast.parse((package if package.exists() else module).read_text("utf-8"))
    return Room(name, first_sentence(ast.get_docstring(tree) or ""))


def crate_layers() -> list[list[Room]]:
    """The crates, each above all that it depends on."""
    needs: dict[str, set[str]] = {}
    for path in sorted((ROOT / "crates").glob("*/Cargo.toml")):
        crate = tomllib.loads(path.read_text("utf-8"))
        dependencies = crate.get("dependencies", {}).values()
        paths = {one["path"] for one in dependencies if isinstance(one, dict) and "path" in one}
        needs[path.parent.name] = {Path(one).name for one in paths}
    layers = []
    while needs:
        needed = set().union(*needs.values())
        top = [name for name in needs if name not in needed]
        if not top:
            raise ValueError(f"crates need each other: {', '.join(needs)}")
        layers.append([crate_room(name) for name in top])
        needs = {name: used for name, used in needs.items() if name not in top}
    return layers


def crate_room(name: str) -> Room:
    """A crate, with the first paragraph of its own description."""
    source = (ROOT / "crates" / name / "src" / "lib.rs").read_text("utf-8")
    lines = re.findall(r"^//! ?(.*)$", source, re.MULTILINE)
    return Room(f"crates/{name}", first_sentence("\n".join(lines)))


def drawn(layers: list[list[Room]], kind: str, top: int) -> tuple[list[str], int]:
    """Boxes of the layers from `top` down, and where they end."""
    parts = []
    left, right = MARGIN + ARROW, WIDTH - MARGIN
    for layer in layers:
        width = (right - left - GAP * (len(layer) - 1)) // len(layer)
        # Alone in its layer a box is wide: its words stand beside its name.
        across, down = (ASIDE, 0) if len(layer) == 1 else (0, NAME)
        characters = int((width - 2 * PAD - across) / CHARACTER)
        texts = [textwrap.wrap(one.words, characters) for one in layer]
        height = 2 * PAD + down + LINE * max(map(len, texts)) - 2
        for place, (one, lines) in enumerate(zip(layer, texts, strict=True)):
            x = left + place * (width + GAP)
            size = f'width="{width}" height="{height}" rx="5"'
            parts.append(f'  <rect class="{kind}" x="{x}" y="{top}" {size}/>')
            parts.append(text("name", x + PAD, top + PAD + 13, one.name))
            for number, line in enumerate(lines):
                y = top + PAD + down + 13 + LINE * number
                parts.append(text("words", x + PAD + across, y, line))
        top += height + GAP
    return parts, top - GAP


def text(kind: str, x: int, y: int, words: str, more: str = "") -> str:
    """One line of text."""
    return f'  <text class="{kind}" x="{x}" y="{y}"{more}>{escape(words)}</text>'


def arrow(top: int, bottom: int, words: str) -> list[str]:
    """An arrow down at the left, with words along it."""
    x = MARGIN + ARROW // 2 + 8
    middle = (top + bottom) // 2
    turned = f' text-anchor="middle" transform="rotate(-90 {x - 12} {middle})"'
    return [
        f'  <path class="arrow" d="M {x} {top} V {bottom - 10}"/>',
        f'  <path class="head" d="M {x - 7} {bottom - 12} h 14 l -7 12 z"/>',
        text("heading", x - 12, middle, words, turned),
    ]


def picture() -> str:
    """The text of docs/architecture.svg."""
    left, top = MARGIN + ARROW, MARGIN
    parts = [text("heading", left, top + 10, "python/truepose")]
    boxes, bottom = drawn(package_layers(), "python", top + 22)
    parts += [*boxes, *arrow(top + 22, bottom, "imports only what stands below")]
    top = bottom + 26
    parts.append(text("heading", left, top + 10, "Rust, reached through truepose._kernel"))
    boxes, bottom = drawn(crate_layers(), "rust", top + 22)
    parts += [*boxes, *arrow(top + 22, bottom, "depends on")]
    height = bottom + MARGIN
    return "\n".join(
        [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}"'
            f' width="{WIDTH}" height="{height}" role="img">',
            "  <!-- Written by `python docs/generate_architecture_picture.py`; do not edit. -->",
            "  <title>The layers of truepose: each imports only what stands below it</title>",
            f"  <style>\n{STYLE}\n  </style>",
            f'  <rect width="{WIDTH}" height="{height}" fill="#ffffff"/>',
            *parts,
            "</svg>\n",
        ]
    )


if __name__ == "__main__":
    (Path(__file__).parent / "architecture.svg").write_text(picture(), encoding="utf-8")
    print("docs/architecture.svg")
