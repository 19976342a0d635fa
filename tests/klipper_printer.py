"""A delta printer in Klipper's own numbers, and what its delta_calibrate would keep: simulated.

By the formulas of Klipper's documentation (Config_Reference, Delta_Calibrate), in plain NumPy and
`firmware`'s trilateration. mm and degrees; a drive's position counts upwards, steps from its
endstop downwards.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from firmware import trilateration

Array = NDArray[np.float64]

SCATTER = (0.95, 0.90, 0.85, 0.70, 0.75, 0.80)


@dataclass(frozen=True)
class Printer:
    """One printer; `scale` (3,): how far its drives really go for what they count."""

    kinematics: str
    radius: float
    arms: tuple[float, float, float]
    ends: tuple[float, float, float]
    angles: tuple[float, float, float]
    bed: float
    upper: float = 0.0
    height: float = 0.0
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)

    @property
    def turns(self) -> bool:
        """Whether its drives turn."""
        return self.kinematics == "rotary_delta"

    @property
    def step(self) -> float:
        """mm or rad for one of 16 microsteps of 200."""
        return 2.0 * math.pi / 3200 / (107 / 16 * 60 / 16) if self.turns else 40.0 / 3200

    @property
    def outwards(self) -> Array:
        """(3, 2) level unit vectors to the limbs."""
        angles = np.radians(self.angles)
        return np.column_stack([np.cos(angles), np.sin(angles)])

    def joints(self, point: Sequence[float] | Array) -> Array:
        """(3,) heights of the carriages, or angles of the upper arms, rad, at a point (3,)."""
        x, y, z = point
        if not self.turns:
            away = self.radius * self.outwards - [x, y]
            joints: Array = z + np.sqrt(np.square(self.arms) - (away**2).sum(axis=1))
            return joints
        out = self.outwards @ [x, y] - self.radius
        beside = y * self.outwards[:, 0] - x * self.outwards[:, 1]
        up = z - self.height
        cosine = (out**2 + up**2 + self.upper**2 - np.square(self.arms) + beside**2) / (
            2.0 * self.upper * np.hypot(out, up)
        )
        middle = np.arctan2(up, out)
        both = middle + np.arccos(cosine) * np.array([[1.0], [-1.0]])
        angle: Array = np.where(np.cos(both[0]) > np.cos(both[1]), both[0], both[1])
        return (angle + np.pi) % (2.0 * np.pi) - np.pi

    def switches(self) -> Array:
        """(3,) joints where the endstops trip."""
        if not self.turns:
            return np.array(self.ends) + np.sqrt(np.square(self.arms) - self.radius**2)
        return np.array([self.joints((0.0, 0.0, end))[limb] for limb, end in enumerate(self.ends)])

    def steps(self, point: Sequence[float] | Array) -> Array:
        """(3,) steps from the endstops at a point, in parts of a step."""
        steps: Array = (self.switches() - self.joints(point)) / (self.step * np.array(self.scale))
        return steps

    def tool(self, steps: Array) -> Array:
        """(3,) where the tool is."""
        joints = self.switches() - steps * self.step * np.array(self.scale)
        if self.turns:
            out = self.radius + self.upper * np.cos(joints)
            up = self.height + self.upper * np.sin(joints)
            return trilateration(np.column_stack([out[:, None] * self.outwards, up]), self.arms)
        centres = np.column_stack([self.radius * self.outwards, joints])
        return trilateration(centres, self.arms)

    @staticmethod
    def counted(steps: Array) -> str:
        """Whole steps, as Klipper keeps them."""
        return ",".join(f"{step:.3f}" for step in np.round(steps))

    def config(self, *, probe: bool = True) -> str:
        """Its printer.cfg, as far as it is of its machine."""
        drive = "gear_ratio: 107:16, 60:16" if self.turns else "rotation_distance: 40"
        lines = ["[printer]", f"kinematics: {self.kinematics}", "minimum_z_position: -5"]
        if self.turns:
            lines += [f"shoulder_radius: {self.radius!r}", f"shoulder_height: {self.height!r}"]
        else:
            lines += [f"delta_radius: {self.radius!r}"]
        rows = zip("abc", self.arms, self.ends, self.angles, strict=True)
        for letter, arm, end, angle in rows:
            lines += [f"[stepper_{letter}]", "microsteps: 16", drive]
            lines += [f"position_endstop: {end!r}", f"angle: {angle!r}"]
            if self.turns:
                lines += [f"upper_arm_length: {self.upper!r}", f"lower_arm_length: {arm!r}"]
            else:
                lines += [f"arm_length: {arm!r}"]
        lines += ["[probe]", "z_offset: 0.5"] if probe else []
        return "\n".join(lines) + "\n"


def saved(
    held: Printer,
    true: Printer,
    *,
    z_offset: float,
    noise: tuple[float, float] = (0.0, 0.0),
    seed: int = 1,
) -> str:
    """[delta_calibrate] of a machine that is `true`, commanded by a controller that has `held`.

    Seven heights by a probe that trips at `z_offset`, and nine distances between places that the
    controller takes for those of a calibration print. `noise`: of a height and of a distance, mm,
    standard.
    """
    random = np.random.default_rng(seed)
    lines = ["[delta_calibrate]", f"radius: {held.bed!r}"]
    angles = np.radians(90.0 + 60.0 * np.arange(6))
    points = [(0.0, 0.0)] + [
        (float(np.cos(a)) * held.bed * s, float(np.sin(a)) * held.bed * s)
        for a, s in zip(angles, SCATTER, strict=True)
    ]
    for number, (x, y) in enumerate(points):
        z = 0.0
        wanted = z_offset + noise[0] * random.standard_normal()
        for _ in range(20):  # down until the probe trips
            z += wanted - true.tool(held.steps((x, y, z)))[2]
        lines += [f"height{number}: {z_offset!r}"]
        lines += [f"height{number}_pos: {held.counted(held.steps((x, y, z)))}"]
    rim = [0.7 * held.bed * np.array([np.cos(a), np.sin(a)]) for a in angles]
    pairs = [(rim[n], rim[n + 3]) for n in range(3)] + [
        (rim[n], rim[(n + 2) % 6]) for n in range(6)
    ]
    for number, pair in enumerate(pairs):
        steps = [np.round(held.steps((*at, 0.0))) for at in pair]
        apart = float(np.linalg.norm(true.tool(steps[0]) - true.tool(steps[1])))
        lines += [f"distance{number}: {apart + noise[1] * random.standard_normal():.3f}"]
        lines += [f"distance{number}_pos{n + 1}: {held.counted(s)}" for n, s in enumerate(steps)]
    return "\n".join(lines) + "\n"


def as_saved(text: str) -> str:
    """Sections as SAVE_CONFIG writes them below a printer.cfg."""
    head = (
        "",
        "#*# <---------------------- SAVE_CONFIG ---------------------->",
        "#*# DO NOT EDIT THIS BLOCK OR BELOW. The contents are auto-generated.",
        "#*#",
    )
    lines = (f"#*# {line}".rstrip() for line in text.replace(": ", " = ").splitlines())
    return "\n".join([*head, *lines, ""])


LINEAR = Printer(
    "delta", 150.0, (300.0, 300.0, 300.0), (310.0, 310.0, 310.0), (210.0, 330.0, 90.0), 90.0
)
ROTARY = Printer(
    "rotary_delta",
    60.0,
    (320.0, 320.0, 320.0),
    (180.0, 180.0, 180.0),
    (30.0, 150.0, 270.0),
    60.0,
    upper=150.0,
    height=400.0,
)

__all__ = ["LINEAR", "ROTARY", "Printer", "as_saved", "saved"]
