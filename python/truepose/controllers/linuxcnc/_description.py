"""What LinuxCNC has to know of a machine: its names, units, limits and pins."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from truepose._kernel import STATUS
from truepose.arrays import Codes, Flags, Floats
from truepose.controllers._export import unsupported_machine
from truepose.controllers._template import one_line
from truepose.controllers.c import Program
from truepose.machine import Drive, Guide, Machine, Strut

FREEDOMS = ("x", "y", "z", "a", "b", "c")
COMPONENTS = ("x", "y", "z", "rx", "ry", "rz")
MILLIMETRE = 1e-3
DEGREE = math.pi / 180.0

MOST_JOINTS = 9
"""LinuxCNC's axes are X Y Z A B C U V W; a machine has as many joints as commanded freedoms."""

PINS = "truepose"
"""What the names of pins begin with where no prefix is asked for, and in the templates always."""

LONGEST_NAME = 40
"""HAL names have at most 47 characters."""

_PIN = re.compile(rf"\b{PINS}(?=[.-])")

HELD = 0.1
"""Half width of the box, mm or degrees, along an axis that the workspace holds at one value.

A feedback pose is off by rounding, and a corrected program asks for a little of every axis: limits
of no width would refuse every move.
"""

WRENCHES = ("force-x", "force-y", "force-z", "moment-x", "moment-y", "moment-z")
"""Pins, in the order of a wrench."""


@dataclass(frozen=True)
class Description:
    """A machine in LinuxCNC's terms.

    `units` (n_joint,): m or rad of one machine unit, mm or degree, of each joint. `arms`
    (n_joint,): by how many m a joint moves what it carries, per m or rad of its coordinate.
    `temperature_parts`: parts whose temperature counts, in the order of the C. `pins`: what the
    names of pins begin with.
    """

    machine: Machine
    pins: str
    module: str
    units: Floats
    arms: Floats
    temperature_parts: tuple[str, ...]
    wrench_matters: bool

    @classmethod
    def of(cls, machine: Machine, program: Program, pins: str = PINS) -> Description:
        """Raises `RequestError` (controller-cannot) where LinuxCNC has no place for it."""
        if len(machine.joints) > MOST_JOINTS:  # pragma: no cover - the kernel has six freedoms
            raise unsupported_machine(
                "linuxcnc",
                machine,
                f"{len(machine.joints)} joints",
                f"at most {MOST_JOINTS}",
                "correct the programs instead: truepose gcode",
            )
        turning = [drive.coordinate == "angle" for drive in machine.drives]
        return cls(
            machine,
            pins,
            f"{pins}_{_stem(machine, LONGEST_NAME - len(pins) - 1)}",
            np.where(turning, DEGREE, MILLIMETRE),
            _arms(machine),
            program.temperature_parts,
            program.wrench_matters,
        )

    def with_pins(self, text: str) -> str:
        """A template or line in which names of pins and signals begin with `truepose`, renamed."""
        return _PIN.sub(self.pins, text)

    @property
    def title(self) -> str:
        """The machine's name, safe anywhere."""
        return one_line(self.machine.name)

    @property
    def home(self) -> Floats:
        """(6,) the home pose x y z a b c, m and rad; 0 where the platform has no freedom."""
        pose = np.zeros(6)
        pose[[FREEDOMS.index(name) for name in self.machine.dof]] = self.machine.home
        return pose

    @property
    def commanded_home(self) -> Floats:
        """(n_commanded,) home, m and rad."""
        return self.home[self.freedoms]

    @property
    def freedoms(self) -> list[int]:
        """Positions of the commanded freedoms among x y z a b c."""
        return [FREEDOMS.index(name) for name in self.machine.commanded]

    @property
    def pose_units(self) -> Floats:
        """(n_commanded,) m or rad of one mm or degree."""
        return np.where(np.array(self.freedoms) < 3, MILLIMETRE, DEGREE)

    @property
    def locked(self) -> tuple[str, ...]:
        """Axes of LinuxCNC that the machine does not have: it has no such freedom."""
        return tuple(name for name in FREEDOMS if name not in self.machine.dof)

    @property
    def following(self) -> tuple[str, ...]:
        """Freedoms that are no axes of LinuxCNC: they are not commanded, the others make them."""
        machine = self.machine
        return tuple(name for name in machine.dof if name not in machine.commanded)

    @property
    def reach(self) -> tuple[Floats, Floats]:
        """(n_commanded,) ends of the file's workspace, home included, m and rad."""
        poses, home = self.machine.poses(), self.commanded_home
        return np.minimum(poses.min(axis=0), home), np.maximum(poses.max(axis=0), home)

    @property
    def held(self) -> Flags:
        """(n_commanded,) axes that the workspace holds at one value, or nearly."""
        low, high = self.reach
        held: Flags = high - low < 2.0 * HELD * self.pose_units
        return held

    @property
    def wrenches(self) -> list[int]:
        """Components of a wrench that the platform can give way to; none where nothing gives."""
        if not self.wrench_matters:
            return []
        return [COMPONENTS.index(name) for name in self.machine.components]

    @property
    def travels(self) -> Floats:
        """(n_joint, 2) travel, m or rad."""
        return np.array([drive.travel for drive in self.machine.drives])

    @property
    def size(self) -> float:
        """m: the largest length that the kinematics reckon with, by which they round."""
        travels = np.abs(self.travels).max(axis=1) * self.arms
        lengths = (self.machine.characteristic_length, travels.max(), np.abs(self.home[:3]).max())
        return float(max(lengths))

    @property
    def temperature_names(self) -> tuple[str, ...]:
        """Of each temperature pin, before `-temperature`: `strut-0`, ..., `frame`."""
        return tuple(_pin(self.machine, part) for part in self.temperature_parts)


def _stem(machine: Machine, longest: int) -> str:
    stem = re.sub(r"[^a-z0-9_]+", "_", Path(machine.file).stem.lower()).strip("_") or "machine"
    return stem[:longest].rstrip("_")


def _pin(machine: Machine, part: str) -> str:
    """A part by its number, since names may hold what HAL does not take."""
    family, _, name = part.partition(".")
    rows: dict[str, tuple[Strut | Drive | Guide, ...]] = {
        "strut": machine.struts,
        "drive": machine.drives,
        "guide": machine.guides,
        "carriage": machine.drives,
    }
    if family not in rows:
        return part
    # A carriage has the name of its drive, and its number.
    return f"{family}-{[row.name for row in rows[family]].index(name)}"


def _arms(machine: Machine) -> Floats:
    """(n_joint,) how far a joint moves the base joints that it carries, per unit of coordinate.

    A telescopic drive carries none: its coordinate is a length itself. By central difference at
    home, exact for a straight motion, and for a circle to the square of the step.
    """
    step = 1e-4
    joints = machine.inverse(machine.home[_columns(machine)])
    placement = machine.kernel.placement_of(machine.home[np.newaxis])
    arms = np.ones(len(machine.drives))
    for index, drive in enumerate(machine.drives):
        if drive.coordinate == "length":
            continue
        moved = np.stack([joints, joints])
        moved[0, index] -= step
        moved[1, index] += step
        centres = machine.kernel.joint_centres(moved, np.repeat(placement, 2, axis=0))
        base = centres[:, :, 0, :]
        arms[index] = np.linalg.norm(base[1] - base[0], axis=-1).max() / (2.0 * step)
    return arms


def _columns(machine: Machine) -> list[int]:
    return [machine.dof.index(name) for name in machine.commanded]


def status_ok(status: Codes) -> Flags:
    """Where a status is ok."""
    ok: Flags = status == STATUS.index("ok")
    return ok
