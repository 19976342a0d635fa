"""Templates of what controllers are given: text with `@name@` where a value goes.

And what may stand in them: text that ends no comment, numbers with all their digits.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from importlib.resources import files

_PLACE = re.compile(r"@(\w+)@")
_UNSAFE = re.compile(r"[^A-Za-z0-9 .,:()+_/-]+")


def template(package: str, name: str) -> str:
    """The text of the template `name` that lies in a package."""
    return (files(package) / name).read_text(encoding="utf-8")


def fill(text: str, values: Mapping[str, str]) -> str:
    """A template with every `@key@` replaced by its value.

    Raises `KeyError` for a place that has no value.
    """
    return _PLACE.sub(lambda place: values[place.group(1)], text)


def one_line(text: str) -> str:
    """Text that means nothing in a comment or a string of C, INI or HAL, on one line."""
    return " ".join(_UNSAFE.sub(" ", text).replace("*/", " ").replace("/*", " ").split())


def exact(value: float) -> str:
    """A number with all the digits that a double has, and with a decimal point or exponent."""
    text = repr(float(value))
    return text if any(mark in text for mark in ".en") else f"{text}.0"
