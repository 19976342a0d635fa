"""Every public name does what it is for, also when all submodules have been imported before."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import truepose

CALLS = Path(__file__).with_name("public_calls.py")
"""What is called, and how: a new public name needs a use there."""


def test_every_public_name_is_what_it_should_be_after_all_imports() -> None:
    package = Path(truepose.__file__).parents[1]
    done = subprocess.run(
        [sys.executable, str(CALLS)],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": str(package)},
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.split("\n")[1:-1] == truepose.__all__
