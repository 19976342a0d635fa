"""Values of every kind of feature: closed forms, rigid motions, and other ways to compute them."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import scipy.optimize
import scipy.spatial.transform

from features_of_elements import (
    bore,
    build,
    deep_wall,
    element,
    every_case,
    face,
    perturbed,
    points_of,
    value,
    wall,
)
from truepose.arrays import Floats
from truepose.workpiece.features import Feature

ZONE = {"zone": "0.05 mm"}
CIRCLE = {"diameter": "40 mm", "tolerance": "H7", "roundness": 0.01}


def _moved(feature: Feature, matrix: Floats, shift: Floats) -> list[Floats]:
    return [points @ matrix.T + shift for points in points_of(feature)]


def _rotation(vector: list[float]) -> Floats:
    return np.asarray(scipy.spatial.transform.Rotation.from_rotvec(vector).as_matrix())


@pytest.mark.parametrize("method", ["iso", "least-squares"])
def test_a_scale_makes_sizes_larger_and_nothing_else(method: str) -> None:
    """1 + a: a width of 40 mm is 40 a wider, a diameter D a, roundness and directions stay 0."""
    scale = 1.0 + 2e-4
    sizes = {"size": 0.04, "diameter": 0.02}
    for name, feature in every_case(method).items():  # type: ignore[arg-type]
        values = feature.values(_moved(feature, scale * np.eye(3), np.zeros(3)))[0]
        for quantity, number in zip(feature.quantities, values, strict=True):
            word = quantity.name.split(",")[0]
            if word in sizes:
                assert number == pytest.approx(scale * sizes[word], rel=1e-12), name
            elif word not in {"position", "profile", "angle"}:
                assert number == pytest.approx(0.0, abs=1e-13), name


@pytest.mark.parametrize("method", ["iso", "least-squares"])
def test_a_part_moved_as_one_has_the_same_values(method: str) -> None:
    """Turned in the working plane and moved; tilted too where a face carries the frame."""
    rng = np.random.default_rng(2)
    level = _rotation([0.0, 0.0, 3e-3])
    tilted = _rotation([2e-3, -1e-3, 3e-3])
    for name, feature in every_case(method).items():  # type: ignore[arg-type]
        if "in place" in name or name in {"arc", "round contour"}:
            continue  # they are seen in place, or (round) with no turn of their own
        count = sum(points.shape[1] for points in points_of(feature))
        off = perturbed(feature, 2e-5 * rng.standard_normal((4, count, 3)))
        before = feature.values(off)
        carried = name in {"face", "tall wall", "parallel faces", "face at 20", "face to face"}
        matrix = tilted if carried else level
        after = feature.values([points @ matrix.T + [0.2, -0.1, 0.05] for points in off])
        np.testing.assert_allclose(after, before, rtol=0.0, atol=2e-13, err_msg=name)


def test_an_ellipse() -> None:
    """Half axes R + a and R - a: two-point diameters 2 (R +- a), roundness 2 a, mean R."""
    a = 1e-5
    feature = build("circle", CIRCLE, [bore("bore", (0.1, 0.2), 0.02, 72)])
    points = points_of(feature)[0] - [0.1, 0.2, 0.0]
    seen = points * [1.0 + a / 0.02, 1.0 - a / 0.02, 1.0] + [0.1, 0.2, 0.0]
    smallest, largest, roundness = feature.values([seen])[0]
    assert smallest == pytest.approx(0.04 - 2 * a, abs=1e-15)
    assert largest == pytest.approx(0.04 + 2 * a, abs=1e-15)
    assert roundness == pytest.approx(2 * a, abs=1e-15)


def test_three_lobes_have_one_diameter_and_are_not_round() -> None:
    """R + a cos(3 t): whatever is above on one side is below on the other."""
    a, count = 1e-5, 360
    angles = 2.0 * np.pi * np.arange(count) / count
    feature = build("circle", CIRCLE, [bore("bore", (0, 0), 0.02, count)])
    radii = 0.02 + a * np.cos(3 * angles)
    seen = np.column_stack([radii * np.cos(angles), radii * np.sin(angles), 0 * angles])
    smallest, largest, roundness = feature.values([seen[np.newaxis]])[0]
    assert largest - smallest < 1e-15
    assert largest == pytest.approx(0.04, abs=1e-15)
    assert roundness == pytest.approx(2 * a, abs=1e-15)


@pytest.mark.parametrize(("side", "more"), [("inside", 0.006), ("outside", -0.006)])
def test_a_tool_makes_bores_larger_and_bosses_smaller(side: str, more: float) -> None:
    row = {"diameter": "40 mm", "tolerance": 0.1, "roundness": 0.01, "side": side}
    circle = build("circle", row, [bore("bore", tool_radius=0.003)])
    values = circle.values(points_of(circle))[0]
    assert values == pytest.approx([0.04 + more, 0.04 + more, 0.0], abs=1e-15)
    walls = [
        wall("1", (0, 0), (0.1, 0), tool_radius=0.003),
        wall("2", (0.1, 0.03), (0, 0.03), tool_radius=0.003),
    ]
    size = build("size", {"nominal": "30 mm", "tolerance": 0.1, "side": side}, walls)
    assert size.values(points_of(size))[0] == pytest.approx([0.03 + more] * 2, abs=1e-15)


def test_a_skew_axis_leans_by_its_length() -> None:
    """y leans by g: a wall of length L along y is out of square by L g / sqrt(1 + g^2)."""
    lean = 1e-4
    feature = build(
        "perpendicularity", ZONE, [wall("b", (0, 0), (0, 0.06))], [wall("A", (0, 0), (0.1, 0))]
    )
    shear = np.array([[1.0, lean, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    seen = feature.values(_moved(feature, shear, np.zeros(3)))[0, 0]
    assert seen == pytest.approx(0.06 * lean, abs=1e-15)


@pytest.mark.parametrize("turn", [1e-3, -1e-3])
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_an_angle_opens_as_its_wall_turns(turn: float, way: float) -> None:
    """Driven from either end, and whichever of the two it is that turns."""
    tangent = np.tan(np.radians(30.0))
    ends = [(0.0, 0.0), (0.05, 0.05 * tangent)][:: int(way)]
    row = {"angle": 30, "tolerance": "±0.1 deg"}
    feature = build("angularity", row, [wall("s", *ends)], [wall("A", (0, 0), (0.1, 0))])
    own, datum = points_of(feature)
    matrix = _rotation([0.0, 0.0, turn]).T
    angle = np.radians(30.0)
    assert feature.values([own @ matrix, datum])[0, 0] == pytest.approx(angle + turn, abs=1e-12)
    assert feature.values([own, datum @ matrix])[0, 0] == pytest.approx(angle - turn, abs=1e-12)


def test_a_place_is_a_diameter() -> None:
    """Off by d, the centre needs a zone of 2 d; a wall off by d one of 2 d too."""
    datums = [wall("A", (0, 0), (0.1, 0)), wall("B", (0, 0), (0, 0.06))]
    off = np.array([3e-5, 4e-5, 0.0])
    hole = build("position", ZONE, [bore("h", (0.05, 0.03), 0.005, 24)], datums)
    own, *rest = points_of(hole)
    assert hole.values([own + off, *rest])[0, 0] == pytest.approx(1e-4, abs=1e-15)
    side = build("position", ZONE, [wall("w", (0.02, 0.04), (0.07, 0.04))], datums)
    own, *rest = points_of(side)
    assert side.values([own + off, *rest])[0, 0] == pytest.approx(8e-5, abs=1e-15)


def test_a_slot_that_opens_has_two_sizes() -> None:
    """Walls that part by 2 a over the length: the sizes are a more and a less, a cosine apart."""
    a = 1e-5
    walls = [wall("1", (0, 0.02), (0.1, 0.02)), wall("2", (0, -0.02), (0.1, -0.02))]
    feature = build("size", {"nominal": "40 mm", "tolerance": 0.1}, walls)
    first, second = points_of(feature)
    first = first + a * (2.0 * first[..., :1] / 0.1 - 1.0) * [0.0, 1.0, 0.0]
    smallest, largest = feature.values([first, second])[0]
    cosine = np.cos(a / 0.1)
    assert smallest == pytest.approx((0.04 - a) * cosine, abs=1e-12)
    assert largest == pytest.approx((0.04 + a) * cosine, abs=1e-12)


def test_a_corner_counts_to_both_sides() -> None:
    """A corner moved along one wall is off the other."""
    corner = element("c", np.array([[0, 0, 0], [0.05, 0, 0], [0.05, 0.03, 0], [0, 0.03, 0]]))
    datums = [wall("A", (0, -0.01), (0.1, -0.01)), wall("B", (-0.01, 0), (-0.01, 0.06))]
    feature = build("profile", ZONE, [corner], datums)
    own, *rest = points_of(feature)
    moved = own.copy()
    moved[0, 1] += [2e-5, 0.0, 0.0]
    assert feature.values([moved, *rest])[0, 0] == pytest.approx(4e-5, abs=1e-15)


def test_straightness_by_every_direction() -> None:
    """The width of a set of points is least across one of its hull's edges."""
    rng = np.random.default_rng(4)
    feature = build("straightness", ZONE, [wall("w", (0, 0), (0.1, 0.02), 15)])
    for _ in range(10):
        points = points_of(feature)[0][0] + 1e-4 * rng.standard_normal((15, 3))
        edges = [points[j] - points[i] for i in range(15) for j in range(i)]
        normals = np.array([[-edge[1], edge[0], 0.0] / np.hypot(*edge[:2]) for edge in edges])
        least = np.ptp(points @ normals.T, axis=0).min()
        assert feature.values([points[np.newaxis]])[0, 0] == pytest.approx(least, abs=1e-15)


