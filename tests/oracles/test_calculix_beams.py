"""Members that bend in CalculiX: what the elements are worth, and machines of them by hand.

First a cantilever against beam theory, in both planes of bending, in torsion and askew: that is the
elements' own error. Then assembled machines whose limbs constrain. They are statically determinate,
so that equilibrium gives what each limb carries, and its flexibility where the tool goes. Under
1 kN in x that is by hand 495 to 580 um over the workspace of a 3-PRS of 50 x 6 mm tubes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import inf
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import block_diag

import calculix
from calculix import Body
from calculix_beams import (
    Box,
    Material,
    Rectangle,
    Section,
    Tube,
    axes_of,
    fixed,
    member,
    platform,
    prismatic,
    revolute,
    sliding_tube,
    spherical,
    strut,
    swinging_limb,
    telescopic_limb,
    universal,
)
from reference_kinematics import rotation_of
from sweeps import thinned

Vector = NDArray[np.float64]

STEEL = Material(210e9, 0.3, density=7850.0, expansion=12e-6)
STRAIGHT = Material(210e9, 0.0, density=7850.0, expansion=12e-6)
"""Without contraction across, rigid end faces hold nothing back: as in beam theory."""

STRUT, TRICEPT_TUBE = Tube(0.05, 0.006), Tube(0.15, 0.01)
BAR, STOUT = Rectangle(0.05, 0.03), Box(0.09, 0.14, 0.01)

FORCE = 1e3

Hold = tuple[Vector, float, float]
"""A direction, and the stiffness along it, N/m, and about it, N m/rad: 0 is free."""
ASKEW = rotation_of([0.5, -0.7, 1.1])


@dataclass(frozen=True)
class Beam:
    """A section's properties in SI, as textbooks have them, each pair by the section's two axes."""

    area: float
    second_moments: tuple[float, float]
    """Of bending along the first axis and along the second."""
    torsion: float
    shear: tuple[float, float]

    @classmethod
    def of(cls, section: Section, poisson: float) -> Beam:
        """Shear coefficients: G. R. Cowper, J. Appl. Mech. 33 (1966), 335-340."""
        if isinstance(section, Tube):
            outer, inner = section.diameter / 2, section.diameter / 2 - section.wall
            moment, hollow = np.pi / 4 * (outer**4 - inner**4), (inner / outer) ** 2
            shear = 6 * (1 + poisson) * (1 + hollow) ** 2
            shear /= (7 + 6 * poisson) * (1 + hollow) ** 2 + (20 + 12 * poisson) * hollow
            area = np.pi * (outer**2 - inner**2)
            return cls(area, (moment, moment), 2 * moment, (shear, shear))
        if isinstance(section, Rectangle):
            wide, high = section.width, section.height
            long, short = max(wide, high), min(wide, high)
            odd = np.arange(1, 99, 2)  # Saint-Venant's series
            series = float((np.tanh(odd * np.pi * long / (2 * short)) / odd**5).sum())
            torsion = long * short**3 * (1 / 3 - 64 * short / (np.pi**5 * long) * series)
            moments = (high * wide**3 / 12, wide * high**3 / 12)
            return cls(wide * high, moments, torsion, (_full(poisson), _full(poisson)))
        assert isinstance(section, Box)
        wide, high, wall = section.width, section.height, section.wall
        wide_in, high_in = wide - 2 * wall, high - 2 * wall
        moments = (
            (high * wide**3 - high_in * wide_in**3) / 12,
            (wide * high**3 - wide_in * high_in**3) / 12,
        )
        middle_w, middle_h = wide - wall, high - wall
        bredt = 2 * wall * (middle_w * middle_h) ** 2 / (middle_w + middle_h)
        shear = (_thin(middle_h, middle_w, poisson), _thin(middle_w, middle_h, poisson))
        return cls(wide * high - wide_in * high_in, moments, bredt, shear)


def _full(poisson: float) -> float:
    """A full rectangle."""
    return 10 * (1 + poisson) / (12 + 11 * poisson)


def _thin(flange: float, web: float, poisson: float) -> float:
    """A box of one wall's thickness, thin."""
    m = n = flange / web
    below = 12 + 72 * m + 150 * m**2 + 90 * m**3 + 10 * n**2 * (3 * m + 3 * m**2)
    below += poisson * (11 + 66 * m + 135 * m**2 + 90 * m**3 + 10 * n**2 * m)
    return float(10 * (1 + poisson) * (1 + 3 * m) ** 2 / below)


