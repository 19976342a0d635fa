"""Cross-sections of the frame model: integrals over what is drawn, series, Cowper's definition."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from numpy.typing import NDArray

from frame_sections import (
    Section,
    bar,
    box,
    h_section,
    rectangle,
    shear_coefficient_of_box,
    shear_coefficient_of_flanges,
    shear_coefficient_of_web,
    tube,
)

Vector = NDArray[np.float64]
Path = list[tuple[float, float]]

POISSON = [0.0, 0.27, 0.33, 0.5]
NODES, WEIGHTS = np.polynomial.legendre.leggauss(12)


def integral(function: Callable[[Vector], Vector], low: float, high: float) -> float:
    """By Gauss and Legendre: exact for polynomials to the 23rd degree."""
    at = (low + high) / 2 + (high - low) / 2 * NODES
    return float((high - low) / 2 * (WEIGHTS * function(at)).sum())


# Areas and moments of what is drawn.


def over_polygon(corners: Path) -> Vector:
    """(3,) area and integrals of z^2 and y^2 within a closed polygon, by Green along its sides."""
    total = np.zeros(3)
    for start, end in pairwise([*corners, corners[0]]):
        y, z = (Polynomial([a, b - a]) for a, b in zip(start, end, strict=True))
        for number, inside in enumerate((y, y * z**2, y**3 / 3)):
            total[number] += inside.integ()(1.0) * (end[1] - start[1])
    return total


def corners_of(width: float, height: float) -> Path:
    y, z = width / 2, height / 2
    return [(-y, -z), (y, -z), (y, z), (-y, z)]


def over_ring(inner: float, outer: float) -> Vector:
    """(3,) as over_polygon, in polar coordinates."""
    around = np.linspace(0, 2 * math.pi, 16, endpoint=False)

    def shells(power: int) -> float:
        return integral(lambda r: r**power, inner, outer) * 2 * math.pi

    return np.array(
        [
            shells(1),
            shells(3) * (np.sin(around) ** 2).mean(),
            shells(3) * (np.cos(around) ** 2).mean(),
        ]
    )


def outline_of_h(width: float, height: float, web: float, flange: float) -> Path:
    """Twelve corners, the flanges along y."""
    b, h, w, inside = width / 2, height / 2, web / 2, height / 2 - flange
    right = [(b, -h), (b, -inside), (w, -inside), (w, inside), (b, inside), (b, h)]
    return right + [(-y, -z) for y, z in right]


DRAWN = {
    "bar": (bar(0.03, 0.3), over_ring(0, 0.015)),
    "tube": (tube(0.05, 0.006, 0.3), over_ring(0.019, 0.025)),
    "rectangle": (rectangle(0.03, 0.08, 0.3), over_polygon(corners_of(0.03, 0.08))),
    "box": (
        box(0.14, 0.09, 0.01, 0.3),
        over_polygon(corners_of(0.14, 0.09)) - over_polygon(corners_of(0.12, 0.07)),
    ),
    "h": (
        h_section(0.1, 0.16, 0.008, 0.012, 0.3),
        over_polygon(outline_of_h(0.1, 0.16, 0.008, 0.012)),
    ),
}


@pytest.mark.parametrize("name", DRAWN)
def test_areas_and_second_moments(name: str) -> None:
    section, integrated = DRAWN[name]
    found = [section.area, section.second_moment_y, section.second_moment_z]
    np.testing.assert_allclose(found, integrated, rtol=1e-13)


# Torsion.


@pytest.mark.parametrize("section", [bar(0.03, 0.3), tube(0.05, 0.006, 0.3)])
def test_torsion_of_circles_is_polar(section: Section) -> None:
    """A circle does not warp."""
    polar = section.second_moment_y + section.second_moment_z
    assert section.torsion_constant == pytest.approx(polar, rel=1e-14)


@pytest.mark.parametrize("sides", [(0.1, 0.1), (0.04, 0.1), (0.1, 0.03), (0.02, 0.2)])
def test_torsion_of_rectangles_by_the_double_series(sides: tuple[float, float]) -> None:
    """Prandtl's stress function as a double sine series; and the textbook's table."""
    a, b = sides
    odd = np.arange(1, 3001, 2, dtype=float)
    m, n = odd[:, None], odd[None, :]
    terms = 1 / (m**2 * n**2 * ((m / a) ** 2 + (n / b) ** 2))
    expected = 256 * a * b / math.pi**6 * terms.sum()
    assert rectangle(a, b, 0.3).torsion_constant == pytest.approx(expected, rel=1e-8)


@pytest.mark.parametrize(
    ("ratio", "factor"), [(1, 0.1406), (1.5, 0.196), (2, 0.229), (3, 0.263), (10, 0.312)]
)
def test_torsion_of_rectangles_by_the_table(ratio: float, factor: float) -> None:
    """Timoshenko and Goodier, section 109, table of k_1 with J = k_1 (2a)^3 (2b)."""
    found = rectangle(1.0, ratio, 0.3).torsion_constant / ratio
    assert found == pytest.approx(factor, abs=6e-4)


def test_torsion_of_thin_walls() -> None:
    """A closed wall by Bredt; a square box is b^3 t of its middle line; an H strip by strip."""
    assert box(0.11, 0.11, 0.01, 0.3).torsion_constant == pytest.approx(0.1**3 * 0.01, rel=1e-13)
    # By shear flow: unit twist, q = 2 A_m G / (integral of ds / t), torque 2 A_m q.
    width, height, wall = 0.14, 0.09, 0.01
    lengths = [width - wall, height - wall] * 2
    flow = 2 * lengths[0] * lengths[1] / sum(length / wall for length in lengths)
    torque = 2 * lengths[0] * lengths[1] * flow
    assert box(width, height, wall, 0.3).torsion_constant == pytest.approx(torque, rel=1e-13)
    # Strips of full length each twist stiffer than a rectangle's series, which knows their ends.
    thin = h_section(0.1, 0.16, 0.002, 0.003, 0.3)
    strips = 2 * rectangle(0.1, 0.003, 0.3).torsion_constant
    strips += rectangle(0.157, 0.002, 0.3).torsion_constant
    assert strips < thin.torsion_constant < 1.02 * strips


# Shear coefficients.


def flexure_of_ring(inner: float, outer: float, poisson: float) -> float:
    """Cowper's coefficient of a ring from Saint-Venant's flexure function chi.

    His definition is
    K = 2 (1 + nu) I / (nu/2 (I_x - I_y) - A/I integral of x (chi + x y^2)), with chi harmonic and
    dchi/dn = -n_x (nu x^2/2 + (1 - nu/2) y^2) - n_y (2 + nu) x y on both circles. There that is
    -r^2 ((3/4 + nu/2) cos t - 3/4 cos 3t), so chi = (A r + B/r) cos t + r^3/4 cos 3t.
    """
    slope = 3 / 4 + poisson / 2
    rising, falling = -slope * (inner**2 + outer**2), -slope * inner**2 * outer**2
    around = np.linspace(0, 2 * math.pi, 64, endpoint=False)
    cos, sin, third = np.cos(around), np.sin(around), np.cos(3 * around)

    def ring(radii: Vector) -> Vector:
        r = radii[:, None]
        chi = (rising * r + falling / r) * cos + r**3 / 4 * third
        return ((r * cos) * (chi + r**3 * cos * sin**2)).mean(axis=1) * 2 * math.pi * radii

    area, second, _ = over_ring(inner, outer)
    return float(2 * (1 + poisson) * second / (-area / second * integral(ring, inner, outer)))


@pytest.mark.parametrize("poisson", POISSON)
@pytest.mark.parametrize("wall", [0.0005, 0.006, 0.02])
def test_shear_of_tubes_by_the_flexure_function(wall: float, poisson: float) -> None:
    expected = flexure_of_ring(0.025 - wall, 0.025, poisson)
    found = tube(0.05, wall, poisson)
    assert found.shear_coefficient_y == pytest.approx(expected, rel=1e-9)
    assert found.shear_coefficient_z == found.shear_coefficient_y


@pytest.mark.parametrize("poisson", POISSON)
def test_shear_of_bars_is_that_of_tubes_without_a_bore(poisson: float) -> None:
    expected = flexure_of_ring(1e-9, 0.025, poisson)
    assert bar(0.05, poisson).shear_coefficient_y == pytest.approx(expected, rel=1e-9)


def flexure_of_walls(
    path: Path,
    thickness: list[float],
    poisson: float,
    idle: tuple[float, float] = (0.0, 0.0),
) -> float:
    """Cowper's coefficient of thin walls, symmetric both ways, sheared along x; from equilibrium.

    `path` is a quarter of the middle line, from where no shear flows to where x = 0; `thickness`
    of its stretches. `idle`: area and second moment of walls on x = 0, which bear no shear. Under
    unit shear the flow falls by t x / I along the path; the wall slides by its shear strain and by
    what the section's lateral strain grows along the beam, u = -nu x_bend (x^2 - y^2, 2 x y) / 2;
    what is left is the warping psi, whose mean turn with the mean displacement is 1 / (K G A).
    """
    points = [np.array(point) for point in path]

    def stretches() -> list[tuple[Vector, Vector, float]]:
        return [(a, b - a, t) for (a, b), t in zip(pairwise(points), thickness, strict=True)]

    area, along, across = idle[0], 0.0, idle[1]
    for start, step, t in stretches():
        length = float(np.hypot(*step))
        area += 4 * t * length
        along += 4 * t * length * integral(lambda s, a=start[0], d=step[0]: (a + s * d) ** 2, 0, 1)
        across += 4 * t * length * integral(lambda s, a=start[1], d=step[1]: (a + s * d) ** 2, 0, 1)
    lateral = poisson / (2 * (1 + poisson) * along)
    flow, warping, moment, arm = Polynomial([0.0]), Polynomial([0.0]), 0.0, 0.0
    for start, step, t in stretches():
        length = float(np.hypot(*step))
        x, y = (Polynomial([a, d]) for a, d in zip(start, step, strict=True))
        flow = flow(1.0) - (t * length / along * x).integ()
        sliding = length / t * flow
        sliding += lateral * ((x**2 - y**2) * step[0] / 2 + x * y * step[1])
        warping = warping(1.0) + sliding.integ()
        moment += 4 * t * length * (x * warping).integ()(1.0)
        arm += 4 * t * length * x.integ()(1.0)
    moment -= warping(1.0) * arm  # nothing warps at x = 0
    return float(1 / (area / along * moment - lateral / 2 * (along - across)))


@pytest.mark.parametrize("poisson", POISSON)
def test_shear_of_rectangles_from_equilibrium(poisson: float) -> None:
    """A wall on its own, sheared along itself; Cowper's is the same for all rectangles."""
    expected = flexure_of_walls([(0.5, 0.0), (0.0, 0.0)], [0.005], poisson)
    found = rectangle(0.08, 0.03, poisson)
    assert found.shear_coefficient_y == pytest.approx(expected, rel=1e-13)
    assert found.shear_coefficient_z == pytest.approx(expected, rel=1e-13)


