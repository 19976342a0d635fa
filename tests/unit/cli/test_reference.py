"""docs/command_line.md is what the commands say of themselves."""

from __future__ import annotations

from generators import DOCS, generator


def test_the_page_is_not_stale() -> None:
    written = (DOCS / "command_line.md").read_text(encoding="utf-8")
    assert written == generator("command_line").page(), "run: python docs/generate_command_line.py"
