"""A machine with limbs at a pose as a frame of beams: what is bent, where, and how joints let go.

The geometry is the file's and the pose's; every part is put down here as what it is (a beam between
two nodes, a joint between two nodes of one place), and nothing of the kernel's statics is used.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from frame_model import RIGID, Beam, Frame, triad
from reference_kinematics import rotation_of_quaternion, turned_about
from truepose.machine import Drive, Machine, chains
from truepose.machine import limbs as parts

Array = NDArray[np.float64]


class MachineFrame:
    """The frame of a machine at one pose; `tool` is the node of its tool point."""

    def __init__(self, machine: Machine, joints: Array, placement: Array) -> None:
        self.machine, self.joints = machine, joints
        self.frame = Frame()
        self.position, self.rotation = placement[:3], rotation_of_quaternion(placement[3:])
        self.values = dict(zip(machine.parameters, machine.nominal.tolist(), strict=True))
        self.tool = self.frame.node(self.position)
        self.carriages: dict[str, int] = {}
        self.beams: list[tuple[parts.Limb, int, int, Beam, Array]] = []
        in_limbs = {limb.strut for limb in machine.limbs}
        for strut in machine.struts:
            if strut.name not in in_limbs:
                self._strut(strut.name)
        for limb in machine.limbs:
            self._tube(limb) if limb.strut is None else self._limb(limb)

    def moved(self, wrench: ArrayLike) -> Array:
        """(6,) displacement and turn of the tool under a wrench (6,) there."""
        self.frame.load(self.tool, wrench)
        found = self.frame.solve()[self.tool]
        self.frame.load(self.tool, -np.asarray(wrench, float))
        return found

    def load_platform(self, weight: Array) -> None:
        """The platform's mass where it is; `weight` (3,): of a kilogram, N."""
        body = self.machine.platform
        node = self._on_platform(np.array(body.centre_of_mass))
        self.frame.load(node, [*(body.mass * weight), 0.0, 0.0, 0.0])

    def load_beams(self, limb: parts.Limb, weight: Array) -> None:
        """A weight (3,), N, spread evenly over the beams of a limb."""
        own = [(first, second) for of, first, second, *_ in self.beams if of is limb]
        points = self.frame.points
        lengths = [np.linalg.norm(points[second] - points[first]) for first, second in own]
        for first, second in own:
            self.frame.uniform(first, second, weight / sum(lengths))

    def load_tube(self, limb: parts.Limb, per_metre: Array, length: float) -> None:
        """A tube's weight per metre (3,), N/m, also of what is beyond the joint it slides in."""
        self.load_beams(limb, per_metre * self._length(limb))
        first = next(first for of, first, *_ in self.beams if of is limb)
        last = [second for of, _, second, *_ in self.beams if of is limb][-1]
        back = self.frame.points[first] - self.frame.points[last]
        beyond = length - self._length(limb)
        weight = per_metre * beyond
        lever = back / np.linalg.norm(back) * beyond / 2.0
        self.frame.load(first, [*weight, *np.cross(lever, weight)])

    def _length(self, limb: parts.Limb) -> float:
        points = self.frame.points
        own = [(first, second) for of, first, second, *_ in self.beams if of is limb]
        return float(sum(np.linalg.norm(points[b] - points[a]) for a, b in own))

    def warm_beams(self, along_y: float, along_z: float) -> None:
        """A temperature gradient across every beam, K/m: where it is warmer it is longer."""
        for limb, first, second, beam, y in self.beams:
            expansion = limb.beams[0].expansion
            assert expansion is not None
            curvature = [expansion * along_z, -expansion * along_y]
            self.frame.curved(first, second, beam, y, curvature)

    def _on_platform(self, point: Array) -> int:
        tool = self._point("tool")
        node = self.frame.node(self.position + self.rotation @ (point - tool))
        self.frame.rigid(self.tool, node)
        return node

    def _point(self, name: str) -> Array:
        return np.array([self.values[f"{name}.{axis}"] for axis in "xyz"])

    def _ground(self, point: Array) -> int:
        node = self.frame.node(point)
        self.frame.clamp(node)
        return node

    def _strut(self, name: str) -> None:
        """Between two ball joints, its drive in series."""
        strut = next(strut for strut in self.machine.struts if strut.name == name)
        drive = next(drive for drive in self.machine.drives if drive.name == strut.drive)
        end = self._on_platform(self._point(f"strut.{name}.platform"))
        base = self._point(f"strut.{name}.base")
        if drive.chain:
            start = self._on_carriage(drive, base)
        else:
            assert drive.kind == "telescopic"
            assert drive.stiffness is None
            start = self._ground(base)
        length = float(np.linalg.norm(self.frame.points[end] - self.frame.points[start]))
        stiffness = strut.axial_stiffness(length)
        assert stiffness is not None
        self.frame.bar(start, end, stiffness)

    def _on_carriage(self, drive: Drive, base: Array) -> int:
        """A base joint on a body that a drive moves, whose chain stands there once."""
        at = list(self.machine.drives).index(drive)
        travelled = drive.fields["scale"] * self.joints[at] + drive.fields["offset"]
        axis = np.array(drive.fields["axis"], float)
        origin = np.array(drive.fields["origin"], float)
        turned = np.eye(3)
        if drive.kind == "crank":
            turned = turned_about(axis, travelled)
        else:
            origin = origin + travelled * axis
        if drive.name not in self.carriages:
            self.carriages[drive.name] = self._body(drive, origin, turned, axis)
        node = self.frame.node(origin + turned @ base)
        self.frame.rigid(self.carriages[drive.name], node)
        return node

    def _body(self, drive: Drive, origin: Array, turned: Array, axis: Array) -> int:
        """The node of a carriage, or of the end of an arm."""
        held = RIGID if drive.stiffness is None else drive.stiffness
        joint, *beams = drive.chain
        assert isinstance(joint, chains.ChainJoint)
        node = self.frame.node(origin)
        ground = self._ground(origin)
        if joint.kind == "prismatic":
            side = [0.3, 0.5, 0.8] if joint.axis is None else joint.axis
            self.frame.joint(ground, node, triad(axis, side), [held, *joint.across, *joint.tilt])
            return node
        springs = [joint.axial, joint.radial, joint.radial, held, *joint.tilt[1:]]
        self.frame.joint(ground, node, triad(axis, [0.3, 0.5, 0.8]), springs)
        carried = [s for s in self.machine.struts if s.drive == drive.name]
        mean = np.mean([self._point(f"strut.{s.name}.base") for s in carried], axis=0)
        foot = (mean @ axis) * axis
        start = self.frame.node(origin + turned @ foot)
        self.frame.rigid(node, start)
        reach = float(np.linalg.norm(mean - foot))
        stated = sum(b.length or 0.0 for b in beams if isinstance(b, chains.Beam))
        station = 0.0
        for beam in beams:
            assert isinstance(beam, chains.Beam)
            station += reach - stated if beam.length is None else beam.length
            end = self.frame.node(origin + turned @ (foot + (mean - foot) * (station / reach)))
            self.frame.beam(start, end, beam_of(beam), turned @ axis)
            start = end
        return start

    def _limb(self, limb: parts.Limb) -> None:
        """A strut that also keeps the platform in a plane, from its carriage or the frame."""
        strut = next(strut for strut in self.machine.struts if strut.name == limb.strut)
        at, drive = next(
            (at, drive) for at, drive in enumerate(self.machine.drives) if drive.name == strut.drive
        )
        base = self._point(f"strut.{strut.name}.base")
        held = RIGID if drive.stiffness is None else drive.stiffness
        axis = np.array(limb.axis or [0.3, 0.5, 0.8])
        chain = list(limb.chain)
        if drive.kind == "slider":
            way = np.array(drive.fields["axis"], float)
            travelled = drive.fields["scale"] * self.joints[at] + drive.fields["offset"]
            carriage = np.array(drive.fields["origin"], float) + travelled * way
            guidance = chain.pop(0)
            assert isinstance(guidance, chains.ChainJoint)
            on_way = self.frame.node(carriage)
            self.frame.joint(
                self._ground(carriage),
                on_way,
                triad(way, axis),
                [held, *guidance.across, *guidance.tilt],
            )
            start = self.frame.node(carriage + base)
            self.frame.rigid(on_way, start)
            held = RIGID
        else:
            start = self._ground(base)
        end = self._on_platform(self._point(f"strut.{strut.name}.platform"))
        self._chain(limb, chain, start, end, axis, held)

    def _tube(self, limb: parts.Limb) -> None:
        """A tube on the platform that slides in a universal joint of the frame."""
        line, cross = (
            next(g for g in self.machine.guides if g.name in limb.guides and g.kind == kind)
            for kind in ("line", "universal")
        )
        start = self._ground(self._point(f"{line.part}.origin"))
        end = self._on_platform(self._point(f"{line.part}.platform"))
        y = self.rotation @ np.array(limb.axis)
        self._cross = np.cross(np.array(cross.fields["base_axis"]), y)
        self._chain(limb, list(limb.chain), start, end, y, 0.0)

    def _chain(
        self,
        limb: parts.Limb,
        chain: Sequence[chains.ChainJoint | chains.Beam],
        start: int,
        end: int,
        y: Array,
        held: float,
    ) -> None:
        points = self.frame.points
        along = points[end] - points[start]
        length = float(np.linalg.norm(along))
        stated = sum(b.length for b in limb.beams if b.length is not None)
        station, node = 0.0, start
        for number, part in enumerate(chain):
            last = number == len(chain) - 1
            here = points[start] + along * (station / length)
            if isinstance(part, chains.Beam):
                station += length - stated if part.length is None else part.length
                to = points[start] + along * (station / length)
                following = end if last else self.frame.node(to)
                beam = beam_of(part)
                self.frame.beam(node, following, beam, y)
                self.beams.append((limb, node, following, beam, y))
            else:
                following = end if last else self.frame.node(here)
                self._let_go(part, node, following, triad(along, y), y, held)
            node = following

    def _let_go(
        self,
        part: chains.ChainJoint,
        first: int,
        second: int,
        of_limb: Array,
        axis: Array,
        held: float,
    ) -> None:
        joint = self.frame.joint
        across = [part.axial, part.radial, part.radial]
        if part.kind == "revolute":
            joint(first, second, triad(axis, of_limb[0]), [*across, 0.0, *part.tilt[1:]])
        elif part.kind == "spherical":
            joint(first, second, of_limb, [*across, 0.0, 0.0, 0.0])
        elif part.kind == "universal" and not hasattr(self, "_cross"):
            # Of a strut: the twist is held, and nothing twists a strut that ends in a ball.
            joint(first, second, of_limb, [*across, part.tilt[0], 0.0, 0.0])
        elif part.kind == "universal":
            joint(first, second, of_limb, [*across, 0.0, 0.0, 0.0])
            joint(first, second, triad(self._cross, axis), [0.0] * 3 + [part.tilt[0], 0.0, 0.0])
        else:
            # Along its way the drive holds it, or, in a tube's guidance, nothing.
            joint(first, second, of_limb, [held, *part.across, *part.tilt])


def beam_of(beam: chains.Beam) -> Beam:
    """The same numbers as a beam of the frame; a rigid one is very stiff."""
    section = beam.section
    assert section is not None
    assert math.isfinite(beam.modulus)
    return Beam(
        beam.modulus,
        beam.shear_modulus,
        section.area,
        section.about_y,
        section.about_z,
        section.torsion,
        section.shear_y,
        section.shear_z,
    )
