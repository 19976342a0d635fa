"""One language: the field's words, one home a class, and names that say what they are."""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path

import truepose
from house.glossary import glossary, standing
from house.source_tree import EMPTY_NAMES, Module, empty_names, modules

AT_FIRST = {"each": 377, "found": 442}
"""How often each was bound before the renames; the sum is to come down by 80 %."""

PUBLIC_MODULES = {"errors"}
"""Names of `truepose.__all__` that are meant to be modules."""


def test_the_glossary_is_in_order() -> None:
    entries = glossary()
    pairs = [entry[:2] for entry in entries]
    assert len(set(pairs)) == len(pairs)
    for entry in entries:
        assert all(entry), entry
        assert (entry.kind, entry.new) not in pairs, f"an old name given anew: {entry}"


def test_no_name_of_the_old_language_is_left() -> None:
    left = [
        f"{entry.kind} {entry.old} (say {entry.new}): {', '.join(places)}"
        for entry, places in standing().items()
    ]
    assert not left, "\n".join(left)


def test_a_class_name_has_one_home() -> None:
    homes = defaultdict(list)
    for module in modules().values():
        for node in module.classes():
            if not node.name.startswith("_"):
                homes[node.name].append(module.name)
    assert {name: where for name, where in homes.items() if len(where) > 1} == {}


def test_names_that_say_nothing_are_rare() -> None:
    bound = empty_names(modules().values())
    assert set(AT_FIRST) == set(EMPTY_NAMES)
    assert bound.total() <= 0.2 * sum(AT_FIRST.values()), dict(bound)


def test_no_subpackage_bears_the_name_of_a_public_function() -> None:
    """Importing it would put the module in the function's place."""
    below = {name.split(".")[1] for name in modules() if name.count(".") == 1}
    assert sorted(below & set(truepose.__all__) - PUBLIC_MODULES) == []


def test_bindings_are_counted() -> None:
    text = (
        "class A:\n    found: str\n\n"
        "def f(found, *each):\n"
        "    for each, (found, a) in []:\n        found = found + each\n"
        "    with a as each: pass\n"
        "    return [each for each in a if (found := each)], found.each\n"
    )
    module = Module("truepose.a", Path("a.py"), False, text)
    assert empty_names([module]) == {"found": 4, "each": 4}
