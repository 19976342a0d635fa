"""Controllers' own small models, from their documentation, as an independent road to their joints.

For each format a reader of the block that is pasted, and a simulation of what the controller does
with it: home against the endstops, then drive the joints for a wanted position. Nothing here
comes from the exported package; rods are met by trilateration and by root finding instead of by the
package's closed forms. Numbers are in the controller's units until they leave: metres and radians.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy import optimize

Array = NDArray[np.float64]
MM = 1e-3


# Readers ----------------------------------------------------------------------------------------


def read_cfg(text: str) -> dict[str, dict[str, str]]:
    """Sections of printer.cfg: `key: value` under `[section]`, comments after # or ;."""
    sections: dict[str, dict[str, str]] = {}
    section: dict[str, str] | None = None
    for number, line in enumerate(text.splitlines(), start=1):
        line = re.split("[#;]", line)[0].strip()
        if not line:
            continue
        if line.startswith("["):
            assert line.endswith("]"), f"line {number}"
            assert line[1:-1] not in sections, f"section {line} twice"
            section = sections.setdefault(line[1:-1], {})
            continue
        assert section is not None, f"line {number} before any section"
        key, colon, value = line.partition(":")
        assert colon, f"line {number} has no colon"
        assert key not in section, f"{key} twice"
        section[key.strip()] = value.strip()
    return sections


def read_gcode(text: str) -> list[tuple[str, dict[str, list[float]]]]:
    """Commands as (code, word -> values); values of one word are apart by colons."""
    found = []
    for line in text.splitlines():
        words = line.split(";")[0].split()
        if not words:
            continue
        arguments: dict[str, list[float]] = {}
        for word in words[1:]:
            assert word[0].isalpha(), word
            assert word[0] not in arguments, f"{word[0]} twice in {line!r}"
            arguments[word[0]] = [float(part) for part in word[1:].split(":")]
        found.append((words[0], arguments))
    return found


def read_hal(text: str) -> dict[str, float]:
    """Pins set with `setp`."""
    pins: dict[str, float] = {}
    for line in text.splitlines():
        words = line.split("#")[0].split()
        if words:
            assert words[0] == "setp"
            assert len(words) == 3
            assert words[1] not in pins
            pins[words[1]] = float(words[2])
    return pins


def read_ini(text: str) -> dict[str, dict[str, str]]:
    """Sections of a LinuxCNC INI: `KEY = value`; a comment has a line of its own."""
    sections: dict[str, dict[str, str]] = {}
    section: dict[str, str] = {}
    for line in text.splitlines():
        if not line.strip() or line.startswith("#"):
            continue
        if line.startswith("["):
            section = sections.setdefault(line.strip()[1:-1], {})
            continue
        key, equals, value = line.partition("=")
        assert equals
        section[key.strip()] = value.strip()
    return sections


# Kinematics -------------------------------------------------------------------------------------


def trilateration(centres: Array, radii: Sequence[float]) -> Array:
    """(3,) the lower of the two points at `radii` from three `centres` (3, 3).

    In the frame whose origin is the first centre, x along the second, y towards the third.
    """
    to_second, to_third = centres[1] - centres[0], centres[2] - centres[0]
    d = np.linalg.norm(to_second)
    ex = to_second / d
    i = ex @ to_third
    ey = (to_third - i * ex) / np.linalg.norm(to_third - i * ex)
    ez = np.cross(ex, ey)
    j = ey @ to_third
    x = (radii[0] ** 2 - radii[1] ** 2 + d**2) / (2 * d)
    y = (radii[0] ** 2 - radii[2] ** 2 + i**2 + j**2) / (2 * j) - i * x / j
    z = math.sqrt(radii[0] ** 2 - x**2 - y**2)
    points = [centres[0] + x * ex + y * ey + side * z * ez for side in (-1, 1)]
    found: Array = min(points, key=lambda point: point[2])
    return found


