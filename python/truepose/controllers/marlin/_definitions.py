"""Marlin's Configuration.h: which names it defines, and what their values are.

As much of C's preprocessor as such a file needs: comments, lines that are continued, `#define`,
`#undef`, conditions with Marlin's own ENABLED, DISABLED, ANY and so on, and constant arithmetic,
in which whole numbers divide as in C. Source: https://marlinfw.org/docs/configuration/configuration.html.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from decimal import Decimal, DivisionByZero, InvalidOperation, Overflow
from itertools import islice
from typing import NamedTuple

DEEPEST = 40
"""Names that lead to names, and parentheses in each other."""

LONGEST = 2000
"""Characters of a value that is computed."""

MOST_LISTED = 8
"""Of a list in braces: one for each axis."""

_DEFINED = "defined"

MOST_NAMES = 2000
"""Names that the value of one leads to, in all."""

_COMMENT = re.compile(r'"(?:[^"\\\n]|\\.)*+"|//[^\n]*+|/\*(?s:.*?)(?:\*/|\Z)')
_DIRECTIVE = re.compile(r"\s*+#\s*+([a-z]++)\b(.*+)", re.DOTALL)
_DEFINE = re.compile(r"\s*+([A-Za-z_]\w*+)(\([^)]*+\))?(.*+)", re.DOTALL)
_TOKEN = re.compile(
    r"\s*+(?:(?P<number>(?:\d++\.?\d*+|\.\d++)(?:[eE][+-]?\d++)?)[fFlLuU]*+"
    r"|(?P<name>[A-Za-z_]\w*+)|(?P<mark>&&|\|\||[=!<>]=|[-+*/!<>(),]))"
)


class NotComputedError(Exception):
    """A value that is no constant of numbers; the reason in words."""


class Constant(NamedTuple):
    """A constant; `whole` where C has an integer of it."""

    value: Decimal
    whole: bool


@dataclass(frozen=True)
class Definition:
    """What a name stands for, as written, and the line of its `#define`.

    `doubt`: the line of a condition about it that is not understood, None without one.
    """

    text: str
    line: int
    doubt: int | None = None


@dataclass
class Definitions:
    """Names as they stand at the end of a file."""

    of: dict[str, Definition] = field(default_factory=dict)

    def enabled(self, name: str) -> bool:
        """Marlin's ENABLED: defined, and as nothing, 1 or true."""
        definition = self.of.get(name)
        return definition is not None and definition.text in ("", "1", "true")

    def number(self, text: str) -> Decimal:
        """A constant's value. Raises `NotComputedError`."""
        return _Expression(text, self.of).whole_text().value

    def numbers(self, text: str) -> list[Decimal]:
        """The first constants of `{ 1, 2, 3 }`. Raises `NotComputedError`."""
        inside = text.strip()
        if not (inside.startswith("{") and inside.endswith("}")):
            raise NotComputedError("not a list in braces")
        return [self.number(part) for part in islice(_parts(inside[1:-1]), MOST_LISTED)]


def definitions(text: str) -> Definitions:
    """The definitions of a file; where a condition is not understood both of its ways are taken."""
    known = Definitions()
    branches: list[_Branch] = []
    for line, number in _lines(text):
        match = _DIRECTIVE.match(line)
        if match is None:
            continue
        word, rest = match[1], match[2].strip()
        if word in ("if", "ifdef", "ifndef"):
            outer = not branches or branches[-1].active
            branches.append(_Branch(outer, doubt=branches[-1].doubt if branches else None))
            branches[-1].turn(_holds(word, rest, known) if outer else False, number)
        elif word == "elif" and branches:
            now = branches[-1]
            now.turn(_holds("if", rest, known) if now.open else False, number)
        elif word == "else" and branches:
            branches[-1].turn(True, number)
        elif word == "endif" and branches:
            branches.pop()
        elif not branches or branches[-1].active:
            if word == "define" and (name := _DEFINE.match(rest)):
                doubt = branches[-1].doubt if branches else None
                known.of[name[1]] = Definition(name[3].strip(), number, doubt)
            elif word == "undef":
                known.of.pop(rest, None)
    return known


