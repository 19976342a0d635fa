"""What a shell may offer at a place of the line: files, kinds, codes, keys of the machine file.

A shell waits for this at every press of the Tab key, so nothing is validated and nothing heavy is
imported: the machine file is read as plain TOML, and one that cannot be read offers nothing.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import click
from click.shell_completion import CompletionItem

from truepose.files.limits import LARGEST_FILE

COMPLETION = "_TRUEPOSE_COMPLETE"
"""Variable of the environment, set by a shell that asks how a line goes on."""

PATH = "path"
"""Type of a completion that is a file or, with a slash at its end, a folder."""
OPEN = "open"
"""Type of one that goes on: a key before its value, the first words of a key."""

Offered = list[CompletionItem]

_NAMED = ("name", "#")


def files(incomplete: str, endings: Iterable[str]) -> Offered:
    """Folders, and files that end as one of `endings`, or all where none is given."""
    folder, slash, start = incomplete.rpartition("/")
    wanted = tuple(endings)
    try:
        entries = sorted(os.scandir(Path(folder + slash or ".").expanduser()), key=lambda e: e.name)
    except OSError:
        return []
    offered = []
    for entry in entries:
        if not entry.name.startswith(start) or (entry.name[0] == "." and not start):
            continue
        name = folder + slash + entry.name
        if entry.is_dir():
            offered.append(CompletionItem(f"{name}/", type=PATH))
        elif not wanted or entry.name.lower().endswith(wanted):
            offered.append(CompletionItem(name, type=PATH))
    return offered


def kinds(_: click.Context, __: click.Parameter, incomplete: str) -> Offered:
    """Kinds of machine that `truepose init` writes."""
    from truepose.machine.library import kinds

    return _plain(kinds(), incomplete)


def controllers(_: click.Context, __: click.Parameter, incomplete: str) -> Offered:
    """Controllers that there is an adapter for."""
    from truepose.controllers import REGISTRY

    return _plain(REGISTRY, incomplete)


def languages(_: click.Context, __: click.Parameter, incomplete: str) -> Offered:
    """Languages in which the report can be written."""
    from truepose.language import languages

    return _plain(languages(), incomplete)


def readers(_: click.Context, __: click.Parameter, incomplete: str) -> Offered:
    """Controllers whose files are read."""
    from truepose.controllers import READERS

    return _plain(READERS, incomplete)


def codes(_: click.Context, __: click.Parameter, incomplete: str) -> Offered:
    """Codes that can be explained, each with its meaning."""
    from truepose.explanations import meanings

    return [
        CompletionItem(code, help=meaning)
        for code, meaning in meanings().items()
        if code.startswith(incomplete)
    ]


def settings(context: click.Context, _: click.Parameter, incomplete: str) -> Offered:
    """Keys of the machine file that the line names, word by word, for `--set KEY=VALUE`."""
    return _by_words(_keys(_document(context)), incomplete, "=")


def unknowns(context: click.Context, _: click.Parameter, incomplete: str) -> Offered:
    """What has a tolerance in the machine file: what a calibration may be asked to find."""
    return _by_words(_with_tolerance(_document(context)), incomplete, "")


def freedoms(context: click.Context, _: click.Parameter, incomplete: str) -> Offered:
    """Freedoms that are commanded, for "x=200:400,y=100:300"; those before stay."""
    before, comma, start = incomplete.rpartition(",")
    machine = _document(context).get("machine")
    given = machine.get("commanded", machine.get("dof")) if isinstance(machine, dict) else None
    names = given if isinstance(given, list) else []
    return [
        CompletionItem(f"{before}{comma}{name}=", type=OPEN)
        for name in map(str, names)
        if f"{name}=".startswith(start) and f"{name}=" not in before
    ]


def _plain(words: Iterable[str], incomplete: str) -> Offered:
    return [CompletionItem(word) for word in words if word.startswith(incomplete)]


def _document(context: click.Context) -> dict[str, Any]:
    """The tables of the machine file on the line so far, none where it cannot be read."""
    import tomllib

    # Where an option still wants its value, click leaves what stands before it unparsed.
    loose = [word for word in context.args if word.lower().endswith(".toml")]
    path = context.params.get("machine_file") or (loose[0] if loose else None)
    if path is None:
        return {}
    try:
        file = Path(path).expanduser()
        if not file.is_file() or file.stat().st_size > LARGEST_FILE:
            return {}
        return tomllib.loads(file.read_text(encoding="utf-8-sig"))
    except (OSError, ValueError, RecursionError):
        return {}


def _keys(document: dict[str, Any]) -> Iterator[tuple[str, ...]]:
    """Every key that the file writes, in words: ("strut", "1", "length"), ("strut", "*", ...)."""
    shared = document.get("each", {})
    for table, content in document.items():
        if table == "schema":
            continue
        if not isinstance(content, list):
            yield from _below((table,), content)
            continue
        common = shared.get(table, {}) if isinstance(shared, dict) else {}
        rows = [row for row in content if isinstance(row, dict)]
        for number, row in enumerate(rows, start=1):
            name = str(row.get("name", f"#{number}"))
            for named in (name, "*") if len(rows) > 1 else (name,):
                for key, value in {**common, **row}.items():
                    if key not in _NAMED:
                        yield from _below((table, named, key), value)


def _below(words: tuple[str, ...], value: Any) -> Iterator[tuple[str, ...]]:
    """The keys of a value: those of its tables, and of a vector (no range of a grid) its own."""
    if isinstance(value, dict):
        for key, below in value.items():
            yield from _below((*words, key), below)
        return
    yield words
    if isinstance(value, list) and len(value) == len("xyz") and words[0] != "workspace":
        yield from ((*words, axis) for axis in "xyz")


def _with_tolerance(document: dict[str, Any]) -> Iterator[tuple[str, ...]]:
    ending = "_tolerance"
    for words in _keys(document):
        if words[0] == "tolerance" and len(words) > 1:
            yield words[1:2]
        elif len(words) > 1 and words[-1].endswith(ending) and words[0] != "each":
            yield (*words[:-1], words[-1].removesuffix(ending))


def _by_words(keys: Iterable[tuple[str, ...]], incomplete: str, after: str) -> Offered:
    """Of every key that begins so, as much as one word more; `after` a whole one."""
    offered: dict[str, str] = {}
    for words in keys:
        for count in range(1, len(words) + 1):
            whole = count == len(words)
            text = ".".join(words[:count]) + (after if whole else ".")
            if len(text) > len(incomplete) and text.startswith(incomplete):
                offered[text] = "plain" if whole and not after else OPEN
                break
    return [CompletionItem(text, type=kind) for text, kind in offered.items()]
