"""Machine file -> machine: TOML, validated with units and dimensions, handed to the kernel.

Sources bring models for the keys that they read; the loader is given their registry, so that
nothing here imports them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from truepose.lazy_names import imported_when_used

if TYPE_CHECKING:
    from truepose.files.tolerance import Band, Tolerance
    from truepose.files.units import FileUnit
    from truepose.machine.condition import Condition, Envelope
    from truepose.machine.loader import load
    from truepose.machine.model import Machine
    from truepose.machine.parts import Body, Drive, Guide, Joint, Strut
    from truepose.machine.source_builder import ErrorSource, SourceBuilder, SourceType
    from truepose.machine.workspace import Accuracy, GridAxis, Workspace

_WHERE = {
    "Accuracy": "truepose.machine.workspace",
    "Band": "truepose.files.tolerance",
    "Body": "truepose.machine.parts",
    "Condition": "truepose.machine.condition",
    "Drive": "truepose.machine.parts",
    "Envelope": "truepose.machine.condition",
    "ErrorSource": "truepose.machine.source_builder",
    "FileUnit": "truepose.files.units",
    "GridAxis": "truepose.machine.workspace",
    "Guide": "truepose.machine.parts",
    "Joint": "truepose.machine.parts",
    "Machine": "truepose.machine.model",
    "SourceBuilder": "truepose.machine.source_builder",
    "SourceType": "truepose.machine.source_builder",
    "Strut": "truepose.machine.parts",
    "Tolerance": "truepose.files.tolerance",
    "Workspace": "truepose.machine.workspace",
    "load": "truepose.machine.loader",
}
"""Name -> the module that is imported when it is first used: the library needs none of them."""

__all__ = [
    "Accuracy",
    "Band",
    "Body",
    "Condition",
    "Drive",
    "Envelope",
    "ErrorSource",
    "FileUnit",
    "GridAxis",
    "Guide",
    "Joint",
    "Machine",
    "SourceBuilder",
    "SourceType",
    "Strut",
    "Tolerance",
    "Workspace",
    "load",
]


if not TYPE_CHECKING:  # type checkers know the names above, and refuse all others
    __getattr__ = imported_when_used(__name__, _WHERE)


def __dir__() -> list[str]:
    return sorted(__all__)
