"""Heights of a delta's carriages as Marlin and RepRapFirmware have them, from their documentation.

An own road from the words of M665 and M666 to the joints, for many positions at once: nothing of
the package is used. mm and degrees in, mm out.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

STANDARD = (210.0, 330.0, 90.0)
"""Degrees about z, counter-clockwise from x: towers X front left, Y front right, Z behind."""


def words_of(text: str, code: str) -> dict[str, list[float]]:
    """Letters and numbers of the last line with a code; of one letter several, colons between."""
    found: dict[str, list[float]] = {}
    for line in text.splitlines():
        match = re.search(rf"\b{code}\b([^;\n]*)", line)
        if match and re.search(r"[A-Z]-?[\d.]", match[1]):
            found = {
                word[0]: [float(part) for part in word[1:].split(":")] for word in match[1].split()
            }
    return found


@dataclass(frozen=True)
class Delta:
    """Towers at `radius` (3,) and `angle` (3,), rods (3,); what stands at the endstops."""

    radius: Sequence[float]
    angle: Sequence[float]
    rod: Sequence[float]
    top: Sequence[float]
    tilt: tuple[float, float] = (0.0, 0.0)

    def heights(self, positions: Array) -> Array:
        """(n, 3) of the carriages for positions (n, 3): Pythagoras, and the tilt as a slope."""
        x, y, z = positions.T
        found = []
        for radius, angle, rod in zip(self.radius, self.angle, self.rod, strict=True):
            turn = np.radians(angle)
            sideways = np.hypot(radius * np.cos(turn) - x, radius * np.sin(turn) - y)
            rise = np.sqrt((rod - sideways) * (rod + sideways))
            found.append(z + rise + self.tilt[0] * x + self.tilt[1] * y)
        return np.stack(found, axis=1)

    def at_endstops(self) -> Array:
        """(3,) heights of the carriages there."""
        return np.array(
            [
                top + np.sqrt((rod - radius) * (rod + radius))
                for top, rod, radius in zip(self.top, self.rod, self.radius, strict=True)
            ]
        )


def marlin(m665: Mapping[str, list[float]], m666: Mapping[str, list[float]], probe: float) -> Delta:
    """M665 L R H XYZ ABC and M666 XYZ of Marlin 2.0.6 and newer; `probe`: M851 Z.

    H is the height of the nozzle after homing, from which a bed probe's z offset is taken; a
    carriage goes down from its endstop by its (negative) adjustment before it stands so.
    """
    one = {letter: values[0] for letter, values in m665.items()}
    down = [m666[letter][0] for letter in "XYZ"]
    return Delta(
        [one["R"]] * 3,
        [at + one[letter] for at, letter in zip(STANDARD, "XYZ", strict=True)],
        [one["L"] + one[letter] for letter in "ABC"],
        [one["H"] - probe - lowered for lowered in down],
    )


def reprap(m665: Mapping[str, list[float]], m666: Mapping[str, list[float]]) -> Delta:
    """M665 L (one or three) R H XYZ and M666 XYZ AB of RepRapFirmware 2.03 and newer.

    A positive adjustment means that the carriage stands higher at its endstop; A and B are percent
    of slope of the bed along x and y.
    """
    rods = m665["L"] * 3 if len(m665["L"]) == 1 else m665["L"]
    return Delta(
        m665["R"] * 3,
        [at + m665[letter][0] for at, letter in zip(STANDARD, "XYZ", strict=True)],
        rods,
        [m665["H"][0] + m666[letter][0] for letter in "XYZ"],
        (m666["A"][0] / 100.0, m666["B"][0] / 100.0),
    )


def positions(radius: float, top: float, count: int, seed: int) -> Array:
    """(count, 3) random ones in a cylinder about z, from z = 0 on."""
    numbers = np.random.default_rng(seed)
    out, turn = radius * np.sqrt(numbers.random(count)), 2.0 * np.pi * numbers.random(count)
    return np.column_stack([out * np.cos(turn), out * np.sin(turn), top * numbers.random(count)])
