"""Orientation to a datum (ISO 1101): zones between two parallel planes at the drawing's angle.

The zone is as wide as the points need at the exact angle to the datum, wherever it lies. Walls are
looked at in the working plane. A zone that the datums leave free to turn about one axis, such as
that of a wall across a face, is turned so that it is narrowest, or with "least-squares" as the
points lie. `DatumFrame` says how datums are associated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import ClassVar

import numpy as np

from truepose.arrays import Floats
from truepose.spatial import cross, norm, rotate_about
from truepose.workpiece.element import FeatureError
from truepose.workpiece.features._base import Forms, Quantity
from truepose.workpiece.features._evaluated import EvaluatedFeature
from truepose.workpiece.features.straightness import residual_forms
from truepose.workpiece.first_order import FirstOrder, Straightened
from truepose.workpiece.fits import TurnedPlane, associate
from truepose.workpiece.outlines import OFF, Straight, plane, straight

_W = np.array([0.0, 0.0, 1.0])


class OrientationFeature(EvaluatedFeature):
    """A wall or face at an `angle` to a datum, of which a kind says what."""

    needs_datums: ClassVar[bool] = True
    angle: float
    """Between the two, rad, 0 to pi/2, or more: lines and planes have no sense."""

    def orient(self, angle: float) -> None:
        """Set the elements at that angle to their datum. Raises `FeatureError`."""
        self.angle = angle
        name = self.elements[0].name
        self.outline = straight(name, self.programmed[0])
        assert self.frame is not None
        datum = self.frame.datums[0]
        if not isinstance(datum, Straight):
            raise FeatureError(
                "feature-datums",
                f"{self.name}: the datum of a direction is a wall or a face",
                found=f"{self.frame.names[0]}, a circle",
                expected="a wall or a face as the first datum",
            )
        self._aim(datum)
        self.free_axis = self._free_axis(datum)
        if self.outline.kind == "face" or self.free_axis is not None:
            plane(name, self.programmed[0])
        deviation = (self.programmed[0] - self.programmed[0].mean(axis=0)) @ self.normal
        self._ideal = self.programmed[0] - np.outer(deviation, self.normal)

    def orientation(self, width: float) -> Quantity:
        """The zone, m."""
        how = "least squares" if self.least_squares else "minimum zone"
        return self.zone(self.kind, width, f"zone at the exact angle (ISO 1101), datum by {how}")

    def evaluate(self, own: Sequence[Floats], seen: Sequence[Floats]) -> list[Floats]:
        """The width of the zone."""
        if self.free_axis is None:
            return [np.ptp(seen[0] @ self.normal, axis=1)]
        return [np.ptp(self._turned(seen[0], self.free_axis)[1], axis=1)]

    def ideal(self) -> list[Floats]:
        """The wall or face at the exact angle."""
        return [self._ideal]

    def linear(self, order: FirstOrder) -> list[Forms]:
        """What the points are off along the zone's normal, as the frame sees them.

        Where the zone may turn by an angle a about an axis, its normal bends besides by a^2 / 2.
        """
        normals = np.tile(self.normal, (order.count, 1))
        effects = order.effect(self._ideal, normals)
        if self.free_axis is None:
            across = order.seen(0, normals)
            return [
                order.forms(
                    "spread",
                    across - across.mean(axis=0),
                    curvature=2.0 * order.bent(self._ideal, normals, ranged=True),
                    plus=order.plus(np.ptp(effects, axis=0)),
                )
            ]
        along = cross(self.free_axis, self.normal)[np.newaxis]
        forms = residual_forms(order, self._ideal, self.normal, along, self.least_squares)
        fit = Straightened.of(self._ideal @ along.T)
        slopes = np.tensordot(fit.slopes, order.seen(0, normals), 1)
        extent = float(norm(np.ptp(self._ideal, axis=0)))
        bend = 1.3 * float(norm(slopes).sum()) ** 2 * extent
        if self.least_squares:
            bend *= 1.0 + fit.steep * extent
        turned = np.concatenate([self.free_axis, np.zeros(3)])
        effect = np.ptp(effects - (effects @ turned)[:, np.newaxis] * turned, axis=0)
        return [
            replace(
                forms,
                curvature=forms.curvature + bend,
                plus=(*forms.plus, *order.plus(effect)),
            )
        ]

    def _turned(self, points: Floats, axis: Floats) -> tuple[TurnedPlane, Floats]:
        normal = np.tile(self.normal, (len(points), 1))
        shape = TurnedPlane(normal, np.broadcast_to(axis, normal.shape), self.outline.length)
        return associate(shape, points, least_squares=self.least_squares)

    def _aim(self, datum: Straight) -> None:
        """Set the zone's normal, at the exact angle. Raises `FeatureError` where it is another."""
        reference, normal = datum.normal, self.outline.normal
        axis = cross(reference, normal)
        sine = float(norm(axis))
        between = float(np.arctan2(sine, reference @ normal))
        wanted = min((self.angle, np.pi - self.angle), key=lambda angle: abs(angle - between))
        wanted = min((wanted, -wanted), key=lambda angle: abs(angle - between))
        if abs(np.sin(between - wanted)) > OFF:
            raise FeatureError(
                "feature-direction",
                f"{self.name}: not programmed at the angle to its datum that its kind is about",
                found=f"{np.degrees(min(between, np.pi - between)):.4g} degrees",
                expected=f"{np.degrees(self.angle):.4g} degrees, to {OFF:g}",
            )
        if sine <= OFF:  # parallel, either way round
            self.normal = reference * np.copysign(1.0, float(reference @ normal))
            self._opens = 0.0
            return
        axis = axis / sine
        self.normal = rotate_about(normal, axis, np.array([wanted - between]))
        self._opens = float(np.sign(axis @ _W))
        if abs(wanted - self.angle) > abs(np.pi - wanted - self.angle):
            self._opens = -self._opens

    def _free_axis(self, datum: Straight) -> Floats | None:
        """About which the zone may turn, where the datums leave it free to."""
        assert self.frame is not None
        parallel = float(norm(cross(datum.normal, self.normal))) <= OFF
        if parallel or (datum.kind == "wall" and self.outline.kind == "wall"):
            return None
        if datum.kind == "face":
            return None if self.frame.turns else _W
        return None if self.frame.tilts else datum.normal
