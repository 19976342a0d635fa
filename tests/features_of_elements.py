"""Elements of a part for tests: walls, faces, circles and contours, with their feature built.

Points are in m; a row is validated as the features file's is.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from truepose.arrays import Floats
from truepose.files.units import FileUnit, UnitSystem
from truepose.workpiece.element import Element
from truepose.workpiece.features import REGISTRY, Feature, Forms, Method

UNITS = UnitSystem({"length": FileUnit("mm", 1e-3), "angle": FileUnit("deg", np.pi / 180.0)})


def element(name: str, points: Floats, tool_radius: float = 0.0) -> Element:
    """Driven at points (n, 3) in the plane of x and y."""
    count = np.arange(len(points))
    return Element(
        name, np.asarray(points, float), count, count, np.array([0.0, 0, 1]), tool_radius
    )


def wall(
    name: str, start: Sequence[float], end: Sequence[float], count: int = 21, **options: float
) -> Element:
    """A straight pass from start to end, x y or x y z."""
    ends = [[*place, *[0.0] * (3 - len(place))] for place in (start, end)]
    return element(name, np.linspace(ends[0], ends[1], count), **options)


def deep_wall(name: str, start: Sequence[float], end: Sequence[float], count: int = 12) -> Element:
    """Passes at three depths."""
    passes = [wall(name, [*start, z], [*end, z], count).points for z in (0.0, -0.004, -0.01)]
    return element(name, np.concatenate(passes))


def face(
    name: str, corner: Sequence[float], size: Sequence[float], z: float = 0.0, tilt: float = 0.0
) -> Element:
    """Parallel passes along x, `tilt` rad about x."""
    x, y = np.meshgrid(np.linspace(0.0, size[0], 9), np.linspace(0.0, size[1], 6))
    across = y.ravel()
    rows = [corner[0] + x.ravel(), corner[1] + np.cos(tilt) * across, z + np.sin(tilt) * across]
    return element(name, np.column_stack(rows))


def bore(
    name: str,
    centre: Sequence[float] = (0.0, 0.0),
    radius: float = 0.02,
    count: int = 72,
    arc: float = 2.0 * np.pi,
    **options: float,
) -> Element:
    """A circle, closed without a second point at its start, or an arc from end to end."""
    full = arc >= 2.0 * np.pi
    angles = np.linspace(0.0, arc, count, endpoint=not full)
    rows = [centre[0] + radius * np.cos(angles), centre[1] + radius * np.sin(angles), 0.0 * angles]
    return element(name, np.column_stack(rows), **options)


def build(
    kind: str,
    row: Mapping[str, object],
    elements: Sequence[Element],
    datums: Sequence[Element] = (),
    method: Method = "iso",
) -> Feature:
    """The feature of that row of a features file, in mm and degrees."""
    table = REGISTRY[kind].table
    checked = table.model_validate(dict(row), context={"units": UNITS})
    named = {datum.name: datum for datum in datums}
    return REGISTRY[kind].build(kind, checked, elements, named, method)


def points_of(feature: Feature) -> list[Floats]:
    """(1, n, 3) of the programmed points of elements and datums."""
    return [element.points[np.newaxis] for element in (*feature.elements, *feature.datums)]


def perturbed(feature: Feature, errors: Floats) -> list[Floats]:
    """(s, n, 3) of elements and datums, with errors (s, N, 3) of all their points."""
    points, first = [], 0
    for nominal in points_of(feature):
        count = nominal.shape[1]
        points.append(nominal + errors[:, first : first + count])
        first += count
    return points


def value(feature: Feature, points: Sequence[Floats], quantity: str) -> Floats:
    """(s,) of the quantity of that name."""
    names = [quantity.name for quantity in feature.quantities]
    return feature.values(points)[:, names.index(quantity)]


def every_case(method: Method, rounded: float = 0.0) -> dict[str, Feature]:
    """A feature of each kind, with each kind of datum and of freedom.

    `rounded`: turned a little, and programmed to whole multiples of that, m.
    """
    bottom, left = wall("A", (0, 0), (0.1, 0)), wall("B", (0, 0), (0, 0.06), 13)
    floor, hole = face("F", (0, 0), (0.1, 0.06)), bore("H", (0.08, 0.05), 0.005, 24)
    slot = [wall("w1", (0, 0.02), (0.1, 0.02)), wall("w2", (0.1, -0.02), (0.01, -0.02), 17)]
    hole_1, hole_2 = bore("D", (0.03, 0.02), 0.01, 36), bore("E", (0.09, 0.03), 0.004, 15)
    arc = bore("arc", (0.01, 0.0), 0.03, 30, np.pi / 2)
    tall = deep_wall("tall", (0.02, 0), (0.02, 0.05))
    ell = [[0, 0, 0], [0.02, 0, 0], [0.05, 0, 0], [0.05, 0.02, 0], [0.03, 0.03, 0], [0, 0.03, 0]]
    contour = element("contour", np.array([*ell, [0, 0.01, 0], ell[0]]))
    size = {"nominal": "40 mm", "tolerance": 0.1}
    round_row = {"diameter": "20 mm", "tolerance": "H7", "roundness": 0.01, "position": 0.05}
    zone = {"zone": "0.02 mm"}
    slope = wall("slope", (0, 0), (0.05, 0.05 * np.tan(np.radians(30))))
    angle = {"angle": "30 deg", "zone": 0.02, "tolerance": "±0.1 deg"}
    cases: dict[str, tuple[str, Mapping[str, object], list[Element], list[Element]]] = {
        "slot": ("size", size, slot, []),
        "bore to walls": ("circle", round_row, [hole_1], [bottom, left]),
        "bore to wall and bore": ("circle", round_row, [hole_1], [bottom, hole]),
        "bore to bores": ("circle", round_row, [hole_1], [hole, hole_2]),
        "bore to faces": ("circle", round_row, [hole_1], [floor, bottom, left]),
        "bore to bore and wall": ("position", zone, [hole_1], [hole, bottom]),
        "arc": ("circle", {"roundness": 0.01, "position": 0.1}, [arc], []),
        "line": ("straightness", zone, [bottom], []),
        "face": ("flatness", zone, [floor], []),
        "tall wall": ("flatness", zone, [tall], []),
        "parallel walls": ("parallelism", zone, [slot[0]], [bottom]),
        "parallel faces": ("parallelism", zone, [face("top", (0, 0), (0.04, 0.05), 0.01)], [floor]),
        "walls across": ("perpendicularity", zone, [left], [bottom]),
        "wall across face": ("perpendicularity", zone, [tall], [floor]),
        "wall across face and wall": ("perpendicularity", zone, [tall], [floor, bottom]),
        "face across wall": ("perpendicularity", zone, [floor], [bottom]),
        "walls at 30": ("angularity", angle, [slope], [bottom]),
        "face at 20": (
            "angularity",
            {"angle": 20, "zone": 0.02},
            [face("chamfer", (0, 0), (0.05, 0.04), 0.0, np.radians(20))],
            [floor],
        ),
        "wall to wall": ("position", zone, [slot[0]], [bottom]),
        "wall to walls": ("position", zone, [tall], [left, bottom]),
        "face to face": ("position", zone, [face("top", (0, 0), (0.04, 0.05), 0.01)], [floor]),
        "wall in place": ("position", zone, [left], []),
        "contour": ("profile", zone, [contour], []),
        "round contour": ("profile", zone, [replace(hole_1, closed=True)], []),
        "straight contour": ("profile", zone, [slope], []),
        "contour to walls": ("profile", zone, [contour], [bottom, left]),
    }

    def programmed(elements: Sequence[Element]) -> list[Element]:
        if not rounded:
            return list(elements)
        turn = np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])
        return [
            replace(one, points=np.round(one.points @ turn.T / rounded) * rounded)
            for one in elements
        ]

    return {
        name: build(kind, row, programmed(elements), programmed(datums), method)
        for name, (kind, row, elements, datums) in cases.items()
    }


def followed(
    form: Forms, errors: Floats, shift: Sequence[float] = (0.0, 0.0, 0.0)
) -> tuple[Floats, Floats]:
    """(s,) what the linear forms say of errors (s, N, 3), and by how much the value may differ.

    A value of rule "spread" may be less by any amount. `shift`, m: what all errors have in common.
    """
    rho = np.linalg.norm(errors - shift, axis=-1).max(axis=1)
    assert np.all(rho <= form.reach)
    values = form.base + np.einsum("kni,sni->sk", form.weights, errors)
    allowed = form.curvature * rho**2
    for besides in form.plus:
        assert besides.rule == "spread"
        allowed = allowed + followed(besides, errors, shift)[0]
    if form.rule == "length":
        return form.factor * np.linalg.norm(values, axis=1), allowed
    if form.rule == "spread":
        return form.factor * np.ptp(values, axis=1), allowed
    return (values.min(axis=1) if form.side < 0 else values.max(axis=1)), allowed