def flexibility(section: Section, material: Material, length: float) -> Vector:
    """(6, 6) of a cantilever's end by Timoshenko: along, the section's axes; then turns."""
    beam = Beam.of(section, material.poisson)
    modulus, shear_modulus = material.modulus, material.modulus / (2 * (1 + material.poisson))
    found = np.zeros((6, 6))
    found[0, 0] = length / (modulus * beam.area)
    found[3, 3] = length / (shear_modulus * beam.torsion)
    for way, turn, sign, moment, shear in zip(
        (1, 2), (5, 4), (1.0, -1.0), beam.second_moments, beam.shear, strict=True
    ):
        bending = modulus * moment
        found[way, way] = length**3 / (3 * bending) + length / (shear * shear_modulus * beam.area)
        found[way, turn] = found[turn, way] = sign * length**2 / (2 * bending)
        found[turn, turn] = length / bending
    return found


# The elements' own error.


@dataclass(frozen=True)
class Cantilever:
    """A member clamped at one end, and how far the elements are from beam theory."""

    section: Section
    material: Material
    error: float
    torsion: float
    """Of the flexibility in torsion."""
    length: float = 0.5
    pieces: int = 10
    askew: bool = False


# Without contraction what is left is the mesh: arcs of parabolas, and Saint-Venant's warping that
# rigid ends hold back. With it the ends hold back the contraction too, the more the shorter it is.
# A box's walls are no thin ones: Bredt's formula lacks 5 % of its torsion, Cowper's some of shear.
QUICK = Cantilever(STRUT, STRAIGHT, 5e-4, 5e-4, askew=True)
QUICK_STEEL = Cantilever(STOUT, STEEL, 0.025, 0.07)
CANTILEVERS = [
    QUICK,
    QUICK_STEEL,
    Cantilever(STRUT, STEEL, 0.005, 5e-4),
    Cantilever(STRUT, STEEL, 0.005, 5e-4, askew=True),
    Cantilever(STRUT, STEEL, 0.008, 5e-4, length=0.3),
    Cantilever(STRUT, STEEL, 0.003, 5e-4, length=1.25),
    Cantilever(STRUT, STEEL, 0.009, 5e-4, pieces=4),
    Cantilever(STRUT, STEEL, 0.005, 5e-4, pieces=20),
    Cantilever(TRICEPT_TUBE, STRAIGHT, 5e-4, 5e-4),
    Cantilever(TRICEPT_TUBE, STEEL, 0.009, 5e-4),
    Cantilever(TRICEPT_TUBE, STEEL, 0.004, 5e-4, length=1.25, askew=True),
    Cantilever(BAR, STRAIGHT, 2e-4, 0.026),
    Cantilever(BAR, STEEL, 0.012, 0.028),
    Cantilever(BAR, STEEL, 0.012, 0.028, askew=True),
    Cantilever(STOUT, STRAIGHT, 0.011, 0.068),
    Cantilever(STOUT, STEEL, 0.025, 0.071, askew=True),
    Cantilever(STOUT, STEEL, 0.008, 0.064, length=1.25),
]


