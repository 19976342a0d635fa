"""What a feature's numbers follow to first order, and by how much the second order is bounded.

Tool points lie at x_i + e_i, with no e_i longer than rho. x_i is where a point would be without the
program's rounding, on an exact line, plane or circle, in u v w of `Coordinates`. A frame sees them
at y_i = R^T (x_i + e_i) - shift, off by d_i = y_i - x_i, with, where m = (omega, shift),

    d_i = e_i - omega x x_i - shift + b_i,      |b_i| <= 1.1 W rho^2 + 1.3 W^2 X rho^2

for |omega| <= 1.1 W rho and |x_i| <= X, as R^T is 1 - [omega] but for |omega|^2 (a tilt and a turn
across it: (|tilt| + |turn|)^2 / 2 <= |omega|^2). A least-squares association makes linear
functionals of the d_i vanish, but for what `Straightened` and `Circled` bound, so that m solves
A m = F e + O(rho^2) with what is known of the rest; that m stays within 1.1 of its first order
is what limits `reach`.

A minimum zone lies elsewhere than least squares, to first order, and no linear form says where. But
it is a line g (a plane) with |g(x_j) - r_j| <= H / 2 at every point, of least-squares residuals
r_j and H their range, since no zone is narrower than the minimum one. A functional of lines that
least squares take as sum w_j (.) gives 0 for the r_j, so that for g it is at most H / 2 sum |w_j|:
that is a `plus` of the `Forms`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.spatial import cross, norm, tangents
from truepose.workpiece.coordinates import Coordinates
from truepose.workpiece.datum_frame import DatumFrame
from truepose.workpiece.features._base import Forms, Rule
from truepose.workpiece.outlines import Round, Straight

_NOISE = 1e-13
"""Of the size of the points: programmed points that are off by less are off by rounding."""


@dataclass(frozen=True, eq=False)
class Straightened:
    """Least squares of a line or a plane: `slopes` (k, n) of one or two, per unit of deviation.

    Points are off along it by tau and across by h. `steep` is k = sqrt(n) / T, with T^2 the least
    sum of squares of the places t along it, and `condition` c the root of the largest over the
    least. Orthogonal least squares have a slope b, of residuals r = h - b (t + tau), with

        sum (t + tau) r (1 + b^2) = -b sum r^2,    so that with b_1 the linear functional of h
        b - b_1 = T^-2 [-b sum t tau - sum tau r - b (...)]

    where sums are at most n times the product of root mean squares, and T times sqrt(n) times one.
    """

    slopes: Floats
    steep: float
    condition: float
    length: float

    @classmethod
    def of(cls, along: Floats) -> Straightened:
        """Of places (n, k) along it, m."""
        centred = along - along.mean(axis=0)
        square = centred.T @ centred
        roots = np.sqrt(np.linalg.eigvalsh(square))
        length = float(norm(np.ptp(along, axis=0)))
        return cls(
            np.linalg.solve(square, centred.T),
            math.sqrt(len(along)) / float(roots[0]),
            float(roots[-1] / roots[0]),
            length,
        )

    def bend(self, along: float = 1.0, across: float = 1.0, slope: float | None = None) -> float:
        """Of a slope's second order, 1/m.

        tau and r are at most `along` and `across` times rho in the root mean square, and the slope
        is at most `slope` rho.
        """
        slope = self.steep if slope is None else slope
        return 1.2 * self.steep * along * (self.steep * across + self.condition * slope)

    def reach(self, along: float = 1.0) -> float:
        """Where these hold: T is at most a hundredth longer or shorter."""
        return 0.01 / (self.steep * along)


@dataclass(frozen=True, eq=False)
class Circled:
    """Least squares of a circle: `centre` (2, n) and `radius` (n,) per unit of radial deviation.

    Of v_i = e_i - c, no longer than `off` rho <= R / 50, the radius is R + u_i . v_i + q_i with
    0 <= q_i <= |v_i|^2 / (1.96 R), and the spoke u_i' is off u_i by at most 1.02 |v_i| / R. With
    f_i the residuals, sum f_i (u_i', 1) = 0 says, a_i = (u_i, 1) and G = sum a_i a_i^t,

        G (c, s - R) = sum a_i (u_i . e_i + q_i) + sum (u_i' - u_i, 0) f_i

    and sum f_i^2 is at most what it is about the nominal circle, 1.1 n rho^2.
    """

    spokes: Floats
    centre: Floats
    radius: Floats
    size: float
    _inverse: Floats

    @classmethod
    def of(cls, outline: Round) -> Circled:
        """Of a circle as it is on the drawing."""
        rows = np.column_stack([outline.spokes, np.ones(len(outline.spokes))])
        inverse = np.linalg.inv(rows.T @ rows)
        weights = inverse @ rows.T
        return cls(outline.spokes, weights[:2], weights[2], outline.radius, inverse)

    @property
    def moved(self) -> float:
        """How far the centre is moved at most, per rho, to first order."""
        return widest(self.centre.T)

    @property
    def off(self) -> float:
        """How far a point and the centre are off each other at most, per rho."""
        return 1.0 + 1.1 * self.moved

    @property
    def bow(self) -> float:
        """Of a radius: what the length of v_i adds to its component along the spoke, 1/m."""
        return self.off**2 / (1.96 * self.size)

    @property
    def bend(self) -> float:
        """Of the centre's second order, 1/m."""
        block = float(np.linalg.norm(self._inverse[:2, :2], 2))
        return self.moved * self.bow + block * self._turned

    @property
    def radius_bend(self) -> float:
        """Of the radius's second order, 1/m."""
        turned = float(norm(self._inverse[2, :2])) * self._turned
        return float(np.abs(self.radius).sum()) * self.bow + turned

    @property
    def reach(self) -> float:
        """Where these hold: the second order is at most a tenth of the first."""
        return min(self.size / (50.0 * self.off), 0.1 * self.moved / self.bend)

    @property
    def _turned(self) -> float:
        return len(self.spokes) * 1.1 * self.off / self.size


class FirstOrder:
    """The points of a feature's elements and datums, and the motion of the frame that sees them.

    `ideal` (N, 3), of all elements and then all datums. `jac_motion` (6, N, 3): omega and shift per
    error. `levers` (6, number of datums): by how much each is moved besides, at most, per range of
    that datum's residuals; `residuals`, their forms. `turned` and `bends` (6,): no component of the
    frame's omega is beyond 1.1 `turned` rho in all, and the motion's second order, 1/m or 1/m^2.
    """

    def __init__(
        self,
        ideal: Sequence[Floats],
        programmed: Sequence[Floats],
        coordinates: Coordinates,
        frame: DatumFrame | None,
    ) -> None:
        """`ideal`, `programmed`: (n, 3) of the elements alone, in u v w."""
        self.coordinates = coordinates
        datums = [] if frame is None else frame.ideal
        given = [*programmed, *([] if frame is None else frame.programmed)]
        self.count = sum(map(len, ideal))
        self.starts = np.cumsum([0, *map(len, [*ideal, *datums])])
        self.ideal = np.concatenate([*ideal, *datums])
        rounding = np.concatenate(given) - self.ideal
        size = float(np.abs(self.ideal).max(initial=0.0))
        rounding[np.abs(rounding) < _NOISE * size] = 0.0
        self.rounding = rounding
        self.rounded = float(norm(rounding).max(initial=0.0))
        self.jac_motion = np.zeros((6, len(self.ideal), 3))
        self.levers = np.zeros((6, len(datums)))
        self.residuals: list[Floats] = [np.zeros((0, 0, 3))] * len(datums)
        self.bends = np.zeros(6)
        self.turned, self.level = 0.0, True
        self.reach = math.inf
        if frame is not None:
            self.level = not frame.tilts
            self._follow(frame, len(ideal))

    @classmethod
    def of_frame(cls, frame: DatumFrame) -> FirstOrder:
        """Of a frame alone, by which a whole part is aligned: all points are its datums'.

        `jac_motion` is that of least squares, in u v w of the frame's coordinates: a point y of the
        drawing is seen at y + omega x y + shift. A minimum zone moves it besides, see `levers`.
        """
        return cls([], [], frame.coordinates, frame)

    def bent(self, points: Floats, directions: Floats, *, ranged: bool = False) -> float:
        """Of seen points (n, 3) along directions (n, 3) the second order at most, 1/m.

        Where `ranged`, of half the range of several: what all have in common falls out. Of a frame
        that only turns in the working plane R^T is 1 - [omega] - |omega|^2 / 2 there.
        """
        effects = self.effect(points, directions)
        if self.level:
            along = np.einsum("nc,nc->n", points[:, :2], directions[:, :2])
            bow = 0.5 * float(0.5 * np.ptp(along) if ranged else np.abs(along).max())
        else:
            bow = float(norm(points - (points.mean(axis=0) if ranged else 0.0)).max())
        moves = 0.5 * np.ptp(effects, axis=0) if ranged else np.abs(effects).max(axis=0)
        turned = 1.1 * self.turned + 1.21 * self.turned**2 * bow
        return float(turned + moves @ self.bends)

    def seen(self, first: int, directions: Floats) -> Floats:
        """(n, N, 3) forms of the seen points from `first` on, along `directions` (n, 3)."""
        return self.seen_at(first + np.arange(len(directions)), directions)

    def seen_at(self, places: Indices, directions: Floats) -> Floats:
        """The same of seen points at `places` (n,), in any order."""
        forms = np.zeros((len(places), len(self.ideal), 3))
        forms[np.arange(len(places)), places] = directions
        forms -= np.tensordot(self.effect(self.ideal[places], directions), self.jac_motion, 1)
        return forms

    def effect(self, points: Floats, directions: Floats) -> Floats:
        """(n, 6) components of omega x point + shift along the directions."""
        return np.concatenate([cross(points, directions), directions], axis=-1)

    def plus(self, effect: Floats, factor: float = 1.0) -> tuple[Forms, ...]:
        """Of a functional moved by |`effect`| (6,) per motion: what the datums' forms add."""
        widths = factor * (np.abs(effect) @ self.levers)
        return tuple(
            self.forms("spread", residuals, factor=float(width))
            for residuals, width in zip(self.residuals, widths, strict=True)
            if width > 0.0
        )

    def forms(
        self,
        rule: Rule,
        weights: Floats,
        base: Floats | float = 0.0,
        *,
        curvature: float = 0.0,
        side: int = 1,
        factor: float = 1.0,
        plus: tuple[Forms, ...] = (),
        reach: float = math.inf,
    ) -> Forms:
        """`Forms` in machine coordinates of `weights` (K, N, 3) in u v w of e.

        e is the error of a point and its rounding r: (rho + r)^2 <= 1.1 rho^2 + 11 r^2.
        """
        values = np.broadcast_to(base, len(weights)) + np.einsum(
            "kni,ni->k", weights, self.rounding
        )
        if self.rounded > 0.0 and curvature > 0.0:
            rest = np.array([0.0, 11.0 * curvature * self.rounded**2])
            none = np.zeros((2, len(self.ideal), 3))
            plus = (*plus, Forms("spread", none, rest, 0.0))
            curvature, reach = 1.1 * curvature, max(reach - self.rounded, 0.0)
        return Forms(
            rule,
            weights @ self.coordinates.axes,
            values,
            curvature,
            side,
            factor,
            plus,
            min(reach, self.reach),
        )

    def _follow(self, frame: DatumFrame, first: int) -> None:
        """Set the motion of the frame, whose datums stand from place `first` of `starts` on."""
        rows = self._rows(frame, first)
        basis = np.array([row.moves for row in rows]).T
        effects = np.array([np.sum(self.effect(self.ideal, row.weights), axis=0) for row in rows])
        gain = basis @ np.linalg.inv(effects @ basis)
        self.jac_motion = np.tensordot(gain, np.array([row.weights for row in rows]), 1)
        sizes = np.array([float(norm(row.weights).sum()) for row in rows])
        limits = self._lever(frame, first, rows, gain, sizes)
        ranges = np.array([self._widest_range(residuals) for residuals in self.residuals])
        first_order = norm(self.jac_motion).sum(axis=1) + self.levers @ ranges
        self.turned = float(norm(first_order[:3]))
        tilted = 1.1 * float(norm(first_order[:2]))
        second = np.zeros(len(rows))
        for k, (row, size) in enumerate(zip(rows, sizes, strict=True)):
            depth = float(np.ptp(self._points(first + row.datum)[:, 2]))
            second[k] = self._row_bend(row, size) + row.fit_bend(1.0 + tilted * depth)
        self.bends = np.abs(gain) @ second
        for k, (row, size) in enumerate(zip(rows, sizes, strict=True)):
            if row.normal is not None and not frame.least_squares:
                # The residuals' range, and the zone's slope on points that are off along it.
                points = self._points(first + row.datum)
                normals = np.broadcast_to(row.normal, points.shape)
                second[k] += size * self.bent(points, normals, ranged=True)
                second[k] += size * 2.2 * float(limits[k] @ ranges) * row.is_slope
                second[k] += 2.2 * size * row.steep * float(ranges.max()) * (not row.is_slope)
        self.bends = np.abs(gain) @ second
        reaches = [row.fit_reach() for row in rows]
        for first_size, second_size in (
            (self.turned, norm(self.bends[:3])),
            (float(norm(first_order[3:])), norm(self.bends[3:])),
        ):
            if second_size > 0.0:
                reaches.append(0.1 * first_size / float(second_size))
        self.reach = min(reaches)

    def _row_bend(self, row: _Row, size: float) -> float:
        """Of a functional of seen points the second order that the frame's rotation makes, 1/m."""
        moment = row.weights.T @ self.ideal
        bow = abs(0.5 * float(moment[0, 0] + moment[1, 1])) if self.level else norm(moment.ravel())
        return 1.1 * self.turned * size + 1.21 * self.turned**2 * float(bow)

    @staticmethod
    def _widest_range(residuals: Floats) -> float:
        return 2.0 * float(norm(residuals).sum(axis=1).max(initial=0.0))

    def _points(self, element: int) -> Floats:
        return self.ideal[self.starts[element] : self.starts[element + 1]]

    def _rows(self, frame: DatumFrame, first: int) -> list[_Row]:
        """What vanishes of the seen points of the datums, one for each freedom that they fix."""
        rows: list[_Row] = []
        for wanted in ("tilts", "turns", "shifts"):
            for k, fixing in enumerate(frame.fixings):
                datum, start = frame.datums[k], int(self.starts[first + k])
                if wanted == "tilts" and fixing.tilts:
                    assert isinstance(datum, Straight)
                    across = tangents(datum.normal)
                    fit = Straightened.of(datum.points @ across.T)
                    for slope, axis in zip(fit.slopes, (across[1], across[0]), strict=True):
                        rows.append(
                            self._straight_row(k, start, datum, slope, fit, np.r_[axis, 0, 0, 0])
                        )
                elif wanted == "turns" and fixing.turns:
                    if isinstance(datum, Straight):
                        fit = Straightened.of((datum.points @ datum.along)[:, np.newaxis])
                        rows.append(self._straight_row(k, start, datum, fit.slopes[0], fit, _TURN))
                    else:
                        rows.append(self._pair_row(frame, first, k))
                elif wanted == "shifts":
                    for shift in fixing.shifts:
                        moves = np.r_[np.zeros(3), shift]
                        if isinstance(datum, Round):
                            rows.append(self._circle_row(k, start, datum, shift, moves))
                        else:
                            mean = np.full(len(datum.points), 1.0 / len(datum.points))
                            rows.append(self._straight_row(k, start, datum, mean, None, moves))
        return rows

    def _straight_row(
        self,
        k: int,
        start: int,
        datum: Straight,
        functional: Floats,
        fit: Straightened | None,
        moves: Floats,
    ) -> _Row:
        weights = np.zeros((len(self.ideal), 3))
        weights[start : start + len(functional)] = functional[:, np.newaxis] * datum.normal
        across = tangents(datum.normal) if datum.kind == "face" else datum.along[np.newaxis]
        steep = Straightened.of(datum.points @ across.T).steep
        return _Row(k, weights, moves, datum.normal, steep, straightened=fit)

    def _circle_row(
        self, k: int, start: int, datum: Round, direction: Floats, moves: Floats
    ) -> _Row:
        fit = Circled.of(datum)
        weights = np.zeros((len(self.ideal), 3))
        along = direction[:2] @ fit.centre
        weights[start : start + len(along), :2] = along[:, np.newaxis] * datum.spokes
        return _Row(k, weights, moves, circled=(fit,))

    def _pair_row(self, frame: DatumFrame, first: int, k: int) -> _Row:
        """That the line between two centres keeps its direction."""
        j = next(j for j, datum in enumerate(frame.datums) if isinstance(datum, Round))
        one, other = frame.datums[j], frame.datums[k]
        assert isinstance(one, Round)
        assert isinstance(other, Round)
        between = other.centre - one.centre
        across = np.array([-between[1], between[0], 0.0]) / float(norm(between))
        rows = [
            self._circle_row(place, int(self.starts[first + place]), datum, across, _TURN)
            for place, datum in ((j, one), (k, other))
        ]
        return _Row(
            k,
            rows[1].weights - rows[0].weights,
            _TURN,
            circled=(*rows[0].circled, *rows[1].circled),
        )

    def _lever(
        self,
        frame: DatumFrame,
        first: int,
        rows: Sequence[_Row],
        gain: Floats,
        sizes: Floats,
    ) -> Floats:
        """Set how far the datums' own forms move the frame: `levers` and `residuals`.

        Returns (number of rows, number of datums) what they make of each functional.
        """
        limits = np.zeros((len(rows), len(frame.datums)))
        if frame.least_squares:
            return limits
        for stage in ("tilts", "turns", "shifts"):
            before = limits.copy()
            for place, row in enumerate(rows):
                if row.normal is None or row.stage != stage:
                    continue
                others = [other.datum != row.datum and other.stage != "shifts" for other in rows]
                turned = (np.abs(gain) @ (before * np.array(others)[:, np.newaxis]))[:3]
                points = self._points(first + row.datum)
                normals = np.broadcast_to(row.normal, points.shape)
                extent = np.ptp(cross(points, normals), axis=0)
                limits[place] = 0.5 * sizes[place] * (extent @ turned)
                limits[place, row.datum] += 0.5 * sizes[place]
        self.levers = np.abs(gain) @ limits
        for k, datum in enumerate(frame.datums):
            if isinstance(datum, Straight) and np.any(limits[:, k]):
                normals = np.broadcast_to(datum.normal, datum.points.shape)
                forms = self.seen(int(self.starts[first + k]), normals)
                self.residuals[k] = forms - forms.mean(axis=0)
        return limits


@dataclass(frozen=True, eq=False)
class FrameMotion:
    """The motion with which a frame answers errors of its m datum points, to first order.

    `response` (6, m, 3): of the place that the drawing has at `about` (3,), then its turn, both in
    machine coordinates. Besides, minimum zones may move it: `levers` (6, number of datums) by how
    much at most per range of that datum's `residuals`, forms (n, m, 3).
    """

    about: Floats
    response: Floats
    levers: Floats
    residuals: tuple[Floats, ...]

    @classmethod
    def of(cls, frame: DatumFrame) -> FrameMotion:
        """Of the datums of a whole part."""
        order, axes = FirstOrder.of_frame(frame), frame.coordinates.axes
        jac = order.jac_motion @ axes
        parts = (slice(3, 6), slice(3))
        return cls(
            frame.coordinates.middle,
            np.concatenate([np.tensordot(axes.T, jac[part], 1) for part in parts]),
            np.concatenate([np.abs(axes.T) @ order.levers[part] for part in parts]),
            tuple(residuals @ axes for residuals in order.residuals),
        )


_TURN = np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0])