@dataclass
class _Branch:
    """`#if` to `#endif`: whether its lines count now, and whether another way is still open.

    `doubt`: the line of its first condition that is not understood, or of one around it.
    """

    reached: bool
    active: bool = False
    doubt: int | None = None
    open: bool = field(init=False)

    def __post_init__(self) -> None:
        self.open = self.reached

    def turn(self, holds: bool | None, line: int) -> None:
        """To the next way; `holds`: its condition, None where it is not understood."""
        if holds is None and self.doubt is None:
            self.doubt = line
        self.active = self.open and holds is not False
        if holds is True:
            self.open = False


def _holds(word: str, rest: str, known: Definitions) -> bool | None:
    """Whether a condition holds; None where it is not understood."""
    if word != "if":
        name = rest.split()[0] if rest else ""
        return (name in known.of) == (word == "ifdef")
    try:
        return _Expression(rest, known.of, known.enabled).whole_text().value != 0
    except NotComputedError:
        return None


class _Expression:
    """Constant arithmetic, by recursive descent."""

    def __init__(
        self,
        text: str,
        of: Mapping[str, Definition],
        enabled: Callable[[str], bool] | None = None,
        depth: int = 0,
        led_to: list[str] | None = None,
    ) -> None:
        """`enabled`: of a condition, in which names without a definition are 0.

        `led_to`: the names so far, of all expressions that this is in.
        """
        if len(text) > LONGEST or depth > DEEPEST:
            raise NotComputedError("too long")
        self._tokens = list(_tokens(text))
        self._at = 0
        self._of, self._enabled, self._depth = of, enabled, depth
        self._led_to = [] if led_to is None else led_to

    def whole_text(self) -> Constant:
        """The value of all of it."""
        try:
            value = self._or()
        except (DivisionByZero, InvalidOperation, Overflow):
            raise NotComputedError("not a number") from None
        if self._at < len(self._tokens):
            raise NotComputedError(f"{self._tokens[self._at]} is not understood")
        return value

    def _next(self) -> str:
        return self._tokens[self._at] if self._at < len(self._tokens) else ""

    def _take(self, *marks: str) -> str:
        """The next token where it is one of these, else nothing."""
        token = self._next()
        if token not in marks:
            return ""
        self._at += 1
        return token

    def _require(self, mark: str) -> None:
        if not self._take(mark):
            raise NotComputedError(f"{mark} is missing")

    def _or(self) -> Constant:
        value = self._and()
        while self._take("||"):
            other = self._and()
            value = _truth(value.value != 0 or other.value != 0)
        return value

    def _and(self) -> Constant:
        value = self._comparison()
        while self._take("&&"):
            other = self._comparison()
            value = _truth(value.value != 0 and other.value != 0)
        return value

    def _comparison(self) -> Constant:
        value = self._sum()
        while mark := self._take("==", "!=", "<=", ">=", "<", ">"):
            a, b = value.value, self._sum().value
            value = _truth(
                {"==": a == b, "!=": a != b, "<=": a <= b, ">=": a >= b, "<": a < b, ">": a > b}[
                    mark
                ]
            )
        return value

    def _sum(self) -> Constant:
        value = self._product()
        while mark := self._take("+", "-"):
            other = self._product()
            total = value.value + other.value if mark == "+" else value.value - other.value
            value = Constant(total, value.whole and other.whole)
        return value

    def _product(self) -> Constant:
        value = self._unary()
        while mark := self._take("*", "/"):
            other = self._unary()
            whole = value.whole and other.whole
            if mark == "*":
                value = Constant(value.value * other.value, whole)
            elif whole:
                value = Constant(Decimal(value.value // other.value), True)
            else:
                value = Constant(value.value / other.value, False)
        return value

    def _unary(self) -> Constant:
        self._depth += 1
        if self._depth > DEEPEST:
            raise NotComputedError("too deep")
        try:
            if mark := self._take("-", "+", "!"):
                inner = self._unary()
                if mark == "!":
                    return _truth(inner.value == 0)
                return inner if mark == "+" else Constant(-inner.value, inner.whole)
            return self._single()
        finally:
            self._depth -= 1

    def _single(self) -> Constant:
        if self._take("("):
            value = self._or()
            self._require(")")
            return value
        token = self._next()
        self._at += 1
        if not token:
            raise NotComputedError("nothing")
        if token[0].isdigit() or token[0] == ".":
            return Constant(Decimal(token), token.isdigit())
        if not (token[0].isalpha() or token[0] == "_"):
            raise NotComputedError(f"{token} is not understood")
        if self._enabled is not None and token == _DEFINED:
            return self._defined()
        if self._next() == "(":
            return self._call(token)
        return self._named(token)

    def _defined(self) -> Constant:
        inside = bool(self._take("("))
        name = self._next()
        self._at += 1
        if inside:
            self._require(")")
        return _truth(name in self._of)

    def _named(self, name: str) -> Constant:
        definition = self._of.get(name)
        if name in ("true", "false"):
            return _truth(name == "true")
        if definition is None:
            if self._enabled is not None:
                return Constant(Decimal(0), True)
            raise NotComputedError(f"{name} is not defined in this file")
        if definition.text == "" and self._enabled is not None:
            return Constant(Decimal(0), True)
        self._led_to.append(name)
        if len(self._led_to) > MOST_NAMES:
            raise NotComputedError("too many names")
        return _Expression(
            definition.text, self._of, self._enabled, self._depth + 1, self._led_to
        ).whole_text()

    def _call(self, name: str) -> Constant:
        self._require("(")
        if name in ("double", "float", "int"):
            value = self._or()
            self._require(")")
            return Constant(value.value, name == "int" and value.whole)
        names = [self._next()]
        self._at += 1
        while self._take(","):
            names.append(self._next())
            self._at += 1
        self._require(")")
        if self._enabled is None:
            raise NotComputedError(f"{name}() is not understood")
        on = [self._enabled(each) for each in names]
        answers = {
            "ENABLED": all(on),
            "ALL": all(on),
            "BOTH": all(on),
            "ANY": any(on),
            "EITHER": any(on),
            "DISABLED": not any(on),
            "NONE": not any(on),
        }
        if name not in answers:
            raise NotComputedError(f"{name}() is not understood")
        return _truth(answers[name])


def _truth(holds: bool) -> Constant:
    return Constant(Decimal(int(holds)), True)


def _tokens(text: str) -> Iterator[str]:
    at = 0
    plain = text.strip()
    while at < len(plain):
        match = _TOKEN.match(plain, at)
        if match is None:
            raise NotComputedError(f"{plain[at : at + 12]} is not understood")
        yield match["number"] or match["name"] or match["mark"]
        at = match.end()


def _parts(inside: str) -> Iterator[str]:
    """What stands between the commas that are in no parentheses."""
    depth, begun = 0, 0
    for at, character in enumerate(inside):
        depth += (character == "(") - (character == ")")
        if character == "," and depth == 0:
            yield inside[begun:at]
            begun = at + 1
    if inside[begun:].strip():
        yield inside[begun:]


def _lines(text: str) -> Iterator[tuple[str, int]]:
    """Lines without comments, continued ones as one, each with the number of its first."""

    def without(match: re.Match[str]) -> str:
        return match[0] if match[0].startswith('"') else "\n" * match[0].count("\n") or " "

    parts: list[str] = []
    first = 1
    for number, line in enumerate(_COMMENT.sub(without, text).split("\n"), start=1):
        if not parts:
            first = number
        plain = line.rstrip()
        continued = plain.endswith("\\")
        parts.append(plain[:-1] if continued else plain)
        if not continued:
            yield " ".join(parts), first
            parts = []
    if parts:
        yield " ".join(parts), first


__all__ = ["Definition", "Definitions", "NotComputedError", "definitions"]
