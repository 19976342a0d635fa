"""Machine file -> machine: TOML, validated with units and dimensions, handed to the kernel.

Sources bring models for the keys that they read; the loader is given their registry, so that
nothing here imports them.
"""

from __future__ import annotations

from truepose.files.tolerance import Band, Tolerance
from truepose.files.units import FileUnit
from truepose.machine.condition import Condition, Envelope
from truepose.machine.loader import load
from truepose.machine.model import Machine
from truepose.machine.parts import Body, Drive, Guide, Joint, Strut
from truepose.machine.source_builder import ErrorSource, SourceBuilder, SourceType
from truepose.machine.workspace import Accuracy, GridAxis, Workspace

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
