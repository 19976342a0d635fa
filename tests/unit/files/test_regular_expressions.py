"""Regular expressions that read what people wrote give nothing back: no text takes them long."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parent.parent.parent.parent / "python" / "truepose"
READERS = (
    "files",
    "machine",
    "calibration/measurements",
    "calibration/planning",
    "calibration/result",
    "controllers/gcode",
    "cli",
)
"""The packages that read text of users."""


def patterns() -> Iterator[tuple[str, str]]:
    """(where, pattern) of every call of `re` in them."""
    for folder in READERS:
        for path in sorted((PACKAGE / folder).rglob("*.py")):
            for node in ast.walk(ast.parse(path.read_text("utf-8"))):
                if (
                    isinstance(node, ast.Call)
                    and isinstance(node.func, ast.Attribute)
                    and isinstance(node.func.value, ast.Name)
                    and node.func.value.id == "re"
                    and node.func.attr != "escape"
                ):
                    yield f"{path.relative_to(PACKAGE)}:{node.lineno}", written(node.args[0])


def written(node: ast.expr) -> str:
    """The pattern of a call; what an f-string puts in is a bound."""
    if isinstance(node, ast.JoinedStr):
        return "".join(written(part) for part in node.values)
    if isinstance(node, ast.FormattedValue):
        return "9"
    assert isinstance(node, ast.Constant)
    return str(node.value)


CLASS = re.compile(r"\\.|\[\^?\]?(?:\\.|[^\]\\])*+\]")
KEEPS = re.compile(r"(?:[*+?]|\{\d*,?\d*\})\+")
ENDLESS = re.compile(r"[*+]|\{\d*,\}")


def gives_back(pattern: str) -> bool:
    """Whether a repeat without an end may try again with less."""
    plain = CLASS.sub("x", pattern)  # what is escaped or in a class repeats nothing
    return ENDLESS.search(KEEPS.sub("", plain)) is not None


@pytest.mark.parametrize(
    ("where", "pattern"), list(patterns()), ids=lambda text: text.split(":")[0]
)
def test_a_pattern_gives_nothing_back(where: str, pattern: str) -> None:
    assert not gives_back(pattern), where


@pytest.mark.parametrize("pattern", [r"\s*x", "[^(]*?", "(a+)+", "x{2,}", r"(?:\d+)?", r"[\]+]+"])
def test_one_that_does_is_found(pattern: str) -> None:
    assert gives_back(pattern)


@pytest.mark.parametrize("pattern", [r"\s*+x", r"a\+", "[+*]", "x{1,60}", r"(?:\d++\.?)?+"])
def test_one_that_does_not_is_taken(pattern: str) -> None:
    assert not gives_back(pattern)
