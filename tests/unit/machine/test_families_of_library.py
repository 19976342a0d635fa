"""Every machine of the library that is of a family: the same from its parameters as by hand.

Where a file writes its joint centres rounded, the family's are compared with as many digits as the
file writes for that key; where it writes them to 1e-12 m, to 1e-12 m.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from build_machine import PER_METRE
from family_machines import DIRECTIONS, KINDS, LENGTHS, family_file, library_file
from generators import DOCS
from machine_file import loaded, rows_of
from truepose.machine import Machine
from truepose.machine.library import kinds

EXACT = 1e-12


def decimals(value: Any) -> int:
    """Decimals of a number of the file, or the most of a list of them."""
    if isinstance(value, list):
        return max(map(decimals, value))
    return len(repr(float(value)).rstrip("0").partition(".")[2])


def rounding(kind: str) -> dict[tuple[str, str], float]:
    """By table and key: half of the last digit that the file writes for it; m, or 1."""
    file = library_file(kind)
    half: dict[tuple[str, str], float] = {}
    for table in ("drive", "strut", "guide"):
        for key in (*LENGTHS, *DIRECTIONS):
            digits = [decimals(row[key]) for row in rows_of(file, table) if key in row]
            scale = PER_METRE[file["units"]["length"]] if key in LENGTHS else 1.0
            half[table, key] = 0.5 * 10.0 ** -max(digits, default=99) * scale
    return half


def both(kind: str) -> tuple[Machine, Machine]:
    return loaded(family_file(kind)), loaded(library_file(kind))


def test_every_machine_of_the_library_is_of_a_family_or_says_why_not() -> None:
    """The table of docs/machines.md has those that are not."""
    assert set(KINDS) <= set(kinds())
    page = (DOCS / "machines.md").read_text(encoding="utf-8")
    told = page[page.index("| not of a family |") :].split("\n\n")[0]
    listed = {line.split("`")[1] for line in told.splitlines()[2:]}
    assert listed == set(kinds()) - set(KINDS)


@pytest.mark.parametrize("kind", KINDS)
def test_the_joint_centres_are_those_of_the_file(kind: str) -> None:
    by_family, by_hand = both(kind)
    assert by_family.parameters == by_hand.parameters
    allowed = rounding(kind)
    for name, one, other in zip(
        by_hand.parameters, by_family.nominal, by_hand.nominal, strict=True
    ):
        table, _, key, *_ = (*name.split("."), "")
        assert abs(one - other) <= EXACT + allowed.get((table, key), 0.0), name


@pytest.mark.parametrize("kind", KINDS)
def test_all_else_is_that_of_the_file(kind: str) -> None:
    by_family, by_hand = both(kind)
    assert (by_family.dof, by_family.commanded) == (by_hand.dof, by_hand.commanded)
    np.testing.assert_allclose(by_family.home, by_hand.home, rtol=0, atol=EXACT)
    allowed = rounding(kind)
    for table in ("drives", "guides"):
        of_family, of_hand = getattr(by_family, table), getattr(by_hand, table)
        assert [row.name for row in of_family] == [row.name for row in of_hand]
        for one, other in zip(of_family, of_hand, strict=True):
            assert one.kind == other.kind
            assert getattr(one, "working_mode", None) == getattr(other, "working_mode", None)
            assert one.fields.keys() == other.fields.keys()
            for key, value in one.fields.items():
                digits = allowed.get((table.removesuffix("s"), key), 0.0)
                np.testing.assert_allclose(
                    value, other.fields[key], rtol=0, atol=EXACT + 2.0 * digits
                )
    assert [strut.drive for strut in by_family.struts] == [strut.drive for strut in by_hand.struts]