@pytest.mark.parametrize(
    ("kind", "row", "own"),
    [
        ("circle", {"roundness": 0.01}, bore("bore", (0.02, 0.01), 0.02, 40)),
        ("flatness", ZONE, face("face", (0, 0), (0.1, 0.06))),
    ],
)
def test_form_by_another_minimiser(kind: str, row: dict[str, object], own: object) -> None:
    """No centre, and no plane, that a search by simplex (Nelder and Mead) finds is better."""
    rng = np.random.default_rng(6)
    feature = build(kind, row, [own])  # type: ignore[list-item]
    nominal = points_of(feature)[0][0]
    points = nominal + 1e-5 * rng.standard_normal(nominal.shape)

    def width(x: Floats) -> float:
        if kind == "circle":
            centre = [0.02 + 1e-5 * x[0], 0.01 + 1e-5 * x[1]]
            return float(np.ptp(np.hypot(*(points[:, :2] - centre).T)))
        normal = np.array([1e-4 * x[0], 1e-4 * x[1], 1.0])
        return float(np.ptp(points @ normal) / np.linalg.norm(normal))

    found = min(
        scipy.optimize.minimize(
            width,
            rng.standard_normal(2),
            method="Nelder-Mead",
            options={"xatol": 1e-9, "fatol": 1e-18, "maxiter": 2000},
        ).fun
        for _ in range(8)
    )
    ours = feature.values([points[np.newaxis]])[0, 0]
    assert ours <= found + 1e-15
    assert ours == pytest.approx(found, rel=1e-4)


