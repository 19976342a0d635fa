"""Where the search for an instrument's frame starts: closed forms on the nominal machine.

The search for an unknown frame is not linear in its rotation, so it starts from the rigid motion
that fits the nominal points best (B. K. P. Horn, Closed-form solution of absolute orientation using
unit quaternions, J. Opt. Soc. Am. A 4 (1987) 629-642), and from trilateration for distances. Where
there is no closed form it starts from the declared frame, and from that turned about. All
measurements here are those of one instrument.
"""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np

from truepose.arrays import Floats
from truepose.calibration.instruments._base import Frame
from truepose.calibration.measurements import Measurements
from truepose.calibration.observables import OBSERVABLES
from truepose.machine import Machine
from truepose.spatial import (
    euler_to_matrix,
    matrix_to_quaternion,
    nearest_rotation,
    quaternion_to_matrix,
    vector_to_matrix,
)

_NUMBER = {name: number for number, name in enumerate(OBSERVABLES)}
_ORIGIN, _ROTATION = slice(0, 3), slice(3, 6)

FAR = 10.0
"""Root mean square of an instrument's residuals, in uncertainties, from which further rotations of
its frame are tried; a machine with wide tolerances may be as far off, which only costs time."""

TURNED = 0.5
"""rad of a rotation unknown from which the frame is rebased to where it was found: the unknown of
half a turn is infinite."""

_ALONG = 1.0 - 1e-6
"""Cosine from which two axes are one."""


def frame_starts(machine: Machine, measurements: Measurements) -> list[Frame]:
    """Where the nominal machine says that the frame of the one instrument is.

    Usually one; where distances leave two sides of a plane open, both. A frame that no closed form
    finds starts where it is declared; see `rotated_starts`.
    """
    return _closed_forms(machine, measurements) or [measurements.instruments[0].frame]


def rotated_starts(machine: Machine, measurements: Measurements) -> list[Frame]:
    """The frame of the one instrument, turned about what is unknown of its rotation.

    About one axis by eighths of a turn, about two by thirds of a half turn in eight directions,
    about three by the rotations of a cube; its origin where the readings then put it. None where
    nothing of the rotation is unknown, or a closed form finds it.
    """
    frame = measurements.instruments[0].frame
    axes = np.flatnonzero(frame.unknown[_ROTATION])
    if not axes.size or _closed_forms(machine, measurements):
        return []
    points, _ = _target_points(measurements)
    read = _table(measurements)
    rotation = quaternion_to_matrix(frame.rotation)
    return [_with_origin(frame, turn @ rotation, points, read) for turn in _start_rotations(axes)]


def moved_frame(frame: Frame, change: Floats) -> Frame:
    """The frame moved by the values (6,) that were found for its origin and rotation."""
    # The kernel's rotation unknowns: the quaternion (1, turn / 2), not of length 1.
    quaternion = np.concatenate([[1.0], 0.5 * change[_ROTATION]])
    turn = quaternion_to_matrix(quaternion / np.linalg.norm(quaternion))
    return dataclasses.replace(
        frame,
        origin=tuple((np.array(frame.origin) + change[_ORIGIN]).tolist()),
        rotation=matrix_to_quaternion(turn @ quaternion_to_matrix(frame.rotation)),
    )


def _start_rotations(axes: np.ndarray) -> list[Floats]:
    """Rotations (3, 3) about the base axes of these numbers, none of them the identity."""
    if axes.size == 3:
        cubes: list[Floats] = []
        for order in itertools.permutations(range(3)):
            for signs in itertools.product((1.0, -1.0), repeat=3):
                cube = np.eye(3)[list(order)] * np.array(signs)
                if np.linalg.det(cube) > 0.0 and np.trace(cube) < 2.5:
                    cubes.append(cube)
        return cubes
    if axes.size == 1:
        eighths = np.arange(1, 8)[:, np.newaxis] * np.pi / 4.0
        return list(vector_to_matrix(eighths * np.eye(3)[axes[0]]))
    first, second = np.eye(3)[axes]
    return [
        vector_to_matrix(angle * (np.cos(azimuth) * first + np.sin(azimuth) * second))
        for angle in (np.pi / 3.0, np.pi / 1.5, np.pi)
        for azimuth in np.arange(8) * np.pi / 4.0
    ]


