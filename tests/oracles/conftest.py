"""Published numbers: compared, and recorded for the trust page with both digits."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from oracle_cases import Published
from results_file import PUBLISHED


@pytest.fixture
def published(record_property: Callable[[str, object], None]) -> Published:
    """A function (what, theirs, ours, *, within, unit="", by="source").

    Asserts that `ours` is `theirs` within `within`, an array of their shape or one number, and
    records the entry that is farthest off. `by` is "source" for what was published, "reference" for
    what was computed independently where nothing was.
    """

    def compare(
        what: str, theirs: Any, ours: Any, *, within: Any, unit: str = "", by: str = "source"
    ) -> None:
        expected, found = np.broadcast_arrays(np.asarray(theirs, float), np.asarray(ours, float))
        allowed = np.broadcast_to(np.asarray(within, float), expected.shape)
        difference = np.abs(found - expected)
        assert expected.size
        assert np.isfinite(found).all(), what
        worst = np.unravel_index(np.argmax(difference / allowed), expected.shape)
        record_property(
            PUBLISHED,
            {
                "what": what,
                "by": by,
                "unit": unit,
                "numbers": int(expected.size),
                "theirs": float(expected[worst]),
                "ours": float(found[worst]),
                "difference": float(difference[worst]),
                "within": float(allowed[worst]),
            },
        )
        assert (difference <= allowed).all(), f"{what}: {found[worst]} for {expected[worst]}"

    return compare
