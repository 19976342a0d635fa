"""Beyond the time that sweeps are given their members are skipped, and quick ones run."""

from __future__ import annotations

import time
from types import SimpleNamespace
from typing import Any

import pytest

from sweeps import UNTIL, skip_beyond_time


def item(marked: bool) -> Any:
    return SimpleNamespace(get_closest_marker=lambda name: "mark" if marked else None)


@pytest.mark.parametrize(
    ("until", "marked", "skipped"),
    [
        (-1.0, True, True),
        (-1.0, False, False),
        (3600.0, True, False),
        (None, True, False),
    ],
)
def test_members_beyond_the_time_are_skipped(
    until: float | None, marked: bool, skipped: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv(UNTIL, raising=False)
    if until is not None:
        monkeypatch.setenv(UNTIL, str(time.time() + until))
    if skipped:
        with pytest.raises(pytest.skip.Exception, match="is over"):
            skip_beyond_time(item(marked))
    else:
        skip_beyond_time(item(marked))
