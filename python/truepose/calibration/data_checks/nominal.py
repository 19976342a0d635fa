"""What the instruments would read of the machine as its file has it, in closed form.

The commanded joints give the platform's pose (already solved in `Measurements.placements`) and the
joint centres; everything an instrument reads follows from those and from its frame and target:

    P = p + R t,  y = F^T (P - o),  A = F^T R

with the tool point p and rotation R of the platform, the target t in its axes, the frame's origin
o and rotation F (frame axes to base axes).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from truepose._kernel import Machine as KernelMachine
from truepose.arrays import Floats, Indices
from truepose.calibration.instruments._base import Frame, Instrument
from truepose.calibration.measurements import Measurements
from truepose.calibration.observables import OBSERVABLES, is_parameter
from truepose.machine import Machine
from truepose.spatial import matrix_to_euler, quaternion_to_matrix

X, A, DISTANCE, LENGTH, DIRECTION, ANGLE, SEPARATION = (
    OBSERVABLES.index(name)
    for name in ("x", "a", "distance", "length", "direction.x", "angle", "separation")
)


@dataclass(frozen=True, eq=False)
class Geometry:
    """Where platform and struts are, row by row, base frame.

    `points` (n, 3) tool point, m; `rotations` (n, 3, 3) platform axes to base axes; `centres`
    (n, n_strut, 2, 3) base-side and platform-side joint centres, m; `parameters` (n_parameter,).
    `others`: at the second poses of rows that are between two.
    """

    points: Floats
    rotations: Floats
    centres: Floats
    parameters: Floats
    others: Geometry | None = None

    @classmethod
    def of_rows(cls, kernel: KernelMachine, measurements: Measurements) -> Geometry:
        """Of measurements, at every row."""
        geometry = cls.of(kernel, measurements.joints, measurements.placements)
        if measurements.other_joints is None or measurements.other_placements is None:
            return geometry
        others = cls.of(kernel, measurements.other_joints, measurements.other_placements)
        return replace(geometry, others=others)

    @classmethod
    def of(cls, kernel: KernelMachine, joints: Floats, placements: Floats) -> Geometry:
        """Of joints (n, n_joint) and the placements (n, 7) that they lead to."""
        centres = kernel.joint_centres(joints, placements)
        rotations = quaternion_to_matrix(placements[:, 3:])
        return cls(placements[:, :3], rotations, centres, np.asarray(kernel.nominal))

    def rows(self, rows: Indices) -> Geometry:
        """These rows only."""
        others = None if self.others is None else self.others.rows(rows)
        return Geometry(
            self.points[rows], self.rotations[rows], self.centres[rows], self.parameters, others
        )

    def targets(self, target: Floats) -> Floats:
        """(n, 3) where a point of the platform is, given from the tool point in its axes."""
        points: Floats = self.points + self.rotations @ target
        return points


@dataclass(frozen=True, eq=False)
class Placement:
    """Where an instrument stands: frame `origin` (3,), m, `rotation` (3, 3), `target` (3,), m."""

    origin: Floats
    rotation: Floats
    target: Floats

    @classmethod
    def stated(cls, instrument: Instrument) -> Placement:
        """As the measurements declare it; where something is unknown, where its search starts."""
        frame: Frame = instrument.frame
        rotation = quaternion_to_matrix(frame.rotation)
        return cls(np.array(frame.origin), rotation, np.array(instrument.target))


def read(
    geometry: Geometry,
    instrument: Instrument,
    placement: Placement,
    row: Indices,
    observable: Indices,
    strut: Indices,
) -> Floats:
    """(k,) what one instrument reads: observation k is of row `row[k]` of the geometry; SI."""
    value: Floats = np.empty(row.size)
    turned = geometry.rotations
    from_origin = geometry.targets(placement.target) - placement.origin
    of_point = (observable < A) | (observable == DISTANCE)
    if of_point.any():
        seen = from_origin @ placement.rotation
        table = np.column_stack([seen, np.linalg.norm(seen, axis=1)])
        column = np.where(observable == DISTANCE, 3, observable)
        value[of_point] = table[row[of_point], column[of_point]]
    of_angle = (observable >= A) & (observable < DISTANCE)
    if of_angle.any():
        angles = matrix_to_euler(placement.rotation.T @ turned)
        value[of_angle] = angles[row[of_angle], observable[of_angle] - A]
    of_two = observable == SEPARATION
    if of_two.any():
        assert geometry.others is not None
        apart = geometry.others.targets(placement.target) - geometry.targets(placement.target)
        value[of_two] = np.linalg.norm(apart, axis=1)[row[of_two]]
    of_parameter = is_parameter(observable)
    value[of_parameter] = geometry.parameters[strut[of_parameter]]
    of_strut = (observable >= LENGTH) & (observable <= ANGLE)
    if of_strut.any():
        value[of_strut] = _of_struts(
            geometry, instrument, placement, row[of_strut], observable[of_strut], strut[of_strut]
        )
    return value


def _of_struts(
    geometry: Geometry,
    instrument: Instrument,
    placement: Placement,
    row: Indices,
    observable: Indices,
    strut: Indices,
) -> Floats:
    ends = geometry.centres[row, strut]
    along = ends[:, 1] - ends[:, 0]
    length = np.linalg.norm(along, axis=1)
    value: Floats = length.copy()
    direction = along / length[:, np.newaxis]
    framed = direction @ placement.rotation
    of_direction = (observable >= DIRECTION) & (observable < ANGLE)
    value[of_direction] = framed[of_direction, observable[of_direction] - DIRECTION]
    of_turn = observable == ANGLE
    if of_turn.any():
        # Seen from the platform, a direction turns back with it: R^T d.
        own = np.einsum("kji,kj->ki", geometry.rotations[row], direction)
        seen = (own if instrument.end == "platform" else framed)[of_turn]
        zero = np.array(instrument.zero)
        across = np.cross(np.array(instrument.axis), zero)
        value[of_turn] = np.arctan2(seen @ across, seen @ zero)
    return value


def nominal_readings(
    machine: Machine,
    measurements: Measurements,
    placements: Sequence[Placement] | None = None,
    geometry: Geometry | None = None,
) -> Floats:
    """(n_observation,) what the instruments read of the nominal machine, SI, at the joints given.

    Each instrument stands where it is stated to, or as in `placements`; what is unknown of it
    counts as its start. Biases count as zero. Raises nothing: a row that is not placed gives NaN.
    """
    if geometry is None:
        geometry = Geometry.of_rows(machine.kernel, measurements)
    value = np.empty(measurements.n_observation)
    instrument_of = measurements.instrument[measurements.row]
    for index, instrument in enumerate(measurements.instruments):
        own = np.flatnonzero(instrument_of == index)
        placement = Placement.stated(instrument) if placements is None else placements[index]
        value[own] = read(
            geometry,
            instrument,
            placement,
            measurements.row[own],
            measurements.observable[own],
            measurements.strut[own],
        )
    return value
