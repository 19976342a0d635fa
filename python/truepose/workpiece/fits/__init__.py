"""Shapes through points: the minimum zone, and least squares, of many sampled parts at once."""

from truepose.workpiece.fits.associate import associate
from truepose.workpiece.fits.shapes import (
    AnyPlane,
    CircleInPlane,
    Contour,
    FittedShape,
    TurnedPlane,
)

__all__ = ["AnyPlane", "CircleInPlane", "Contour", "FittedShape", "TurnedPlane", "associate"]
