"""Members that bend, and the joints between them, in CalculiX: solids between rigid ends.

A member is a prism of C3D20R elements; each of its two end faces is a rigid body with a point on
the axis and a turn. A joint is linear equations between two such bodies: for each direction the
relative displacement or turn is free, zero, or that of a spring. Every structure is a chain: a body
is held by one joint, in whose equations its displacements are the dependent ones.

Beam elements are not used. In version 2.20, B32R of a pipe's section is up to 6 % off a
cantilever's deflection with eight elements, and its error changes with their number and with the
orientation in space; a force along a member moves the middle node of its end face alone.

G. Dhondt, CalculiX CrunchiX user's manual, version 2.20: C3D20R, *RIGID BODY, *EQUATION.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import inf
from types import MappingProxyType
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from calculix import EVERY_WAY, Body, Deck

Vector = NDArray[np.float64]

CORNERS = ((-1, -1), (1, -1), (1, 1), (-1, 1))
MIDDLES = ((0, -1), (1, 0), (0, 1), (-1, 0))


class Section(Protocol):
    """A member's cross-section in its own axes, the origin at its centroid."""

    def quads(self) -> Iterator[Vector]:
        """(8, 2) points of each quadrilateral, m: four corners, then the middles between them."""
        ...


@dataclass(frozen=True)
class Tube:
    """A round tube, m; `segments` elements round it, of quadratic arcs, one through the wall."""

    diameter: float
    wall: float
    segments: int = 12

    def quads(self) -> Iterator[Vector]:
        half = np.pi / self.segments
        for segment in range(self.segments):
            yield np.array(
                [
                    (self.diameter / 2 - self.wall * (1 - x) / 2)
                    * np.array([np.cos(angle), np.sin(angle)])
                    for x, y in CORNERS + MIDDLES
                    for angle in [half * (2 * segment + y)]
                ]
            )


@dataclass(frozen=True)
class Rectangle:
    """A full rectangle, m; `width` along the section's first axis."""

    width: float
    height: float
    divisions: int = 2

    def quads(self) -> Iterator[Vector]:
        xs = np.linspace(-self.width / 2, self.width / 2, self.divisions + 1)
        ys = np.linspace(-self.height / 2, self.height / 2, self.divisions + 1)
        for x, y in itertools.product(itertools.pairwise(xs), itertools.pairwise(ys)):
            yield _cell(x, y)


@dataclass(frozen=True)
class Box:
    """A rectangular tube with sharp corners, m; `width` along the section's first axis."""

    width: float
    height: float
    wall: float
    divisions: int = 2
    """Elements along each side, between the corners."""

    def quads(self) -> Iterator[Vector]:
        xs, ys = self._lines(self.width), self._lines(self.height)
        for x, y in itertools.product(itertools.pairwise(xs), itertools.pairwise(ys)):
            in_wall_x = x[0] == xs[0] or x[1] == xs[-1]
            in_wall_y = y[0] == ys[0] or y[1] == ys[-1]
            if in_wall_x or in_wall_y:
                yield _cell(x, y)

    def _lines(self, size: float) -> Vector:
        inside = size / 2 - self.wall
        return np.r_[-size / 2, np.linspace(-inside, inside, self.divisions + 1), size / 2]


def _cell(x: tuple[float, float], y: tuple[float, float]) -> Vector:
    """(8, 2) points of the rectangle between two lines each way."""
    centre = np.array([sum(x), sum(y)]) / 2
    return centre + np.array(CORNERS + MIDDLES) * [(x[1] - x[0]) / 2, (y[1] - y[0]) / 2]


@dataclass(frozen=True)
class Material:
    """Pa, kg/m^3 and 1/K."""

    modulus: float
    poisson: float
    density: float = 0.0
    expansion: float = 0.0


@dataclass(frozen=True)
class Member:
    """A prism in a deck: its two rigid ends, and its nodes with where they stand."""

    start: Body
    end: Body
    nodes: dict[int, Vector]
    """(3,) by number: along the axis from the start, then along the section's axes, m."""

    def warm(self, deck: Deck, temperature: float, gradient: Sequence[float] = (0.0, 0.0)) -> None:
        """`temperature` K on the axis; `gradient` K/m along the section's two axes."""
        for node, (_, x, y) in self.nodes.items():
            deck.heat(node, temperature + gradient[0] * x + gradient[1] * y)


