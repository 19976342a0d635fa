"""What controllers take: programs, parameters and kinematics, each adapter one folder.

`REGISTRY` has every adapter, in the order of `truepose export --help`, and `READERS` every reader
of a controller's own files; both are read lazily, since an adapter may need what only it needs.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from truepose.controllers._registry import READERS, REGISTRY
from truepose.lazy_names import imported_when_used

if TYPE_CHECKING:
    from truepose.controllers._adapters import controller, export
    from truepose.controllers._against import difference
    from truepose.controllers._export import Controller, Export, Option
    from truepose.controllers._import import Import, import_machine, reader
    from truepose.controllers._reader import (
        Assumption,
        ControllerFile,
        ControllerReading,
        Reader,
        Setting,
    )

_WHERE = {
    "Assumption": "truepose.controllers._reader",
    "Controller": "truepose.controllers._export",
    "ControllerFile": "truepose.controllers._reader",
    "ControllerReading": "truepose.controllers._reader",
    "Export": "truepose.controllers._export",
    "Import": "truepose.controllers._import",
    "Option": "truepose.controllers._export",
    "Reader": "truepose.controllers._reader",
    "Setting": "truepose.controllers._reader",
    "controller": "truepose.controllers._adapters",
    "difference": "truepose.controllers._against",
    "export": "truepose.controllers._adapters",
    "import_machine": "truepose.controllers._import",
    "reader": "truepose.controllers._import",
}
"""Name -> the module that is imported when it is first used: the names of adapters need none."""

__all__ = [
    "READERS",
    "REGISTRY",
    "Assumption",
    "Controller",
    "ControllerFile",
    "ControllerReading",
    "Export",
    "Import",
    "Option",
    "Reader",
    "Setting",
    "controller",
    "difference",
    "export",
    "import_machine",
    "reader",
]


if not TYPE_CHECKING:  # type checkers know the names above, and refuse all others
    __getattr__ = imported_when_used(__name__, _WHERE)


def __dir__() -> list[str]:
    return sorted(__all__)
