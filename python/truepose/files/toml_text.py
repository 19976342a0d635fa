"""TOML text -> its data, and where each key stands; or why it is none, and in which line."""

from __future__ import annotations

import re
import tomllib
from typing import Any

from truepose._kernel import toml_lines
from truepose.files.limits import DEEPEST_NESTING, LONGEST_TOML, MOST_DIGITS

_PLACE = re.compile(r"\(at (?:line (\d++), column \d++|end of document)\)\Z")
"""At the end of the standard library's messages."""

# What bounds the work of reading it; text in quotation marks and comments count for nothing.
_TOKEN = re.compile(
    r"""
    (?P<quoted>
        "{3}(?:[^"\\]|\\.|"(?!""))*+"{3,5} | '{3}(?:[^']|'(?!''))*+'{3,5}
      | "(?:[^"\\\n]|\\.)*+" | '[^'\n]*+' )
  | (?P<comment> \#[^\n]*+ )
  | (?P<word> [A-Za-z0-9_+-]++ )
  | (?P<blank> [ \t]++ )
  | (?P<dot> \. )
  | (?P<open> [\[{] )
  | (?P<close> [\]}] )
  | (?P<other> . )
    """,
    re.VERBOSE | re.DOTALL,
)


class TomlError(Exception):
    """Text that is not TOML, or `too_much` of it; `line` from 1, None where it is not known."""

    def __init__(self, reason: str, line: int | None, *, too_much: bool = False) -> None:
        super().__init__(reason)
        self.reason = reason
        self.line = line
        self.too_much = too_much


def parse_toml(text: str) -> dict[str, Any]:
    """The data of a TOML document. Raises `TomlError`."""
    _require_bounded(text)
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        reason = str(error)
        match = _PLACE.search(reason)
        if match is None:
            raise TomlError(reason, None) from None
        line = int(match[1]) if match[1] else text.rstrip("\n").count("\n") + 1
        raise TomlError(reason[: match.start()].rstrip(), line) from None
    except ValueError as error:  # of a date or a time that there is not
        raise TomlError(str(error), None) from None


def lines_of(text: str) -> dict[tuple[str | int, ...], int]:
    """The line, from 1, of every key and list item of a document that `parse_toml` has read."""
    try:
        return dict(toml_lines(text))
    except ValueError:
        # The two parsers differ in some corner of TOML. The text is still good, without lines.
        return {}


def _require_bounded(text: str) -> None:
    """Raise `TomlError` where reading would take long, or more depth than there is."""
    if len(text) > LONGEST_TOML:
        raise TomlError(f"more than {LONGEST_TOML:,} characters", None, too_much=True)
    depth = dots = 0
    for match in _TOKEN.finditer(text):
        kind = match.lastgroup
        if kind in ("other", "comment"):
            dots = 0
        elif kind == "dot":
            dots += 1
        elif kind == "open":
            depth, dots = depth + 1, 0
        elif kind == "close":
            depth, dots = max(depth - 1, 0), 0
        elif kind == "word" and match.end() - match.start() > MOST_DIGITS:
            raise _too_much(f"a number or key of more than {MOST_DIGITS} characters", match)
        if max(depth, dots) >= DEEPEST_NESTING:
            raise _too_much(f"nested too deeply: {DEEPEST_NESTING} levels or more", match)


def _too_much(reason: str, match: re.Match[str]) -> TomlError:
    return TomlError(reason, match.string.count("\n", 0, match.start()) + 1, too_much=True)
