"""A part to drive on any machine: walls, a chamfer, a bore and a face, and where they are drawn.

The program is written here, and what the drawing has of every element, so that nothing of the
reading of programs is needed to know where a point should be. In machine coordinates.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, eq=False)
class Wall:
    """From `begin` to `end` (3,), m."""

    begin: Floats
    end: Floats

    @property
    def along(self) -> Floats:
        """(3,) unit."""
        way = self.end - self.begin
        return np.asarray(way / np.linalg.norm(way))

    @property
    def normal(self) -> Floats:
        """(3,) unit, in the working plane."""
        return np.cross(UP, self.along)


@dataclass(frozen=True, eq=False)
class Bore:
    """Driven once round, counter-clockwise or not; m."""

    centre: Floats
    radius: float


@dataclass(frozen=True, eq=False)
class Face:
    """A raster in the working plane at the height `z`, m."""

    z: float


@dataclass
class DrawnPart:
    """The program's text, and of each element its lines and what it is."""

    text: str
    lines: dict[str, str] = field(default_factory=dict)
    shapes: dict[str, Wall | Bore | Face] = field(default_factory=dict)


CHAMFER = float(np.arctan(0.75))
"""rad, of the chamfer to the walls along x."""


class _Writer:
    def __init__(self, begin: Floats, planar: bool) -> None:
        self.words = ["G21 G90 G17 F1000"]
        self.at, self.planar = begin, planar
        self.part = DrawnPart("")
        self._to("G0", begin)

    def _to(self, code: str, end: Floats, more: str = "") -> int:
        axes = zip("XY" if self.planar else "XYZ", end * 1e3, strict=False)
        self.words.append(f"{code} " + " ".join(f"{a}{v:.6f}" for a, v in axes) + more)
        self.at = end
        return len(self.words)

    def rapid(self, end: Floats) -> None:
        self._to("G0", end)

    def wall(self, name: str, end: Floats) -> None:
        wall = Wall(self.at, end)
        line = self._to("G1", end)
        self.part.lines[name], self.part.shapes[name] = str(line), wall

    def bore(self, name: str, centre: Floats, radius: float, code: str = "G3") -> None:
        start = centre + np.array([radius, 0.0, 0.0])
        self.rapid(start)
        line = self._to(code, start, f" I{-radius * 1e3:.6f} J0")
        self.part.lines[name], self.part.shapes[name] = str(line), Bore(centre, radius)

    def face(self, name: str, corner: Floats, size: Floats, rows: int) -> None:
        self.rapid(corner)
        first = len(self.words) + 1
        for row in range(rows):
            y = corner[1] + size[1] * row / (rows - 1)
            ends = [corner[0], corner[0] + size[0]]
            near, far = ends if row % 2 == 0 else ends[::-1]
            if row:
                self._to("G1", np.array([near, y, corner[2]]))
            last = self._to("G1", np.array([far, y, corner[2]]))
        self.part.lines[name], self.part.shapes[name] = f"{first}-{last}", Face(corner[2])

    def rib(self, name: str, begin: Floats, end: Floats, deep: Floats) -> None:
        """A wall driven there at one depth and back at another."""
        self.rapid(begin)
        first = len(self.words) + 1
        for corner in (end, end - deep):
            self._to("G1", corner)
        last = self._to("G1", begin - deep)
        self.part.lines[name], self.part.shapes[name] = f"{first}-{last}", Wall(begin, end)

    def written(self) -> DrawnPart:
        self.part.text = "\n".join([*self.words, "M2", ""])
        return self.part


def rounded(values: Floats) -> Floats:
    """To whole hundredths of millimetres, m: what is drawn of them the program says exactly."""
    return np.asarray(np.round(np.asarray(values, float) * 1e5) * 1e-5)


def drawn_part(middle: Floats, size: float, planar: bool) -> DrawnPart:
    """About `middle` (3,), `size` across, m.

    South, east, north and west walls with a chamfer between north and west, which rises 3 over 4,
    one bore in the middle and one beside it; where the machine is not planar, below them a face, a
    smaller one, and a wall of two depths.
    """
    middle = rounded(middle)
    half = float(rounded(np.array(size / 2.0)))
    deep = np.array([0.0, 0.0, 0.4 * half])

    def at(x: float, y: float) -> Floats:
        return np.asarray(middle + half * np.array([x, y, 0.0]))

    writer = _Writer(at(-1.0, -1.0), planar)
    writer.wall("south", at(1.0, -1.0))
    writer.wall("east", at(1.0, 1.0))
    writer.wall("north", at(-0.6, 1.0))
    writer.wall("chamfer", at(-1.0, 0.7))
    writer.wall("west", at(-1.0, -1.0))
    writer.bore("bore", at(0.0, 0.0), 0.4 * half)
    writer.bore("hole", at(0.6, -0.5), 0.15 * half, "G2")
    if not planar:
        writer.face("face", at(-0.8, -0.8) - deep, 1.6 * np.array([half, half]), 9)
        writer.face("step", at(0.2, 0.3) - 0.5 * deep, 0.5 * np.array([half, half]), 5)
        writer.rib("rib", at(-0.7, 0.1), at(-0.7, -0.7), 0.5 * deep)
    return writer.written()