def test_a_wall_across_a_face_may_turn_about_it() -> None:
    """Turned about the face's normal nothing is asked of it, leaning it is."""
    feature = build(
        "perpendicularity",
        ZONE,
        [deep_wall("tall", (0.02, 0), (0.02, 0.05))],
        [face("F", (0, 0), (0.1, 0.06))],
    )
    own, datum = points_of(feature)
    turned = own @ _rotation([0.0, 0.0, 2e-3]).T
    assert feature.values([turned, datum])[0, 0] == pytest.approx(0.0, abs=1e-12)
    leaning = own @ _rotation([0.0, 1e-3, 0.0]).T
    assert feature.values([leaning, datum])[0, 0] == pytest.approx(0.01 * 1e-3, rel=1e-5)


def test_values_of_many_samples_are_those_of_each() -> None:
    feature = every_case("iso")["bore to walls"]
    count = sum(points.shape[1] for points in points_of(feature))
    rng = np.random.default_rng(9)
    points = perturbed(feature, 1e-5 * rng.standard_normal((700, count, 3)))
    together = feature.values(points)
    for sample in (0, 333, 699):
        alone = feature.values([one[sample : sample + 1] for one in points])
        np.testing.assert_allclose(alone[0], together[sample], rtol=0, atol=1e-16)
    assert value(feature, points, "roundness").shape == (700,)


@pytest.mark.parametrize("method", ["iso", "least-squares"])
def test_a_closed_path_has_no_end(method: str) -> None:
    """A circle that turns about its centre is where it was; its first point is not there twice."""
    once = dataclasses.replace(bore("bore", (0.1, 0.2), 0.02, 72), closed=True)
    feature = build("profile", ZONE, [once], method=method)  # type: ignore[arg-type]
    turn = 1e-4
    centre = np.array([0.1, 0.2, 0.0])
    points = (points_of(feature)[0] - centre) @ _rotation([0.0, 0.0, turn]).T + centre
    assert feature.values([points])[0] == pytest.approx([0.02 * turn**2], rel=1e-3)
    # Larger, it is off by as much everywhere, wherever it begins.
    larger = (points_of(feature)[0] - centre) * 1.001 + centre
    assert feature.values([larger])[0] == pytest.approx([2 * 0.02 * 0.001], rel=1e-9)
