"""What the names of an export begin with, where the user says it: two machines in one program."""

from __future__ import annotations

import re

from truepose.controllers._export import Option
from truepose.errors import Problem, RequestError

LONGEST_PREFIX = 24
"""Characters: with a point and the longest name of a pin, 22, the 47 that a HAL name may have."""

_FORM = re.compile(r"[a-z][a-z0-9_]*", re.ASCII)


def prefix_option(default: str) -> Option:
    """The option `prefix`; `default` says what names begin with without it."""
    return Option("", f"what all names begin with, for two machines in one; {default}", None)


def prefix_of(controller: str, given: float | str, kept: tuple[str, ...] = ()) -> str:
    """The prefix that was given, or "" where none was.

    Lower case alone, since C's macros have it in upper case. `kept`: words that it cannot be.
    Raises `RequestError` (bad-option).
    """
    prefix = str(given)
    if not prefix:
        return ""
    if prefix in kept:
        found = f"{prefix!r}, the name of a header of C"
    elif len(prefix) > LONGEST_PREFIX:
        found = f"{len(prefix)} characters"
    elif not _FORM.fullmatch(prefix):
        found = repr(prefix)
    else:
        return prefix
    raise RequestError(
        Problem(
            "bad-option",
            f"option prefix of {controller} cannot begin names",
            found=found,
            expected=f"a letter, then letters, digits and _, lower case, at most {LONGEST_PREFIX}",
            hint="prefix=left gives left_inverse in C, and left.enable in HAL",
        )
    )


__all__ = ["LONGEST_PREFIX", "prefix_of", "prefix_option"]
