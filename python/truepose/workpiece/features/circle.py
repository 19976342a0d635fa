"""A bore, boss or arc: its diameter, its roundness and its place.

Points are looked at in the working plane. Two-point diameters (ISO 14405-1) go through the centre
of the least-squares circle, from each point to the one opposite to it on the drawing, between two
points by the angle; the smallest and the largest must be within the limits. Roundness is the width
between two concentric circles of the minimum zone (ISO 12181). The place is that of the centre of
the least-squares circle, as ISO 17450-3 has the centre of a section; its zone (ISO 1101) is a
circle, and the value the diameter of the zone that just holds it. With "least-squares" the diameter
is that of the least-squares circle, and roundness goes from the lowest to the highest point from
it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar, Self

import numpy as np
from pydantic import BaseModel, Field, model_validator

from truepose.arrays import Floats, Indices
from truepose.errors import Fault
from truepose.files.file_table import FileTable
from truepose.files.quantity import AllowedLength, PositiveLength, refuse
from truepose.files.size_limits import LengthLimits
from truepose.spatial import norm
from truepose.workpiece.datum_frame import centres
from truepose.workpiece.element import FeatureError
from truepose.workpiece.features._base import Forms, Quantity
from truepose.workpiece.features._evaluated import LIMITS, SIDE, EvaluatedFeature, Side
from truepose.workpiece.first_order import Circled, FirstOrder
from truepose.workpiece.fits import associate
from truepose.workpiece.outlines import Round, circle

_SAME_ANGLE = 1e-7
"""Directions to points that are one, rad."""

_LARGEST_GAP = 4.0
"""Of the usual angle between points: between two that are further apart there is no path."""

PLACE_OF_CENTRE = "centre of the least-squares circle (ISO 17450-3), diameter of the zone"


class CircleTable(FileTable):
    """Keys of a feature of kind circle."""

    diameter: PositiveLength | None = Field(
        None, description="The diameter that the drawing asks for."
    )
    tolerance: LengthLimits | None = Field(None, description=LIMITS)
    roundness: AllowedLength | None = Field(
        None, description="Width of the zone between two concentric circles."
    )
    position: AllowedLength | None = Field(None, description="Diameter of the zone of the centre.")
    side: Side = Field(None, description=SIDE)

    @model_validator(mode="after")
    def _asks_something(self) -> Self:
        if self.tolerance is None and self.roundness is None and self.position is None:
            refuse(
                Fault(
                    "missing-key",
                    "nothing is asked of the circle",
                    found="neither tolerance, roundness nor position",
                    expected="one of them at least",
                )
            )
        if (self.tolerance is None) != (self.diameter is None):
            refuse(
                Fault(
                    "missing-key",
                    "a diameter and its tolerance go together",
                    found="tolerance alone" if self.diameter is None else "diameter alone",
                    expected='both, such as diameter = "40 mm" and tolerance = "+0.025 0"',
                )
            )
        return self


class Circle(EvaluatedFeature):
    """A circle or an arc in the working plane."""

    kind = "circle"
    doc = "diameter, roundness and position of a bore, boss or arc"
    table: ClassVar[type[BaseModel]] = CircleTable

    def set_up(self, row: BaseModel) -> None:
        """Raises `FeatureError` where the points are no circle, or no two of them are opposite."""
        assert isinstance(row, CircleTable)
        self.outline = circle(self.elements[0].name, self.programmed[0])
        quantities: list[Quantity] = []
        self._asked = [
            name for name in ("diameter", "roundness", "position") if getattr(row, name) is not None
        ]
        if row.diameter is not None and row.tolerance is not None:
            self._shift = self.surface(row.side, "the surface is")
            operators = {"": "least-squares diameter (ISO 14405-1)"}
            if not self.least_squares:
                self._opposite = opposite_shares(self.name, self.outline)
                operators = {
                    ", smallest": "two-point diameter (ISO 14405-1), smallest",
                    ", largest": "two-point diameter (ISO 14405-1), largest",
                }
            quantities += self.size("diameter", row.diameter, row.tolerance, operators)
        if row.roundness is not None:
            operator = (
                "from the least-squares circle (ISO 12181)"
                if self.least_squares
                else "minimum zone (ISO 12181)"
            )
            quantities.append(self.zone("roundness", row.roundness, operator))
        if row.position is not None:
            if self.frame is not None:
                self.frame.require_place(list(np.eye(3)[:2]), self.name)
            quantities.append(self.zone("position", row.position, PLACE_OF_CENTRE))
        elif self.datums:
            raise FeatureError(
                "feature-datums",
                f"{self.name}: datums, and no position that is seen from them",
                found="datums without position",
                expected='position, such as position = "0.05 mm"',
            )
        self.quantities = tuple(quantities)

    def evaluate(self, own: Sequence[Floats], seen: Sequence[Floats]) -> list[Floats]:
        """Diameters, roundness and place, as far as they are asked for."""
        start = self.outline.placed(own[0])
        mean, radii = associate(start, own[0], least_squares=True)
        values: list[Floats] = []
        if "diameter" in self._asked:
            if self.least_squares:
                values.append(2.0 * radii.mean(axis=1) + self._shift)
            else:
                places, shares = self._opposite
                local = radii[:, places[:, 0]]
                local = local + (1.0 - shares) * radii[:, places[:, 1]]
                local = local + shares * radii[:, places[:, 2]]
                values += [local.min(axis=1) + self._shift, local.max(axis=1) + self._shift]
        if "roundness" in self._asked:
            if not self.least_squares:
                radii = associate(mean, own[0])[1]
            values.append(np.ptp(radii, axis=1))
        if "position" in self._asked:
            values.append(centre_value(self.outline, seen[0]))
        return values

    def ideal(self) -> list[Floats]:
        """The circle."""
        return [self.outline.ideal(self.programmed[0])]

    def linear(self, order: FirstOrder) -> list[Forms]:
        """Radii from the centre of least squares, to first order; see `Circled`.

        Roundness is at most the range of the radii from any centre, so from that one, where a
        radius is its form and a bow of one sign.
        """
        fit = Circled.of(self.outline)
        bow, bend, reach = fit.bow, fit.bend, fit.reach
        forms: list[Forms] = []
        radii = radial_forms(self.outline, fit, len(order.ideal))
        if "diameter" in self._asked:
            base = 2.0 * self.outline.radius + self._shift
            if self.least_squares:
                weights = _spokes(self.outline, len(order.ideal))
                mean = 2.0 * np.tensordot(fit.radius[np.newaxis], weights, 1)
                curvature = 2.0 * fit.radius_bend
                forms.append(order.forms("between", mean, base, curvature=curvature, reach=reach))
            else:
                places, shares = self._opposite
                local = radii[places[:, 0]]
                local = local + (1.0 - shares)[:, np.newaxis, np.newaxis] * radii[places[:, 1]]
                local = local + shares[:, np.newaxis, np.newaxis] * radii[places[:, 2]]
                curvature = 2.0 * (bow + bend)
                forms += [
                    order.forms("between", local, base, curvature=curvature, side=side, reach=reach)
                    for side in (-1, 1)
                ]
        if "roundness" in self._asked:
            curvature = bow + (2.0 * bend if self.least_squares else 0.0)
            forms.append(order.forms("spread", radii, curvature=curvature, reach=reach))
        if "position" in self._asked:
            forms.append(centre_forms(order, self.outline, 0))
        return forms


def centre_value(outline: Round, points: Floats) -> Floats:
    """(s,) diameter of the zone about the nominal centre that just holds the centre."""
    return np.asarray(2.0 * np.linalg.norm(centres(outline, points) - outline.centre, axis=1))


def centre_forms(order: FirstOrder, outline: Round, first: int) -> Forms:
    """The place of the centre of a circle whose points stand from `first` on.

    A frame sees the centre where it sees any point, so that it adds what it does there.
    """
    fit = Circled.of(outline)
    spokes = np.column_stack([outline.spokes, np.zeros(len(outline.spokes))])
    weights = np.zeros((2, len(order.ideal), 3))
    own = slice(first, first + len(spokes))
    weights[:, own] = fit.centre[..., np.newaxis] * spokes
    middle = np.tile([*outline.centre, 0.0], (2, 1))
    effects = order.effect(middle, np.eye(3)[:2])
    weights -= np.tensordot(effects, order.jac_motion, 1)
    seen = norm(np.array([order.bent(middle[:1], axis[np.newaxis]) for axis in np.eye(3)[:2]]))
    return order.forms(
        "length",
        weights,
        curvature=2.0 * (fit.bend + float(seen) * (1.0 + fit.moved)),
        factor=2.0,
        plus=order.plus(norm(effects.T), 2.0),
        reach=fit.reach,
    )


def radial_forms(outline: Round, fit: Circled, count: int) -> Floats:
    """(n, `count`, 3) of each radius of a circle, whose points come first of `count`."""
    spokes = _spokes(outline, count)
    shift = np.tensordot(fit.centre, spokes, 1)
    return np.asarray(spokes - np.tensordot(outline.spokes, shift, 1))


def _spokes(outline: Round, count: int) -> Floats:
    """(n, `count`, 3) of what each point is off along its spoke."""
    points = len(outline.spokes)
    forms = np.zeros((points, count, 3))
    forms[np.arange(points), np.arange(points), :2] = outline.spokes
    return forms


def opposite_shares(name: str, outline: Round) -> tuple[Indices, Floats]:
    """Of each point with an opposite: itself and the two about that, (p, 3), and shares (p,).

    Raises `FeatureError` where no point has one.
    """
    angles = np.arctan2(outline.spokes[:, 1], outline.spokes[:, 0]) % (2.0 * np.pi)
    order = np.argsort(angles, kind="stable")
    ring = np.append(angles[order], angles[order[0]] + 2.0 * np.pi)
    gaps = np.diff(ring)
    wanted = (angles + np.pi) % (2.0 * np.pi)
    wanted = np.where(wanted < ring[0], wanted + 2.0 * np.pi, wanted)
    before = np.clip(np.searchsorted(ring, wanted, side="right") - 1, 0, len(gaps) - 1)
    share = (wanted - ring[before]) / np.where(gaps[before] > 0.0, gaps[before], 1.0)
    # A point that is opposite to within rounding is the opposite one.
    whole = np.rint(share)
    share = np.where(np.abs(share - whole) * gaps[before] < _SAME_ANGLE, whole, share)
    path = gaps[before] <= _LARGEST_GAP * np.median(gaps[gaps > _SAME_ANGLE])
    path |= share == whole
    if not path.any():
        raise FeatureError(
            "feature-short-arc",
            f"{name}: no two points of the arc are opposite, and it has no two-point diameter",
            found=f"an arc of {np.degrees(outline.arc):.4g} degrees",
            expected="a circle, or more than half of one",
            hint='evaluate = "least-squares" gives the diameter of the least-squares circle',
        )
    after = (before + 1) % len(order)
    places = np.column_stack([np.arange(len(angles)), order[before], order[after]])
    return places[path], np.clip(share[path], 0.0, 1.0)
