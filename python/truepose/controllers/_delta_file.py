"""The machine file of a delta of which only a firmware's numbers are known.

A firmware takes the two parallel rods of a limb as one line and the effector as a point: its
radius is that of the base-side joints less the effector's, and the platform never tilts. Where the
effector's radius and the spacing of the rods are given besides, the file says the machine as its
`[family]`; else it has one rod a limb and no tilt. What no firmware says is assumed, widely, in
lines whose comments have the word ASSUMED.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

from truepose.controllers._reader import ASSUMED, Assumption, Setting
from truepose.errors import Fault, RequestError

LIMBS = ("a", "b", "c")

WIDE_LENGTH, WIDE_ROD = 1.0, 0.5
"""mm: assumed of radii, heights and places of limbs, and of the length of each rod or arm."""
WIDE_SCALE = "0.2 %"
"""Assumed of how far a drive moves for a step: the pitch of a belt on its pulley."""
ACCURACY = "0.2 mm"
"""Assumed to be asked for: what a printer's nozzle is hoped to keep."""

EFFECTOR, SPACING = "family.effector_radius", "family.spacing"
SETTINGS: Mapping[str, Setting] = {
    EFFECTOR: Setting("from the tool's axis to the middle of each two joints of the effector"),
    SPACING: Setting("distance of the two rods of a pair, with which the tilt becomes known"),
}
"""What a delta's file may be told besides, for a reader's `settings`."""

_NOTHING = 1e-9
"""A component of a unit vector that is rounding."""


@dataclass(frozen=True)
class Rods:
    """What makes two rods of one, mm: the effector's radius and the spacing of the rods."""

    effector_radius: float
    spacing: float


def rods_of(settings: Mapping[str, float | str]) -> Rods | None:
    """The rods as they are given; None where nothing is said.

    Raises `RequestError`: not-positive, and import-incomplete where one of the two is missing.
    """
    given = {key: float(settings[key]) * 1e3 for key in (EFFECTOR, SPACING) if key in settings}
    for key, value in given.items():
        if not value > 0.0:
            message, found = f"--set {key}: not above zero", f"{value:.10g} mm"
            raise RequestError(Fault("not-positive", message, found, "a length, mm").at())
    if len(given) == 2:
        return Rods(round(given[EFFECTOR], 9), round(given[SPACING], 9))
    for key, other in ((EFFECTOR, SPACING), (SPACING, EFFECTOR)):
        if key in given:
            fault = Fault(
                "import-incomplete",
                f"{other} is missing: with {key} alone nothing is known of the tilt",
                f"--set {key}={given[key]:.10g}",
                f"--set {other}=..., too: {SETTINGS[other].doc}",
                "measure it on the machine, or leave both away",
            )
            raise RequestError(fault.at())
    return None


