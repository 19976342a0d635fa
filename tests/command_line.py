"""Run the command line in this process, as a user would, and look at what comes out."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import pytest

from truepose.cli import run

MACHINES = Path(__file__).parent.parent / "machines"
PLANAR = MACHINES / "planar_two_slider.toml"


@dataclass(frozen=True)
class Outcome:
    """What one call of the command line gave."""

    code: int
    out: str
    err: str

    @property
    def codes(self) -> list[str]:
        """Codes of the problems on stderr, in their order."""
        return re.findall(r"error\[([a-z0-9-]+)\]", self.err)


def call(capsys: pytest.CaptureFixture[str], *arguments: object) -> Outcome:
    """`truepose ARGUMENTS...` -> exit code, stdout and stderr."""
    capsys.readouterr()
    code = run([str(argument) for argument in arguments])
    captured = capsys.readouterr()
    return Outcome(code, captured.out, captured.err)