@pytest.mark.parametrize("case", thinned(CANTILEVERS, quick={QUICK, QUICK_STEEL}))
def test_a_cantilever_is_as_beam_theory_has_it(case: Cantilever, tmp_path: Path) -> None:
    """Six loads in one run: along, across in both planes, torsion, bending moments."""
    calculix.required()
    turned = ASKEW if case.askew else np.eye(3)
    along, across, _ = turned.T
    start, end = np.ones(3), np.ones(3) + case.length * along
    deck = calculix.Deck()
    ends = []
    for load in range(6):
        limb = member(
            deck, start, end, case.section, case.material, across=across, pieces=case.pieces
        )
        fixed(deck, limb.start, None)
        node = limb.end.turn if load > 2 else limb.end.point
        deck.load(node, FORCE * turned[:, load % 3])
        ends.append(limb.end)
    moved = deck.run(tmp_path)
    found = np.array([np.r_[moved[e.point] @ turned, moved[e.turn] @ turned] for e in ends]).T
    found /= FORCE
    expected = flexibility(case.section, case.material, case.length)
    size = np.sqrt(np.outer(expected.diagonal(), expected.diagonal()))
    allowed = case.error * np.abs(expected) + 1e-5 * size  # seven digits of what moves most
    allowed[3, 3] = case.torsion * expected[3, 3]
    assert (np.abs(found - expected) <= allowed).all(), np.round((found - expected) / size, 5)


@pytest.mark.parametrize(("section", "error"), [(STRUT, 1e-3), (STOUT, 0.015)])
def test_weight_and_a_gradient_bend_a_cantilever(
    section: Section, error: float, tmp_path: Path
) -> None:
    """q L^4 / 8 E I with its shear; a gradient bends to a circle, away from where it is warm."""
    calculix.required()
    length, gravity, gradient = 0.5, 9.81, 200.0
    deck = calculix.Deck(gravity=[0.0, 0.0, -gravity], reference=293.15)
    heavy = member(deck, np.zeros(3), [length, 0, 0], section, STRAIGHT, across=[0, 0, 1])
    weightless = replace(STRAIGHT, density=0.0)
    warm = member(deck, np.zeros(3), [length, 0, 0], section, weightless, across=[0, 0, 1])
    warm.warm(deck, 303.15, (gradient, 0.0))
    for limb in (heavy, warm):
        fixed(deck, limb.start, None)
    moved = deck.run(tmp_path)
    beam = Beam.of(section, 0.0)
    line_load = STRAIGHT.density * beam.area * gravity
    sag = line_load * length**4 / (8 * STRAIGHT.modulus * beam.second_moments[0])
    shear_modulus = STRAIGHT.modulus / 2
    sag += line_load * length**2 / (2 * beam.shear[0] * shear_modulus * beam.area)
    assert moved[heavy.end.point] == pytest.approx([0.0, 0.0, -sag], rel=error, abs=1e-5 * sag)
    arc = STRAIGHT.expansion * gradient * length**2 / 2
    grown = STRAIGHT.expansion * 10.0 * length
    assert moved[warm.end.point] == pytest.approx([grown, 0.0, -arc], rel=2e-3, abs=1e-5 * arc)


# Joints: a cantilever whose end one holds too, to the ground.

FIRST, SECOND, THIRD = axes_of([0.3, 0.5, -0.8], [1.0, 0.2, 0.1])
LEANING = np.cos(1.2) * FIRST + np.sin(1.2) * THIRD
HOLDS: dict[str, tuple[Callable[[calculix.Deck, Body], None], list[Hold]]] = {
    "revolute": (
        lambda deck, end: revolute(deck, end, None, FIRST, axial=2e8, radial=1e8, tilt=4e5),
        [(FIRST, 2e8, 0.0), (SECOND, 1e8, 4e5), (THIRD, 1e8, 4e5)],
    ),
    "spherical": (
        lambda deck, end: spherical(deck, end, None, 1e8),
        [(FIRST, 1e8, 0.0), (SECOND, 1e8, 0.0), (THIRD, 1e8, 0.0)],
    ),
    "universal": (
        lambda deck, end: universal(deck, end, None, FIRST, LEANING, radial=1e8, tilt=4e5),
        [(FIRST, 1e8, 0.0), (SECOND, 1e8, 4e5), (THIRD, 1e8, 0.0)],
    ),
    "sliding": (
        lambda deck, end: universal(
            deck, end, None, FIRST, LEANING, slide=THIRD, radial=1e8, tilt=4e5
        ),
        [(FIRST, 1e8, 0.0), (SECOND, 1e8, 4e5)],
    ),
    "prismatic": (
        lambda deck, end: prismatic(deck, end, None, THIRD, drive=5e7, across=1e8, tilt=4e5),
        [(FIRST, 1e8, 4e5), (SECOND, 1e8, 4e5), (THIRD, 5e7, 4e5)],
    ),
    "free slide": (
        lambda deck, end: prismatic(deck, end, None, THIRD, drive=0.0),
        [(FIRST, inf, inf), (SECOND, inf, inf), (THIRD, 0.0, inf)],
    ),
}


