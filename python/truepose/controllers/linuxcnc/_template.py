"""Templates: text files of the package with `@name@` where a value goes."""

from __future__ import annotations

import re
from collections.abc import Mapping
from importlib.resources import files

_PLACE = re.compile(r"@(\w+)@")
_PLAIN = re.compile(r"[^A-Za-z0-9 .,:()+_/-]+")


def filled(name: str, values: Mapping[str, str]) -> str:
    """The template `name` of this package with every `@key@` replaced by its value.

    Raises `KeyError` for a place that has no value.
    """
    template = (files(__package__) / name).read_text(encoding="utf-8")
    return _PLACE.sub(lambda place: values[place.group(1)], template)


def plain(text: str) -> str:
    """Text that means nothing in a comment or a string of C, INI or HAL, on one line."""
    return " ".join(_PLAIN.sub(" ", text).replace("*/", " ").replace("/*", " ").split())


def exact(value: float) -> str:
    """A number with all the digits that a double has, and with a decimal point or exponent."""
    text = repr(float(value))
    return text if any(mark in text for mark in ".en") else f"{text}.0"
