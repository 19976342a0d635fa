"""The quantities of a circular test, ISO 230-4:2005, from polar data in both directions.

    G_ccw, G_cw  circular deviation: width of the narrowest ring (minimum zone) that holds a path
    G_b          bi-directional circular deviation: of the narrowest ring that holds both paths
    F_max, F_min radial deviation of a path from the nominal circle, about the centre of the least-
                 squares circle of both paths, outwards positive
    D            mean bi-directional radial deviation: radius of the least-squares circle of both
                 paths, less the nominal radius
    H            circular hysteresis (of ISO 230-4:1996, no longer in the edition of 2005): largest
                 distance of the two paths from each other at one angle, along the radius, about the
                 centre of the least-squares circle of both

What of a set-up would be in F, that the instrument does not stand in the middle, is taken out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from truepose.arrays import Floats
from truepose.machine_tests.circle import Fitted, least_squares, ring_widths

STANDARD = "ISO 230-4:2005; H of ISO 230-4:1996"

DIRECTIONS = ("counter-clockwise", "clockwise")

QUANTITIES = {
    "G_b": "bi-directional circular deviation G(b)",
    "G_ccw": "circular deviation G, counter-clockwise",
    "G_cw": "circular deviation G, clockwise",
    "H": "circular hysteresis H",
    "D": "mean bi-directional radial deviation D",
    "F_max_ccw": "radial deviation F, highest, counter-clockwise",
    "F_min_ccw": "radial deviation F, lowest, counter-clockwise",
    "F_max_cw": "radial deviation F, highest, clockwise",
    "F_min_cw": "radial deviation F, lowest, clockwise",
}
"""Quantity -> what it is."""


@dataclass(frozen=True, eq=False)
class Evaluated:
    """Quantities (s, q), m, of s tests; `deviations` (s, 2, n): F at every angle, m."""

    values: Floats
    deviations: Floats
    circle: Fitted


def evaluated(angles: Floats, radii: Floats, nominal: float) -> Evaluated:
    """Of `radii` (s, 2, n), counter-clockwise and clockwise, at `angles` (n,); `nominal` radius.

    All in m and rad.
    """
    sets, _, n = radii.shape
    both = radii.reshape(sets, 2 * n)
    circle = least_squares(np.tile(angles, 2), both)
    deviations = (circle.deviations + (circle.radius - nominal)[:, np.newaxis]).reshape(sets, 2, n)
    values = {
        "G_b": ring_widths(np.tile(angles, 2), both),
        "G_ccw": ring_widths(angles, radii[:, 0]),
        "G_cw": ring_widths(angles, radii[:, 1]),
        "H": np.abs(deviations[:, 0] - deviations[:, 1]).max(axis=1),
        "D": circle.radius - nominal,
        "F_max_ccw": deviations[:, 0].max(axis=1),
        "F_min_ccw": deviations[:, 0].min(axis=1),
        "F_max_cw": deviations[:, 1].max(axis=1),
        "F_min_cw": deviations[:, 1].min(axis=1),
    }
    return Evaluated(np.stack([values[name] for name in QUANTITIES], axis=1), deviations, circle)
