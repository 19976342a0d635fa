"""The frame of datums: where a part's own coordinates are, of many sampled parts at once.

A face fixes two turns and its height, a wall one turn and its distance, a circle a point, each as
far as those before it left it free (ISO 5459), except that a face always tilts the part before its
walls turn it: a wall driven at one depth says nothing of the tilt. A wall or face is associated by
its minimum zone, which lies as the outer tangent of least distance does, and stands where the
middle of the zone is, since a program does not say on which side the material is; with
"least-squares" by that, in the direction that is free to it, and at its mean. The centre of a
circle is that of its least-squares circle either way. The path of the tool stands for the surface:
moved by the tool's radius along the associated line it has the same frame.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from truepose.arrays import Floats
from truepose.spatial import cross, skew
from truepose.workpiece.coordinates import Coordinates
from truepose.workpiece.element import Element, FeatureError
from truepose.workpiece.fits import AnyPlane, TurnedPlane, associate
from truepose.workpiece.outlines import Round, Straight, outline_of

Datum = Straight | Round

_LEVEL = 0.999
"""Cosine to the working plane's normal, of a face that can be a datum."""

_SAME = 1e-3
"""Sine of the angle between directions that are one."""

_U, _V, _W = np.eye(3)


@dataclass(frozen=True, eq=False)
class Fixing:
    """What one datum fixes: the tilt, the turn in the working plane, places along `shifts`."""

    tilts: bool
    turns: bool
    shifts: tuple[Floats, ...]


class DatumFrame:
    """The frame of `datums`, of which there is at least one, in u v w of `coordinates`."""

    def __init__(
        self, datums: Sequence[Element], coordinates: Coordinates, *, least_squares: bool
    ) -> None:
        """Raises `FeatureError` where a datum is none, or fixes nothing that is still free."""
        self.least_squares = least_squares
        self.coordinates = coordinates
        self.names = [datum.name for datum in datums]
        self.programmed = [coordinates.local(datum.points) for datum in datums]
        self.datums = [
            _datum(datum.name, points)
            for datum, points in zip(datums, self.programmed, strict=True)
        ]
        self.ideal = [
            datum.ideal(points) for datum, points in zip(self.datums, self.programmed, strict=True)
        ]
        self.fixings = _fixings(self.names, self.datums)
        shifts = [shift for fixing in self.fixings for shift in fixing.shifts]
        self._from_shifts = np.linalg.pinv(np.array(shifts)) if shifts else np.zeros((3, 0))

    @property
    def tilts(self) -> bool:
        """Whether a face says how the part is tilted."""
        return any(fixing.tilts for fixing in self.fixings)

    @property
    def turns(self) -> bool:
        """Whether walls or circles say how it is turned in the working plane."""
        return any(fixing.turns for fixing in self.fixings)

    def fixes(self, direction: Floats) -> bool:
        """Whether the frame says where along `direction` (3,) the part is."""
        return bool(
            np.linalg.norm(
                self._from_shifts @ np.linalg.pinv(self._from_shifts) @ direction - direction
            )
            < _SAME
        )

    def require_place(self, directions: Sequence[Floats], what: str) -> None:
        """Raises `FeatureError` where the frame does not say where along these something is."""
        if not self.turns:
            raise _no_frame(self.names, f"how {what} is turned in the working plane")
        for direction in directions:
            if not self.fixes(direction):
                u, v, w = self.coordinates.axes.T @ direction
                raise _no_frame(self.names, f"where {what} is along ({u:.3g}, {v:.3g}, {w:.3g})")

    def require_tilt(self, what: str) -> None:
        """Raises `FeatureError` where the frame does not say how high and tilted something is."""
        if not self.tilts:
            raise _no_frame(self.names, f"how high and how tilted {what} is")

    def fit(self, points: Sequence[Floats]) -> tuple[Floats, Floats]:
        """Rotation R (s, 3, 3) and shift (s, 3): a point y of the drawing is at R (y + shift).

        `points`: (s, n, 3) of each datum, in u v w. What no datum fixes is as on the drawing.
        """
        rotation = np.broadcast_to(np.eye(3), (len(points[0]), 3, 3))
        for k, fixing in enumerate(self.fixings):
            if fixing.tilts:
                rotation = self._tilt(k, points)
        for k, fixing in enumerate(self.fixings):
            if fixing.turns:
                rotation = rotation @ self._turn(k, points, rotation)
        found = [
            self._place(k, points[k] @ rotation, shift)
            for k, fixing in enumerate(self.fixings)
            for shift in fixing.shifts
        ]
        places = np.array(found).reshape(len(found), len(points[0]))
        return rotation, np.einsum("ck,ks->sc", self._from_shifts, places)

    def seen(self, points: Sequence[Floats], of_datums: Sequence[Floats]) -> list[Floats]:
        """Points (s, n, 3) of elements as they are on the drawing's own axes."""
        rotation, shift = self.fit(of_datums)
        return [element @ rotation - shift[:, np.newaxis] for element in points]

    def _tilt(self, k: int, points: Sequence[Floats]) -> Floats:
        """(s, 3, 3) least rotation of the face's normal to where it is associated."""
        datum = self._straight(k)
        shape = AnyPlane(np.tile(datum.normal, (len(points[k]), 1)), datum.length)
        shape, _ = associate(shape, points[k], least_squares=self.least_squares)
        axis = cross(np.broadcast_to(datum.normal, shape.normal.shape), shape.normal)
        cosine = shape.normal @ datum.normal
        matrix = skew(axis)
        rest = (matrix @ matrix) / (1.0 + cosine)[:, np.newaxis, np.newaxis]
        return np.asarray(np.eye(3) + matrix + rest)

    def _turn(self, k: int, points: Sequence[Floats], rotation: Floats) -> Floats:
        """(s, 3, 3) rotation about w, of points that were tilted back."""
        datum, seen = self.datums[k], points[k] @ rotation
        if isinstance(datum, Straight):
            normal = np.tile(datum.normal, (len(seen), 1))
            shape = TurnedPlane(normal, np.broadcast_to(_W, normal.shape), datum.length)
            direction = associate(shape, seen, least_squares=self.least_squares)[0].normal
            nominal = datum.normal
        else:
            first = next(j for j, other in enumerate(self.datums) if isinstance(other, Round))
            other = self.datums[first]
            assert isinstance(other, Round)  # the one that it was chosen as
            direction = centres(datum, seen) - centres(other, points[first] @ rotation)
            nominal = datum.centre - other.centre
        angle = np.arctan2(
            nominal[0] * direction[:, 1] - nominal[1] * direction[:, 0],
            nominal[0] * direction[:, 0] + nominal[1] * direction[:, 1],
        )
        turned = np.zeros((len(seen), 3, 3))
        turned[:, 0, 0] = turned[:, 1, 1] = np.cos(angle)
        turned[:, 1, 0] = np.sin(angle)
        turned[:, 0, 1] = -turned[:, 1, 0]
        turned[:, 2, 2] = 1.0
        return turned

    def _place(self, k: int, seen: Floats, direction: Floats) -> Floats:
        """(s,) how far the datum is along `direction` (3,) from where it should be."""
        datum = self.datums[k]
        if isinstance(datum, Round):
            return np.asarray((centres(datum, seen) - datum.centre) @ direction[:2])
        along = (seen - datum.points) @ direction
        if self.least_squares:
            return np.asarray(along.mean(axis=1))
        return np.asarray(0.5 * (along.max(axis=1) + along.min(axis=1)))

    def _straight(self, k: int) -> Straight:
        datum = self.datums[k]
        assert isinstance(datum, Straight)  # only a face tilts
        return datum