@pytest.mark.parametrize("name", HOLDS)
def test_a_joint_holds_what_it_says(name: str, tmp_path: Path) -> None:
    """Forces by which the ends' relative displacement is what the joint's stiffness gives."""
    calculix.required()
    hold, said = HOLDS[name]
    rows = [np.r_[axis, 0, 0, 0] for axis, _, _ in said]
    rows += [np.r_[0, 0, 0, axis] for axis, _, _ in said]
    stiffness = [way for _, way, _ in said] + [turn for _, _, turn in said]
    held = np.array([row for row, each in zip(rows, stiffness, strict=True) if each])
    gives = np.diag([1.0 / each for each in stiffness if each])

    length, pull, twist = 0.5, [4e3, -2e3, 3e3], [500.0, 300.0, -400.0]
    deck = calculix.Deck()
    limb = member(deck, np.zeros(3), [length, 0, 0], STRUT, STRAIGHT, across=[0, 1, 0])
    fixed(deck, limb.start, None)
    hold(deck, limb.end)
    deck.load(limb.end.point, pull)
    deck.load(limb.end.turn, twist)
    moved = deck.run(tmp_path)

    own = flexibility(STRUT, STRAIGHT, length)
    alone = own @ np.r_[pull, twist]
    carried = np.linalg.solve(held @ own @ held.T + gives, held @ alone)
    expected = alone - own @ held.T @ carried
    found = np.r_[moved[limb.end.point], moved[limb.end.turn]]
    unit = np.r_[np.ones(3), np.full(3, length)]
    assert np.linalg.norm((found - expected) * unit) <= 1e-3 * np.linalg.norm(expected * unit)
    assert np.abs(held @ found - gives @ carried).max() <= 1e-3 * np.abs(expected).max()


# Machines, by equilibrium and by what each limb's flexibility gives.


@dataclass(frozen=True)
class LimbByHand:
    """What a limb does to the platform: unit wrenches at a point, and their flexibility there."""

    point: Vector
    wrenches: Vector
    """(k, 6) forces and moments on the platform, base axes."""
    flexibility: Vector
    """(k, k)."""


def displacement(limbs: Sequence[LimbByHand], tool: Vector, force: ArrayLike) -> Vector:
    """(6,) of the tool point where the limbs' wrenches are six: nothing is undetermined."""
    rows = np.vstack(
        [
            np.c_[w[:, :3], w[:, 3:] + np.cross(limb.point - tool, w[:, :3])]
            for limb in limbs
            for w in [limb.wrenches]
        ]
    )
    carried = np.linalg.solve(rows.T, np.r_[np.asarray(force, float), np.zeros(3)])
    given = block_diag(*(limb.flexibility for limb in limbs)) @ carried
    return np.asarray(np.linalg.solve(rows, given))


def carried_to(flexibility: Vector, lever: Vector) -> Vector:
    """(6, 6) flexibility of what holds a rigid lever, seen at the lever's end."""
    moves = np.eye(6)
    moves[:3, 3:] = np.cross(np.eye(3), lever).T
    return np.asarray(moves @ flexibility @ moves.T)


