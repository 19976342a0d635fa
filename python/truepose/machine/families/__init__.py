"""The families of machines: what `[family]` may name, one file a family.

A new family is a file beside the others and its line in `REGISTRY`: the machine file's validation,
its documentation, `truepose init` and the laws of the tests walk it.
"""

from __future__ import annotations

from truepose.machine.families._family import MachineFamily
from truepose.machine.families.hexapod import HexapodFamily
from truepose.machine.families.linear_delta import LinearDeltaFamily
from truepose.machine.families.rotary_delta import RotaryDeltaFamily

REGISTRY: tuple[type[MachineFamily], ...] = (
    LinearDeltaFamily,
    RotaryDeltaFamily,
    HexapodFamily,
)

__all__ = ["REGISTRY", "MachineFamily"]
