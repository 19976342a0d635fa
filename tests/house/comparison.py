"""Compares two records: byte for byte, or as far as a kind of change may go.

With `relative` a number may differ by that share of itself or, near zero, of the largest number in
the same place of the file: the same key of JSON, the same column of CSV, the whole of a text. With
`mask_sentences` a string with a space in it is a sentence and may differ in JSON and CSV; of
other texts (tables, messages, pages) only codes and numbers with a decimal point are compared.
"""

from __future__ import annotations

import csv
import difflib
import io
import json
import math
import re
from collections import defaultdict
from pathlib import Path

NUMBER = re.compile(r"(?<![\w.])[-\u2212+]?\d+(?:\.\d+)?(?:[eE][+-]?\d+)?(?![\w.]*\w)")
DECIMAL = re.compile(r"(?<![\w.])[-\u2212+]?\d+\.\d+(?:[eE][+-]?\d+)?")
CODES = re.compile(r"\b(?:error|warning)\[[a-z0-9-]+\]")
SENTENCE = "<sentence>"
SHOWN_LINES = 8

Parts = list[tuple[str, object]]
"""What a file says, in its order: where (key, column), and the value there."""


def compare_records(
    old: Path, new: Path, relative: float = 0.0, mask_sentences: bool = False
) -> int:
    """Print the cases that differ, with the first lines of it; 0 where none does, else 1."""
    files = [
        {path.relative_to(root) for path in root.rglob("*") if path.is_file()}
        for root in (old, new)
    ]
    cases = [{case_of(path) for path in paths} for paths in files]
    differing: dict[str, list[str]] = {
        case: [f"  only in the {'old' if case in cases[0] else 'new'} record"]
        for case in sorted(cases[0] ^ cases[1])
    }
    for path in sorted(path for path in files[0] | files[1] if case_of(path) not in differing):
        there = [path in paths for paths in files]
        if all(there):
            told = difference(old / path, new / path, relative, mask_sentences)
        else:
            told = [f"only in {'the old' if there[0] else 'the new'} record"]
        if told:
            differing.setdefault(case_of(path), []).append(f"  {path.name}")
            differing[case_of(path)] += [f"    {line}" for line in told]
    for case, lines in differing.items():
        print(case, *lines, sep="\n")
    every = cases[0] | cases[1]
    print(f"{len(every)} cases, {len(every) - len(differing)} equal, {len(differing)} differing")
    return int(bool(differing) or not every)


def case_of(path: Path) -> str:
    """The case that a file of a record belongs to."""
    parts = path.parts
    return "/".join(parts[: parts.index("files")] if "files" in parts else parts[:-1])


def difference(old: Path, new: Path, relative: float, mask: bool) -> list[str]:
    """What tells two files apart, none where they are equal as far as is asked."""
    contents = [path.read_bytes() for path in (old, new)]
    if contents[0] == contents[1]:
        return []
    texts = [content.decode("utf-8", errors="replace") for content in contents]
    if relative or mask:
        parts = [parts_of(old.name, text, mask) for text in texts]
        told = parts_that_differ(parts[0], parts[1], relative)
        return told if len(told) <= SHOWN_LINES else [*told[:SHOWN_LINES], f"... {len(told)} all"]
    lines = [text.splitlines() for text in texts]
    shown = [
        line[:160]
        for line in difflib.unified_diff(*lines, lineterm="", n=0)
        if line[:3] not in ("---", "+++")
    ]
    return shown[:SHOWN_LINES] or ["line ends differ"]


def parts_of(name: str, text: str, mask: bool) -> Parts:
    """A file in parts, by its form."""
    if name.endswith(".exit"):
        return [("exit", text)]
    if text.startswith(("{", "[")):
        try:
            return list(json_parts(json.loads(text), "", mask))
        except json.JSONDecodeError:
            pass
    rows = list(csv.reader(io.StringIO(text))) if "," in text.partition("\n")[0] else []
    is_table = len(rows) > 1 and len({len(row) for row in rows}) == 1
    if is_table and (name.endswith(".csv") or name.endswith(".stdout")):
        head, *body = rows
        parts: Parts = [("header", column) for column in head]
        for row in body:
            parts += [(key, value_of(cell, mask)) for key, cell in zip(head, row, strict=True)]
        return parts
    if mask:
        words = [match[0] for match in CODES.finditer(text)]
        numbers = [number_of(match[0]) for match in DECIMAL.finditer(text)]
        return [("code", word) for word in words] + [("number", number) for number in numbers]
    whole: Parts = [("words", line.split()) for line in NUMBER.sub("#", text).splitlines()]
    return whole + [("number", number_of(match[0])) for match in NUMBER.finditer(text)]


def json_parts(value: object, key: str, mask: bool) -> Parts:
    """Key paths, with [] for a list, and the values there."""
    parts: Parts = []
    if isinstance(value, dict):
        for name, content in value.items():
            parts += [("key", f"{key}.{name}"), *json_parts(content, f"{key}.{name}", mask)]
    elif isinstance(value, list):
        for content in value:
            parts += json_parts(content, f"{key}[]", mask)
    elif isinstance(value, str):
        # An attribute may be JSON itself.
        if value.startswith(("{", "[")):
            try:
                return json_parts(json.loads(value), f"{key}:", mask)
            except json.JSONDecodeError:
                pass
        parts.append((key, SENTENCE if mask and " " in value else value))
    elif isinstance(value, (int, float)) and not isinstance(value, bool):
        parts.append((key, float(value)))
    else:
        parts.append((key, value))
    return parts


def number_of(text: str) -> float:
    return float(text.replace("\u2212", "-"))


def value_of(cell: str, mask: bool) -> object:
    """A cell as a number, if it is one."""
    try:
        return float(cell)
    except ValueError:
        return SENTENCE if mask and " " in cell else cell


def parts_that_differ(old: Parts, new: Parts, relative: float) -> list[str]:
    """Lines that tell the parts that are further apart than is allowed."""
    if [where for where, _ in old] != [where for where, _ in new]:
        names = [[f"{where}" for where, _ in parts] for parts in (old, new)]
        changes = difflib.unified_diff(*names, lineterm="", n=0) if len(old) < 20000 else ["keys"]
        return [line for line in changes if line[:3] not in ("---", "+++")]
    largest: dict[str, float] = defaultdict(float)
    for where, value in old:
        if isinstance(value, float) and math.isfinite(value):
            largest[where] = max(largest[where], abs(value))
    told = []
    for (where, one), (_, other) in zip(old, new, strict=True):
        if one == other or (one != one and other != other):
            continue
        if isinstance(one, float) and isinstance(other, float):
            allowed = relative * max(abs(one), largest[where])
            if abs(one - other) <= allowed:
                continue
        told.append(f"{where}: {one!r} -> {other!r}")
    return told
