"""Names to come stand in one file."""

from __future__ import annotations

import subprocess

from release import ROOT
from release.names import CITATION

MARKS = ("PLACEHOLDER", "placeholder.invalid")
ABOUT_THEM = {"release/names.py", "tests/unit/release"}
"""Code that looks for the marks."""


def test_no_other_file_has_a_placeholder() -> None:
    command = ["git", "grep", "--untracked", "-lF", *(f"-e{mark}" for mark in MARKS)]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    files = {
        path
        for path in run.stdout.splitlines()
        if not any(path.startswith(about) for about in ABOUT_THEM)
    }
    assert files <= {CITATION}