@dataclass(frozen=True, kw_only=True)
class DeltaFile(ABC):
    """A delta in mm and degrees, limb by limb in the controller's order.

    `ends` (3,): joint coordinates where the endstops trip, the upper ends of the travels, and
    `lows` (3,) their lower ones, None where the controller does not say. `workspace`: radius,
    lowest and highest z; `reach_assumed`: how its radius was guessed, a sentence. `home`: z of the
    tool there. `origin`: where the numbers come from.
    """

    name: str
    origin: str
    angles: Sequence[float]
    ends: Sequence[float]
    workspace: tuple[float, float, float]
    rods: Rods | None = None
    lows: Sequence[float] | None = None
    home: float | None = None
    reach_assumed: str | None = None

    family: ClassVar[str]
    drive: ClassVar[str]
    described: ClassVar[str]
    lengths: ClassVar[Sequence[str]]
    """Parameters of the family that are known to `WIDE_LENGTH`."""

    @abstractmethod
    def parameters(self, rods: Rods) -> Iterator[tuple[str, float | Sequence[float]]]:
        """The family's, in the file's units."""

    @abstractmethod
    def rows(self, limb: int) -> Iterator[tuple[str, str]]:
        """Of one limb with one rod: keys of the drive, then of the strut, behind an empty one."""

    @abstractmethod
    def groups(self) -> Iterator[tuple[str, Mapping[str, float]]]:
        """What varies together: a name, and the parameters with their shares of `WIDE_LENGTH`."""

    @abstractmethod
    def lever(self, rods: Rods) -> float:
        """How far from the tool's axis a limb goes that stands beside its angle, mm."""

    def struts(self, limb: int) -> tuple[str, ...]:
        """Names of a limb's rods."""
        name = LIMBS[limb]
        return (name,) if self.rods is None else (f"{name}1", f"{name}2")

    def assumptions(self) -> tuple[Assumption, ...]:
        """What the file says and no firmware does."""
        told = [
            Assumption(
                f"radii, endstops and places of limbs to ±{WIDE_LENGTH:g} mm, rods to "
                f"±{WIDE_ROD:g} mm, steps to ±{WIDE_SCALE}",
                "tolerance",
            ),
            Assumption(f"an accuracy of {ACCURACY} is asked for", "accuracy.target"),
        ]
        if self.lows is None:
            sentence = "drives go down as far as the workspace needs"
            told.append(Assumption(sentence, "drive.*.travel"))
        if self.reach_assumed is not None:
            told.append(Assumption(self.reach_assumed, "workspace.cylinder"))
        if self.rods is None:
            told.append(
                Assumption(
                    "one rod a limb, and so no tilt: how the tool tilts is unknown until "
                    f"--set {EFFECTOR}=... and --set {SPACING}=... say how the rods stand",
                    "machine.dof",
                )
            )
        return tuple(told)

    def text(self) -> str:
        """The machine file."""
        shape = self._rows() if self.rods is None else self._family(self.rods)
        return "\n".join([*self._head(), *shape, *self._tail(), ""])

    def _head(self) -> Iterator[str]:
        rods = "one rod" if self.rods is None else "two parallel rods"
        yield "schema = 1"
        yield from ("", "[machine]", f"name = {quoted(self.name)}")
        yield f'description = "{self.described}, {rods} each."'
        yield f"origin = {quoted(self.origin)}"
        if self.rods is None:
            yield 'dof = ["x", "y", "z"] # each pair of rods is one line, as the controller has it'
        yield from ("", "[units]", 'length = "mm"', 'angle = "deg"')

    def _family(self, rods: Rods) -> Iterator[str]:
        yield from ("", "[family]", f'kind = "{self.family}"')
        for key, value in self.parameters(rods):
            yield f"{key} = {_listed(value)}"
        for limb in range(len(LIMBS)):
            yield from ("", "[[drive]]", f'name = "{LIMBS[limb]}"', self._travel(limb))

    def _rows(self) -> Iterator[str]:
        yield from ("", "[each.drive]", f'kind = "{self.drive}"', 'working_mode = "+"')
        yield from ("", "[each.strut]", "platform = [0, 0, 0] # the tool point")
        for limb, name in enumerate(LIMBS):
            yield from ("", "[[drive]]", f'name = "{name}" # at {self.angles[limb]:.10g} degrees')
            for key, value in self.rows(limb):
                if not key:
                    yield self._travel(limb)
                    yield from ("", "[[strut]]", f'name = "{name}"', f'drive = "{name}"')
                else:
                    yield f"{key} = {value}"

    def _travel(self, limb: int) -> str:
        low = self.lowest() if self.lows is None else self.lows[limb]
        note = f"; the lower end is {ASSUMED}" if self.lows is None else ""
        return f"travel = [{low!r}, {self.ends[limb]!r}] # up to the endstop{note}"

    def _tail(self) -> Iterator[str]:
        yield from ("", f"[tolerance] # {ASSUMED}, widely: put in what is known")
        yield f'"drive.*.offset" = {self.wide_end()} # endstops'
        yield f'"drive.*.scale" = "{WIDE_SCALE}" # steps'
        yield f'"strut.*.length" = {WIDE_ROD} # rods'
        yield from self._grouped() if self.rods is None else self._of_family(self.rods)
        radius, low, high = self.workspace
        step = max(radius, high - low) / 5.0
        cylinder = f"{{ radius = {radius!r}, z = [{low!r}, {high!r}], step = {step:.6g} }}"
        note = "" if self.reach_assumed is None else f" # {ASSUMED}"
        yield from ("", "[workspace]")
        if self.home is not None:
            yield f"home = {{ z = {self.home!r} }}"
        yield f"cylinder = {cylinder}{note}"
        yield from ("", "[accuracy]", f'target = "{ACCURACY}" # {ASSUMED}')

    def _grouped(self) -> Iterator[str]:
        for group, members in self.groups():
            for parameter, share in members.items():
                if abs(share) > _NOTHING:
                    band = f"band = {WIDE_LENGTH * abs(share):.9g}"
                    sign = ", sign = -1" if share < 0.0 else ""
                    yield f'"{parameter}" = {{ {band}, group = "{group}"{sign} }}'

    def _of_family(self, rods: Rods) -> Iterator[str]:
        for parameter in self.lengths:
            yield f'"family.{parameter}" = {WIDE_LENGTH}'
        for name in LIMBS[:-1]:  # the last one says where y is
            band = math.degrees(WIDE_LENGTH / self.lever(rods))
            yield f'"family.angle.{name}" = {band:.4g} # {WIDE_LENGTH:g} mm sideways'

    @abstractmethod
    def lowest(self) -> float:
        """The lower end of the travels where the controller does not say it."""

    def wide_end(self) -> str:
        """Half band of the endstops, in the unit of the joint coordinates."""
        return repr(WIDE_LENGTH)

    def sideways(self) -> Iterator[tuple[str, Mapping[str, float]]]:
        """Limbs beside their places on the circle; the last one says where y is."""
        for limb, name in enumerate(LIMBS[:-1]):
            across = along(self.angles[limb] + 90.0)
            parts = [f"strut.{strut}.platform" for strut in self.struts(limb)]
            yield f"limb {name} sideways", components(parts, across)


