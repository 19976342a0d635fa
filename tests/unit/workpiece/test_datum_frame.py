"""The frame of datums: what it fixes, exactly and to first order, and what forms none."""

from __future__ import annotations

import re

import numpy as np
import pytest
import scipy.spatial.transform

from features_of_elements import bore, build, deep_wall, face, wall
from truepose.arrays import Floats
from truepose.workpiece.coordinates import Coordinates
from truepose.workpiece.datum_frame import DatumFrame, datum_alignment
from truepose.workpiece.element import Element
from truepose.workpiece.features import FeatureError
from truepose.workpiece.first_order import FirstOrder

BOTTOM, LEFT = wall("A", (0, 0), (0.1, 0)), wall("B", (0, 0), (0, 0.06), 13)
FLOOR, HOLE = face("F", (0, 0), (0.1, 0.06)), bore("H", (0.08, 0.05), 0.005, 24)
OTHER = bore("K", (0.01, 0.05), 0.004, 15)
SLANTED = wall("S", (0, 0), (0.05, 0.05))

FRAMES = {
    "walls": [BOTTOM, LEFT],
    "slanted": [BOTTOM, SLANTED],
    "wall and bore": [BOTTOM, HOLE],
    "bore and wall": [HOLE, BOTTOM],
    "bores": [HOLE, OTHER],
    "faces": [FLOOR, BOTTOM, LEFT],
    "faces, walls first": [BOTTOM, FLOOR, HOLE],
}


def _points(datums: list[Element]) -> list[Floats]:
    return [datum.points[np.newaxis] for datum in datums]


@pytest.mark.parametrize("name", FRAMES)
@pytest.mark.parametrize("least_squares", [False, True])
def test_the_frame_goes_with_the_part(name: str, least_squares: bool) -> None:
    """Whatever errors the datums have: a part turned by R and moved has a frame that is, too."""
    datums = FRAMES[name]
    fit = datum_alignment(datums, least_squares=least_squares)
    rng = np.random.default_rng(1)
    points = np.concatenate(_points(datums), axis=1)
    off = points + 1e-5 * rng.standard_normal(points.shape)
    turn = [2e-3, -1e-3, 3e-3] if fit.frame.tilts else [0.0, 0.0, 3e-3]
    matrix = scipy.spatial.transform.Rotation.from_rotvec(turn).as_matrix()
    shift = np.array([0.02, -0.01, 0.005 if fit.frame.tilts else 0.0])
    rotation, origin = fit(off)
    after, origin_after = fit(off @ matrix.T + shift)
    np.testing.assert_allclose(after[0], matrix @ rotation[0], rtol=0, atol=1e-13)
    np.testing.assert_allclose(origin_after[0], matrix @ origin[0] + shift, rtol=0, atol=1e-13)


@pytest.mark.parametrize("name", FRAMES)
def test_a_perfect_part_is_where_it_is_drawn(name: str) -> None:
    points = np.concatenate(_points(FRAMES[name]), axis=1)
    rotation, origin = datum_alignment(FRAMES[name], least_squares=False)(points)
    np.testing.assert_allclose(rotation[0], np.eye(3), rtol=0, atol=1e-14)
    np.testing.assert_allclose(origin[0], 0.0, rtol=0, atol=1e-15)


@pytest.mark.parametrize("name", FRAMES)
def test_the_motion_is_the_derivative_of_least_squares(name: str) -> None:
    datums = FRAMES[name]
    frame = DatumFrame(datums, Coordinates.of(datums), least_squares=True)
    order = FirstOrder.of_frame(frame)
    rng = np.random.default_rng(3)
    error = rng.standard_normal(order.ideal.shape)
    ends = np.cumsum([len(datum.points) for datum in datums])[:-1]

    def motion(step: float) -> Floats:
        moved = np.split((order.ideal + step * error)[np.newaxis], ends, axis=1)
        (rotation,), (shift,) = frame.fit(moved)
        turn = scipy.spatial.transform.Rotation.from_matrix(rotation).as_rotvec()
        return np.concatenate([turn, shift])

    by_differences = (motion(1e-7) - motion(-1e-7)) / 2e-7
    said = np.einsum("cni,ni->c", order.jac_motion, error)
    np.testing.assert_allclose(by_differences, said, rtol=1e-6, atol=1e-6)


def test_the_first_datum_turns_and_the_second_stops() -> None:
    """B leans: the part turns with A alone, and ends at the middle of B's zone."""
    lean = 1e-3
    fit = datum_alignment([BOTTOM, LEFT], least_squares=False)
    first, second = _points([BOTTOM, LEFT])
    leaning = second + lean * second[..., 1:2] * [1.0, 0.0, 0.0]
    (rotation,), (origin,) = fit(np.concatenate([first, leaning], axis=1))
    np.testing.assert_allclose(rotation, np.eye(3), rtol=0, atol=1e-14)
    np.testing.assert_allclose(origin, [0.5 * lean * 0.06, 0.0, 0.0], rtol=0, atol=1e-14)


@pytest.mark.parametrize(
    ("datums", "what"),
    [
        ([BOTTOM], "where the part is along"),
        ([BOTTOM, wall("C", (0, 0.05), (0.1, 0.05))], "anything that the datums before it leave"),
        ([HOLE], "how the part is turned"),
        ([FLOOR, face("G", (0, 0), (0.05, 0.05), 0.02)], "anything that the datums before it"),
        ([BOTTOM, LEFT, HOLE], "anything that the datums before it leave"),
        ([FLOOR], "how the part is turned"),
    ],
)
def test_datums_that_form_no_frame(datums: list[Element], what: str) -> None:
    with pytest.raises(FeatureError, match=re.escape(what)) as caught:
        datum_alignment(datums, least_squares=False)
    assert caught.value.code == "feature-datums"
    assert caught.value.fault.found
    assert caught.value.fault.expected


def test_one_wall_is_enough_for_what_it_fixes() -> None:
    """A wall's distance to a wall beside it, not a bore's place along it."""
    zone = {"zone": 0.02}
    build("position", zone, [wall("w", (0, 0.02), (0.1, 0.02))], [BOTTOM])
    build("position", zone, [face("top", (0, 0), (0.05, 0.05), 0.02)], [FLOOR])
    with pytest.raises(FeatureError, match="does not say where"):
        build("position", zone, [OTHER], [BOTTOM])
    with pytest.raises(FeatureError, match="how high and how tilted"):
        build("position", zone, [face("top", (0, 0), (0.05, 0.05), 0.02)], [BOTTOM, LEFT])
    with pytest.raises(FeatureError, match="a face that is a datum"):
        build(
            "parallelism",
            zone,
            [deep_wall("t", (0, 0), (0.05, 0))],
            [face("g", (0, 0), (0.05, 0.05), 0, 0.3)],
        )