@pytest.mark.parametrize("poisson", POISSON)
@pytest.mark.parametrize(("across", "along"), [(0.1, 0.1), (0.04, 0.13), (0.2, 0.05)])
def test_shear_of_boxes_from_equilibrium(across: float, along: float, poisson: float) -> None:
    quarter = [(along / 2, 0.0), (along / 2, across / 2), (0.0, across / 2)]
    expected = flexure_of_walls(quarter, [0.003, 0.003], poisson)
    assert shear_coefficient_of_box(across, along, poisson) == pytest.approx(expected, rel=1e-13)


@pytest.mark.parametrize("poisson", POISSON)
@pytest.mark.parametrize("sizes", [(0.1, 0.15, 0.003, 0.002), (0.2, 0.08, 0.002, 0.004)])
def test_shear_of_h_from_equilibrium(
    sizes: tuple[float, float, float, float], poisson: float
) -> None:
    width, height, flange, web = sizes
    quarter = [(height / 2, width / 2), (height / 2, 0.0), (0.0, 0.0)]
    expected = flexure_of_walls(quarter, [flange, web / 2], poisson)
    assert shear_coefficient_of_web(*sizes, poisson) == pytest.approx(expected, rel=1e-13)

    quarter = [(width / 2, height / 2), (0.0, height / 2)]
    expected = flexure_of_walls(quarter, [flange], poisson, (web * height, web * height**3 / 12))
    assert shear_coefficient_of_flanges(*sizes, poisson) == pytest.approx(expected, rel=1e-13)