@dataclass(frozen=True, kw_only=True)
class LinearDeltaFile(DeltaFile):
    """A linear delta: joint coordinates are the heights of the carriages' joints over z = 0.

    `radius` (3,): from the tool's axis to each carriage's joints, less the effector's; `arms` (3,):
    the rods.
    """

    radius: Sequence[float]
    arms: Sequence[float]

    family: ClassVar[str] = "linear_delta"
    drive: ClassVar[str] = "slider"
    described: ClassVar[str] = "Three carriages on vertical guideways"
    lengths: ClassVar[Sequence[str]] = ("radius",)

    def parameters(self, rods: Rods) -> Iterator[tuple[str, float | Sequence[float]]]:
        """Radii with the effector's."""
        yield "radius", _one([radius + rods.effector_radius for radius in self.radius])
        yield "effector_radius", rods.effector_radius
        yield "rod", _one(self.arms)
        yield "spacing", rods.spacing
        yield "angle", self.angles

    def rows(self, limb: int) -> Iterator[tuple[str, str]]:
        """A carriage whose one joint is its origin."""
        x, y = (self.radius[limb] * part for part in along(self.angles[limb]))
        yield "origin", f"[{x!r}, {y!r}, 0]"
        yield "axis", "[0, 0, 1]"
        yield "", ""
        yield "base", "[0, 0, 0]"
        yield "length", repr(self.arms[limb])

    def lever(self, rods: Rods) -> float:
        """The nearest carriage."""
        return min(self.radius) + rods.effector_radius

    def lowest(self) -> float:
        """mm, where no carriage comes."""
        return min(0.0, self.workspace[1])

    def groups(self) -> Iterator[tuple[str, Mapping[str, float]]]:
        """All carriages outwards, and two of them sideways."""
        outwards: dict[str, float] = {}
        for limb, name in enumerate(LIMBS):
            outwards |= components([f"drive.{name}.origin"], along(self.angles[limb]))
        yield "delta radius", outwards
        yield from self.sideways()


def along(degrees: float) -> tuple[float, float]:
    """x and y of the unit vector at an angle."""
    angle = math.radians(degrees)
    return math.cos(angle), math.sin(angle)


def components(parts: Iterable[str], direction: Sequence[float]) -> dict[str, float]:
    """The parameters x, y (z) of parts, and their shares of a step along a direction."""
    return {
        f"{part}.{axis}": share
        for part in parts
        for axis, share in zip("xyz", direction, strict=False)
    }


def quoted(text: str) -> str:
    """Text as a string of TOML, on one line."""
    plain = " ".join(text.split()).replace("\\", "\\\\").replace('"', '\\"')
    return '"' + "".join(mark for mark in plain if mark.isprintable()) + '"'


def _one(values: Sequence[float]) -> float | Sequence[float]:
    """One number for all limbs, where they have the same."""
    return values[0] if len(set(values)) == 1 else values


def _listed(value: float | Sequence[float]) -> str:
    if isinstance(value, float):
        return repr(value)
    return f"[{', '.join(map(repr, value))}]"


__all__ = [
    "EFFECTOR",
    "LIMBS",
    "SETTINGS",
    "SPACING",
    "WIDE_LENGTH",
    "DeltaFile",
    "LinearDeltaFile",
    "Rods",
    "along",
    "components",
    "quoted",
    "rods_of",
]
