"""What `make test` leaves to `make test-all`: all but some members of a sweep.

A sweep is one test that is run many times, for machines, seeds, instruments or flags. Its members
with the marker `sweep` run in `make test-all` only. Of a law (tests/laws) every machine file keeps
a member in `make test`, which laws/test_quick_members.py checks. Members with the marker `long` too
run in `make test-all`, but not in the CI, which has an hour. On a slow machine even the rest of the
sweeps takes longer than that: beyond the time that it is given the CI skips them, and says so.
"""

from __future__ import annotations

import os
import time
from collections.abc import Collection, Iterable, Sequence
from typing import Any

import pytest

sweep = pytest.mark.sweep
long = pytest.mark.long

UNTIL = "TRUEPOSE_SWEEPS_UNTIL"
"""Variable of the environment: s since 1970, after which members of sweeps are skipped."""

Member = tuple[str, str | None, bool]
"""A test with its file, the member's id in brackets or None, and whether it is marked `sweep`."""

COLLECTED = pytest.StashKey[list[Member]]()
"""In pytest's `config`: all that was collected, before `-m` took any out."""


def member_of(item: pytest.Item) -> Member:
    test, _, rest = item.nodeid.partition("[")
    return test, rest.removesuffix("]") or None, item.get_closest_marker("sweep") is not None


def skip_beyond_time(item: pytest.Item) -> None:
    """Skip a member of a sweep where the time that sweeps are given is over."""
    ends = os.environ.get(UNTIL)
    if ends and time.time() > float(ends) and item.get_closest_marker("sweep") is not None:
        pytest.skip("the time that this run gives to sweeps is over")


def thinned(members: Iterable[Any], quick: Collection[Any] | None = None) -> list[Any]:
    """Members for `parametrize` or a fixture's `params`, with those marked that are not `quick`.

    Quick is the first one where `quick` is left out. A member may be a `pytest.param`, which is
    never found in `quick`.
    """
    found: list[Any] = []
    for number, member in enumerate(members):
        if number == 0 if quick is None else member in quick:
            found.append(member)
        elif isinstance(member, type(pytest.param())):
            found.append(member._replace(marks=[*member.marks, sweep]))
        else:
            found.append(pytest.param(member, marks=sweep))
    return found


def long_member(*values: Any, id: str | None = None) -> Any:  # noqa: A002 the name that pytest has
    """A member for `parametrize` that is left out of `make test` and of the CI."""
    return pytest.param(*values, marks=(sweep, long), id=id)


def one_a_machine(cases: Sequence[tuple[str, ...]]) -> set[tuple[str, ...]]:
    """Of cases (machine, ...) one for each machine, by turns another: each has been on some."""
    by_machine: dict[str, list[tuple[str, ...]]] = {}
    for case in cases:
        by_machine.setdefault(case[0], []).append(case)
    return {own[turn % len(own)] for turn, own in enumerate(by_machine.values())}