def member(
    deck: Deck,
    start: ArrayLike,
    end: ArrayLike,
    section: Section,
    material: Material,
    *,
    across: ArrayLike,
    pieces: int = 10,
) -> Member:
    """A prism from `start` to `end` (3,), m, of `pieces` elements along it.

    `across` (3,): the section's first axis is its part across the member.
    """
    first, last = np.asarray(start, float), np.asarray(end, float)
    frame = axes_of(last - first, across)
    length = float(np.linalg.norm(last - first))
    numbers: dict[tuple[float, ...], int] = {}
    nodes: dict[int, Vector] = {}
    faces: tuple[list[int], list[int]] = ([], [])

    def node(layer: int, point: Vector) -> int:
        key = (float(layer), *np.round(point, 9) + 0.0)
        if key not in numbers:
            own = np.array([length * layer / (2 * pieces), *point])
            numbers[key] = deck.node(first + frame.T @ own)
            nodes[numbers[key]] = own
            if layer in (0, 2 * pieces):
                faces[layer > 0].append(numbers[key])
        return numbers[key]

    elements = []
    for piece in range(pieces):
        low, middle, high = 2 * piece, 2 * piece + 1, 2 * piece + 2
        for quad in section.quads():
            corners, middles = quad[:4], quad[4:]
            layers = ((low, corners), (high, corners), (low, middles), (high, middles))
            layers = (*layers, (middle, corners))
            elements.append([node(layer, point) for layer, points in layers for point in points])
    deck.solid(
        elements,
        material.modulus,
        material.poisson,
        density=material.density,
        expansion=material.expansion,
    )
    return Member(deck.body(faces[0], first), deck.body(faces[1], last), nodes)


def platform(deck: Deck, at: ArrayLike, points: Sequence[ArrayLike]) -> tuple[Body, list[Body]]:
    """A rigid body with its point of reference at `at`, m, and as seen at each of `points`, m."""
    nodes = [deck.node(point) for point in points]
    body = deck.body(nodes, at)
    return body, [Body(node, body.turn) for node in nodes]


Give = tuple[ArrayLike, float]
"""A direction (3,) and the stiffness along it or about it, N/m or N m/rad: `inf` does not give."""


def joint(
    deck: Deck, held: Body, by: Body | None, ways: Sequence[Give], turns: Sequence[Give]
) -> None:
    """What two bodies' points, at one place, and turns have in common; `by` None is the ground.

    Directions are of unit length and square to each other; what stands in no list is free. A body
    is `held` once.
    """
    pairs = ((held.point, by and by.point, ways), (held.turn, by and by.turn, turns))
    for node, other, gives in pairs:
        if not gives:
            continue
        rows = np.array([axis for axis, _ in gives], float)
        assert np.allclose(rows @ rows.T, np.eye(len(rows)), atol=1e-9), "directions askew"
        springs = [deck.spring(stiffness) if stiffness < inf else None for _, stiffness in gives]
        # Each equation has a displacement of the held body that stands in no other.
        columns = max(
            itertools.combinations(range(3), len(rows)),
            key=lambda columns: abs(float(np.linalg.det(rows[:, columns]))),
        )
        solved = np.linalg.inv(rows[:, columns])
        for own, column, row in zip(solved, columns, solved @ rows, strict=True):
            order = (column, *(each for each in range(3) if each not in columns))
            terms = [(node, way + 1, float(row[way])) for way in order]
            if other is not None:
                terms += [(other, way, -float(row[way - 1])) for way in EVERY_WAY]
            terms += [
                (spring, 1, -float(factor))
                for spring, factor in zip(springs, own, strict=True)
                if spring is not None
            ]
            if len(terms) == 1:
                deck.hold(node, (column + 1,))
            else:
                deck.equation(terms)


def fixed(deck: Deck, held: Body, by: Body | None) -> None:
    """All six in common."""
    every = [(axis, inf) for axis in np.eye(3)]
    joint(deck, held, by, every, every)


def spherical(deck: Deck, held: Body, by: Body | None, stiffness: float = inf) -> None:
    """Every turn free; `stiffness` N/m each way."""
    joint(deck, held, by, [(axis, stiffness) for axis in np.eye(3)], [])


def revolute(
    deck: Deck,
    held: Body,
    by: Body | None,
    axis: ArrayLike,
    *,
    axial: float = inf,
    radial: float = inf,
    tilt: float = inf,
) -> None:
    """Free to turn about `axis` (3,); N/m along and across it, N m/rad about what is across."""
    along, *across = axes_of(axis, _aside(axis))
    ways = [(along, axial), *((each, radial) for each in across)]
    joint(deck, held, by, ways, [(each, tilt) for each in across])


