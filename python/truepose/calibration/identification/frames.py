"""Where an instrument stands, to begin with: closed forms on the nominal machine.

The search for an unknown frame is not linear in its rotation, so it starts from the rigid motion
that fits the nominal points best (B. K. P. Horn, Closed-form solution of absolute orientation using
unit quaternions, J. Opt. Soc. Am. A 4 (1987) 629-642), and from trilateration for distances.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from truepose.calibration.instruments._base import Frame, Instrument
from truepose.calibration.measurements import Measurements
from truepose.calibration.observables import OBSERVABLES
from truepose.machine import Machine
from truepose.sources._base import Floats
from truepose.sources._block import rotations_of

_NUMBER = {name: number for number, name in enumerate(OBSERVABLES)}
_ORIGIN, _ROTATION = slice(0, 3), slice(3, 6)


def with_frames_found(machine: Machine, measurements: Measurements) -> list[Measurements]:
    """The measurements with unknown frames set to where the nominal machine says they are.

    Usually one; where distances leave two sides of a plane open, one for each. Frames that are
    known in part, or of which too little was measured, start where they are declared.
    """
    found = [measurements]
    for number, instrument in enumerate(measurements.instruments):
        starts = _starts(machine, measurements, number, instrument)
        found = [_replaced(each, number, start) for each in found for start in starts]
    return found


def _replaced(measurements: Measurements, number: int, frame: Frame) -> Measurements:
    instruments = list(measurements.instruments)
    instruments[number] = dataclasses.replace(instruments[number], frame=frame)
    return dataclasses.replace(measurements, instruments=tuple(instruments))


def _starts(
    machine: Machine, measurements: Measurements, number: int, instrument: Instrument
) -> list[Frame]:
    frame = instrument.frame
    unknown = np.array(frame.unknown)
    if not unknown.any():
        return [frame]
    read = _table(measurements, number)
    rows = np.flatnonzero(measurements.instrument == number)
    rotations = rotations_of(measurements.placements[rows])
    points = measurements.placements[rows, :3] + rotations @ np.array(instrument.target)
    if "distance" in read and unknown[_ORIGIN].any():
        return _by_distances(frame, points, read["distance"])
    if all(axis in read for axis in "xyz"):
        whole = np.asarray(np.isfinite([read[axis] for axis in "xyz"]).all(axis=0))
        seen = np.stack([read[axis] for axis in "xyz"], axis=1)[whole]
        return [_by_points(frame, points[whole], seen, rotations[whole], read, whole)]
    if any(f"direction.{axis}" in read for axis in "xyz"):
        return [_by_directions(machine, measurements, number, frame)]
    return [frame]


def _table(measurements: Measurements, number: int) -> dict[str, Floats]:
    """What an instrument read of the platform by row, NaN where it did not; by observable."""
    mine = measurements.instrument[measurements.row] == number
    rows = np.flatnonzero(measurements.instrument == number)
    place = np.searchsorted(rows, measurements.row[mine])
    table: dict[str, Floats] = {}
    for what in np.unique(measurements.observable[mine]).tolist():
        chosen = measurements.observable[mine] == what
        values = np.full(rows.size, np.nan)
        values[place[chosen]] = measurements.value[mine][chosen]
        table[OBSERVABLES[what]] = values
    return table


def _by_points(
    frame: Frame,
    points: Floats,
    seen: Floats,
    rotations: Floats,
    read: dict[str, Floats],
    whole: np.ndarray,
) -> Frame:
    """Points (n, 3) in the base frame, read as `seen` (n, 3) in the instrument's."""
    rotation = rotation_matrix(frame.rotation)
    if all(frame.unknown[_ROTATION]):
        if all(angle in read for angle in "abc"):
            angles = np.stack([read[angle] for angle in "abc"], axis=1)[whole]
            measured = euler_matrices(angles)
            rotation = nearest_rotation(np.einsum("nij,nkj->ik", rotations, measured))
        elif _spread_out(seen):
            left, right = points - points.mean(axis=0), seen - seen.mean(axis=0)
            rotation = nearest_rotation(left.T @ right)
    origin = np.array(frame.origin)
    free = np.array(frame.unknown[_ORIGIN])
    origin[free] = (points - seen @ rotation.T).mean(axis=0)[free]
    return dataclasses.replace(
        frame, origin=tuple(origin.tolist()), rotation=quaternion_of(rotation)
    )


