"""Which characters a name may hold: it stands in tables, files and programs, and on a terminal."""

from __future__ import annotations

import unicodedata

from truepose.files.limits import LONGEST_NAME

_BAD = {
    "Cc": "a control character",
    "Cf": "a character that is not seen",
    "Cs": "half a character",
    "Zl": "a line separator",
    "Zp": "a line separator",
}
"""Categories of Unicode that no name has: on a terminal they write other text than stands there, or
turn its order (Unicode Standard Annex 9)."""


def fault_of_name(name: str) -> str | None:
    """Why this can be no name, for people: "a control character, U+001B"; None where it can."""
    if not name.strip():
        return "nothing but spaces" if name else "nothing"
    if len(name) > LONGEST_NAME:
        return f"{len(name)} characters"
    for character in name:
        bad = _BAD.get(unicodedata.category(character))
        if bad is not None:
            return f"{bad}, U+{ord(character):04X}"
    return None
