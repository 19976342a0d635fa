"""What stands in for functions of numpy that import `numpy.ma`."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from truepose.arrays import is_masked, sorted_union


@pytest.mark.parametrize("sizes", [(0, 0), (0, 3), (1, 0), (4, 4), (40, 7)])
def test_a_union_is_numpy_s(sizes: tuple[int, int]) -> None:
    random = np.random.default_rng(sum(sizes))
    one, other = (random.integers(0, 12, size) for size in sizes)
    found = sorted_union(one, other)
    assert found.dtype == np.intp
    assert np.array_equal(found, np.union1d(one, other))


def test_what_is_masked(monkeypatch: pytest.MonkeyPatch) -> None:
    hidden = np.ma.masked_array([1.0, 2.0], [False, True])
    assert is_masked(hidden)
    assert is_masked(np.ma.masked)
    assert not is_masked(np.ma.masked_array([1.0, 2.0]))
    assert not is_masked(1.0)
    # Without the module there is no masked array; nothing is imported to find out.
    monkeypatch.delitem(sys.modules, "numpy.ma")
    assert not is_masked(1.0)
    assert "numpy.ma" not in sys.modules
