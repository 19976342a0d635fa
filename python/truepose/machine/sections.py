"""Cross sections of beams: area, second moments, torsion constant and shear coefficients.

A section has its axes: x along the beam, y and z across it. Torsion constants after Saint-Venant
(Timoshenko & Goodier, Theory of Elasticity, 3rd ed., 1970, chapter 10), of closed thin walls after
Bredt. Shear coefficients after G. R. Cowper, The Shear Coefficient in Timoshenko's Beam Theory,
Journal of Applied Mechanics 33 (1966) 335-340, which follow from Poisson's ratio.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

TERMS = 400
"""Of the series of a rectangle's torsion: the next one is below 1e-14 of the whole."""


@dataclass(frozen=True)
class Section:
    """Of a beam along x: `area` m^2, second moments `about_y`, `about_z` m^4, `torsion` m^4.

    `shear_y`, `shear_z`: the shear coefficients of forces along y and z, by which the area counts.
    """

    area: float
    about_y: float
    about_z: float
    torsion: float
    shear_y: float
    shear_z: float


def bar(diameter: float, poisson: float) -> Section:
    """A round bar, m."""
    area = math.pi * diameter**2 / 4.0
    moment = math.pi * diameter**4 / 64.0
    shear = 6.0 * (1.0 + poisson) / (7.0 + 6.0 * poisson)
    return Section(area, moment, moment, 2.0 * moment, shear, shear)


def tube(outside: float, wall: float, poisson: float) -> Section:
    """A round tube of an outside diameter and a wall, m."""
    inside = outside - 2.0 * wall
    area = math.pi * (outside**2 - inside**2) / 4.0
    moment = math.pi * (outside**4 - inside**4) / 64.0
    square = (inside / outside) ** 2
    sum2 = (1.0 + square) ** 2
    shear = (
        6.0
        * (1.0 + poisson)
        * sum2
        / ((7.0 + 6.0 * poisson) * sum2 + (20.0 + 12.0 * poisson) * square)
    )
    return Section(area, moment, moment, 2.0 * moment, shear, shear)


def rectangle(height: float, width: float, poisson: float) -> Section:
    """A solid rectangle, `height` along y and `width` along z, m."""
    long, short = max(height, width), min(height, width)
    odd = range(1, 2 * TERMS, 2)
    series = sum(math.tanh(n * math.pi * long / (2.0 * short)) / n**5 for n in odd)
    torsion = long * short**3 * (1.0 / 3.0 - 64.0 * short / (math.pi**5 * long) * series)
    shear = 10.0 * (1.0 + poisson) / (12.0 + 11.0 * poisson)
    return Section(
        height * width,
        height * width**3 / 12.0,
        width * height**3 / 12.0,
        torsion,
        shear,
        shear,
    )


def box(height: float, width: float, wall: float, poisson: float) -> Section:
    """A box of one wall, `height` along y and `width` along z, outside, m."""
    inner_height, inner_width = height - 2.0 * wall, width - 2.0 * wall
    middle_height, middle_width = height - wall, width - wall
    enclosed = middle_height * middle_width
    return Section(
        height * width - inner_height * inner_width,
        (height * width**3 - inner_height * inner_width**3) / 12.0,
        (width * height**3 - inner_width * inner_height**3) / 12.0,
        2.0 * enclosed**2 * wall / (middle_height + middle_width),
        _thin_box(middle_height, middle_width, poisson),
        _thin_box(middle_width, middle_height, poisson),
    )


def _thin_box(web: float, flange: float, poisson: float) -> float:
    """Cowper's coefficient of a thin-walled box of one wall, for a force along its webs."""
    m = n = flange / web
    of_flanges = 10.0 * n**2 * ((3.0 + poisson) * m + 3.0 * m**2)
    return _of_thin_walls(m, of_flanges, poisson)


def _of_thin_walls(m: float, of_flanges: float, poisson: float) -> float:
    """What Cowper's coefficients of thin walls have in common: `m` flange over web area."""
    below = 12.0 + 72.0 * m + 150.0 * m**2 + 90.0 * m**3
    below += poisson * (11.0 + 66.0 * m + 135.0 * m**2 + 90.0 * m**3)
    return 10.0 * (1.0 + poisson) * (1.0 + 3.0 * m) ** 2 / (below + of_flanges)


def h_beam(height: float, width: float, web: float, flange: float, poisson: float) -> Section:
    """An H or I: webs `height` along y outside, two flanges `width` along z, m.

    Torsion is that of an open section whose ends are free to warp: the sum of the walls' thirds.
    """
    between = height - 2.0 * flange
    area = 2.0 * width * flange + between * web
    middle = height - flange
    m, n = 2.0 * width * flange / (middle * web), width / middle
    of_flanges = 30.0 * n**2 * (m + m**2) + 5.0 * poisson * n**2 * (8.0 * m + 9.0 * m**2)
    return Section(
        area,
        (2.0 * flange * width**3 + between * web**3) / 12.0,
        (width * height**3 - (width - web) * between**3) / 12.0,
        (2.0 * width * flange**3 + middle * web**3) / 3.0,
        _of_thin_walls(m, of_flanges, poisson),
        _along_flanges(1.0 / m, (middle / width) ** 2, poisson),
    )


def _along_flanges(web: float, square: float, poisson: float) -> float:
    """Of an H, for a force along its flanges: `web` over flange area, height over width squared.

    By Cowper's definition, which has no formula for it: the web bears no shear and moves with the
    mean, 1/k = 6/5 (1 + r) + nu / (1 + nu) (3 r / 20 - 1 / 10 - n r / 2).
    """
    lateral = poisson / (1.0 + poisson)
    return 1.0 / (1.2 * (1.0 + web) + lateral * (0.15 * web - 0.1 - 0.5 * square * web))


__all__ = ["Section", "bar", "box", "h_beam", "rectangle", "tube"]