@dataclass(frozen=True)
class ThreePrs:
    """machines/3prs.toml at a height and tilt, its limbs made of beams, 1 kN at its tool."""

    section: Section
    material: Material
    error: float
    """Of the tool's displacement: the cantilever's, and 0.1 %."""
    height: float = 0.0
    tilt: tuple[float, float] = (0.0, 0.0)
    force: tuple[float, float, float] = (FORCE, 0.0, 0.0)
    revolute: Mapping[str, float] = field(default_factory=dict, hash=False)
    carriage: Mapping[str, float] = field(default_factory=dict, hash=False)
    """Keywords of `revolute` and of `prismatic`."""
    spherical: float = inf
    rod: Section | None = None
    """Of a 3-RPS: its revolutes are on the ground, the guidance is between a tube and this rod."""

    def placed(self) -> tuple[Vector, Vector, Vector, Vector]:
        """(3, 3) revolutes, their axes and spherical joints by limb, and the tool (3,)."""
        angles = np.radians([90.0, 210.0, 330.0])
        outward = np.c_[np.cos(angles), np.sin(angles), np.zeros(3)]
        axes = np.c_[-outward[:, 1], outward[:, 0], np.zeros(3)]
        spin, x, y = 0.0, 0.0, 0.0
        for _ in range(50):  # each joint in its limb's plane: x, y by the platform, then its spin
            arms = 0.25 * outward @ rotation_of([*self.tilt, spin]).T
            off = ((arms + np.array([x, y, 0.0])) * axes).sum(axis=1)
            slopes = np.c_[axes[:, :2], (np.cross([0.0, 0.0, 1.0], arms) * axes).sum(axis=1)]
            step = np.linalg.solve(slopes, off)
            x, y, spin = np.array([x, y, spin]) - step
        turned = rotation_of([*self.tilt, spin])
        centre = np.array([x, y, self.height])
        ends = centre + 0.25 * outward @ turned.T
        assert np.abs((ends * axes).sum(axis=1)).max() < 1e-12
        starts = 0.35 * outward
        starts[:, 2] = ends[:, 2] + np.sqrt(0.5**2 - (0.35 - (ends * outward).sum(axis=1)) ** 2)
        return starts, axes, ends, centre + turned @ [0.0, 0.0, -0.12]

    def by_calculix(self, folder: Path) -> Vector:
        """(6,) of the tool point, m and rad."""
        starts, axes, ends, tool = self.placed()
        deck = calculix.Deck()
        body, joints = platform(deck, tool, ends)
        for start, axis, end, holds in zip(starts, axes, ends, joints, strict=True):
            if self.rod is not None:
                telescopic_limb(
                    deck,
                    [start, (start + end) / 2, end],
                    axis,
                    [self.section, self.rod],
                    self.material,
                    holds=holds,
                    joint_stiffness=self.revolute,
                    guidance_stiffness=self.carriage,
                )
                continue
            by = None
            if self.carriage:
                by, _ = platform(deck, start, [start])
                prismatic(deck, by, None, [0.0, 0.0, 1.0], **self.carriage)
            swinging_limb(
                deck,
                start,
                end,
                axis,
                self.section,
                self.material,
                by=by,
                holds=holds,
                joint_stiffness=self.revolute,
                spherical_stiffness=self.spherical,
            )
        deck.load(body.point, self.force)
        moved = deck.run(folder)
        return np.r_[moved[body.point], moved[body.turn]]

    def by_hand(self) -> Vector:
        """(6,) likewise: a limb carries a force along it and one along its revolute's axis."""
        starts, axes, ends, tool = self.placed()
        limbs = []
        for start, axis, end in zip(starts, axes, ends, strict=True):
            along = (end - start) / np.linalg.norm(end - start)
            own = block_diag(*2 * [axes_of(along, np.cross(axis, along))])
            chain = carried_to(gives(axis, "axial", "radial", None, self.revolute), end - start)
            rod = self.rod
            if rod is None:
                chain += own.T @ flexibility(self.section, self.material, 0.5) @ own
                guided = gives([0.0, 0.0, 1.0], "drive", "across", "tilt", self.carriage)
                chain += carried_to(guided, end - start)
            else:
                lower = own.T @ flexibility(self.section, self.material, 0.25) @ own
                lower += gives(along, "drive", "across", "tilt", self.carriage)
                chain += carried_to(lower, 0.25 * along)
                chain += own.T @ flexibility(rod, self.material, 0.25) @ own
            chain[:3, :3] += np.eye(3) / self.spherical
            wrenches = np.c_[[along, axis], np.zeros((2, 3))]
            limbs.append(LimbByHand(end, wrenches, wrenches @ chain @ wrenches.T))
        return displacement(limbs, tool, self.force)


