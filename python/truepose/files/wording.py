"""Words for messages: the nearest to one that is not known, lists, counts."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches


def nearest(word: str, possible: Iterable[str]) -> str | None:
    """The possible word that `word` most likely means, or None."""
    words = {word.lower(): word for word in possible}
    near = get_close_matches(word.lower(), words, n=1, cutoff=0.6)
    return words[near[0]] if near else None


def did_you_mean(word: str, possible: Iterable[str]) -> str | None:
    """`did you mean "length"?`, or None where nothing is near."""
    near = nearest(word, possible)
    return None if near is None else f'did you mean "{near}"?'


def one_of(words: Iterable[str], *, limit: int = 24) -> str:
    """`one of a, b, c` for people, cut short where there are many."""
    every = list(words)
    shown = ", ".join(every[:limit]) + (", ..." if len(every) > limit else "")
    return shown if len(every) == 1 else f"one of {shown}"


def counted(number: int, word: str) -> str:
    """`1 strut`, `2 struts`."""
    return f"{number} {word}" if number == 1 else f"{number} {word}s"
