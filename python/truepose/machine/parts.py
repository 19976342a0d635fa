"""The parts of a machine as its file says them: drives, struts, joints and bodies, SI."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from truepose.machine.chains import Beam, ChainJoint, Vector

Fields = Mapping[str, float | tuple[float, ...]]

BODIES = ("platform", "frame", "tool")
"""Parts that every machine has once."""

_CARRIAGE = "carriage."
"""How the path of a carriage begins: `carriage.d1` is that of drive d1."""


_LIMB = "limb."


def carriage_part(drive: str) -> str:
    """Path of the carriage of a drive, by the drive's name."""
    return f"{_CARRIAGE}{drive}"


def is_body(part: str) -> bool:
    """Whether a part, by its path, extends along three axes: one of `BODIES`, or a carriage."""
    return part in BODIES or part.startswith(_CARRIAGE)


def limb_part(limb: str) -> str:
    """Path of a limb, by its name."""
    return f"{_LIMB}{limb}"


def is_limb(part: str) -> bool:
    """Whether a part, by its path, is a limb: it has a temperature gradient and no temperature."""
    return part.startswith(_LIMB)


def gives_way_only(parameter: str) -> bool:
    """Whether a parameter is nothing but how a limb or a carriage gives way.

    Such are zero in every machine that carries no load. They are neither toleranced nor identified:
    as errors they would repeat lengths, origins and directions.
    """
    table, _, name = parameter.partition(".")
    own = name.partition(".")[2]
    return (table == "guide" and own.partition(".")[0] == "offset") or (
        table == "drive" and own.startswith(_CARRIAGE)
    )


def in_series(*stiffnesses: float | None) -> float | None:
    """Stiffness of springs in series; a spring that is None, or infinite, is rigid.

    None where all of them are rigid.
    """
    compliance = sum(1.0 / stiffness for stiffness in stiffnesses if stiffness is not None)
    return 1.0 / compliance if compliance > 0.0 else None


@dataclass(frozen=True)
class Joint:
    """The passive joint at one end of a strut.

    `kind`: spherical, universal, revolute or flexure. `stiffness`: N/m along the strut, or None,
    rigid.
    `clearance`, `axial_clearance` (m): total play of the pair, across and along a revolute's axis.
    `axis`: of a revolute; of another, the direction from which `angle_limit` (rad, the largest
    angle between it and the strut) counts. Axes of the carriage or frame at the base, of the
    platform at the platform.
    """

    kind: str = "spherical"
    stiffness: float | None = None
    clearance: float = 0.0
    axial_clearance: float = 0.0
    axis: Vector | None = None
    angle_limit: float | None = None


class _WithFields:
    """What has `fields` of its element: read-only, and picklable all the same."""

    fields: Fields

    def __post_init__(self) -> None:
        object.__setattr__(self, "fields", MappingProxyType(dict(self.fields)))

    def __getstate__(self) -> dict[str, object]:
        return vars(self) | {"fields": dict(self.fields)}

    def __setstate__(self, state: dict[str, object]) -> None:
        fields = state["fields"]
        assert isinstance(fields, dict)
        vars(self).update(state | {"fields": MappingProxyType(fields)})


