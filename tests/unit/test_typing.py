"""What a type checker sees of the package."""

from __future__ import annotations

import re
from pathlib import Path

from mypy import api

SNIPPET = """
import truepose as tp
m = tp.load("machine.toml")
reveal_type(m.inverse([0.0]))
reveal_type(m.forward([0.0], status=True))
tp.plan
tp.bugdet
"""


def test_calls_are_typed_and_unknown_names_are_errors(tmp_path: Path) -> None:
    file = tmp_path / "snippet.py"
    file.write_text(SNIPPET, encoding="utf-8")
    out, _, _ = api.run(["--strict", "--cache-dir", str(tmp_path / "cache"), str(file)])
    lines = {int(line): text for line, text in re.findall(r"snippet\.py:(\d+): (.*)", out)}
    assert "ndarray" in lines[4]
    assert "Any" not in lines[4].partition("ndarray")[0]
    assert "tuple[" in lines[5].lower()
    assert "bugdet" in lines[7]
    assert set(lines) == {4, 5, 7}
