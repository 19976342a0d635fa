"""Elements: walls, bores and faces of the part, each a stretch of the programmed path."""

from __future__ import annotations

from dataclasses import dataclass

from truepose.arrays import Floats, Indices
from truepose.errors import ReadingError


class FeatureError(ReadingError):
    """Elements that are not what a feature or a frame is about; `fault` says why."""


@dataclass(frozen=True, eq=False)
class Element:
    """One wall, bore or face, as the program drives it.

    `name`: of the feature or datum that it belongs to, and which of its elements it is where there
    are several, such as "width, wall 2". `points` (n, 3): programmed tool points, m, in machine
    coordinates, in the order of the path; of a machine that moves in a plane z is 0. `place` (n,):
    number of each among the points of the part. `lines` (n,): of the program. `plane` (3,): unit
    normal of the working plane (G17: z). `tool_radius`, m. `closed`: the path ends where it began,
    and has no point there but the last.
    """

    name: str
    points: Floats
    place: Indices
    lines: Indices
    plane: Floats
    tool_radius: float
    closed: bool = False
