"""What a drawing tolerates, a second time, of one part whose tool points are known.

By the definitions of docs/part_features.md, with the fits of `shapes`. In the working plane xy of
the machine; what is drawn comes from `drawn_part`, and of a point also where it was programmed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from part_simulator.drawn_part import UP, Bore, Face, Wall
from part_simulator.shapes import (
    STEPS,
    circle_of_least_squares,
    least_largest,
    wall_of_least_squares,
    zone_of_circle,
    zone_of_face,
    zone_of_wall,
)

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Made:
    """One element: what is drawn, where its points were programmed (n, 3), and where they are."""

    drawn: Wall | Bore | Face
    programmed: Floats
    points: Floats

    def seen(self, frame: Frame) -> Made:
        """The same as a frame of datums sees it."""
        return Made(self.drawn, self.programmed, frame.seen(self.points))


# --- sizes


def sizes(first: Made, second: Made) -> tuple[float, float]:
    """The smallest and the largest distance across two walls, point by opposite point."""
    offs, places = _pooled(first, second)
    local = []
    for own, other in ((0, 1), (1, 0)):
        order = np.argsort(places[other])
        low, high = places[other][order[[0, -1]]]
        inside = (places[own] >= low - 1e-9) & (places[own] <= high + 1e-9)
        opposite = np.interp(places[own][inside], places[other][order], offs[other][order])
        local.append(np.abs(offs[own][inside] - opposite))
    every = np.concatenate(local)
    return float(every.min()), float(every.max())


def size_of_least_squares(first: Made, second: Made) -> float:
    """The distance of two walls of one normal."""
    offs, _ = _pooled(first, second)
    return float(abs(offs[0].mean() - offs[1].mean()))


def _pooled(first: Made, second: Made) -> tuple[list[Floats], list[Floats]]:
    """Of each wall's points how far along the normal that both have in common, and where."""
    assert isinstance(first.drawn, Wall)
    flat = [made.points[:, :2] for made in (first, second)]
    together = np.concatenate([points - points.mean(axis=0) for points in flat])
    normal = np.linalg.svd(together, full_matrices=False)[2][1]
    places = [made.programmed @ first.drawn.along for made in (first, second)]
    middle = flat[0].mean(axis=0)
    return [(points - middle) @ normal for points in flat], places


def diameters(made: Made) -> tuple[float, float]:
    """The smallest and the largest through the centre of the least-squares circle."""
    assert isinstance(made.drawn, Bore)
    centre, _ = circle_of_least_squares(made.points[:, :2])
    radii = np.hypot(*(made.points[:, :2] - centre).T)
    x, y, _ = (made.programmed - made.drawn.centre).T
    angles = np.arctan2(y, x)
    opposite = np.interp(angles + np.pi, *_round(angles, radii), period=2.0 * np.pi)
    return float((radii + opposite).min()), float((radii + opposite).max())


def _round(angles: Floats, radii: Floats) -> tuple[Floats, Floats]:
    """One value at every angle: where a circle begins it is driven twice, at the same place."""
    order = np.argsort(angles)
    return angles[order], radii[order]


# --- forms


def straightness(made: Made, *, least_squares: bool = False) -> float:
    """Of a wall in the working plane."""
    flat = made.points[:, :2]
    if least_squares:
        return float(np.ptp((flat - flat.mean(axis=0)) @ wall_of_least_squares(flat)))
    return zone_of_wall(flat)[0]


def flatness(made: Made, *, least_squares: bool = False) -> float:
    """Of a face."""
    if least_squares:
        centred = made.points - made.points.mean(axis=0)
        return float(np.ptp(centred @ wall_of_least_squares(made.points)))
    return zone_of_face(made.points)[0]


def roundness(made: Made, *, least_squares: bool = False) -> float:
    """Of a bore in the working plane."""
    flat = made.points[:, :2]
    if least_squares:
        centre, _ = circle_of_least_squares(flat)
        return float(np.ptp(np.hypot(*(flat - centre).T)))
    return zone_of_circle(flat)[0]


