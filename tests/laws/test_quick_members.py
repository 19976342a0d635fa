"""Every law has a quick member for every machine: what `make test` runs leaves none out."""

from __future__ import annotations

from collections.abc import Iterable

import pytest

from build_machine import awkward_files, machine_files
from sweeps import COLLECTED, Member

LAWS = "tests/laws/"
STEMS = {path.stem for path in [*machine_files(), *awkward_files()]}
OTHERS = "machines of no file"
"""Drawn machines, and laws of no machine: of all these together a law has one quick member."""


def machine_of(member: str | None) -> str:
    """The machine file named in an id such as `hexapod-pose-2`."""
    words = (member or "").split("-")
    if "drawn" in words:  # and the name of the machine in whose neighbourhood it was
        return OTHERS
    return next((word for word in words if word in STEMS), OTHERS)


def never_quick(members: Iterable[Member]) -> list[str]:
    """Laws and machines of which all members are marked."""
    swept: dict[tuple[str, str], bool] = {}
    for law, member, marked in members:
        key = law, machine_of(member)
        swept[key] = marked and swept.get(key, True)
    return sorted(f"{law} for {machine}" for (law, machine), every in swept.items() if every)


def test_every_law_has_a_quick_member_for_every_machine(request: pytest.FixtureRequest) -> None:
    collected = request.config.stash[COLLECTED]
    laws = [member for member in collected if member[0].startswith(LAWS)]
    assert laws
    assert never_quick(laws) == []


def test_a_law_without_one_is_named() -> None:
    members: list[Member] = [
        ("laws/a.py::test_a", "hexapod-0", False),
        ("laws/a.py::test_a", "hexapod-1", True),
        ("laws/a.py::test_a", "tricept-0", True),
        ("laws/a.py::test_a", "tricept-1", True),
        ("laws/a.py::test_b", "drawn-tricept-1", True),
        ("laws/a.py::test_b", "drawn-18", False),
        ("laws/a.py::test_c", "drawn-17", True),
        ("laws/a.py::test_d", None, True),
        ("laws/a.py::test_e", None, False),
    ]
    assert never_quick(members) == [
        "laws/a.py::test_a for tricept",
        f"laws/a.py::test_c for {OTHERS}",
        f"laws/a.py::test_d for {OTHERS}",
    ]
