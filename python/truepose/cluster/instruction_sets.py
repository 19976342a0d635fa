"""Instruction sets of the kernel: which a processor has, and computing with one."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from functools import cache

from truepose._kernel import instruction_set, use_instruction_set

SETS = ("scalar", "portable", "avx2", "avx512")
"""All, from least to most; a processor that has one has those before it."""


@cache
def best_instruction_set() -> str:
    """The most that this processor has."""
    with computing_with("best"):
        return instruction_set()


def least(names: Iterable[str]) -> str:
    """The least of some sets."""
    return min(names, key=SETS.index)


def has(best: str, name: str) -> bool:
    """Whether a processor whose most is `best` has the set `name`."""
    return name in SETS and SETS.index(name) <= SETS.index(best)


@contextmanager
def computing_with(name: str) -> Iterator[None]:
    """Let the kernel run on an instruction set inside.

    Raises `ValueError` where there is no such set, `RuntimeError` where this processor has it not.
    """
    before = instruction_set()
    use_instruction_set(name)
    try:
        yield
    finally:
        use_instruction_set(before)


__all__ = ["SETS", "best_instruction_set", "computing_with", "has", "least"]
