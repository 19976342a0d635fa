"""Numbers as they are printed in a controller's file, kept digit by digit."""

from __future__ import annotations

import re
from decimal import Decimal

LARGEST = Decimal(10) ** 9
"""Beyond it no number of a machine is, whatever its unit."""

_NUMBER = re.compile(r"[+-]?(?:\d{1,30}(?:\.\d{0,30})?|\.\d{1,30})(?:[eE][+-]?\d{1,2})?")


def decimal_of(text: str) -> Decimal | None:
    """The number that a text is, or None where it is none, or one of no size that anything has."""
    if not _NUMBER.fullmatch(text):
        return None
    value = Decimal(text)
    return value if abs(value) <= LARGEST else None


def plain(value: Decimal) -> str:
    """A number with all its digits and without an exponent, as TOML and CSV take it."""
    text = f"{value:f}"
    return text.rstrip("0").rstrip(".") or "0" if "." in text else text


def numbers_of(text: str) -> list[Decimal]:
    """The numbers of a text with blanks or commas between them; none where one cannot be read."""
    values = [decimal_of(part) for part in text.replace(",", " ").split()]
    known = [value for value in values if value is not None]
    return known if len(known) == len(values) else []


__all__ = ["LARGEST", "decimal_of", "numbers_of", "plain"]
