"""Cross-sections of beams, from textbooks: areas, moments, torsion and shear coefficients.

For tests only: the second road to what the package says of a section. Everywhere x is along the
beam, y and z across it along the principal axes of the section; `width` is along y, `height` along
z, both over all. SI. Areas and second moments are those of the section as drawn, with thick walls;
torsion and shear of box and H are those of thin walls, taken at their middle lines.

Shear coefficients are Cowper's: G. R. Cowper (1966), "The shear coefficient in Timoshenko's beam
theory", Journal of Applied Mechanics 33, 335-340. Torsion: S. P. Timoshenko and J. N. Goodier,
"Theory of Elasticity", 3rd edition, 1970, chapter 10. Warping torsion (Vlasov) is left out.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

ZETA_5 = 1.0369277551433699  # Riemann's zeta of 5: the sum of 1 / n^5


@dataclass(frozen=True)
class Section:
    """What a beam knows of its cross-section.

    Attributes:
        area: m^2.
        second_moment_y: m^4, integral of z^2: bending about y, which moves along z.
        second_moment_z: m^4, integral of y^2: bending about z, which moves along y.
        torsion_constant: m^4, J of M = G J times the twist per length.
        shear_coefficient_y: of shear along y; `math.inf` for no shear deformation.
        shear_coefficient_z: of shear along z.
    """

    area: float
    second_moment_y: float
    second_moment_z: float
    torsion_constant: float
    shear_coefficient_y: float = math.inf
    shear_coefficient_z: float = math.inf


def bar(diameter: float, poisson: float) -> Section:
    """A solid circle. J is the polar moment; Cowper: 6(1+nu)/(7+6nu)."""
    radius = diameter / 2
    second = math.pi * radius**4 / 4
    shear = 6 * (1 + poisson) / (7 + 6 * poisson)
    return Section(math.pi * radius**2, second, second, 2 * second, shear, shear)


def tube(outer_diameter: float, wall: float, poisson: float) -> Section:
    """A hollow circle of any wall. J is the polar moment; Cowper's formula of m = inner / outer."""
    outer = outer_diameter / 2
    inner = outer - wall
    if not 0 < wall < outer:
        raise ValueError("a tube's wall is thinner than its outer radius")
    second = math.pi * (outer**4 - inner**4) / 4
    square = (inner / outer) ** 2
    shear = (6 * (1 + poisson) * (1 + square) ** 2) / (
        (7 + 6 * poisson) * (1 + square) ** 2 + (20 + 12 * poisson) * square
    )
    area = math.pi * (outer**2 - inner**2)
    return Section(area, second, second, 2 * second, shear, shear)


def rectangle(width: float, height: float, poisson: float) -> Section:
    """A solid rectangle. Cowper: 10(1+nu)/(12+11nu), whichever side is the longer.

    Torsion by Saint-Venant's series (Timoshenko and Goodier, section 109), long side a, short b:
    J = a b^3/3 (1 - 192/pi^5 b/a sum over odd n of tanh(n pi a / 2b) / n^5). What tanh lacks of 1
    is summed, the rest is known: sum over odd n of 1 / n^5 = 31/32 zeta(5).
    """
    long, short = max(width, height), min(width, height)
    decay = math.exp(-math.pi * long / short)
    # From n = 13 on a term is below 1e-20.
    lacking = sum(2 * decay**n / (1 + decay**n) / n**5 for n in range(1, 13, 2))
    series = 31 / 32 * ZETA_5 - lacking
    torsion = long * short**3 / 3 * (1 - 192 / math.pi**5 * short / long * series)
    shear = 10 * (1 + poisson) / (12 + 11 * poisson)
    return Section(
        width * height, width * height**3 / 12, height * width**3 / 12, torsion, shear, shear
    )


