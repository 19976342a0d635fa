"""What controllers take: programs, parameters and kinematics, each adapter one folder.

`REGISTRY` has every adapter, in the order of `truepose export --help`; it is read lazily, since
an adapter may need what only it needs.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from truepose.controllers._registry import REGISTRY

if TYPE_CHECKING:
    from truepose.controllers._adapters import controller, export
    from truepose.controllers._export import Controller, Export, Option

_WHERE = {
    "Controller": "truepose.controllers._export",
    "Export": "truepose.controllers._export",
    "Option": "truepose.controllers._export",
    "controller": "truepose.controllers._adapters",
    "export": "truepose.controllers._adapters",
}
"""Name -> the module that is imported when it is first used: the names of adapters need none."""

__all__ = ["REGISTRY", "Controller", "Export", "Option", "controller", "export"]


if not TYPE_CHECKING:  # type checkers know the names above, and refuse all others

    def __getattr__(name: str) -> Any:
        if name not in _WHERE:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        value = getattr(import_module(_WHERE[name]), name)
        globals()[name] = value
        return value


def __dir__() -> list[str]:
    return sorted(__all__)