def gives(
    axis: ArrayLike, along: str, across: str, spin: str | None, stiffness: Mapping[str, float]
) -> Vector:
    """(6, 6) flexibility of a joint with `stiffness` along and across `axis`, and in tilt."""
    own = block_diag(*2 * [axes_of(axis, [0.3, 0.5, 0.8])])
    ways = [along, across, across, spin, "tilt", "tilt"]
    each = [1.0 / stiffness.get(way, inf) if way else 0.0 for way in ways]
    return np.asarray(own.T @ np.diag(each) @ own)


STRAIGHT_PRS = ThreePrs(STRUT, STRAIGHT, 5e-4)
PRS = ThreePrs(STRUT, STEEL, 0.005)
JOINTED = ThreePrs(
    STOUT,
    STEEL,
    0.004,
    revolute={"axial": 3e8, "radial": 3e8, "tilt": 4e6},
    carriage={"drive": 1e8, "across": 4e8, "tilt": 8e6},
)
GUIDED = {"drive": 1e8, "across": 4e8, "tilt": 5e5}
STRAIGHT_RPS = replace(STRAIGHT_PRS, carriage=GUIDED, rod=BAR, tilt=(0.3, -0.2))
THREE_PRS = [
    STRAIGHT_PRS,
    JOINTED,
    STRAIGHT_RPS,
    replace(STRAIGHT_RPS, material=STEEL, error=0.01, revolute=JOINTED.revolute),
    replace(STRAIGHT_PRS, tilt=(0.3, -0.3), height=-0.06),
    replace(STRAIGHT_PRS, tilt=(-0.1, 0.35), force=(200.0, 700.0, -400.0)),
    PRS,
    replace(PRS, tilt=(0.3, -0.3), height=0.14),
    replace(PRS, tilt=(-0.35, 0.0), height=-0.06, force=(0.0, FORCE, 0.0)),
    replace(JOINTED, tilt=(0.3, -0.3), spherical=2e8),
    replace(JOINTED, section=Box(0.12, 0.2, 0.015)),
    replace(JOINTED, section=Box(0.2, 0.12, 0.015), error=0.006),
]


@pytest.mark.parametrize("machine", thinned(THREE_PRS, quick={STRAIGHT_PRS, JOINTED, STRAIGHT_RPS}))
def test_the_tool_of_a_3_prs_or_3_rps_goes_where_equilibrium_says(
    machine: ThreePrs, tmp_path: Path
) -> None:
    calculix.required()
    agrees(machine.by_calculix(tmp_path), machine.by_hand(), machine.error)


def agrees(found: Vector, expected: Vector, error: float) -> None:
    """Both (6,), m and rad: within `error` of the displacement's length; turns at an arm's end."""
    size, arm = np.linalg.norm(expected[:3]), 0.3
    assert np.linalg.norm(found[:3] - expected[:3]) <= error * size, (found, expected)
    assert np.linalg.norm(found[3:] - expected[3:]) * arm <= error * size, (found, expected)


