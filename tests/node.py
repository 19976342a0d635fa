"""JavaScript outside of a browser: the Node.js that Playwright brings along."""

from __future__ import annotations

import shutil
import subprocess
from importlib.util import find_spec
from pathlib import Path

from system_package import missing


def node() -> str:
    """Where Node.js is; skips where there is none."""
    found = find_spec("playwright")
    beside = None if found is None or found.origin is None else Path(found.origin).parent
    driver = None if beside is None else beside / "driver" / "node"
    program = str(driver) if driver is not None and driver.exists() else shutil.which("node")
    if program is None:
        missing("there is no Node.js: pip install 'truepose[dev]'")
    return program


def run_script(script: str) -> str:
    """What a script prints; skips where there is no Node.js."""
    done = subprocess.run(
        [node(), "-"], input=script, capture_output=True, text=True, encoding="utf-8", check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout
