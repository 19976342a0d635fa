"""The kernel's instruction sets, for tests that one gives what the others give."""

from __future__ import annotations

from contextlib import AbstractContextManager

import pytest

from truepose.cluster.instruction_sets import SETS, best_instruction_set, computing_with, has


def computing_or_skipped(name: str) -> AbstractContextManager[None]:
    """Let the kernel run on an instruction set inside; skip the test if the processor lacks it."""
    if not has(best_instruction_set(), name):
        pytest.skip(f"this processor has no {name}")
    return computing_with(name)


__all__ = ["SETS", "computing_or_skipped"]
