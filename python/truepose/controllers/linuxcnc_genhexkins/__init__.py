"""LinuxCNC's genhexkins: hexapods with six struts of variable length, 36 coordinates.

A joint's value is the length of its strut, |x + R a - b|, from the base joint b to the platform
joint a, with the tool point x and R = Rz(c) Ry(b) Rx(a). Where the joint trips its home switch its
value is HOME_OFFSET. screw-lead, spindle-offset and tool-offset are set to 0: the platform's joints
are given from the tool point. Facts: the manual page kins(9) and the INI's homing documentation
(https://linuxcnc.org/docs/stable/html/config/ini-homing.html).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from truepose.arrays import Floats
from truepose.controllers._export import Export, Option, unsupported_machine
from truepose.controllers._homing import switch_option, switches
from truepose.controllers._linuxcnc_joints import (
    SCALE,
    UNITS,
    digits_of,
    exported,
    ini_joint,
    unit_of,
)
from truepose.controllers._small_model import (
    INSTEAD,
    Parameter,
    Printed,
    fixed,
    scales,
    value,
    vector,
)
from truepose.machine import Machine
from truepose.spatial import euler_to_matrix

PINS = "genhexkins"
STRUTS = 6
COORDINATES = 3 * STRUTS

ZEROS = ("screw-lead", "spindle-offset", "tool-offset")
"""Pins that must be 0."""

SWITCHES = switch_option("the start of each drive's travel")


class _Model:
    """A `SmallModel` of 42 numbers: base and platform joints, and a length for each strut."""

    def __init__(self, machine: Machine, options: Mapping[str, float | str]) -> None:
        _check(machine)
        self.machine = machine
        self.unit = unit_of(machine, options["units"])
        starts = [drive.travel[0] for drive in machine.drives]
        self.switches = switches(machine, options, starts, "linuxcnc-genhexkins")
        """(6,) joint coordinates, m, where the home switches trip."""
        self._gain = scales(machine)
        carried = {strut.drive: strut for strut in machine.struts}
        struts = [carried[drive.name] for drive in machine.drives]
        tool = vector(machine, "tool")
        base = [vector(machine, f"{strut.part}.base") for strut in struts]
        platform = [vector(machine, f"{strut.part}.platform") - tool for strut in struts]
        offsets = [value(machine, f"{drive.part}.offset") for drive in machine.drives]
        lengths = self._gain * self.switches + offsets
        self._start = np.concatenate([*base, *platform, lengths])

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Coordinates of the joints, and the struts' lengths at the switches."""
        names = [
            f"{end} {strut} {axis}"
            for end in ("base", "platform")
            for strut in range(STRUTS)
            for axis in "xyz"
        ]
        names += [f"length {strut}" for strut in range(STRUTS)]
        return tuple(
            Parameter(*parameter) for parameter in zip(names, self._start.tolist(), strict=True)
        )

    def joints(self, values: Floats, poses: Floats) -> Floats:
        """(n, 6) joint coordinates, m, in the order of the drives, for poses (n, 6), m, rad."""
        longer = self.lengths(values, poses) - values[2 * COORDINATES :]
        joints: Floats = self.switches + longer / self._gain
        return joints

    def lengths(self, values: Floats, poses: Floats) -> Floats:
        """(n, 6) lengths of the struts, m: LinuxCNC's joint values."""
        base = values[:COORDINATES].reshape(STRUTS, 3)
        platform = values[COORDINATES : 2 * COORDINATES].reshape(STRUTS, 3)
        turned = np.einsum("nij,kj->nki", euler_to_matrix(poses[:, 3:]), platform)
        lengths: Floats = np.linalg.norm(poses[:, np.newaxis, :3] + turned - base, axis=2)
        return lengths

    def format(self, values: Floats) -> Printed:
        """Pins, and HOME_OFFSET of the joints, in the block's unit."""
        words = [
            f"{PINS}.{end}.{strut}.{axis}"
            for end in ("base", "platform")
            for strut in range(STRUTS)
            for axis in "xyz"
        ]
        words += [f"JOINT_{joint} HOME_OFFSET" for joint in range(STRUTS)]
        scale, digits = SCALE[self.unit], digits_of(self.machine, self.unit)
        return {word: fixed(v / scale, digits) for word, v in zip(words, values, strict=True)}

    def parse(self, printed: Printed) -> Floats:
        """(42,) the model's values, m, of printed numbers."""
        return np.array([float(text) for text in printed.values()]) * SCALE[self.unit]

    def hal(self, printed: Printed) -> list[str]:
        """`setp` of every pin that the kinematics reads."""
        lines = [f"setp {word} {text}" for word, text in printed.items() if word.startswith(PINS)]
        return [*lines, *(f"setp {PINS}.{pin} 0" for pin in ZEROS)]

    def ini(self, values: Floats, printed: Printed) -> list[str]:
        """The sections of the joints."""
        home = self.lengths(values, self.machine.home[np.newaxis, :])[0]
        lines: list[str] = []
        for joint in range(STRUTS):
            lines += ini_joint(
                self.machine,
                joint,
                joint,
                self.unit,
                gain=float(self._gain[joint]),
                offset=float(
                    values[2 * COORDINATES + joint] - self._gain[joint] * self.switches[joint]
                ),
                home_offset=printed[f"JOINT_{joint} HOME_OFFSET"],
                home=float(home[joint]),
            )
        return lines


class LinuxCncGenhexkins:
    """The 36 coordinates of genhexkins, and the joints' HOME_OFFSET, fitted."""

    name: ClassVar[str] = "linuxcnc-genhexkins"
    doc: ClassVar[str] = "joint coordinates and offsets of a hexapod for LinuxCNC's genhexkins"
    options: ClassVar[Mapping[str, Option]] = {"switches": SWITCHES, "units": UNITS}

    @classmethod
    def export(cls, machine: Machine, options: Mapping[str, float | str]) -> Export:
        """Lines for the HAL file and for the INI.

        Raises `RequestError`: controller-cannot, bad-option, no-workspace, no-pose-left.
        """
        return exported(machine, _Model(machine, options), PINS, STRUTS)


def _check(machine: Machine) -> None:
    kinds = [drive.kind for drive in machine.drives]
    carried = sorted(str(strut.drive) for strut in machine.struts)
    names = sorted(drive.name for drive in machine.drives)
    if kinds == ["telescopic"] * STRUTS and carried == names and len(machine.commanded) == 6:
        return
    raise unsupported_machine(
        "linuxcnc-genhexkins",
        machine,
        f"{len(machine.struts)} struts, drives of kind {', '.join(sorted(set(kinds)))}, "
        f"commanded {' '.join(machine.commanded)}",
        "a hexapod: six telescopic struts and x y z a b c commanded",
        INSTEAD,
    )


__all__ = ["LinuxCncGenhexkins"]