def _spread_out(points: Floats) -> bool:
    """Whether points fix a rotation: they are not on a line."""
    if len(points) < 3:
        return False
    singular = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(singular[1] > 1e-3 * singular[0])


def _by_distances(frame: Frame, points: Floats, distances: Floats) -> list[Frame]:
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


def _by_directions(
    machine: Machine, measurements: Measurements, number: int, frame: Frame
) -> Frame:
    """A camera's rotation, from the directions that nominal struts have."""
    mine = np.flatnonzero(measurements.instrument[measurements.row] == number)
    centres = machine.kernel.joint_centres(measurements.joints, measurements.placements)
    along = centres[:, :, 1] - centres[:, :, 0]
    along /= np.linalg.norm(along, axis=2, keepdims=True)
    read: dict[tuple[int, int], dict[int, float]] = {}
    for at in mine.tolist():
        what = int(measurements.observable[at]) - _NUMBER["direction.x"]
        key = int(measurements.row[at]), int(measurements.strut[at])
        if 0 <= what < 3:
            read.setdefault(key, {})[what] = float(measurements.value[at])
    product = np.zeros((3, 3))
    count = 0
    for (row, strut), seen in read.items():
        if len(seen) == 3:
            product += np.outer(along[row, strut], [seen[0], seen[1], seen[2]])
            count += 1
    if count < 2 or not all(frame.unknown[_ROTATION]):
        return frame
    return dataclasses.replace(frame, rotation=quaternion_of(nearest_rotation(product)))


def nearest_rotation(product: Floats) -> Floats:
    """(3, 3) the rotation R for which trace(R^T product) is largest."""
    left, _, right = np.linalg.svd(product)
    sign = np.sign(np.linalg.det(left @ right))
    rotation: Floats = left @ np.diag([1.0, 1.0, sign]) @ right
    return rotation


def euler_matrices(angles: Floats) -> Floats:
    """(n, 3, 3) of angles a, b, c (n, 3), rad: R = Rz(c) Ry(b) Rx(a)."""
    (sa, sb, sc), (ca, cb, cc) = np.sin(angles).T, np.cos(angles).T
    rows = [
        [cb * cc, sa * sb * cc - ca * sc, ca * sb * cc + sa * sc],
        [cb * sc, sa * sb * sc + ca * cc, ca * sb * sc - sa * cc],
        [-sb, sa * cb, ca * cb],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def rotation_matrix(quaternion: tuple[float, float, float, float]) -> Floats:
    """(3, 3) of a unit quaternion w x y z."""
    placement = np.array([[0.0, 0.0, 0.0, *quaternion]])
    matrix: Floats = rotations_of(placement)[0]
    return matrix


def quaternion_of(rotation: Floats) -> tuple[float, float, float, float]:
    """Unit quaternion w x y z, w >= 0, of a rotation (3, 3)."""
    m = rotation
    # 4 times each squared component; the largest is safe to divide by (S. W. Shepperd, 1978).
    squares = np.array(
        [
            1.0 + m[0, 0] + m[1, 1] + m[2, 2],
            1.0 + m[0, 0] - m[1, 1] - m[2, 2],
            1.0 - m[0, 0] + m[1, 1] - m[2, 2],
            1.0 - m[0, 0] - m[1, 1] + m[2, 2],
        ]
    )
    skew = (m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1])
    even = (m[0, 1] + m[1, 0], m[0, 2] + m[2, 0], m[1, 2] + m[2, 1])
    rows = [
        [squares[0], skew[0], skew[1], skew[2]],
        [skew[0], squares[1], even[0], even[1]],
        [skew[1], even[0], squares[2], even[2]],
        [skew[2], even[1], even[2], squares[3]],
    ]
    row = np.array(rows[int(np.argmax(squares))])
    row /= np.linalg.norm(row)
    if row[0] < 0.0:
        row = -row
    w, x, y, z = row.tolist()
    return (w, x, y, z)
