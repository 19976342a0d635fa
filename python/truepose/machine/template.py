"""A machine file with a comment at each key: what `truepose init` writes.

The comments are the descriptions of the reference, each at the first row that has the key, so that
a file to begin with says what it is made of, and says nothing that the reference does not.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from inspect import cleandoc

from truepose.files.document import SEVERAL
from truepose.machine.elements import kinds_of
from truepose.machine.library import SCHEMA_FILE, SCHEMA_LINE
from truepose.machine.shared_keys import EACH
from truepose.machine.source_builder import SourceType
from truepose.machine.tables import owners, takes_every_key

WIDTH = 100
HEAD = (
    f"{SCHEMA_LINE}# For editors, once `truepose schema -o {SCHEMA_FILE}` has written it beside "
    "this file.\n"
    "# Numbers without a unit are in those of [units]; any other is written with it: "
    '"0.02 mm".\n'
    "# Sizes, tolerances, temperatures, loads and the accuracy asked are an example to change.\n"
)

_TABLE = re.compile(r"\[\[?+([\w.]++)\]")
_KEY = re.compile(r'"?+([\w.*]++)"?+ *+=')
_SENTENCE_END = re.compile(r"(?<=\.) (?=[A-Z])")
_UNSAID = frozenset(
    {("machine", "name"), ("machine", "description"), ("machine", "origin")}
    | {(table, "name") for table in SEVERAL}
)
"""Keys that need no words."""


def commented(text: str, registry: Sequence[SourceType]) -> str:
    """The machine file `text` with what the reference says of each of its keys, once.

    A key that the file itself comments on, before it or behind it, keeps that comment alone.
    """
    return HEAD + "".join(f"{line}\n" for line in _lines(text, _descriptions(registry)))


def _lines(text: str, descriptions: Mapping[tuple[str, str], str]) -> Iterator[str]:
    table, before, inside = "", "", False
    said: set[tuple[str, str]] = set()
    for line in text.splitlines():
        header, key = _TABLE.match(line), _KEY.match(line)
        if header is not None:
            table = header[1].removeprefix(f"{EACH}.")
            if (table, "") in descriptions and "#" not in line:
                yield from _comment(descriptions[table, ""])
        elif key is not None and not inside:
            here = (table, key[1])
            own = before.startswith("#") or "#" in line
            if here in descriptions and here not in said and not own:
                yield from _comment(descriptions[here])
            said.add(here)
        inside ^= line.count('"""') == 1
        before = line
        yield line


def _comment(text: str) -> list[str]:
    return textwrap.wrap(text, WIDTH, initial_indent="# ", subsequent_indent="#   ")


def _descriptions(registry: Sequence[SourceType]) -> dict[tuple[str, str], str]:
    """(table, key) -> the first sentence of its description; key "" of a table of free keys."""
    found: dict[tuple[str, str], str] = {}
    for table, models in owners(source.tables for source in registry).by_table.items():
        of_kinds = [kind.model for kind in kinds_of(table).values()] if table in SEVERAL else []
        for model in (*models, *of_kinds):
            if takes_every_key(model):
                doc = cleandoc(model.__doc__ or "")
                found[table, ""] = _first_sentence(doc.partition(" table: ")[2] or doc)
            for key, field in model.model_fields.items():
                if field.description and (table, key) not in _UNSAID:
                    found.setdefault((table, key), _first_sentence(field.description))
    return found


def _first_sentence(description: str) -> str:
    first = _SENTENCE_END.split(description, 1)[0].replace("`", "").replace("**", "")
    return f"{first[:1].upper()}{first[1:].removesuffix('.')}."


__all__ = ["commented"]
