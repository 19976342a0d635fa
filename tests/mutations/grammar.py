"""Spoil a text by its tokens, the same for the same seed."""

from __future__ import annotations

import random
import re

TOKEN = re.compile(r'"[^"\n]*+"|[A-Za-z_]++|[+-]?[0-9.]++(?:[eE][+-]?[0-9]++)?+|\n|[ \t]++|.')

NUMBERS = [
    *("0", "-1", "1e308", "-1e308", "1e-308", "5e-324", "nan", "inf", "-inf", "1e400", "0x10"),
    *("1_000", "1.5.2", "1,5", "00", "9" * 30, "9" * 500, "1e18", "-0.0", "0.1", "1e50", "1e51"),
    "2147483648",
]
TEXTS = [
    *("", " ", "x", "*", ".", "strut.*", "d1", "1 m", "12 mm/", "1e400 mm", "m" * 300, "((((", "e"),
    *("1 (((99^99)^99)^99)^99 m", "1" + " " * 500 + "m", "\\u0000", "\\u001b[31m", "\\u202e", "µ"),
    *("±0.1 mm", "+-1 mm", "IT7", "5 %", "-5 %", "1/0", "1 mm / 0 mm", "default", "../x", "degC"),
    "/dev/null",
]
MARKS = [
    *(
        "[",
        "]",
        "{",
        "}",
        "[[",
        "]]",
        "=",
        ",",
        ";",
        ".",
        '"',
        "'",
        '"""',
        "#",
        "#:",
        "\\",
        "(",
        ")",
    ),
    *("\x00", "\x1b", "\t", "\r", "\n", "\u2028", "\ufeff", "é", "%", "-", "+", "|"),
]


def spoilt(text: str, numbers: random.Random) -> str:
    """The text after one to four mutations."""
    tokens = TOKEN.findall(text)
    for _ in range(numbers.choice((1, 1, 1, 2, 2, 3, 4))):
        if not tokens:
            break
        if numbers.random() < 0.25:
            tokens = _lines(tokens, numbers)
        else:
            _one(tokens, numbers)
    return "".join(tokens)


def _one(tokens: list[str], numbers: random.Random) -> None:
    """Spoil one token, most often one that says something."""
    at = numbers.randrange(len(tokens))
    for _ in range(3):
        if tokens[at].strip():
            break
        at = numbers.randrange(len(tokens))
    what = numbers.randrange(12)
    if what == 0:
        del tokens[at]
    elif what == 1:
        tokens.insert(at, tokens[at])
    elif what == 2:
        other = numbers.randrange(len(tokens))
        tokens[at], tokens[other] = tokens[other], tokens[at]
    elif what == 3:
        tokens[at] = numbers.choice(MARKS)
    elif what == 4:
        tokens.insert(at, numbers.choice(MARKS) * numbers.choice((1, 1, 2, 60, 3000)))
    elif what == 5:
        tokens[at] = tokens[at] * numbers.choice((2, 10, 1000))
    else:
        tokens[at] = _other(tokens[at], tokens, numbers)


def _other(token: str, tokens: list[str], numbers: random.Random) -> str:
    """Another token of the same kind."""
    if token.startswith('"'):
        return '"' + numbers.choice((*TEXTS, *NUMBERS)) + '"'
    if token[0].isdigit() or token[0] in "+-.":
        return numbers.choice((*NUMBERS, *(f'"{text}"' for text in TEXTS)))
    if token[0].isalpha():
        words = [word for word in tokens if word[0].isalpha()]
        return numbers.choice(words)
    return numbers.choice((*NUMBERS, *MARKS))


def _lines(tokens: list[str], numbers: random.Random) -> list[str]:
    """Leave out, double, move or cut a line."""
    lines = "".join(tokens).split("\n")
    at, other = numbers.randrange(len(lines)), numbers.randrange(len(lines))
    what = numbers.randrange(5)
    if what == 0:
        del lines[at]
    elif what == 1:
        lines.insert(at, lines[other])
    elif what == 2:
        lines[at], lines[other] = lines[other], lines[at]
    elif what == 3:
        lines[at] = lines[at][: numbers.randrange(len(lines[at]) + 1)]
    else:
        lines = lines[:at] or [""]
    return TOKEN.findall("\n".join(lines))