def universal(
    deck: Deck,
    held: Body,
    by: Body | None,
    own_axis: ArrayLike,
    other_axis: ArrayLike,
    *,
    slide: ArrayLike | None = None,
    radial: float = inf,
    tilt: float = inf,
) -> None:
    """Free to turn about the cross's two axes, one in each body; `radial` N/m, `tilt` N m/rad.

    `slide` (3,): a direction of the held body along which it slides through the joint.
    """
    square, *_ = axes_of(np.cross(own_axis, other_axis), own_axis)
    along, *across = axes_of(square if slide is None else slide, own_axis)
    ways = [(each, radial) for each in (across if slide is not None else [along, *across])]
    joint(deck, held, by, ways, [(square, tilt)])


def prismatic(
    deck: Deck,
    held: Body,
    by: Body | None,
    along: ArrayLike,
    *,
    drive: float = inf,
    across: float = inf,
    tilt: float = inf,
) -> None:
    """A guidance along (3,): N/m of the drive that holds it, and across; N m/rad in each tilt."""
    way, *others = axes_of(along, _aside(along))
    ways = [(way, drive), *((each, across) for each in others)]
    joint(deck, held, by, ways, [(each, tilt) for each in (way, *others)])


def swinging_limb(
    deck: Deck,
    start: ArrayLike,
    end: ArrayLike,
    axis: ArrayLike,
    section: Section,
    material: Material,
    *,
    by: Body | None,
    holds: Body,
    joint_stiffness: Mapping[str, float] = MappingProxyType({}),
    spherical_stiffness: float = inf,
) -> Member:
    """A member from a revolute joint at `start` (3,) about `axis` to a spherical one at `end`.

    The section's first axis is across the revolute's. `by`: the carriage, at `start`, None on the
    ground; `holds`: the platform as seen at `end`. `joint_stiffness`: keywords of `revolute`.
    """
    along = np.asarray(end, float) - np.asarray(start, float)
    limb = member(deck, start, end, section, material, across=np.cross(axis, along))
    revolute(deck, limb.start, by, axis, **joint_stiffness)
    spherical(deck, limb.end, holds, spherical_stiffness)
    return limb


def telescopic_limb(
    deck: Deck,
    points: Sequence[ArrayLike],
    axis: ArrayLike,
    sections: Sequence[Section],
    material: Material,
    *,
    holds: Body,
    joint_stiffness: Mapping[str, float] = MappingProxyType({}),
    guidance_stiffness: Mapping[str, float] = MappingProxyType({}),
) -> tuple[Member, Member]:
    """As `swinging_limb` from the ground, of a tube and a rod that a drive holds in it.

    `points`: the revolute joint, where the tube ends and the rod begins, the spherical joint;
    `sections`: the tube's and the rod's. `guidance_stiffness`: keywords of `prismatic`.
    """
    start, middle, end = (np.asarray(point, float) for point in points)
    across = np.cross(axis, end - start)
    tube = member(deck, start, middle, sections[0], material, across=across)
    rod = member(deck, middle, end, sections[1], material, across=across)
    revolute(deck, tube.start, None, axis, **joint_stiffness)
    prismatic(deck, rod.start, tube.end, end - start, **guidance_stiffness)
    spherical(deck, rod.end, holds)
    return tube, rod


def strut(deck: Deck, start: ArrayLike, holds: Body, end: ArrayLike, stiffness: float) -> None:
    """An axial member from the ground at `start` (3,) to a body as seen at `end`, N/m."""
    foot = deck.node(start)
    deck.hold(foot)
    deck.truss(foot, holds.point, stiffness)


def sliding_tube(
    deck: Deck,
    through: ArrayLike,
    end: ArrayLike,
    base_axis: ArrayLike,
    own_axis: ArrayLike,
    section: Section,
    material: Material,
    *,
    holds: Body,
    radial: float = inf,
    tilt: float = inf,
) -> Member:
    """A member fixed to a body, as seen at `end` (3,), that slides through a universal joint.

    The joint's centre `through` (3,) and its `base_axis` are the ground's, `own_axis` the member's.
    """
    along = np.asarray(end, float) - np.asarray(through, float)
    tube = member(deck, through, end, section, material, across=own_axis)
    universal(deck, tube.start, None, own_axis, base_axis, slide=along, radial=radial, tilt=tilt)
    fixed(deck, tube.end, holds)
    return tube


def axes_of(along: ArrayLike, across: ArrayLike) -> Vector:
    """(3, 3) rows: the unit vector along, that nearest to `across`, and their cross product."""
    one = np.asarray(along, float) / np.linalg.norm(along)
    two = np.asarray(across, float) - one * (one @ np.asarray(across, float))
    two /= np.linalg.norm(two)
    return np.array([one, two, np.cross(one, two)])


def _aside(axis: ArrayLike) -> Vector:
    """The base direction that is most across `axis`."""
    return np.asarray(np.eye(3)[np.abs(np.asarray(axis, float)).argmin()])