@dataclass(frozen=True)
class Tricept:
    """machines/tricept.toml with its tool at a point, its tube a beam, 1 kN at its tool."""

    section: Section
    material: Material
    error: float
    at: tuple[float, float, float] = (0.0, 0.0, -1.25)
    """m: of the point 300 mm below the platform on the tube's axis."""
    aside: float = 0.0
    """m from that to the tool, along the platform's x axis."""
    struts: float = 6e7
    force: tuple[float, float, float] = (FORCE, 0.0, 0.0)
    radial: float = inf
    tilt: float = inf
    """N/m and N m/rad of the universal joint."""

    def placed(self) -> tuple[Vector, Vector, Vector, Vector, Vector]:
        """The struts' ends (3, 3) each, platform (3,), its axes (3, 3 columns) and the tool."""
        angles = np.radians([90.0, 210.0, 330.0])
        outward = np.c_[np.cos(angles), np.sin(angles), np.zeros(3)]
        along = -np.array(self.at) / np.linalg.norm(self.at)
        own = axes_of(along, np.cross(along, [1.0, 0.0, 0.0]))[1]  # square to the base's x axis
        turned = np.c_[np.cross(own, along), own, along]
        centre = np.array(self.at) + 0.3 * along
        tool = np.array(self.at) + self.aside * turned[:, 0]
        return 0.5 * outward, centre + 0.2 * outward @ turned.T, centre, turned, tool

    def by_calculix(self, folder: Path) -> Vector:
        """(6,) of the tool point, m and rad."""
        starts, ends, centre, turned, tool = self.placed()
        deck = calculix.Deck()
        body, (*joints, middle) = platform(deck, tool, [*ends, centre])
        for start, end, holds in zip(starts, ends, joints, strict=True):
            strut(deck, start, holds, end, self.struts)
        sliding_tube(
            deck,
            np.zeros(3),
            centre,
            [1.0, 0.0, 0.0],
            turned[:, 1],
            self.section,
            self.material,
            holds=middle,
            radial=self.radial,
            tilt=self.tilt,
        )
        deck.load(body.point, self.force)
        moved = deck.run(folder)
        return np.r_[moved[body.point], moved[body.turn]]

    def by_hand(self) -> Vector:
        """(6,) likewise: the joint carries two forces across the tube, and a moment."""
        starts, ends, centre, turned, tool = self.placed()
        limbs = []
        for start, end in zip(starts, ends, strict=True):
            along = (end - start) / np.linalg.norm(end - start)
            limbs.append(
                LimbByHand(end, np.r_[along, 0, 0, 0][None], np.array([[1 / self.struts]]))
            )
        own = block_diag(*2 * [axes_of(-centre, turned[:, 1])])
        tube = own.T @ flexibility(self.section, self.material, float(np.linalg.norm(centre))) @ own
        square = np.cross([1.0, 0.0, 0.0], turned[:, 1])
        wrenches = np.zeros((3, 6))
        wrenches[:2, :3] = turned[:, :2].T
        wrenches[2, 3:] = square / np.linalg.norm(square)
        joint = np.diag([1 / self.radial, 1 / self.radial, 1 / self.tilt])
        limbs.append(LimbByHand(np.zeros(3), wrenches, wrenches @ tube @ wrenches.T + joint))
        return displacement(limbs, tool, self.force)


TRICEPT = Tricept(TRICEPT_TUBE, STRAIGHT, 5e-4)
TRICEPT_ASIDE = replace(TRICEPT, at=(0.25, 0.2, -1.1), aside=0.25)
TRICEPTS = [
    TRICEPT,
    replace(TRICEPT, material=STEEL, error=0.001),
    TRICEPT_ASIDE,
    replace(TRICEPT_ASIDE, force=(0.0, FORCE, 0.0)),
    Tricept(TRICEPT_TUBE, STEEL, 0.002, (0.25, -0.25, -1.4), aside=0.25, struts=15e7),
    Tricept(TRICEPT_TUBE, STEEL, 0.001, (-0.2, 0.25, -1.2), force=(0.0, FORCE, 0.0), radial=1e8),
    replace(TRICEPT_ASIDE, error=0.001, material=STEEL, radial=1e8, tilt=1e5),
]


@pytest.mark.parametrize("machine", thinned(TRICEPTS, quick={TRICEPT_ASIDE}))
def test_the_tool_of_a_tricept_goes_where_equilibrium_says(
    machine: Tricept, tmp_path: Path
) -> None:
    calculix.required()
    expected = machine.by_hand()
    agrees(machine.by_calculix(tmp_path), expected, machine.error)
    unbent = replace(machine, material=replace(machine.material, modulus=1e30)).by_hand()
    assert np.linalg.norm(expected - unbent) > 10 * machine.error * np.linalg.norm(expected)
