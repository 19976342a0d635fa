"""What an editor of the user's own configuration says: an edit a line, or why there is none."""

from __future__ import annotations

from dataclasses import dataclass

from truepose.controllers._reader import ControllerFile
from truepose.errors import Fault, RequestError


@dataclass(frozen=True)
class Edit:
    """What becomes of a line of a file, from 1: its new text, or lines `below` it, 0 the top."""

    file: ControllerFile
    line: int
    text: str | None = None
    below: tuple[str, ...] = ()


def no_difference(message: str, found: str, expected: str, hint: str | None = None) -> RequestError:
    """The refusal of a file, or of a controller, of which no lines can be told."""
    return RequestError(Fault("no-difference", message, found, expected, hint).at())


def same_number(one: str, other: str) -> bool:
    """Whether two texts are one number, or one list of them: a line that says it stays."""
    if one == other:
        return True
    try:
        pairs = zip(one.split(":"), other.split(":"), strict=True)
        return all(float(a) == float(b) for a, b in pairs)
    except ValueError:
        return False


__all__ = ["Edit", "no_difference", "same_number"]
