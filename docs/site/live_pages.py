"""Live pages of the machines of the library, which share one file with the kernel."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import truepose as tp
from truepose.reporting.live import page, part

ROOT = Path(__file__).resolve().parents[2]
KERNEL = "kernel.js"
LISTED = "../machines.html"
"""The page of the gallery with all of them, seen from one."""


def can_be_written() -> bool:
    """Whether the kernel for browsers was built."""
    return part.is_built()


def link(kind: str, name: str) -> str:
    """To the live page of a machine, from the gallery: a page that Sphinx does not know."""
    says = f"{name}, live: move it, warm it, load it"
    return f'<p><a class="live" href="live/{kind}.html">{says}</a></p>'


def write(folder: Path, kinds: Iterable[str]) -> None:
    """Write the page of each kind of machine, and what they share, into a new folder.

    Raises `RequestError` (no-live-kernel).
    """
    folder.mkdir(parents=True)
    (folder / KERNEL).write_text(part.shared_kernel(), encoding="utf-8")
    for kind in kinds:
        machine = tp.load(ROOT / "machines" / f"{kind}.toml")
        page.write_text(page.html(machine, KERNEL, LISTED), folder / f"{kind}.html")
