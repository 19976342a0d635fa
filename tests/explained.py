"""Runs the example of an explanation, in a folder of its own, and says which codes it gives."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

from command_line import call
from truepose.errors import TrueposeError
from truepose.explanations import Example

_GIVEN = re.compile(r"(?:error|warning|looks odd)\[([a-z0-9-]+)\]")
_IN_JSON = re.compile(r'"(?:code|status)": "([a-z0-9_-]+)"')


def codes_of(example: Example, folder: Path, capsys: pytest.CaptureFixture[str]) -> list[str]:
    """Codes that the last step of the example gives; `folder` is the current one."""
    if example.needs_machine:
        assert call(capsys, "init", example.machine, "-o", "machine.toml").code == 0
        file = folder / "machine.toml"
        # Whoever changes lines reads past the comments between them.
        lines = file.read_text("utf-8").splitlines(keepends=True)
        text = "".join(line for line in lines if not line.startswith("#"))
        for old, new in example.changes:
            assert old in text, f"{old!r} is not in machine.toml"
            text = text.replace(old, new, 1)
        file.write_text(text, "utf-8")
    for name, content in example.all_files().items():
        (folder / name).write_text(content, "utf-8")
    if example.python:
        return _codes_of_python(example.python, capsys)
    outcome = None
    for command in example.commands:
        outcome = call(capsys, *shlex.split(command))
    assert outcome is not None
    return [
        *_GIVEN.findall(outcome.out + outcome.err),
        *_IN_JSON.findall(outcome.out + outcome.err),
    ]


def _codes_of_python(script: str, capsys: pytest.CaptureFixture[str]) -> list[str]:
    capsys.readouterr()
    try:
        exec(script, {"__name__": "__main__"})  # noqa: S102  the examples are ours
    except TrueposeError as error:
        return [problem.code for problem in error.problems]
    return capsys.readouterr().out.split()
