"""Acceptance tests of machines: what an instrument will show, predicted with its uncertainty.

A test is one file and one line here; it is imported when it is asked for. To add one, such as
ISO 230-2, ISO 230-6 or ISO 9283: write a module with `TEST`, a `MachineTest` (`_base.py`).
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from truepose.machine_tests._base import MachineTest

REGISTRY: dict[str, str] = {
    "circular": "truepose.machine_tests.circular",
}
"""Name of a test -> module that holds its `TEST`."""


def test_named(name: str) -> MachineTest:
    """The test of a name in `REGISTRY`."""
    test: MachineTest = import_module(REGISTRY[name]).TEST
    return test


__all__ = ["REGISTRY", "test_named"]
