"""Names of a package whose modules are imported when a name is first used."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any


def of_the_package(name: str) -> Any:
    """What stands under this name in `truepose` itself, which shows what all its layers have.

    So a method of a lower layer hands on to a higher one, and is only there for convenience:
    nothing is computed with what comes back.
    """
    package: str = __name__.rpartition(".")[0]
    return getattr(sys.modules[package], name)


def imported_when_used(package: str, where: Mapping[str, str]) -> Callable[[str], Any]:
    """A package's `__getattr__` for names -> the modules that have them.

    Each is looked for once. Raises `AttributeError` for all other names.
    """

    def of_module(name: str) -> Any:
        if name not in where:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        value = getattr(import_module(where[name]), name)
        setattr(sys.modules[package], name, value)
        return value

    return of_module
