"""docs/command_line.md is what the commands say of themselves."""

from __future__ import annotations

import importlib.util
from pathlib import Path

DOCS = Path(__file__).parents[3] / "docs"


def test_the_page_is_not_stale() -> None:
    spec = importlib.util.spec_from_file_location("generate", DOCS / "generate_command_line.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    written = (DOCS / "command_line.md").read_text(encoding="utf-8")
    assert written == module.page(), "run: python docs/generate_command_line.py"