def _target_points(measurements: Measurements) -> tuple[Floats, Floats]:
    """Target points (n_row, 3) in the base frame and rotations (n_row, 3, 3) of the platform."""
    rotations = quaternion_to_matrix(measurements.placements[:, 3:])
    arm = rotations @ np.array(measurements.instruments[0].target)
    return measurements.placements[:, :3] + arm, rotations


def _closed_forms(machine: Machine, measurements: Measurements) -> list[Frame]:
    """Frames that fit the nominal machine best; empty where no closed form finds them."""
    frame = measurements.instruments[0].frame
    unknown = np.array(frame.unknown)
    if not unknown.any():
        return [frame]
    read = _table(measurements)
    points, rotations = _target_points(measurements)
    if "distance" in read and unknown[_ORIGIN].any():
        return _trilaterate(frame, points, read["distance"])
    if not unknown[_ROTATION].any():
        return [_with_origin(frame, quaternion_to_matrix(frame.rotation), points, read)]
    if any(f"direction.{axis}" in read for axis in "xyz"):
        product = _direction_product(machine, measurements)
    elif all(angle in read for angle in "abc"):
        product = _angle_product(rotations, read)
    else:
        product = _point_product(frame, points, read)
    rotation = None if product is None else _rotation_by(frame, product)
    return [] if rotation is None else [_with_origin(frame, rotation, points, read)]


def _rotation_by(frame: Frame, product: Floats) -> Floats | None:
    """(3, 3) R with the largest trace(R^T product) that what is unknown of the frame allows."""
    axes = np.flatnonzero(frame.unknown[_ROTATION])
    if axes.size == 3:
        return nearest_rotation(product)
    if axes.size != 1:
        return None
    rotation = quaternion_to_matrix(frame.rotation)
    i, j = (axes[0] + 1) % 3, (axes[0] + 2) % 3
    turned = product @ rotation.T
    angle = np.arctan2(turned[j, i] - turned[i, j], turned[i, i] + turned[j, j])
    return vector_to_matrix(angle * np.eye(3)[axes[0]]) @ rotation


def _with_origin(frame: Frame, rotation: Floats, points: Floats, read: dict[str, Floats]) -> Frame:
    """The frame with this rotation, its origin where the readings of points (n, 3) put it."""
    origin = np.array(frame.origin)
    free = np.array(frame.unknown[_ORIGIN])
    axes = [at for at, axis in enumerate("xyz") if axis in read]
    if axes and free.any():
        seen = (points - origin) @ rotation
        away = [np.nanmean(seen[:, at] - read["xyz"[at]]) for at in axes]
        origin[free] += np.linalg.lstsq(rotation.T[axes][:, free], np.array(away), rcond=1e-6)[0]
    return dataclasses.replace(
        frame, origin=tuple(origin.tolist()), rotation=matrix_to_quaternion(rotation)
    )


def _table(measurements: Measurements) -> dict[str, Floats]:
    """What the instrument read of the platform by row, NaN where it did not; by observable."""
    table: dict[str, Floats] = {}
    for code in np.unique(measurements.observable).tolist():
        of_code = measurements.observable == code
        values = np.full(measurements.n_row, np.nan)
        values[measurements.row[of_code]] = measurements.value[of_code]
        table[OBSERVABLES[code]] = values
    return table


