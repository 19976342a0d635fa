"""What users may rely on by name is what it was; see tests/house/public_names.py."""

from __future__ import annotations

import difflib
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

from sweeps import sweep

SCRIPT = Path(__file__).parents[1] / "house" / "public_names.py"


@sweep
def test_public_names(tmp_path: Path, golden: Callable[[str, str], str]) -> None:
    """To change one on purpose: `pytest tests/golden/test_public_names.py --update-golden`."""
    written = tmp_path / "public_names.txt"
    environment = {**os.environ, "PYTHONPATH": str(SCRIPT.parents[1])}
    subprocess.run([sys.executable, SCRIPT, written], check=True, env=environment)
    found = written.read_text(encoding="utf-8")
    expected = golden("public_names.txt", found)
    changes = [
        line
        for line in difflib.unified_diff(
            expected.splitlines(), found.splitlines(), "expected", "found", lineterm="", n=0
        )
        if not line.startswith("@@")
    ]
    shown = "\n".join(changes[:60])
    assert not changes, (
        f"public names differ; where that is wanted, write them anew with "
        f"`pytest tests/golden/test_public_names.py --update-golden`:\n{shown}"
    )