@dataclass(frozen=True, eq=False)
class _Row:
    """A functional `weights` (N, 3) of seen points that vanishes, and the move (6,) that it fixes.

    Of a wall or face with its `normal`, and how `steep` a slope of its points may be; a minimum
    zone puts it elsewhere.
    """

    datum: int
    weights: Floats
    moves: Floats
    normal: Floats | None = None
    steep: float = 0.0
    straightened: Straightened | None = None
    circled: tuple[Circled, ...] = ()

    @property
    def is_slope(self) -> bool:
        """Whether it says of a wall or face how it is turned."""
        return self.straightened is not None

    @property
    def stage(self) -> str:
        """Which of what its datum fixes it says."""
        if np.any(self.moves[3:]):
            return "shifts"
        return "turns" if self.moves[2] else "tilts"

    def fit_bend(self, along: float) -> float:
        """Of the functional's second order: of its own least squares, seen along themselves.

        There the slope is none but for the second order, and residuals are at most rho in the root
        mean square.
        """
        bend = sum(circled.bend for circled in self.circled)
        return bend + (self.straightened.bend(along, along, 0.0) if self.straightened else 0.0)

    def fit_reach(self) -> float:
        """Where that holds."""
        reaches = [circled.reach for circled in self.circled]
        if self.straightened:
            reaches.append(self.straightened.reach())
        return min(reaches, default=math.inf)


_DIRECTIONS = 90


def widest(vectors: Floats) -> float:
    """An upper bound of the longest sum of vectors (n, 2), each with the better sign.

    It is the largest sum of |a . vector| over unit a; between the directions looked at, a cosine.
    """
    angles = np.arange(_DIRECTIONS) * (np.pi / _DIRECTIONS)
    sums = np.abs(np.stack([np.cos(angles), np.sin(angles)], 1) @ vectors.T).sum(axis=1)
    return float(sums.max() / np.cos(0.5 * np.pi / _DIRECTIONS))
