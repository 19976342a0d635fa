"""LinuxCNC's lineardeltakins: linear deltas with two numbers, R and L.

Towers stand at the radius R at 90, 210 and 330 degrees, joints 0, 1 and 2; each has a rod of
length L; a joint's value is the height of its carriage. Where it trips its home switch that value
is HOME_OFFSET. Facts: the manual page lineardeltakins(9) and the INI's homing documentation
(https://linuxcnc.org/docs/stable/html/config/ini-homing.html).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from truepose.arrays import Floats
from truepose.controllers._delta import SWITCHES, TOWERS, tower_order, wrapped
from truepose.controllers._export import Export, Option, unsupported_machine
from truepose.controllers._linear_delta import (
    ANGLES,
    ARMS,
    COUNT,
    HEIGHTS,
    RADIUS,
    linear_delta,
    parameters,
)
from truepose.controllers._linuxcnc_joints import (
    SCALE,
    UNITS,
    digits_of,
    exported,
    ini_joint,
    unit_of,
)
from truepose.controllers._small_model import INSTEAD, Parameter, Printed, fixed
from truepose.machine import Machine

PINS = "lineardeltakins"
JOINT_TOWERS = [2, 0, 1]
"""The tower, of A B C, that each joint stands at."""

TURNED = math.radians(30.0)
"""How far a tower may stand off its place: farther, it is nearer to being another one."""


class _Model:
    """A `SmallModel` of five numbers: R, L and three heights."""

    def __init__(self, machine: Machine, options: Mapping[str, float | str]) -> None:
        delta = linear_delta(machine, options, "linuxcnc-lineardelta")
        towers = tower_order(delta.nominal[ANGLES])
        self.delta = delta.in_order([towers[at] for at in JOINT_TOWERS])
        self.unit = unit_of(machine, options["units"])
        self._angles = TOWERS[JOINT_TOWERS]
        off = np.degrees(wrapped(self.delta.nominal[ANGLES] - self._angles))
        if np.abs(off).max() > math.degrees(TURNED):
            places = ", ".join(f"{angle:.1f}" for angle in np.degrees(self.delta.nominal[ANGLES]))
            raise unsupported_machine(
                "linuxcnc-lineardelta",
                machine,
                f"towers at {places} degrees about z",
                "towers at 90, 210 and 330 degrees about z",
                INSTEAD,
            )

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """R, L and the heights."""
        every = parameters(self.delta)
        rod = Parameter("rod", float(self.delta.nominal[ARMS].mean()))
        return (every[0], rod, *every[HEIGHTS])

    def _all(self, values: Floats) -> Floats:
        numbers = np.zeros(COUNT)
        numbers[RADIUS], numbers[ANGLES] = values[0], self._angles
        numbers[ARMS], numbers[HEIGHTS] = values[1], values[2:]
        return numbers

    @property
    def switches(self) -> Floats:
        """(3,) joint coordinates, m, where the home switches trip."""
        return self.delta.switches

    def joints(self, values: Floats, poses: Floats) -> Floats:
        """(n, 3) joint coordinates, m, in the machine's order, for poses (n, 3), m."""
        return self.delta.joints(self._all(values), poses)

    def format(self, values: Floats) -> Printed:
        """Pins, and HOME_OFFSET of the joints, in the block's unit."""
        words = ["R", "L", *(f"JOINT_{joint} HOME_OFFSET" for joint in range(3))]
        scale, digits = SCALE[self.unit], digits_of(self.delta.machine, self.unit)
        return {word: fixed(v / scale, digits) for word, v in zip(words, values, strict=True)}

    def parse(self, printed: Printed) -> Floats:
        """(5,) the model's values, m, of printed numbers."""
        return np.array([float(text) for text in printed.values()]) * SCALE[self.unit]

    def hal(self, printed: Printed) -> list[str]:
        """`setp` of R and L."""
        return [f"setp {PINS}.{pin} {printed[pin]}" for pin in ("R", "L")]

    def ini(self, values: Floats, printed: Printed) -> list[str]:
        """The sections of the joints."""
        delta, machine = self.delta, self.delta.machine
        home = delta.joints(self._all(values), machine.home[np.newaxis, :3])[0]
        lines: list[str] = []
        for joint, drive in enumerate(delta.order):
            gain = float(delta.gain[joint])
            offset = float(values[2 + joint] - gain * delta.switch[joint])
            lines += ini_joint(
                machine,
                joint,
                int(drive),
                self.unit,
                gain=gain,
                offset=offset,
                home_offset=printed[f"JOINT_{joint} HOME_OFFSET"],
                home=gain * float(home[drive]) + offset,
            )
        return lines


class LinuxCncLinearDelta:
    """R and L of lineardeltakins, and the joints' HOME_OFFSET, fitted."""

    name: ClassVar[str] = "linuxcnc-lineardelta"
    doc: ClassVar[str] = "R, L and joint offsets of a linear delta for LinuxCNC's lineardeltakins"
    options: ClassVar[Mapping[str, Option]] = {"switches": SWITCHES, "units": UNITS}

    @classmethod
    def export(cls, machine: Machine, options: Mapping[str, float | str]) -> Export:
        """Lines for the HAL file and for the INI.

        Raises `RequestError`: controller-cannot, bad-option, no-workspace, no-pose-left.
        """
        return exported(machine, _Model(machine, options), PINS, 3)


__all__ = ["LinuxCncLinearDelta"]