@dataclass(frozen=True, eq=False)
class PartFrame:
    """Where sampled parts have their `frame`, in machine coordinates."""

    frame: DatumFrame
    coordinates: Coordinates

    def __call__(self, points: Floats) -> tuple[Floats, Floats]:
        """Rotations R (s, 3, 3) and origins o (s, 3), m, of points (s, n, 3) of all datums, m.

        A point x of the machine is at R^T (x - o) of the part, in the program's own coordinates.
        """
        ends = np.cumsum([len(datum) for datum in self.frame.programmed])[:-1]
        local = [self.coordinates.local(datum) for datum in np.split(points, ends, axis=1)]
        turned, shift = self.frame.fit(local)
        axes, middle = self.coordinates.axes, self.coordinates.middle
        rotation = axes.T @ turned @ axes
        return rotation, middle - np.einsum("sij,sj->si", rotation, middle - shift @ axes)


def datum_alignment(datums: Sequence[Element], *, least_squares: bool) -> PartFrame:
    """The frame of a whole part.

    Raises `FeatureError` where the datums leave the part free in its working plane.
    """
    coordinates = Coordinates.of(datums)
    frame = DatumFrame(datums, coordinates, least_squares=least_squares)
    frame.require_place(list(np.eye(3)[:2]), "the part")
    return PartFrame(frame, coordinates)


def centres(datum: Round, points: Floats) -> Floats:
    """(s, 2) centres of the least-squares circles through points (s, n, 3) of a circle."""
    return associate(datum.placed(points), points, least_squares=True)[0].centre


def _datum(name: str, points: Floats) -> Datum:
    """The wall, face or circle that it is. Raises `FeatureError`."""
    outline = outline_of(name, points)
    if isinstance(outline, Straight) and outline.kind == "face":
        leaning = float(np.degrees(np.arccos(min(abs(outline.normal[2]), 1.0))))
        if abs(outline.normal[2]) < _LEVEL:
            raise FeatureError(
                "feature-datums",
                f"{name}: a face that is a datum lies in the working plane",
                found=f"a face at {leaning:.3g} degrees to it",
                expected="a face in the working plane, or a wall that stands across it",
            )
    return outline


def _fixings(names: Sequence[str], datums: Sequence[Datum]) -> list[Fixing]:
    fixings: list[Fixing] = []
    tilted = turned = seen_circle = False
    level: list[Floats] = []  # directions in the working plane along which the part is placed
    for name, datum in zip(names, datums, strict=True):
        tilts = turns = False
        shifts: tuple[Floats, ...] = ()
        if isinstance(datum, Round):
            turns = seen_circle and not turned
            seen_circle = True
            if not level:
                shifts = (_U, _V)
            elif len(level) == 1:
                shifts = (cross(_W, level[0]),)
            level.extend(shifts)
        elif datum.kind == "face":
            tilts = not tilted
            shifts = (_W,) if tilts else ()
        else:
            turns = not turned
            parallel = level and abs(level[0] @ datum.along) < _SAME
            if not level or (len(level) == 1 and not parallel):
                shifts = (datum.normal,)
                level.append(datum.normal)
        if not (tilts or turns or shifts):
            raise _no_frame([name], "anything that the datums before it leave free")
        tilted, turned = tilted or tilts, turned or turns
        fixings.append(Fixing(tilts, turns, shifts))
    return fixings


def _no_frame(names: Sequence[str], what: str) -> FeatureError:
    says = "does" if len(names) == 1 else "do"
    return FeatureError(
        "feature-datums",
        f"the datums form no frame: {' and '.join(names)} {says} not say {what}",
        found=f"datums {', '.join(names)}",
        expected="such as a wall and a wall or a bore across it, in the order of the drawing",
    )
