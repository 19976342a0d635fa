"""Sentences for people, in their language: English stands in the source, any other is a file.

A message is English text with named places for what differs: `say("{count} poses", count=5)`.
`languages/<code>.po` (gettext's format) has the translations of one language; what it does not
have is said in English. Plural forms and the marks of numbers are Babel's, of the extra `report`;
English needs neither the file nor Babel. Unit symbols are the same in every language.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from io import BytesIO
from typing import TYPE_CHECKING, Any

from truepose.errors import Problem, RequestError

if TYPE_CHECKING:
    from gettext import NullTranslations

ENGLISH = "en"


@dataclass(frozen=True)
class Language:
    """A language: its code, its translations, and the marks of its numbers."""

    code: str
    translations: NullTranslations | None = None
    decimal_mark: str = "."
    group_mark: str = ","


_SPOKEN: ContextVar[Language | None] = ContextVar("language", default=None)


def spoken() -> Language:
    """The language of what is said now."""
    return _SPOKEN.get() or Language(ENGLISH)


def say(message: str, **values: Any) -> str:
    """A message in the language spoken, with `values` in its places."""
    translations = spoken().translations
    text = message if translations is None else translations.gettext(message)
    return text.format(**values) if values else text


def say_counted(singular: str, plural: str, count: int, **values: Any) -> str:
    """A message in the form that goes with a number, which stands at {count}."""
    translations = spoken().translations
    if translations is None:
        text = singular if count == 1 else plural
    else:
        text = translations.ngettext(singular, plural, count)
    return text.format(count=grouped(count), **values)


def grouped(count: int) -> str:
    """A whole number with the language's mark between thousands."""
    return f"{count:,}".replace(",", spoken().group_mark)


def marked(number: str) -> str:
    """A number written with a full stop, with the language's decimal mark."""
    return number.replace(".", spoken().decimal_mark)


def languages() -> tuple[str, ...]:
    """Codes of the languages that there are, English first."""
    folder = files("truepose").joinpath("languages")
    codes = sorted(file.name[:-3] for file in folder.iterdir() if file.name.endswith(".po"))
    return (ENGLISH, *codes)


@contextmanager
def speaking(code: str) -> Iterator[None]:
    """Say everything in the language of this code, within the block.

    Raises `RequestError` (unknown-language) for one that there is not, `ImportError` where the
    language needs Babel and it is not installed.
    """
    before = _SPOKEN.set(_language(code))
    try:
        yield
    finally:
        _SPOKEN.reset(before)


@cache
def _language(code: str) -> Language:
    if code == ENGLISH:
        return Language(ENGLISH)
    if code not in languages():
        raise RequestError(
            Problem(
                "unknown-language",
                "there is no such language",
                found=code,
                expected=", ".join(languages()),
            )
        )
    from gettext import GNUTranslations

    from babel import Locale
    from babel.messages.mofile import write_mo
    from babel.messages.pofile import read_po

    compiled = BytesIO()
    with files("truepose").joinpath("languages", f"{code}.po").open("rb") as file:
        write_mo(compiled, read_po(file, locale=code))
    compiled.seek(0)
    symbols = Locale.parse(code).number_symbols
    marks = symbols.get("latn", symbols)
    return Language(code, GNUTranslations(compiled), marks["decimal"], marks["group"])


__all__ = [
    "ENGLISH",
    "Language",
    "grouped",
    "languages",
    "marked",
    "say",
    "say_counted",
    "speaking",
    "spoken",
]