def _point_product(frame: Frame, points: Floats, read: dict[str, Floats]) -> Floats | None:
    """(3, 3) sum over points of (in the base frame) (as read)^T, both from their means.

    None where they do not fix the rotation. For a rotation about one axis, the two coordinates
    across it are enough.
    """
    axes = [at for at, axis in enumerate("xyz") if axis in read]
    unread = [at for at in range(3) if at not in axes]
    about = np.flatnonzero(frame.unknown[_ROTATION])
    if unread:
        across = about.size == 1 and len(unread) == 1
        along = across and abs(quaternion_to_matrix(frame.rotation)[about[0], unread[0]])
        if not along > _ALONG:
            return None
    seen = np.zeros_like(points)
    for at in axes:
        seen[:, at] = read["xyz"[at]]
    whole = np.isfinite(seen).all(axis=1)
    points, seen = points[whole], seen[whole]
    if len(points) < 2 or (about.size > 1 and not _are_off_a_line(seen)):
        return None
    product: Floats = (points - points.mean(axis=0)).T @ (seen - seen.mean(axis=0))
    return product if product.any() else None


def _angle_product(rotations: Floats, read: dict[str, Floats]) -> Floats | None:
    """(3, 3) sum of the platform's rotations (n, 3, 3), each with its reading taken back."""
    angles = np.stack([read[angle] for angle in "abc"], axis=1)
    whole = np.isfinite(angles).all(axis=1)
    if not whole.any():
        return None
    product: Floats = np.einsum("nij,nkj->ik", rotations[whole], euler_to_matrix(angles[whole]))
    return product


def _are_off_a_line(points: Floats) -> bool:
    """Whether points fix a rotation: they are not on a line."""
    if len(points) < 3:
        return False
    singular = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(singular[1] > 1e-3 * singular[0])


def _trilaterate(frame: Frame, points: Floats, distances: Floats) -> list[Frame]:
    """Trilateration: differences of squared distances are linear in the centre.

    Points in a plane leave the centre's height over it, up to its sign: both are starts.
    """
    free = np.array(frame.unknown[_ORIGIN])
    known = np.isfinite(distances)
    points, distances = points[known], distances[known]
    middle = points.mean(axis=0)
    away = points - middle
    squares = (away**2).sum(axis=1) - distances**2
    _, singular, axes = np.linalg.svd(away[:, free], full_matrices=False)
    seen = singular > 1e-2 * singular.max(initial=0.0)
    centred = squares - squares.mean()
    local = np.linalg.lstsq(2.0 * away[:, free] @ axes[seen].T, centred, rcond=None)[0]
    within = np.zeros(3)
    within[free] = axes[seen].T @ local
    starts = [within]
    hidden = axes[~seen]
    if len(hidden) == 1:
        height2 = float(np.mean(distances**2 - ((away - within) ** 2).sum(axis=1)))
        height = np.sqrt(max(height2, 0.0))
        normal = np.zeros(3)
        normal[free] = hidden[0]
        starts = [within + height * normal, within - height * normal]
    frames = []
    for start in starts:
        origin = np.array(frame.origin)
        origin[free] = (middle + start)[free]
        frames.append(dataclasses.replace(frame, origin=tuple(origin.tolist())))
    return frames


def _direction_product(machine: Machine, measurements: Measurements) -> Floats | None:
    """(3, 3) sum of the directions that nominal struts have times those that a camera read."""
    centres = machine.kernel.joint_centres(measurements.joints, measurements.placements)
    along = centres[:, :, 1] - centres[:, :, 0]
    along /= np.linalg.norm(along, axis=2, keepdims=True)
    read: dict[tuple[int, int], dict[int, float]] = {}
    for observation in range(measurements.n_observation):
        axis = int(measurements.observable[observation]) - _NUMBER["direction.x"]
        key = int(measurements.row[observation]), int(measurements.strut[observation])
        if 0 <= axis < 3:
            read.setdefault(key, {})[axis] = float(measurements.value[observation])
    product = np.zeros((3, 3))
    count = 0
    for (row, strut), seen in read.items():
        if len(seen) == 3:
            product += np.outer(along[row, strut], [seen[0], seen[1], seen[2]])
            count += 1
    return product if count > 1 else None