@dataclass(frozen=True)
class Drive(_WithFields):
    """An actuated joint. `travel` and `coordinate`: m (`length`) or rad (`angle`).

    `fields` are the element's own (origin, axis, offset, ...) as the file gives them, SI, base
    frame; `drawing` is how the element is drawn (`line`, `circle`, `none`).

    `feedback`: the position is measured at the `motor`, so that screw, backlash and lead come
    between it and the carriage, or `direct` on the carriage. `expansion` (1/K) is that of what the
    position is measured by (screw, rack or scale), which is fixed at the joint coordinate
    `fixed_at`; None: that at which a telescopic strut would have no length. `stiffness`: N/m, or
    N m/rad of a crank, of all that the file names, in series; None: rigid. `mass` (kg) is that of
    the `carriage`, the body between the drive's point and the struts' base joints; None where the
    drive moves none. `chain`: what lies between the frame and the body that it moves, a
    carriage or an arm; empty where that is rigid.
    """

    name: str
    kind: str
    coordinate: str
    travel: tuple[float, float]
    working_mode: str | None
    fields: Fields
    drawing: str
    feedback: str = "motor"
    material: str | None = None
    expansion: float | None = None
    fixed_at: float | None = 0.0
    stiffness: float | None = None
    mass: float = 0.0
    carriage: Body | None = None
    chain: tuple[ChainJoint | Beam, ...] = ()

    @property
    def part(self) -> str:
        """Its path: `drive.d1`."""
        return f"drive.{self.name}"

    @property
    def held_stiffness(self) -> float | None:
        """Stiffness between what is measured and what moves: a direct scale sees all the rest."""
        return None if self.feedback == "direct" else self.stiffness


@dataclass(frozen=True)
class Strut:
    """A strut's properties: what it is made of, not where it is (that is in the parameters).

    `drive` is the drive that carries its base joint, None on the frame. `area` in m^2, `modulus` in
    Pa, `expansion` in 1/K, `stiffness` (axial, outright) in N/m; None where the file says nothing.
    `mass` in kg, its centre at the fraction `centre_of_mass` of the way from the base joint to the
    platform joint. `base_stiffness` (N/m, infinite where rigid) is that of the carriage or frame at
    the base joint, along its x y z; None: rigid. `ring_axis`: of the ring on which its platform
    joint slides, platform axes.
    """

    name: str
    drive: str | None
    area: float | None
    modulus: float | None
    expansion: float | None
    stiffness: float | None
    material: str | None
    mass: float = 0.0
    centre_of_mass: float = 0.5
    base_joint: Joint = field(default_factory=Joint)
    platform_joint: Joint = field(default_factory=Joint)
    base_stiffness: Vector | None = None
    ring_axis: Vector | None = None

    @property
    def part(self) -> str:
        """Its path: `strut.1`."""
        return f"strut.{self.name}"

    def axial_stiffness(self, length: float) -> float | None:
        """N/m of the strut `length` m long: outright, else modulus * area / length, else None."""
        if self.stiffness is not None:
            return self.stiffness
        if self.area is None or self.modulus is None:
            return None
        return self.modulus * self.area / length

    @property
    def stiffness_known(self) -> bool:
        """Whether the file says how stiff the strut itself is."""
        return self.axial_stiffness(1.0) is not None

    @property
    def joints(self) -> tuple[Joint, Joint]:
        """At the base and at the platform."""
        return self.base_joint, self.platform_joint

    @property
    def base_compliance(self) -> Vector:
        """m/N of the carriage or frame at the base joint, along its x y z."""
        if self.base_stiffness is None:
            return (0.0, 0.0, 0.0)
        x, y, z = (0.0 if math.isinf(k) else 1.0 / k for k in self.base_stiffness)
        return (x, y, z)


@dataclass(frozen=True)
class Body:
    """The platform with the spindle, the frame, the tool, or a drive's carriage.

    `mass` in kg, `centre_of_mass` in platform axes, m. `expansion` in 1/K, None where the file says
    nothing; it grows about `anchor` (m; base axes of the frame, platform axes of platform and tool,
    of a carriage its point that the drive moves), and a tool from its anchor to the tool point.
    """

    part: str
    mass: float = 0.0
    centre_of_mass: Vector = (0.0, 0.0, 0.0)
    material: str | None = None
    expansion: float | None = None
    anchor: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Guide(_WithFields):
    """A passive limb. `fields` are its element's own (origin, normal, ...), SI."""

    name: str
    kind: str
    fields: Fields

    @property
    def part(self) -> str:
        """Its path: `guide.g1`."""
        return f"guide.{self.name}"
