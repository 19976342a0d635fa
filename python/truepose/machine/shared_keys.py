"""`[each.strut]` and the like: keys that every row of an array table has unless it writes its own.

They are handed to the rows before anything is validated, so that all that reads a row need not
know; a problem with one of them is said once, where it is written.
"""

from __future__ import annotations

import copy
from collections.abc import Collection, Iterable, Mapping, Sequence

from truepose.errors import Fault, Problem, RequestError
from truepose.files.document import ARRAY_TABLES, Document, Key
from truepose.files.settings import apply, of_table
from truepose.files.units import shown_value, type_phrase
from truepose.files.wording import did_you_mean, one_of

EACH = "each"
"""The table of the tables."""


def share_each(
    document: Document,
    settings: Mapping[str, str] | Sequence[str],
    free_tables: Collection[str] = (),
) -> None:
    """Give the rows what `[each.*]` says; settings of `each` go first, for rows go by them.

    A key is shared as a whole: a row that writes one keeps all of its own value.
    """
    changes = of_table(settings, EACH)
    apply(document, changes, free_tables)
    _require_effect(document, changes)
    tables = document.data.get(EACH)
    if not isinstance(tables, dict):
        return
    for table in ARRAY_TABLES:
        common, rows = tables.get(table), document.data.get(table)
        if not isinstance(common, dict) or not isinstance(rows, list):
            continue
        for index, row in enumerate(rows):
            for key, value in common.items():
                if isinstance(row, dict) and key not in row and key != "name":
                    row[key] = copy.deepcopy(value)
                    document.shared[table, index, key] = (EACH, table, key)


def _require_effect(document: Document, settings: Iterable[str]) -> None:
    """Raise `RequestError` (bad-setting) for what every row says otherwise: it would do nothing."""
    problems = []
    for path in (setting.partition("=")[0].strip() for setting in settings):
        _, table, key, *_ = *path.split("."), "", ""
        rows = document.data.get(table) if table in ARRAY_TABLES else None
        if rows and isinstance(rows, list) and all(isinstance(r, dict) and key in r for r in rows):
            problems.append(
                Problem(
                    "bad-setting",
                    f"--set {path}: changes nothing, for every {table} has a {key} of its own",
                    path=path,
                    found=path,
                    expected="a key that some row leaves to the others",
                    hint=f"--set {table}.*.{key}=... changes the rows themselves",
                )
            )
    if problems:
        raise RequestError(*problems)


def problems(document: Document) -> list[Problem]:
    """What is wrong with `[each.*]` as such; its keys are judged in the rows that they go to."""
    tables = document.data.get(EACH)
    if tables is None:
        return []
    if not isinstance(tables, dict):
        return [_not_tables(document, (EACH,), tables)]
    problems = []
    for table, common in tables.items():
        key: Key = (EACH, table)
        if table not in ARRAY_TABLES or table not in document.data:
            known = table in ARRAY_TABLES
            problems.append(
                document.problem(
                    Fault(
                        "unknown-key",
                        f"there is no [[{table}]] whose rows could share keys",
                        found=table,
                        expected=f"a [[{table}]] too" if known else one_of(ARRAY_TABLES),
                        hint=None if known else did_you_mean(table, ARRAY_TABLES),
                    ),
                    key,
                )
            )
        elif not isinstance(common, dict):
            problems.append(_not_tables(document, key, common))
        elif "name" in common:
            problems.append(
                document.problem(
                    Fault(
                        "unknown-key",
                        f"the {table}s cannot share a name",
                        found=shown_value(common["name"]),
                        expected=f"a name of its own in every [[{table}]]",
                    ),
                    (*key, "name"),
                )
            )
    return problems


def _not_tables(document: Document, key: Key, value: object) -> Problem:
    return document.problem(
        Fault(
            "wrong-type",
            f"expected a table, found {type_phrase(value)}",
            found=shown_value(value),
            expected=" or ".join(f"[{EACH}.{table}]" for table in ARRAY_TABLES),
        ),
        key,
    )