def profile(
    made: Sequence[Made],
    frame: Frame | None,
    *,
    corners: bool = False,
    least_squares: bool = False,
) -> float:
    """Twice what a contour is off the drawing at most, along the drawing's normals.

    `corners`: a point where two walls meet counts along the normals of both.
    """
    drawn, points, normals = [], [], []
    for one in made:
        for normal, chosen in _normals_at(one, made if corners else [one]):
            drawn.append(one.programmed[chosen, :2])
            points.append(one.points[chosen] if frame is None else frame.seen(one.points[chosen]))
            normals.append(normal)
    places, normal = np.concatenate(drawn), np.concatenate(normals)
    flat = np.concatenate(points)[:, :2]
    if frame is not None:
        return float(2.0 * np.abs(((flat - places) * normal).sum(axis=1)).max())
    place = np.zeros(3)
    place[:2] = flat.mean(axis=0) - places.mean(axis=0)
    # The drawing's middle stays where it is when it turns: round contours do not care for turns.
    middle = places.mean(axis=0)
    freedoms = 2 if len(made) == 1 and isinstance(made[0].drawn, Bore) else 3

    def off_at(motion: Floats) -> tuple[Floats, Floats]:
        seen = (flat - middle - motion[:2]) @ _turned(motion[2])
        across = normal[:, 1] * seen[:, 0] - normal[:, 0] * seen[:, 1]
        slopes = np.column_stack([normal @ _turned(motion[2]).T, across])[:, :freedoms]
        return ((seen + middle - places) * normal).sum(axis=1), slopes

    if least_squares:
        for _ in range(STEPS):
            off, slopes = off_at(place)
            place[:freedoms] += np.linalg.lstsq(slopes, off, rcond=None)[0]
        return float(2.0 * np.abs(off_at(place)[0]).max())
    best, slopes = off_at(place)
    trust = 1.0
    for _ in range(200):
        step = np.zeros(3)
        step[:freedoms] = least_largest(slopes, best, trust)
        off, further = off_at(place + step)
        if np.abs(off).max() < np.abs(best).max():
            place, best, slopes = place + step, off, further
        else:
            trust = 0.25 * min(trust, float(np.abs(step).max()))
            if trust < 1e-9:
                break
    return float(2.0 * np.abs(best).max())


def _normals_at(one: Made, every: Sequence[Made]) -> list[tuple[Floats, Floats]]:
    """Normals of an element's points, of all the walls that they are on, and which points."""
    if isinstance(one.drawn, Bore):
        spokes = (one.programmed - one.drawn.centre)[:, :2]
        unit = spokes / np.hypot(*spokes.T)[:, np.newaxis]
        return [(unit, np.arange(len(unit)))]
    found = []
    for wall in {id(other.drawn): other.drawn for other in every}.values():
        assert isinstance(wall, Wall)
        away = one.programmed - wall.begin
        along = away @ wall.along
        length = np.linalg.norm(wall.end - wall.begin)
        on = (np.abs(away @ wall.normal) < 1e-8) & (along > -1e-8) & (along < length + 1e-8)
        chosen = np.flatnonzero(on)
        found.append((np.tile(wall.normal[:2], (chosen.size, 1)), chosen))
    return found


# --- datums


@dataclass(frozen=True, eq=False)
class Frame:
    """A point of the drawing at y is at R (y + shift) of the part."""

    rotation: Floats
    shift: Floats

    def seen(self, points: Floats) -> Floats:
        """Points (n, 3) of the part on the drawing."""
        return np.asarray(points @ self.rotation - self.shift)


def frame_of(datums: Sequence[Made], *, least_squares: bool = False) -> Frame:
    """Of datums in their order: a face tilts, then the first wall or two bores turn, then place."""
    rotation = np.eye(3)
    for datum in datums:
        if isinstance(datum.drawn, Face):
            rotation = _tilt(datum, least_squares=least_squares)
            break
    turned = _turn(
        [Made(d.drawn, d.programmed, d.points @ rotation) for d in datums],
        least_squares=least_squares,
    )
    rotation = rotation @ turned
    ways, places = [], []
    for datum in datums:
        off = datum.points @ rotation - datum.programmed
        if isinstance(datum.drawn, Face):
            candidates = [UP]
        elif isinstance(datum.drawn, Wall):
            candidates = [datum.drawn.normal]
        else:
            candidates = [np.eye(3)[0], np.eye(3)[1]]
        for way in candidates:
            known = np.array(ways).reshape(-1, 3)
            free = way - known.T @ np.linalg.lstsq(known.T, way, rcond=None)[0] if ways else way
            if np.linalg.norm(free) < 1e-3:
                continue
            if isinstance(datum.drawn, Bore):
                free = free / np.linalg.norm(free)
                centre, _ = circle_of_least_squares((datum.points @ rotation)[:, :2])
                place = float((centre - datum.drawn.centre[:2]) @ free[:2])
                way = free
            elif least_squares:
                place = float((off @ way).mean())
            else:
                place = float(0.5 * ((off @ way).max() + (off @ way).min()))
            ways.append(way)
            places.append(place)
    shift = np.linalg.lstsq(np.array(ways), np.array(places), rcond=None)[0]
    return Frame(rotation, shift)


