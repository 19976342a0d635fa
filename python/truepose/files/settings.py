"""`--set key=value`: change a value of a machine file before it is validated."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from difflib import get_close_matches
from fnmatch import fnmatchcase
from typing import Any

from truepose.errors import ArgumentError, Problem, RequestError
from truepose.files.document import SEVERAL, Document, Key
from truepose.files.limits import DEEPEST_NESTING, LONGEST_QUANTITY
from truepose.files.toml_text import TomlError, parse_toml
from truepose.files.units import shown_value

_SETTINGS = 'settings, such as ["condition.temperature=30"], or a dict of them'

_QUOTED = re.compile(r"""(["'])([^"']*+)\1""")
"""A part of a path as TOML has it; as names may hold points anyway, the marks say nothing more."""

_COMPONENTS = {"x": 0, "y": 1, "z": 2}


def apply(
    document: Document,
    settings: Mapping[str, str] | Sequence[str],
    free_tables: Collection[str] = (),
) -> None:
    """Write the settings into the document, in order.

    A key is a path: `accuracy.target`, `strut.1.length` (rows by name, `strut.*.length` for all),
    `strut.1.base.x`. In a table of `free_tables` the rest of the path is one key. Quotation marks
    round a key with points may stay. A value is a TOML value; text that is none is taken as a
    string (`501 mm`). Whether a key is one that the file may have is left to validation. Raises
    `RequestError` with all settings that lead nowhere.
    """
    problems: list[Problem] = []
    for path, text in _pairs(settings, problems):
        setting = _shortened(f"{path}={text}")
        document.settings[path] = text
        try:
            if path.count(".") >= DEEPEST_NESTING:
                raise _LeadsNowhereError(
                    "a key of too many parts",
                    f"{path.count('.') + 1} parts",
                    f"at most {DEEPEST_NESTING}",
                )
            value = _value(text)
            for key in _targets(document, path.split("."), free_tables):
                _write(document.data, key, value)
                document.set_keys[key] = setting
        except _LeadsNowhereError as error:
            problems.append(
                Problem(
                    "bad-setting",
                    f"--set {setting}: {error.message}",
                    path=path,
                    found=error.found,
                    expected=error.expected,
                    hint=error.hint,
                )
            )
    if problems:
        raise RequestError(*problems)


def of_table(
    settings: Mapping[str, str] | Sequence[str], table: str
) -> Mapping[str, str] | Sequence[str]:
    """Those of the settings that change something in `table`."""

    def inside(path: str) -> bool:
        return path.strip().startswith(f"{table}.")

    if isinstance(settings, Mapping):
        return {path: text for path, text in settings.items() if inside(path)}
    return [setting for setting in settings if inside(setting)]


class _LeadsNowhereError(Exception):
    def __init__(self, message: str, found: str, expected: str, hint: str | None = None) -> None:
        super().__init__(message)
        self.message, self.found, self.expected, self.hint = message, found, expected, hint


def require_settings(settings: object) -> None:
    """Raise `ArgumentError` (bad-argument) for what are no settings."""
    fits = isinstance(settings, Mapping) or (
        isinstance(settings, Sequence)
        and not isinstance(settings, str)
        and all(isinstance(setting, str) for setting in settings)
    )
    if not fits:
        raise ArgumentError.of("settings", settings, _SETTINGS)


def _pairs(
    settings: Mapping[str, str] | Sequence[str], problems: list[Problem]
) -> Iterable[tuple[str, str]]:
    if isinstance(settings, Mapping):
        yield from ((unquoted(str(path)), str(text)) for path, text in settings.items())
        return
    for setting in settings:
        path, equals, text = setting.partition("=")
        path = unquoted(path)
        if not equals or not all(path.split(".")):
            problems.append(
                Problem(
                    "bad-setting",
                    f"--set {_shortened(setting)}: not a key and a value",
                    found=_shortened(setting),
                    expected="key=value, such as strut.1.length=501",
                )
            )
            continue
        yield path, text.strip()


def unquoted(path: str) -> str:
    """A key without the quotation marks that may stand round its parts."""
    return _QUOTED.sub(r"\2", path.strip())


def _shortened(setting: str) -> str:
    return setting if len(setting) <= LONGEST_QUANTITY else setting[: LONGEST_QUANTITY - 3] + "..."


def _value(text: str) -> Any:
    """The TOML value that `text` is, or the text itself."""
    if "\n" in text or "\r" in text:
        raise _LeadsNowhereError("a value is one line", "several lines", "one TOML value")
    try:
        return parse_toml(f"value = {text}")["value"]
    except TomlError as error:
        if error.too_much:
            raise _LeadsNowhereError(
                f"a value that is not read: {error.reason}", shown_value(text), "one TOML value"
            ) from None
        return text


def _targets(document: Document, words: list[str], free_tables: Collection[str]) -> list[Key]:
    """The keys that a path names; several where it has a pattern for the rows of an array."""
    table, rest = words[0], words[1:]
    if table in SEVERAL:
        return _row_targets(document, table, rest)
    if table in free_tables and rest and isinstance(document.data.get(table, {}), dict):
        return [(table, ".".join(rest))]
    return [_key_below(document, (), words)]


def _row_targets(document: Document, table: str, words: list[str]) -> list[Key]:
    rows = document.data.get(table)
    rows = rows if isinstance(rows, list) else []
    names = [
        str(row.get("name", f"#{index + 1}")) if isinstance(row, dict) else ""
        for index, row in enumerate(rows)
    ]
    # A name may hold points itself: take the longest one that there is.
    for taken in range(len(words) - 1, 0, -1):
        pattern = ".".join(words[:taken])
        matching = [i for i, name in enumerate(names) if name and fnmatchcase(name, pattern)]
        if matching:
            return [_key_below(document, (table, i), words[taken:]) for i in matching]
    named = ", ".join(f"{table}.{name}" for name in names if name) or f"a [[{table}]]"
    near = get_close_matches(words[0], names, n=1) if words else []
    raise _LeadsNowhereError(
        f"there is no such {table}" if len(words) > 1 else f"a key of one {table} is wanted",
        ".".join([table, *words]),
        f"one of {named}, then a key",
        f"did you mean {table}.{near[0]}?" if near and len(words) > 1 else None,
    )


def _key_below(document: Document, before: Key, words: list[str]) -> Key:
    """Follow `words` into tables that are there; what is not there yet becomes a key of its own."""
    value = document.value(before)
    if isinstance(value, dict):
        for taken in range(len(words), 0, -1):
            word = ".".join(words[:taken])
            if word in value:
                key = (*before, word)
                return key if taken == len(words) else _key_below(document, key, words[taken:])
        return (*before, *words)
    if isinstance(value, list) and len(words) == 1:
        index = _COMPONENTS.get(words[0], -1)
        if 0 <= index < len(value) == len(_COMPONENTS):
            return (*before, index)
    path = document.path(before)
    raise _LeadsNowhereError(
        f"{path} is not a table", f"{path} = {value}", f"{path} itself", f"give {path} as a whole"
    )


def _write(data: dict[str, Any], key: Key, value: Any) -> None:
    target: Any = data
    for part in key[:-1]:
        target = target.setdefault(part, {}) if isinstance(target, dict) else target[part]
    target[key[-1]] = value
