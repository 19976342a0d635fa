"""Thermal expansion of every part: what is warmer than the reference is longer.

    strut           length     expansion * (rise * L + gradient * L^2 / 2)
    screw, scale    scale and offset, so that the point `fixed_at` stays on what holds it
    crank's arm     the base joints that it carries, about its axis
    frame, platform, tool, carriages
                    u = expansion * [rise r + (g . r) r - |r|^2 g / 2]

with L the strut's length at the pose and r the arm from a body's anchor. A slider goes with the
frame where its screw or scale is held. The temperatures are known: there is no band.
`docs/sources/thermal.md` has the derivation and the references.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar, Self

import numpy as np

from truepose.arrays import Floats
from truepose.errors import TrueposeError
from truepose.machine.parts import Body, Drive, Strut
from truepose.sources._expansion import ASKED_BY, located, silent, silent_limbs, twice
from truepose.sources._growth import Growth, along_line
from truepose.sources.deviation import Deviation
from truepose.sources.pose_block import PoseBlock
from truepose.spatial import rotate_about

if TYPE_CHECKING:
    from pydantic import BaseModel

    from truepose.machine import Condition, Machine, SourceBuilder


@dataclass(frozen=True)
class Thermal:
    """Expansion of struts, drives and all bodies, each at its own temperature."""

    name: ClassVar[str] = "thermal"
    doc: ClassVar[str] = "thermal expansion of struts, drives, carriages, frame, platform and tool"
    tables: ClassVar[Mapping[str, type[BaseModel]]] = {}
    sets_overall_edges: ClassVar[bool] = False
    over_region: ClassVar[str] = "lengths"

    requested: bool
    """The file gives temperatures and an expansion, were all at the reference temperature."""

    @classmethod
    def build(cls, parts: SourceBuilder) -> Self | None:
        """Always there, for a condition given later may have temperatures that the file has not."""
        bodies = (parts.platform, parts.frame, parts.tool, *parts.carriages)
        for problem in silent(parts.condition, parts.drives, parts.struts, bodies):
            parts.record(located(parts, problem))
        for problem in silent_limbs(parts.condition, parts.limbs):
            parts.record(located(parts, problem))
        for problem in twice(parts.kernel, parts.drives, parts.struts):
            parts.record(problem)
        every: tuple[Drive | Strut | Body, ...] = (*parts.drives, *parts.struts, *bodies)
        known = any(part.expansion is not None for part in every)
        return cls(requested=known and any(map(parts.has, ASKED_BY)))

    def acts(self, condition: Condition) -> bool:
        """Where the file asks for it, and in any condition that leaves the reference."""
        temperatures = (condition.default_temperature, *condition.part_temperatures.values())
        return (
            self.requested
            or any(t != condition.reference_temperature for t in temperatures)
            or any(np.any(gradient) for gradient in condition.gradients.values())
            or condition.temperature_log is not None
        )

    def deviation(self, machine: Machine, condition: Condition, block: PoseBlock) -> Deviation:
        """The lengths of all struts, and what else moves, m, (n or 1, k); scales are ratios.

        Raises `TrueposeError` (no-expansion) for struts off the reference temperature, and other
        parts whose temperature the condition names, whose expansion the machine does not say; all
        of them at once.
        """
        unsaid = list(silent(condition, machine.drives, machine.struts, machine.bodies))
        unsaid += silent_limbs(condition, machine.limbs)
        if unsaid:
            raise TrueposeError(*unsaid)
        moved = _Moved(machine, condition, block)
        moved.struts()
        for index, drive in enumerate(machine.drives):
            moved.drive(index, drive)
            moved.carriage(drive)
        moved.frame()
        moved.limbs()
        moved.platform_and_tool()
        return moved.deviation()


@dataclass
class _Moved:
    """Gathers what happens to the parameters at the poses of one block, by their names."""

    machine: Machine
    condition: Condition
    block: PoseBlock
    columns: dict[int, Floats] = field(default_factory=dict)
    """Parameter -> shift (n or 1, 1)."""

    def __post_init__(self) -> None:
        kernel = self.machine.kernel
        self._at = {name: index for index, name in enumerate(kernel.parameters)}
        self._nominal = kernel.nominal

    def deviation(self) -> Deviation:
        """All columns together."""
        rows = max((len(values) for values in self.columns.values()), default=1)
        shift = np.empty((rows, len(self.columns)))
        # What is alike at every pose, row by row; then the columns that are not.
        shift[:] = [values[0, 0] for values in self.columns.values()]
        for place, values in enumerate(self.columns.values()):
            if len(values) > 1:
                shift[:, [place]] = values
        return Deviation.of(list(self.columns), shift)

    def struts(self) -> None:
        """Every strut, were it at the reference, so that a condition's rows are always the same."""
        for index, strut in enumerate(self.machine.struts):
            length = self.block.lengths[:, [index]]
            growth = along_line(
                strut.expansion or 0.0,
                self.block.rise(strut.part),
                self.condition.gradient(strut.part)[0],
                length,
            )
            self._add(int(self.machine.kernel.length_parameters[index]), growth)

    def drive(self, index: int, drive: Drive) -> None:
        """The screw or scale that a position is measured by, or the arm of a crank."""
        rise, gradient = self.block.rise(drive.part), self.condition.gradient(drive.part)[0]
        expansion = drive.expansion or 0.0
        if expansion == 0.0 or not (np.any(rise) or gradient):
            return
        if drive.coordinate == "angle":
            arm = Growth(expansion, rise, np.zeros(3), np.zeros(3))
            for strut in self._carried(drive):
                self._shift(f"{strut.part}.base", arm.displacement(self._point(strut, "base")))
            return
        scale, _ = self._driven(drive)
        fixed_at = self._fixed_at(drive)
        strain = np.atleast_2d(scale * expansion * rise)
        self._add(self._at[f"{drive.part}.scale"], strain)
        fixed = -strain * fixed_at
        if gradient:
            way = self.block.drive_joints[:, [index]] - fixed_at
            fixed = fixed + scale * along_line(expansion, 0.0, gradient, way)
        if fixed.any():
            self._add(self._at[f"{drive.part}.offset"], fixed)

    def carriage(self, drive: Drive) -> None:
        """The base joints that a carriage carries, about the point that the drive moves."""
        growth = None if drive.carriage is None else self._growth(drive.carriage)
        if growth is not None and growth.any:
            for strut in self._carried(drive):
                self._shift(f"{strut.part}.base", growth.displacement(self._point(strut, "base")))

    def frame(self) -> None:
        """Where struts stand on the frame, where drives and guides are held by it."""
        frame = self._growth(self.machine.frame)
        if not frame.any:
            return
        # A list, for the order of the columns is that of the results.
        held = [drive for drive in self.machine.drives if self._has_origin(drive)]
        names = [drive.name for drive in held]
        for strut in self.machine.struts:
            if strut.drive not in names:
                self._shift(f"{strut.part}.base", frame.displacement(self._point(strut, "base")))
        for drive in held:
            self._shift(f"{drive.part}.origin", frame.displacement(self._held_at(drive)))
        for guide in self.machine.guides:
            if f"{guide.part}.origin.x" in self._at:
                origin = self._nominal_of(guide.part, "origin")
                self._shift(f"{guide.part}.origin", frame.displacement(origin))
        if frame.gradient.any():
            for index, drive in enumerate(self.machine.drives):
                if drive.name in names:
                    self._on_bent_frame(frame, index, drive)

    def limbs(self) -> None:
        """Limbs that hold the platform and are warmer on one side: they bend."""
        limbs = self.machine.limbs
        gradients = np.array([self.condition.gradient(limb.part) for limb in limbs]).ravel()
        if not gradients.any():
            return
        kernel = self.machine.kernel
        opened = kernel.limb_bend_at(
            self.block.joints, self.block.placements, gradients[np.newaxis]
        )
        for column, values in zip(kernel.limb_parameters, opened.T, strict=True):
            self._add(column, values[:, np.newaxis])

    def _held_at(self, drive: Drive) -> Floats:
        """(3,) where the frame holds a drive: a crank's pivot; where a screw or scale is fixed."""
        origin = self._nominal_of(drive.part, "origin")
        if drive.coordinate == "angle":
            return origin
        scale, offset = self._driven(drive)
        return origin + (scale * self._fixed_at(drive) + offset) * np.array(drive.fields["axis"])

    def _on_bent_frame(self, frame: Growth, index: int, drive: Drive) -> None:
        """A temperature gradient bends the frame: what moves along it, or turns on it, leans.

        A carriage follows its guideway across the axis (along it, its own scale decides, from where
        that is held) and turns with it; an arm turns with its bearing. Both move the base joints
        that they carry.
        """
        origin = self._nominal_of(drive.part, "origin")
        axis = np.asarray(drive.fields["axis"], np.float64)
        scale, offset = self._driven(drive)
        way = scale * self.block.drive_joints[:, [index]] + offset
        for strut in self._carried(drive):
            base = self._point(strut, "base")
            if drive.coordinate == "angle":
                leaning = np.cross(frame.turn(origin), rotate_about(base, axis, way))
                self._shift(f"{strut.part}.base", rotate_about(leaning, axis, -way))
                continue
            carriage = origin + way * axis
            bending = frame.displacement(carriage) - frame.displacement(self._held_at(drive))
            bending -= (bending @ axis)[:, np.newaxis] * axis
            turning = np.cross(frame.turn(carriage), base)
            self._shift(f"{strut.part}.base", bending + turning)

    def platform_and_tool(self) -> None:
        """The points of the platform, and the tool point on the tool that it holds."""
        platform, tool = self._growth(self.machine.platform), self._growth(self.machine.tool)
        if platform.any:
            for strut in self.machine.struts:
                centre = self._point(strut, "platform")
                self._shift(f"{strut.part}.platform", platform.displacement(centre))
                ring = self._at.get(f"{strut.part}.ring_radius")
                if ring is not None:
                    self._add(ring, platform.strain(centre) * self._nominal[ring])
            for guide in self.machine.guides:
                if f"{guide.part}.platform.x" in self._at:
                    point = self._nominal_of(guide.part, "platform")
                    self._shift(f"{guide.part}.platform", platform.displacement(point))
        point = self._nominal_of("tool", None)
        if self.machine.tool.expansion is None:
            # Nobody says what the tool is made of: it is part of the platform.
            if platform.any:
                self._shift("tool", platform.displacement(point))
            return
        moved = tool.displacement(point) if tool.any else np.zeros((1, 3))
        if platform.any:
            held = tool.anchor
            turned = np.cross(platform.turn(held), point - held)
            moved = moved + platform.displacement(held) + turned
        self._shift("tool", moved)

    def _growth(self, body: Body) -> Growth:
        return Growth(
            body.expansion or 0.0,
            self.block.rise(body.part),
            np.array(self.condition.gradient(body.part)),
            np.array(body.anchor),
        )

    def _fixed_at(self, drive: Drive) -> float:
        """The joint coordinate, m or rad, at which what the position is measured by is held."""
        if drive.fixed_at is not None:
            return drive.fixed_at
        scale, offset = self._driven(drive)
        return -offset / scale

    def _driven(self, drive: Drive) -> tuple[float, float]:
        """Scale and offset: where the coordinate q is, the drive is scale q + offset, m or rad."""
        scale, offset = (float(self._nominal[self._at[f"{drive.part}.{key}"]]) for key in _DRIVEN)
        return scale, offset

    def _carried(self, drive: Drive) -> Iterator[Strut]:
        return (strut for strut in self.machine.struts if strut.drive == drive.name)

    def _has_origin(self, drive: Drive) -> bool:
        return f"{drive.part}.origin.x" in self._at

    def _point(self, strut: Strut, end: str) -> Floats:
        return self._nominal_of(strut.part, end)

    def _nominal_of(self, part: str, point: str | None) -> Floats:
        """(3,) nominal coordinates of a point, m."""
        start = part if point is None else f"{part}.{point}"
        return np.array([self._nominal[self._at[f"{start}.{axis}"]] for axis in "xyz"])

    def _shift(self, point: str, displacement: Floats) -> None:
        """Move a point by (n or 1, 3) m; a coordinate that stays gets no column."""
        for axis, name in enumerate("xyz"):
            values = displacement[:, [axis]]
            if values.any():
                self._add(self._at[f"{point}.{name}"], values)

    def _add(self, parameter: int, values: Floats) -> None:
        before = self.columns.get(parameter)
        self.columns[parameter] = values if before is None else before + values


_DRIVEN = ("scale", "offset")


__all__ = ["Thermal"]