@dataclass
class Towers:
    """Upright towers at `centres` (3, 2), rods (3,), mm; `home` (3,) heights at the endstops.

    `tilt`: what the heights grow by per mm in x and y.
    """

    centres: Array
    rods: Array
    home: Array
    tilt: tuple[float, float] = (0.0, 0.0)
    order: list[int] = field(default_factory=lambda: [0, 1, 2])

    def heights(self, position: Array) -> Array:
        """(3,) of the carriages for a position (3,), found by bisection and checked."""
        x, y, z = position
        found = np.empty(3)
        for tower, ((cx, cy), rod) in enumerate(zip(self.centres, self.rods, strict=True)):

            def missing(s: float, cx: float = cx, cy: float = cy, rod: float = rod) -> float:
                return (s - z) ** 2 + (cx - x) ** 2 + (cy - y) ** 2 - rod**2

            found[tower] = optimize.brentq(missing, z, z + rod, xtol=1e-13, rtol=1e-15)
        spheres = np.column_stack([self.centres, found])
        assert np.abs(trilateration(spheres, self.rods) - position).max() < 1e-7
        return found + self.tilt[0] * x + self.tilt[1] * y

    def position(self, heights: Array) -> Array:
        """(3,) of the tool at heights (3,), mm; without a tilt."""
        return trilateration(np.column_stack([self.centres, heights]), self.rods)


@dataclass
class Arms:
    """A rotary delta, mm and rad: `home` (3,) angles of the arms at the endstops."""

    radius: float
    height: float
    angles: Array
    upper: Array
    lower: Array
    home: Array = field(default_factory=lambda: np.zeros(3))

    def elbow(self, arm: int, angle: float) -> Array:
        out = self.radius + self.upper[arm] * math.cos(angle)
        up = self.height + self.upper[arm] * math.sin(angle)
        where = self.angles[arm]
        return np.array([out * math.cos(where), out * math.sin(where), up])

    def arm_angle(self, arm: int, position: Array) -> float:
        """The outward one of the two angles at which the lower arm meets the position."""

        def missing(angle: float) -> float:
            return float(np.linalg.norm(self.elbow(arm, angle) - position)) - self.lower[arm]

        # The elbow is farthest from the tool where the upper arm points away from it: from there
        # turning outwards and down brings it nearer.
        shoulder = np.array([math.cos(self.angles[arm]), math.sin(self.angles[arm])])
        out = self.radius - float(shoulder @ position[:2])
        up = self.height - position[2]
        farthest = math.atan2(up, out)
        return float(optimize.brentq(missing, farthest - math.pi, farthest, xtol=1e-15, rtol=1e-15))

    def angles_of(self, position: Array) -> Array:
        return np.array([self.arm_angle(arm, position) for arm in range(3)])

    def position(self, angles: Array) -> Array:
        elbows = np.array([self.elbow(arm, angle) for arm, angle in enumerate(angles)])
        return trilateration(elbows, list(self.lower))


# Controllers: (n, n_joint) coordinates of the machine for wanted positions ------------------------

Drive = Callable[[Array], Array]


def klipper_linear(text: str) -> Towers:
    cfg = read_cfg(text)
    assert cfg["printer"]["kinematics"] == "delta"
    radius = float(cfg["printer"]["delta_radius"])
    assert float(cfg["printer"]["print_radius"]) > 0
    steppers = [cfg[f"stepper_{letter}"] for letter in "abc"]
    angles = np.radians([float(stepper["angle"]) for stepper in steppers])
    rods = np.array([float(stepper["arm_length"]) for stepper in steppers])
    endstops = np.array([float(stepper["position_endstop"]) for stepper in steppers])
    centres = radius * np.column_stack([np.cos(angles), np.sin(angles)])
    return Towers(centres, rods, endstops + np.sqrt(rods**2 - radius**2))


def klipper_rotary(text: str) -> Arms:
    cfg = read_cfg(text)
    assert cfg["printer"]["kinematics"] == "rotary_delta"
    steppers = [cfg[f"stepper_{letter}"] for letter in "abc"]

    def of(key: str) -> Array:
        return np.array([float(stepper[key]) for stepper in steppers])

    arms = Arms(
        float(cfg["printer"]["shoulder_radius"]),
        float(cfg["printer"]["shoulder_height"]),
        np.radians(of("angle")),
        of("upper_arm_length"),
        of("lower_arm_length"),
    )
    heights = of("position_endstop")
    # An endstop's angle is the arm's with the tool in the middle at that height.
    home = [arms.arm_angle(arm, np.array([0.0, 0.0, z])) for arm, z in enumerate(heights)]
    arms.home = np.array(home)
    return arms


