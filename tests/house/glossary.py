"""The names that the field's words have taken the place of, and where one of them still stands.

    python tests/house/glossary.py

prints the table. `glossary.csv` has it: what a name is, the old name, the word to use instead. Only
the pair counts: a module `words` is refused, an attribute `words` is not. Kinds:

* module, package: the last part of a module's name.
* class: a class, or an alias of a type, of a module; function: of a module; method: of a class,
  properties too; field: assigned in a class; local: any other assigned name, and arguments.
* rust function, rust type (struct, enum, trait, type), rust name (fields, arguments, `let`).
* phrase: words anywhere in the source, over the end of a comment's line too.

A module that only forwards an old public name, with a DeprecationWarning, is left in peace.
"""

from __future__ import annotations

import ast
import csv
import re
import sys
from collections import defaultdict
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

sys.path.insert(0, str(Path(__file__).parents[1]))

from house.rust_tree import CRATES, without_comments
from house.source_tree import PACKAGE, ROOT, Module, modules

FILE = Path(__file__).with_name("glossary.csv")


class Entry(NamedTuple):
    """What a name is, the name, and what takes its place."""

    kind: str
    old: str
    new: str


Places = Mapping[tuple[str, str], list[str]]
"""(kind, name) -> where it stands."""


def glossary() -> list[Entry]:
    with FILE.open(encoding="utf-8", newline="") as file:
        return [Entry(row["kind"], row["old"], row["new"]) for row in csv.DictReader(file)]


def aliases(module: Module) -> set[str]:
    """Types that a module names by an assignment, `Floats = NDArray[...]`."""
    assigned = {
        target.id
        for node in module.tree.body
        if isinstance(node, ast.Assign)
        for target in node.targets
        if isinstance(target, ast.Name)
    }
    return {name for name in assigned if name.lstrip("_")[:1].isupper() and not name.isupper()}


def forwards(module: Module) -> bool:
    """Whether it only keeps an old public name alive for a version."""
    own = {function.name for function in module.functions()}
    return (
        "DeprecationWarning" in module.text and own <= {"__getattr__"} and not [*module.classes()]
    )


def names_of(module: Module) -> Iterator[tuple[str, str]]:
    """(kind, name) of all that a Python module defines or binds, itself included."""
    yield "package" if module.is_package else "module", module.last_name
    yield from (("class", node.name) for node in module.classes())
    yield from (("function", node.name) for node in module.functions())
    yield from (("method", method.name) for _, method in module.methods())
    yield from (("class", name) for name in aliases(module))
    for binding in module.bindings():
        yield "field" if binding.kind == "field" else "local", binding.name


def python_places() -> Places:
    places = defaultdict(list)
    for module in modules().values():
        if not forwards(module):
            for kind, name in dict.fromkeys(names_of(module)):
                places[kind, name].append(module.name)
    return places


def rust_places(old: list[Entry]) -> Places:
    """Of names of the glossary alone."""
    forms = {
        "rust function": r"\bfn\s+{}\b",
        "rust type": r"\b(?:struct|enum|trait|type)\s+{}\b",
        "rust name": r"\blet\s+(?:mut\s+)?{0}\b|\b{0}\s*:(?!:)",
    }
    wanted = [
        (entry, re.compile(forms[entry.kind].format(re.escape(entry.old))))
        for entry in old
        if entry.kind in forms
    ]
    places = defaultdict(list)
    for path in sorted(CRATES.glob("*/src/**/*.rs")):
        code = without_comments(path.read_text(encoding="utf-8"))
        for entry, form in wanted:
            if form.search(code):
                places[entry.kind, entry.old].append(path.relative_to(CRATES).as_posix())
    return places


def phrase_places(old: list[Entry]) -> Places:
    wanted = [
        (entry, re.compile(entry.old.replace(" ", r"\s+(?:(?://[/!]?|#)\s*)?"), re.IGNORECASE))
        for entry in old
        if entry.kind == "phrase"
    ]
    places = defaultdict(list)
    for path in sorted([*CRATES.glob("*/src/**/*.rs"), *PACKAGE.rglob("*.py")]):
        text = path.read_text(encoding="utf-8")
        for entry, phrase in wanted:
            if phrase.search(text):
                places[entry.kind, entry.old].append(path.relative_to(ROOT).as_posix())
    return places


def standing() -> dict[Entry, list[str]]:
    """Entries whose old name is still there, with the modules or files that have it."""
    old = glossary()
    places = {**python_places(), **rust_places(old), **phrase_places(old)}
    return {entry: places[entry[:2]] for entry in old if places.get(entry[:2])}


def main() -> int:
    there = standing()
    for entry in glossary():
        places = there.get(entry, [])
        shown = ", ".join(places[:3]) + (f" and {len(places) - 3} more" if len(places) > 3 else "")
        print(f"{entry.kind:14} {entry.old:18} -> {entry.new:24} {shown or 'gone'}")
    print(f"{len(there)} of {len(glossary())} are still there")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
