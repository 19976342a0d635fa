"""What controllers take: programs, parameters and kinematics, each adapter one folder.

`REGISTRY` has every adapter, in the order of `truepose export --help`; it is read lazily, since
an adapter may need what only it needs.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from truepose.controllers._registry import REGISTRY
from truepose.lazy_names import imported_when_used

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
    __getattr__ = imported_when_used(__name__, _WHERE)


def __dir__() -> list[str]:
    return sorted(__all__)
