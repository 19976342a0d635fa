"""A LinuxCNC configuration with genhexkins -> a hexapod of six telescopic struts.

The offsets of spindle and tool are added to z of every joint, of the base and of the platform, as
genhexkins does; a tool offset that comes from `motion.tooloffset.z` is taken as 0, no tool. Facts:
the manual page kins(9), and the INI's documentation
(https://linuxcnc.org/docs/stable/html/config/ini-config.html).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from decimal import Decimal
from typing import ClassVar

import numpy as np

from truepose.arrays import Floats
from truepose.controllers._decimals import numbers_of
from truepose.controllers._hal_text import value_of
from truepose.controllers._hexapod_text import (
    FREEDOMS,
    STRUTS,
    Hexapod,
    Point,
    hexapod_text,
    lengths,
)
from truepose.controllers._linuxcnc_files import Configuration, read
from truepose.controllers._linuxcnc_read import (
    UNIT,
    configuration_of,
    kinematics_named,
    limits,
    machine_name,
    pins,
    unit_of,
)
from truepose.controllers._reader import (
    Assumption,
    ControllerFile,
    ControllerReading,
    Setting,
    refuse,
)
from truepose.errors import Fault, Problem

KINEMATICS = "genhexkins"
SHIFTS = ("spindle-offset", "tool-offset")
JOINTS = [
    f"{KINEMATICS}.{end}.{strut}.{axis}"
    for end in ("base", "platform")
    for strut in range(STRUTS)
    for axis in "xyz"
]

STEPS, CLOSE = 50, 1e-11
"""Newton's steps from the home joints to the home pose, and when they are enough, of its size."""


class GenhexkinsReader:
    """The joint centres that genhexkins holds, and the INI's units, limits and home."""

    name: ClassVar[str] = "linuxcnc-genhexkins"
    doc: ClassVar[str] = "LinuxCNC's INI or HAL file of a hexapod with genhexkins"
    settings: ClassVar[Mapping[str, Setting]] = {
        "units.length": UNIT,
        "workspace.home.z": Setting("z of the platform at home, where the INI does not say it"),
    }

    @classmethod
    def recognises(cls, text: str) -> bool:
        """An INI with this kinematics, or a HAL file that sets one of its joints."""
        return kinematics_named(text, KINEMATICS)

    @classmethod
    def read(cls, file: ControllerFile, settings: Mapping[str, float | str]) -> ControllerReading:
        """The hexapod. Raises `MachineFileError`: import-value, import-incomplete."""
        config = configuration_of(file)
        problems: list[Problem] = []
        unit, scale = unit_of(file, config, settings, problems)
        values = pins(file, config, JOINTS, problems)
        shift = _shift(config, problems)
        refuse(problems)
        base, platform = (
            [
                _raised([values[f"{KINEMATICS}.{end}.{strut}.{axis}"] for axis in "xyz"], shift)
                for strut in range(STRUTS)
            ]
            for end in ("base", "platform")
        )
        size = max(abs(value) for point in (*base, *platform) for value in point)
        home, assumptions = _home(file, config, settings, scale, base, platform, problems)
        size = max(size, *(abs(value) for value in home[:3]))
        travel = [limits(config, f"JOINT_{joint}", size, problems) for joint in range(STRUTS)]
        ranges = {}
        for freedom in FREEDOMS:
            span = size if freedom in "xyz" else Decimal(12)  # degrees: a turn is no limit
            known = limits(config, f"AXIS_{freedom.upper()}", span, problems)
            known = known or limits(config, f"AXIS_{freedom.upper()}L", span, problems)
            if known is not None:
                ranges[freedom] = known
        refuse(problems)
        known_travel = [ends for ends in travel if ends is not None]
        hexapod = Hexapod(
            machine_name(config, "Hexapod (genhexkins)"),
            "Six telescopic struts, read from a LinuxCNC configuration.",
            unit,
            [f"joint_{joint}" for joint in range(STRUTS)],
            base,
            platform,
            home,
            known_travel if len(known_travel) == STRUTS else None,
            ranges,
        )
        text, assumed = hexapod_text(hexapod)
        holds = {entry.key: entry.text for pin, entry in config.pins.items() if KINEMATICS in pin}
        holds |= {
            f"[{entry.section}]{entry.key}": entry.text
            for entry in config.ini
            if entry.section.startswith("JOINT_") and entry.key in ("HOME_OFFSET", "HOME")
        }
        return ControllerReading(
            text,
            holds=holds,
            assumptions=(*assumptions, *assumed, *_of_tool(config)),
            lost=tuple(_lost(config)),
        )


def _shift(config: Configuration, problems: list[Problem]) -> Decimal:
    """What is added to z of all joints."""
    total = Decimal(0)
    for pin in SHIFTS:
        entry = config.pins.get(f"{KINEMATICS}.{pin}")
        if entry is not None:
            total += read(entry, problems) or Decimal(0)
    return total


def _raised(point: Sequence[Decimal], shift: Decimal) -> Point:
    x, y, z = point
    return x, y, z + shift