def box(width: float, height: float, wall: float, poisson: float) -> Section:
    """A rectangular hollow section, sharp corners, one wall all round.

    Torsion by Bredt's second formula, J = 4 A_m^2 / (closed integral of ds / t), with A_m the area
    within the middle line and both of the middle line (Timoshenko and Goodier, section 116);
    what the wall's own thickness adds is left out.
    """
    clear_width, clear_height = width - 2 * wall, height - 2 * wall
    if not (wall > 0 and clear_width > 0 and clear_height > 0):
        raise ValueError("a box has walls, and is hollow between them")
    middle_width, middle_height = width - wall, height - wall
    enclosed = middle_width * middle_height
    return Section(
        area=width * height - clear_width * clear_height,
        second_moment_y=(width * height**3 - clear_width * clear_height**3) / 12,
        second_moment_z=(height * width**3 - clear_height * clear_width**3) / 12,
        torsion_constant=4 * enclosed**2 / (2 * (middle_width + middle_height) / wall),
        shear_coefficient_y=shear_coefficient_of_box(middle_height, middle_width, poisson),
        shear_coefficient_z=shear_coefficient_of_box(middle_width, middle_height, poisson),
    )


def h_section(width: float, height: float, web: float, flange: float, poisson: float) -> Section:
    """Two flanges along y, `width` by `flange`, and a web along z, `web` thick, between them.

    Torsion as of narrow strips, J = (2 b t_f^3 + h t_w^3) / 3 with h between the flanges' middle
    lines (Timoshenko and Goodier, section 108). Cowper gives the coefficient of shear along the
    web; along the flanges it follows from his definition in the same way
    (`shear_coefficient_of_flanges`).
    """
    clear = height - 2 * flange
    if not (flange > 0 and clear > 0 and 0 < web < width):
        raise ValueError("an H has two flanges and a web between them, narrower than they are")
    middle = height - flange
    return Section(
        area=2 * width * flange + clear * web,
        second_moment_y=(width * height**3 - (width - web) * clear**3) / 12,
        second_moment_z=(2 * flange * width**3 + clear * web**3) / 12,
        torsion_constant=(2 * width * flange**3 + middle * web**3) / 3,
        shear_coefficient_y=shear_coefficient_of_flanges(width, middle, flange, web, poisson),
        shear_coefficient_z=shear_coefficient_of_web(width, middle, flange, web, poisson),
    )


def shear_coefficient_of_box(across: float, along: float, poisson: float) -> float:
    """Cowper's thin-walled box of one wall; middle lines `along` the shear and `across` it."""
    ratio = across / along  # his n, and with one wall also his m = b t_1 / (h t)
    m, square = ratio, ratio**2
    return (10 * (1 + poisson) * (1 + 3 * m) ** 2) / (
        (12 + 72 * m + 150 * m**2 + 90 * m**3)
        + poisson * (11 + 66 * m + 135 * m**2 + 90 * m**3)
        + 10 * square * ((3 + poisson) * m + 3 * m**2)
    )


def shear_coefficient_of_web(
    width: float, height: float, flange: float, web: float, poisson: float
) -> float:
    """Cowper's thin-walled I, shear along the web; `height` between middle lines of flanges."""
    m = 2 * width * flange / (height * web)
    square = (width / height) ** 2
    return (10 * (1 + poisson) * (1 + 3 * m) ** 2) / (
        (12 + 72 * m + 150 * m**2 + 90 * m**3)
        + poisson * (11 + 66 * m + 135 * m**2 + 90 * m**3)
        + 30 * square * (m + m**2)
        + 5 * poisson * square * (8 * m + 9 * m**2)
    )


def shear_coefficient_of_flanges(
    width: float, height: float, flange: float, web: float, poisson: float
) -> float:
    """A thin-walled I sheared along its flanges; `height` between their middle lines.

    Not in Cowper's table; his definition, his equations for thin walls. The web bears no shear and
    moves with the mean: with r = web area / flanges' area and n = (height / width)^2,
    1/K = 6/5 (1+r) + nu/(1+nu) (3r/20 - 1/10 - n r/2); without a web it is the rectangle's.
    """
    r = height * web / (2 * width * flange)
    n = (height / width) ** 2
    lateral = poisson / (1 + poisson)
    return 1 / (6 / 5 * (1 + r) + lateral * (3 * r / 20 - 1 / 10 - n * r / 2))