def marlin(text: str, probe_offset: float = 0.0) -> Towers:
    commands = dict(read_gcode(text))
    m665 = {word: values[0] for word, values in commands["M665"].items()}
    m666 = {word: values[0] for word, values in commands["M666"].items()}
    assert all(value <= 0.0 for value in m666.values())  # Marlin refuses others
    angles = np.radians([a + m665[w] for a, w in zip((210, 330, 90), "XYZ", strict=True)])
    rods = np.array([m665["L"] + m665[word] for word in "ABC"])
    centres = m665["R"] * np.column_stack([np.cos(angles), np.sin(angles)])
    # Up to the switches, down by the adjustments, and that is x = y = 0 at H less the probe's z.
    middle = Towers(centres, rods, np.zeros(3)).heights(
        np.array([0.0, 0.0, m665["H"] - probe_offset])
    )
    return Towers(centres, rods, middle - [m666[word] for word in "XYZ"])


def reprap(text: str) -> Towers:
    commands = dict(read_gcode(text))
    m665, m666 = commands["M665"], commands["M666"]
    radius, height = m665["R"][0], m665["H"][0]
    rods = np.array(m665["L"])
    assert rods.shape == (3,)
    corrections = [m665[word][0] for word in "XYZ"]
    # A stands front left, B front right, C behind; all turn counter-clockwise.
    angles = np.radians(np.array([180 + 30, -30, 90]) + corrections)
    centres = radius * np.column_stack([np.cos(angles), np.sin(angles)])
    adjust = np.array([m666[word][0] for word in "XYZ"])
    home = height + np.sqrt(rods**2 - radius**2) + adjust
    return Towers(centres, rods, home, (m666["A"][0] / 100, m666["B"][0] / 100))


def lineardeltakins(hal: str, ini: str) -> Towers:
    pins, sections = read_hal(hal), read_ini(ini)
    assert sections["KINS"]["KINEMATICS"] == "lineardeltakins"
    unit = {"mm": 1.0, "inch": 25.4}[sections["TRAJ"]["LINEAR_UNITS"]]
    radius, rod = pins["lineardeltakins.R"] * unit, pins["lineardeltakins.L"] * unit
    angles = np.radians([90, 210, 330])
    centres = radius * np.column_stack([np.cos(angles), np.sin(angles)])
    home = [float(sections[f"JOINT_{joint}"]["HOME_OFFSET"]) * unit for joint in range(3)]
    return Towers(centres, np.full(3, rod), np.array(home))


@dataclass
class Hexapod:
    """genhexkins, m: `base`, `platform` (6, 3), `home` (6,) joint values at the switches."""

    base: Array
    platform: Array
    home: Array

    def lengths(self, poses: Array) -> Array:
        """(n, 6) for poses (n, 6) m and rad."""
        from scipy.spatial.transform import Rotation

        turn = Rotation.from_euler("ZYX", poses[:, [5, 4, 3]])  # intrinsic: Rz Ry Rx
        joints = [poses[:, :3] + turn.apply(point) for point in self.platform]
        return np.stack(
            [np.linalg.norm(p - b, axis=1) for p, b in zip(joints, self.base, strict=True)], axis=1
        )


def genhexkins(hal: str, ini: str) -> Hexapod:
    pins, sections = read_hal(hal), read_ini(ini)
    assert sections["KINS"] == {"KINEMATICS": "genhexkins", "JOINTS": "6"}
    assert pins["genhexkins.screw-lead"] == pins["genhexkins.spindle-offset"] == 0.0
    unit = {"mm": MM, "inch": 0.0254}[sections["TRAJ"]["LINEAR_UNITS"]]

    def points(end: str) -> Array:
        rows = [[pins[f"genhexkins.{end}.{n}.{axis}"] for axis in "xyz"] for n in range(6)]
        return np.array(rows) * unit

    home = [float(sections[f"JOINT_{joint}"]["HOME_OFFSET"]) * unit for joint in range(6)]
    return Hexapod(points("base"), points("platform"), np.array(home))


STATED_IN = {
    "um": ("um", 1.0),
    "uin": ("um", 0.0254),
    "urad": ("urad", 1.0),
    "mdeg": ("urad", 1e3 * math.pi / 180.0),
}


def stated(text: str, what: str) -> dict[str, tuple[float, float]]:
    """Highest and rms (um, urad) in the line of a block's comment that has `what`, in any unit."""
    line = next(line for line in text.splitlines() if what in line).replace("µ", "u")
    found = {}
    for highest, unit, rms in re.findall(
        r"at most ([\d.]+) (um|uin|urad|mdeg) \(at [^)]*\), rms ([\d.]+)", line
    ):
        name, times = STATED_IN[unit]
        found[name] = (float(highest) * times, float(rms) * times)
    return found