def _home(
    file: ControllerFile,
    config: Configuration,
    settings: Mapping[str, float | str],
    scale: Decimal,
    base: Sequence[Point],
    platform: Sequence[Point],
    problems: list[Problem],
) -> tuple[list[Decimal], list[Assumption]]:
    """The home pose: as said, [TRAJ]HOME, or where the struts have the joints' HOME lengths."""
    zero = Decimal(0)
    if "workspace.home.z" in settings:
        z = Decimal(f"{float(settings['workspace.home.z']) * 1000:.12g}") / scale
        return [zero, zero, z, zero, zero, zero], []
    entry = value_of(config.ini, "TRAJ", "HOME")
    if entry is not None:
        pose = numbers_of(entry.text)[:STRUTS]
        pose += [zero] * (STRUTS - len(pose))
        if float(np.min(lengths(base, platform, [float(value) for value in pose]))) > 0.0:
            return pose, []
    joints = [config.number(f"JOINT_{joint}", "HOME", problems) for joint in range(STRUTS)]
    known = [joint for joint in joints if joint is not None and joint > 0]
    if len(known) == STRUTS:
        last = max(10.0 ** int(joint.as_tuple().exponent) for joint in known)
        home_pose = _pose_of(base, platform, np.array(known, np.float64), last)
        if home_pose is not None:
            sentence = "home is where the struts have the lengths that [JOINT_n]HOME says"
            return home_pose, [Assumption(sentence, "workspace.home")]
    refuse(problems)
    refuse(
        [
            file.problem(
                Fault(
                    "import-incomplete",
                    "nothing says where the platform is at home",
                    found="neither [TRAJ]HOME nor a pose with the lengths of [JOINT_n]HOME",
                    expected="the height of the platform, from which the forward solution starts",
                    hint="--set workspace.home.z=500",
                )
            )
        ]
    )
    raise AssertionError  # refused above


def _pose_of(
    base: Sequence[Point], platform: Sequence[Point], wanted: Floats, last: float
) -> list[Decimal] | None:
    """The pose at which the struts are `wanted` long, by Newton's method; None where there is none.

    From a level platform above the base, which is the pose that such a machine is homed to. It has
    the fewest decimals with which the lengths are those wanted to their `last` digit.
    """
    size = float(wanted.mean())
    across = np.linalg.norm(
        np.array(base, np.float64)[:, :2] - np.array(platform, np.float64)[:, :2], axis=1
    )
    rise = float(np.median(np.sqrt(np.maximum(wanted**2 - across**2, (0.1 * size) ** 2))))
    lift = float(np.mean(np.array(base, np.float64)[:, 2] - np.array(platform, np.float64)[:, 2]))
    pose = np.array([0.0, 0.0, lift + rise, 0.0, 0.0, 0.0])
    units = np.array([size, size, size, 60.0, 60.0, 60.0])  # lengths, and about a radian
    for _ in range(STEPS):
        missing = lengths(base, platform, pose) - wanted
        if float(np.abs(missing).max()) <= CLOSE * size:
            return _rounded(base, platform, wanted, pose, 0.49 * last)
        step = 1e-6 * units
        jacobian = np.column_stack(
            [
                (lengths(base, platform, pose + shift) - lengths(base, platform, pose - shift))
                / (2.0 * shift.max())
                for shift in np.diag(step)
            ]
        )
        try:
            change = np.linalg.solve(jacobian, missing)
        except np.linalg.LinAlgError:
            return None
        if not np.isfinite(change).all():
            return None
        pose = pose - change * min(1.0, 0.3 / float(np.abs(change / units).max() + 1e-300))
    return None


def _rounded(
    base: Sequence[Point], platform: Sequence[Point], wanted: Floats, pose: Floats, off: float
) -> list[Decimal]:
    """The pose with the fewest decimals at which no length is `off` by more."""
    texts: list[str] = []
    for digits in range(13):
        texts = [f"{value + 0.0:.{digits}f}" for value in pose]
        missing = lengths(base, platform, [float(text) for text in texts]) - wanted
        if float(np.abs(missing).max()) <= off:
            break
    return [Decimal(text) for text in texts]


def _of_tool(config: Configuration) -> list[Assumption]:
    if f"{KINEMATICS}.tool-offset" not in config.driven:
        return []
    sentence = (
        "no tool is offset (G43): one of length T adds T to z of all joints, base and platform"
    )
    return [Assumption(sentence, "strut.platform")]


def _lost(config: Configuration) -> list[str]:
    lost = []
    lead = config.pins.get(f"{KINEMATICS}.screw-lead")
    if lead is not None and any(character in "123456789" for character in lead.text):
        lost.append(
            f"screw-lead {lead.text}: LinuxCNC adds to a joint's value what its screw turns with "
            "the universal joints; here a joint coordinate is the length of the strut alone"
        )
    offsets = [value_of(config.ini, f"JOINT_{joint}", "HOME_OFFSET") for joint in range(STRUTS)]
    if all(offset is not None for offset in offsets):
        said = ", ".join(offset.text for offset in offsets if offset is not None)
        lost.append(
            "where the home switches trip, HOME_OFFSET: to print it again, "
            f'--option switches="{said}"'
        )
    lost += [f"{name}, which is named and was not read" for name in config.left_out]
    return lost


__all__ = ["GenhexkinsReader"]
