"""Elements and rows that are not what a kind is about: code, what was found, what is expected."""

from __future__ import annotations

import numpy as np
import pydantic
import pytest

from features_of_elements import bore, build, deep_wall, element, face, wall
from truepose.workpiece.element import Element
from truepose.workpiece.features import FeatureError

ZONE = {"zone": "0.02 mm"}
SIZE = {"nominal": "40 mm", "tolerance": "±0.05"}
ROUND = {"roundness": 0.01}
DIAMETER = {"diameter": 40, "tolerance": "+0.025 0"}
A = wall("A", (0, 0), (0.1, 0))
BENT = element("bent", np.array([[0, 0, 0], [0.05, 0, 0], [0.05, 0.02, 0], [0.0, 0.03, 0]]))
XZ = Element("xz", A.points, A.place, A.lines, np.array([0.0, 1.0, 0.0]), 0.0)

WRONG = {
    "one wall": ("size", SIZE, [A], [], "feature-elements"),
    "three walls": ("size", SIZE, [A, A, A], [], "feature-elements"),
    "two bores": ("circle", ROUND, [bore("1"), bore("2")], [], "feature-elements"),
    "a size of a face": (
        "size",
        SIZE,
        [A, face("f", (0, 0), (0.05, 0.05), 0, 0.4)],
        [],
        "feature-elements",
    ),
    "two planes": ("size", SIZE, [A, XZ], [], "feature-elements"),
    "not parallel": ("size", SIZE, [A, wall("w", (0, 0.04), (0.1, 0.05))], [], "feature-direction"),
    "not opposite": (
        "size",
        SIZE,
        [A, wall("w", (0.2, 0.04), (0.3, 0.04))],
        [],
        "feature-direction",
    ),
    "a corner": ("straightness", ZONE, [BENT], [], "feature-elements"),
    "two depths": (
        "straightness",
        ZONE,
        [deep_wall("t", (0, 0), (0.05, 0))],
        [],
        "feature-elements",
    ),
    "along the tool": (
        "straightness",
        ZONE,
        [wall("t", (0, 0, 0), (0, 0, 0.05))],
        [],
        "feature-elements",
    ),
    "one pass": ("flatness", ZONE, [A], [], "feature-elements"),
    "two points": (
        "straightness",
        ZONE,
        [wall("w", (0, 0), (0.1, 0), 2)],
        [],
        "feature-too-few-points",
    ),
    "one place": (
        "straightness",
        ZONE,
        [wall("w", (0, 0), (0, 0), 9)],
        [],
        "feature-too-few-points",
    ),
    "three points": ("circle", ROUND, [bore("b", count=3)], [], "feature-too-few-points"),
    "three of a plane": ("flatness", ZONE, [bore("b", count=3)], [], "feature-too-few-points"),
    "three of a contour": (
        "profile",
        ZONE,
        [wall("w", (0, 0), (0.1, 0), 3)],
        [],
        "feature-too-few-points",
    ),
    "a wall as a circle": ("circle", ROUND, [A], [], "feature-no-circle"),
    "a square as a circle": (
        "circle",
        ROUND,
        [face("f", (0, 0), (0.05, 0.05))],
        [],
        "feature-no-circle",
    ),
    "a bent path as a circle": ("circle", ROUND, [BENT], [], "feature-no-circle"),
    "a short arc": (
        "circle",
        ROUND,
        [bore("a", count=20, arc=np.radians(59))],
        [],
        "feature-short-arc",
    ),
    "a quarter's diameter": (
        "circle",
        DIAMETER,
        [bore("a", count=20, arc=np.pi / 2)],
        [],
        "feature-short-arc",
    ),
    "no datum": ("parallelism", ZONE, [A], [], "feature-datums"),
    "a datum of a form": (
        "flatness",
        ZONE,
        [face("f", (0, 0), (0.05, 0.05))],
        [A],
        "feature-datums",
    ),
    "a datum of a diameter": ("circle", DIAMETER, [bore("b")], [A], "feature-datums"),
    "a direction to a bore": ("parallelism", ZONE, [A], [bore("H")], "feature-datums"),
    "a corner as a datum": ("position", ZONE, [A], [BENT], "feature-datums"),
    "across and not": (
        "perpendicularity",
        ZONE,
        [wall("w", (0, 0), (0.1, 0))],
        [A],
        "feature-direction",
    ),
    "another angle": (
        "angularity",
        {"angle": 30, "zone": 0.02},
        [wall("w", (0, 0), (0.1, 0.1))],
        [A],
        "feature-direction",
    ),
    "an angle of a face": (
        "angularity",
        {"angle": 20, "tolerance": 0.1},
        [face("f", (0, 0), (0.05, 0.04), 0.0, np.radians(20))],
        [face("F", (0, 0), (0.05, 0.05))],
        "feature-elements",
    ),
    "a wall across a face, one pass": (
        "perpendicularity",
        ZONE,
        [A],
        [face("F", (0, 0), (0.05, 0.05))],
        "feature-elements",
    ),
    "no side": ("circle", DIAMETER, [bore("b", tool_radius=0.003)], [], "missing-key"),
    "no grade": (
        "circle",
        {"diameter": 9000, "tolerance": "H7"},
        [bore("b")],
        [],
        "tolerance-out-of-range",
    ),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_feature_that_is_none(name: str) -> None:
    kind, row, elements, datums, code = WRONG[name]
    with pytest.raises(FeatureError) as caught:
        build(kind, row, elements, datums)  # type: ignore[arg-type]
    fault = caught.value.fault
    assert fault.code == code
    assert fault.found
    assert fault.expected
    fault.at()  # a code of the catalogue


def test_a_quarter_has_a_least_squares_diameter() -> None:
    arc = bore("a", count=20, arc=np.pi / 2)
    feature = build("circle", DIAMETER, [arc], method="least-squares")
    assert feature.values([arc.points[np.newaxis]])[0, 0] == pytest.approx(0.04, abs=1e-14)


def test_more_than_half_a_circle_has_two_point_diameters() -> None:
    arc = bore("a", count=28, arc=1.5 * np.pi)
    feature = build("circle", DIAMETER, [arc])
    np.testing.assert_allclose(feature.values([arc.points[np.newaxis]]), 0.04, atol=1e-14)


def test_a_closed_circle_counts_its_start_twice() -> None:
    """The last point of a full turn is the first again, and may be elsewhere."""
    points = bore("b", count=36).points
    feature = build("circle", DIAMETER | ROUND, [element("b", points[[*range(36), 0]])])
    seen = feature.elements[0].points.copy()
    seen[-1, 0] += 1e-5
    smallest, largest, roundness = feature.values([seen[np.newaxis]])[0]
    assert smallest < largest
    assert largest == pytest.approx(0.04 + 1e-5, abs=1e-6)
    assert roundness == pytest.approx(1e-5, rel=0.1)


@pytest.mark.parametrize(
    ("kind", "row", "code"),
    [
        ("circle", {}, "missing-key"),
        ("circle", {"diameter": 40, "roundness": 0.01}, "missing-key"),
        ("circle", {"tolerance": 0.01}, "missing-key"),
        ("circle", {"diameter": 40, "tolerance": "g6"}, "unknown-tolerance-class"),
        ("circle", {"diameter": "40 kg", "tolerance": 0.1}, "wrong-dimension"),
        ("circle", {"diameter": 40, "tolerance": "0.1 deg"}, "wrong-dimension"),
        ("angularity", {"angle": 30}, "missing-key"),
        ("flatness", {"zone": 0}, "not-positive"),
        ("size", {"nominal": -4, "tolerance": 0.1}, "not-positive"),
    ],
)
def test_a_row_that_is_none(kind: str, row: dict[str, object], code: str) -> None:
    with pytest.raises(pydantic.ValidationError) as caught:
        build(kind, row, [bore("b")])
    assert [error["type"] for error in caught.value.errors()] == [code]
