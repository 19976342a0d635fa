"""The families of machines: what `[family]` may name, one file a family.

A new family is a file beside the others and its line in `REGISTRY`: the machine file's validation,
its documentation, `truepose init` and the laws of the tests walk it.
"""

from __future__ import annotations

from truepose.machine.families._family import MachineFamily
from truepose.machine.families.five_bar import FiveBarFamily
from truepose.machine.families.hexaglide import HexaglideFamily
from truepose.machine.families.hexapod import HexapodFamily
from truepose.machine.families.hexapod_telescope import HexapodTelescopeFamily
from truepose.machine.families.linapod import LinapodFamily
from truepose.machine.families.linear_delta import LinearDeltaFamily
from truepose.machine.families.orthoglide import OrthoglideFamily
from truepose.machine.families.overconstrained import OverconstrainedFamily
from truepose.machine.families.planar_collinear import PlanarCollinearFamily
from truepose.machine.families.planar_crossed import PlanarCrossedFamily
from truepose.machine.families.planar_two_slider import PlanarTwoSliderFamily
from truepose.machine.families.prs3 import PrsHeadFamily
from truepose.machine.families.rotary_delta import RotaryDeltaFamily
from truepose.machine.families.rpr3 import PlanarRprFamily
from truepose.machine.families.rps3 import RpsFamily
from truepose.machine.families.rrr3 import PlanarRrrFamily
from truepose.machine.families.tricept import TriceptFamily
from truepose.machine.families.tripod import TripodFamily
from truepose.machine.families.walking_6psu import WalkingPsuFamily

REGISTRY: tuple[type[MachineFamily], ...] = (
    PlanarTwoSliderFamily,
    PlanarCrossedFamily,
    PlanarCollinearFamily,
    FiveBarFamily,
    PlanarRprFamily,
    PlanarRrrFamily,
    OverconstrainedFamily,
    LinearDeltaFamily,
    RotaryDeltaFamily,
    OrthoglideFamily,
    TripodFamily,
    HexapodFamily,
    HexapodTelescopeFamily,
    LinapodFamily,
    HexaglideFamily,
    WalkingPsuFamily,
    TriceptFamily,
    PrsHeadFamily,
    RpsFamily,
)

__all__ = ["REGISTRY", "MachineFamily"]
