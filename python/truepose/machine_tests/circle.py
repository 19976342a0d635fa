"""Circles fitted to polar data: least squares, and the narrowest ring (minimum zone).

Data are radii at angles, as an instrument in the middle reads them; the circle's centre is beside
that of the instrument. Many sets of data at the same angles are fitted at once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from truepose.arrays import Floats
from truepose.workpiece.fits.associate import associate
from truepose.workpiece.fits.shapes import CircleInPlane


@dataclass(frozen=True, eq=False)
class Fitted:
    """Circles of s sets: `centre` (s, 2) from the instrument's, `radius` (s,); m.

    `deviations` (s, n) of the points from the circle, outwards.
    """

    centre: Floats
    radius: Floats
    deviations: Floats


def least_squares(angles: Floats, radii: Floats) -> Fitted:
    """The circle with the least sum of squares of the radial deviations of `radii` (s, n), m."""
    circle, distances = associate(_about(radii), _points(angles, radii), least_squares=True)
    radius = distances.mean(axis=1)
    return Fitted(circle.centre, radius, distances - radius[:, np.newaxis])


def ring_widths(angles: Floats, radii: Floats) -> Floats:
    """(s,) width of the narrowest ring, of two circles about one centre, that holds all points, m.

    `angles` (n,), rad; `radii` (s, n), m.
    """
    _, distances = associate(_about(radii), _points(angles, radii))
    return np.asarray(np.ptp(distances, axis=1))


def _about(radii: Floats) -> CircleInPlane:
    return CircleInPlane(np.zeros((len(radii), 2)))


def _points(angles: Floats, radii: Floats) -> Floats:
    """(s, n, 3) in the plane."""
    return np.stack([radii * np.cos(angles), radii * np.sin(angles), np.zeros_like(radii)], axis=2)