def test_which_way_is_which() -> None:
    """Walls along the shear bear it: of a flat box and of an H the two ways differ, and so."""
    flat = box(0.14, 0.06, 0.004, 0.3)
    expected = (
        shear_coefficient_of_box(0.056, 0.136, 0.3),
        shear_coefficient_of_box(0.136, 0.056, 0.3),
    )
    found = flat.shear_coefficient_y, flat.shear_coefficient_z
    assert found == pytest.approx(expected, rel=1e-13)
    assert found[0] > found[1]
    beam = h_section(0.1, 0.16, 0.006, 0.012, 0.3)
    sizes = 0.1, 0.148, 0.012, 0.006
    expected = shear_coefficient_of_flanges(*sizes, 0.3), shear_coefficient_of_web(*sizes, 0.3)
    found = beam.shear_coefficient_y, beam.shear_coefficient_z
    assert found == pytest.approx(expected, rel=1e-13)
    # About the web's share of the area, about the flanges' times 5/6.
    assert beam.shear_coefficient_z == pytest.approx(0.148 * 0.006 / beam.area, rel=0.15)
    assert beam.shear_coefficient_y == pytest.approx(5 / 6 * 2 * 0.1 * 0.012 / beam.area, rel=0.15)


def test_walls_that_cannot_be() -> None:
    with pytest.raises(ValueError, match="thinner than its outer radius"):
        tube(0.05, 0.025, 0.3)
    with pytest.raises(ValueError, match="hollow between them"):
        box(0.1, 0.02, 0.01, 0.3)
    with pytest.raises(ValueError, match="web between them"):
        h_section(0.1, 0.02, 0.003, 0.01, 0.3)
