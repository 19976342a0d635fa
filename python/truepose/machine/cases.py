"""`[case.NAME]`: further conditions, which take what they do not write from `[condition]`.

A key is taken as a whole. What replaces another key takes its place: a case that writes `kienzle`
has no `force` of the `[condition]`, one that writes `temperature` no log of it.
"""

from __future__ import annotations

import copy
from typing import Any

from truepose.errors import Fault, Problem
from truepose.files.document import Document
from truepose.files.names import fault_of_name
from truepose.files.units import shown_value, type_phrase

CASE = "case"
"""The table of the tables."""

CONDITION = "condition"

_FORCES = frozenset({"force", "cutting", "kienzle"})
_IN_PLACE_OF = {
    **dict.fromkeys(_FORCES, _FORCES),
    "temperature": frozenset({"temperature_log", "time"}),
    "temperature_log": frozenset({"time"}),
}
"""Keys of `[condition]` that a case does not take where it writes one."""

_WITH_MEANING = ".*="


def share_condition(document: Document) -> None:
    """Give the cases what `[condition]` says and they do not; a problem of it is told there."""
    cases, common = document.data.get(CASE), document.data.get(CONDITION)
    if not isinstance(cases, dict) or not isinstance(common, dict):
        return
    for name, case in cases.items():
        if not isinstance(case, dict):
            continue
        own = set(case)
        replaced = frozenset[str]().union(*(_IN_PLACE_OF.get(key, frozenset()) for key in own))
        for key, value in common.items():
            if key not in own and key not in replaced:
                case[key] = copy.deepcopy(value)
                document.shared[CASE, name, key] = (CONDITION, key)


def tables(document: Document, problems: list[Problem]) -> dict[str, dict[str, Any]]:
    """The cases by name, those that are tables of a good name; what is wrong with the others."""
    cases = document.data.get(CASE, {})
    if not isinstance(cases, dict):
        problems.append(document.problem(_no_table(cases), (CASE,)))
        return {}
    good = {}
    for name, case in cases.items():
        wrong = fault_of_name(name)
        if wrong is None and any(mark in name for mark in _WITH_MEANING):
            wrong = shown_value(name)
        if wrong is not None:
            problems.append(
                document.problem(
                    Fault(
                        "bad-name",
                        "a case is named by a word without point, star or equals sign",
                        found=wrong,
                        expected="a name, such as [case.hot]",
                    ),
                    (CASE, name),
                )
            )
        elif not isinstance(case, dict):
            problems.append(document.problem(_no_table(case), (CASE, name)))
        else:
            good[name] = case
    return good


def _no_table(value: object) -> Fault:
    return Fault(
        "wrong-type",
        f"expected a table, found {type_phrase(value)}",
        found=shown_value(value),
        expected="a table for each case, such as [case.hot]",
    )


__all__ = ["CASE", "CONDITION", "share_condition", "tables"]