def _tilt(face: Made, *, least_squares: bool) -> Floats:
    normal = wall_of_least_squares(face.points) if least_squares else zone_of_face(face.points)[1]
    normal = normal * np.sign(normal[2])
    sine_axis = np.cross(UP, normal)
    cross = np.cross(np.eye(3), sine_axis)
    return np.asarray(np.eye(3) + cross + cross @ cross / (1.0 + normal[2]))


def _turn(datums: Sequence[Made], *, least_squares: bool) -> Floats:
    """About z, by the first datum that says it."""
    bores: list[Made] = []
    for datum in datums:
        if isinstance(datum.drawn, Wall):
            flat = datum.points[:, :2]
            normal = wall_of_least_squares(flat) if least_squares else zone_of_wall(flat)[1]
            return _about_up(_between(datum.drawn.normal[:2], normal, either_way=True))
        if isinstance(datum.drawn, Bore):
            bores.append(datum)
            if len(bores) == 2:
                ends = [circle_of_least_squares(bore.points[:, :2])[0] for bore in bores]
                drawn = [bore.drawn.centre[:2] for bore in bores]  # type: ignore[union-attr]
                return _about_up(_between(drawn[1] - drawn[0], ends[1] - ends[0], either_way=False))
    return np.eye(3)


def _between(first: Floats, second: Floats, *, either_way: bool) -> float:
    if either_way and first @ second < 0.0:
        second = -second
    return float(np.arctan2(first[0] * second[1] - first[1] * second[0], first @ second))


def _about_up(angle: float) -> Floats:
    turned = np.eye(3)
    turned[:2, :2] = _turned(angle)
    return turned


def _turned(angle: float) -> Floats:
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


# --- what is seen from datums


def orientation(made: Made, datums: Sequence[Made], *, least_squares: bool = False) -> float:
    """Width of the zone at the drawing's angle to the datums; free about z, it lies as it may."""
    seen = made.seen(frame_of(datums, least_squares=least_squares))
    if isinstance(made.drawn, Face):
        return float(np.ptp(seen.points[:, 2]))
    assert isinstance(made.drawn, Wall)
    if all(isinstance(datum.drawn, Face) for datum in datums):
        return straightness(seen, least_squares=least_squares)
    return float(np.ptp(seen.points @ made.drawn.normal))


def angle(made: Made, datums: Sequence[Made], *, least_squares: bool = False) -> float:
    """By how much a wall is turned more than drawn, rad, counter-clockwise from the datums."""
    seen = made.seen(frame_of(datums, least_squares=least_squares))
    assert isinstance(made.drawn, Wall)
    flat = seen.points[:, :2]
    normal = wall_of_least_squares(flat) if least_squares else zone_of_wall(flat)[1]
    return _between(made.drawn.normal[:2], normal, either_way=True)


def position(made: Made, datums: Sequence[Made], *, least_squares: bool = False) -> float:
    """Of a bore the diameter of the zone of its centre, of a wall or face the width."""
    frame = frame_of(datums, least_squares=least_squares) if datums else None
    seen = made if frame is None else made.seen(frame)
    if isinstance(made.drawn, Bore):
        centre, _ = circle_of_least_squares(seen.points[:, :2])
        return float(2.0 * np.hypot(*(centre - made.drawn.centre[:2])))
    normal = made.drawn.normal if isinstance(made.drawn, Wall) else UP
    return float(2.0 * np.abs((seen.points - made.programmed) @ normal).max())
