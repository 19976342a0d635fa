"""Measurements made for tests: any kind of instrument, at any poses, of what a machine would show.

What a nominal machine shows is worked out here in plain NumPy from its placements and joint
centres, by other formulas than the kernel's.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from truepose.calibration.instruments import REGISTRY, Frame, Instrument
from truepose.calibration.instruments._base import KNOWN
from truepose.calibration.measurements import Measurements
from truepose.calibration.observables import (
    OBSERVABLES,
    OF_PARAMETERS,
    OF_STRUTS,
    UNITS,
    is_parameter,
)
from truepose.machine import Condition, Machine
from truepose.sources.tolerance import bands_of

Floats = NDArray[np.float64]

UNCERTAINTY = {"m": 10e-6, "rad": 20e-6, "1": 20e-6}
"""Standard uncertainty of readings where a test states none, by unit."""


def made_measurements(
    machine: Machine,
    kind: str,
    poses: ArrayLike,
    *,
    name: str = "made",
    frame: Frame | str = "base",
    observables: Sequence[str] | None = None,
    struts: Sequence[int] | None = None,
    uncertainty: float | None = None,
    condition: Condition | Sequence[Condition] | None = None,
    held_out: ArrayLike | None = None,
    values: str = "zero",
    target: tuple[float, float, float] = (0.0, 0.0, 0.0),
    target_unknown: bool = False,
    bias_unknown: bool = False,
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0),
    zero: tuple[float, float, float] = (1.0, 0.0, 0.0),
    end: str = "base",
) -> Measurements:
    """Measurements of one instrument at commanded poses (n, n_commanded), SI.

    `frame`: "base", "unknown" (at the base, with what the kind says to be found) or a `Frame`.
    `observables`: default all that the kind reads of this machine; `struts`: default all; of
    parameters, which of these, default those with a tolerance. Each row has all of them.
    `values`: "zero", or "nominal": what the machine as filed shows.
    """
    given = np.atleast_2d(np.asarray(poses, np.float64))
    of_kind = REGISTRY[kind]
    if not of_kind.poses:
        columns = [machine.dof.index(name) for name in machine.commanded]
        given = np.tile(machine.home[columns], (len(given), 1))
    joints, placements, status = machine.kernel.place(given)
    assert not status.any(), "a pose that the machine cannot be commanded to"
    read = tuple(observables or of_kind.observed(machine.components))
    if isinstance(frame, str):
        rule = of_kind.frame if frame == "unknown" else None
        frame = Frame(unknown=KNOWN if rule is None else rule(read, machine.components))
    by_observable = {
        each: UNCERTAINTY[UNITS[OBSERVABLES.index(each)]] if uncertainty is None else uncertainty
        for each in read
    }
    instrument = Instrument(
        name, kind, frame, target, target_unknown, bias_unknown, by_observable, axis, zero, end
    )
    of_struts = range(len(machine.struts)) if struts is None else struts
    one = [
        (OBSERVABLES.index(each), strut)
        for strut in (of_struts if of_kind.of_struts else [-1])
        for each in read
    ]
    if not of_kind.poses:
        bands = bands_of(machine)
        toleranced = () if bands is None else np.unique(bands.parameters).tolist()
        one = [
            (OBSERVABLES.index(OF_PARAMETERS[machine.units[number]]), number)
            for number in (toleranced if struts is None else struts)
        ]
        one.sort(key=lambda each: each[::-1])
    assert all((each in OF_STRUTS) == of_kind.of_struts for each in read)
    n = len(given)
    second: dict[str, Floats] = {}
    if of_kind.poses == 2:  # each pose to the one before
        assert n > 1
        second["other_joints"] = np.roll(joints, 1, axis=0)
        second["other_placements"] = np.roll(placements, 1, axis=0)
    conditions: tuple[Condition, ...]
    if condition is None or isinstance(condition, Condition):
        conditions = (reference_condition(machine) if condition is None else condition,) * n
    else:
        conditions = tuple(condition)
    measurements = Measurements(
        instruments=(instrument,),
        joints=joints,
        placements=placements,
        instrument=np.zeros(n, np.intp),
        conditions=conditions,
        held_out=np.zeros(n, np.bool_) if held_out is None else np.asarray(held_out, np.bool_),
        row=np.repeat(np.arange(n), len(one)).astype(np.intp),
        observable=np.tile([each for each, _ in one], n).astype(np.intp),
        strut=np.tile([strut for _, strut in one], n).astype(np.intp),
        value=np.zeros(n * len(one)),
        uncertainty=np.tile([by_observable[OBSERVABLES[each]] for each, _ in one], n),
        lines=np.zeros(n, np.intp),
        **second,
    )
    if values == "nominal":
        return measurements.with_values(nominal_values(machine, measurements))
    return measurements


def reference_condition(machine: Machine) -> Condition:
    """The machine's condition as it is where a row says nothing: cold, and nothing on the tool."""
    given = machine.condition
    return Condition(
        reference_temperature=given.reference_temperature,
        default_temperature=given.reference_temperature,
        gravity=given.gravity,
        acceleration=given.acceleration,
    )


def poses_within(machine: Machine, count: int, seed: int = 0, share: float = 0.8) -> Floats:
    """(count, n_commanded) poses that the machine can be commanded to, inside its workspace."""
    given = machine.poses()
    low, high = given.min(axis=0), given.max(axis=0)
    middle, half = 0.5 * (low + high), 0.5 * share * (high - low)
    random = np.random.default_rng(seed)
    found = np.empty((0, len(low)))
    for _ in range(100):
        drawn = middle + half * random.uniform(-1.0, 1.0, (4 * count, len(low)))
        _, _, status = machine.kernel.place(drawn)
        found = np.concatenate([found, drawn[status == 0]])
        if len(found) >= count:
            return found[:count]
    raise AssertionError("the machine's workspace has too few poses")


def rotation_matrix(quaternion: ArrayLike) -> Floats:
    """(..., 3, 3) of quaternions w x y z (..., 4)."""
    w, x, y, z = np.moveaxis(np.asarray(quaternion, np.float64), -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def nominal_values(machine: Machine, measurements: Measurements) -> Floats:
    """(n_observation,) what the machine as filed shows, cold and without loads, SI; no biases."""
    placements = measurements.placements
    turned = rotation_matrix(placements[:, 3:])
    centres = machine.kernel.joint_centres(measurements.joints, placements)
    along = centres[:, :, 1] - centres[:, :, 0]
    lengths = np.linalg.norm(along, axis=-1)
    values = np.empty(measurements.n_observation)
    for at in range(measurements.n_observation):
        row, strut = int(measurements.row[at]), int(measurements.strut[at])
        name = OBSERVABLES[measurements.observable[at]]
        instrument = measurements.instruments[measurements.instrument[row]]
        frame = rotation_matrix(instrument.frame.rotation)
        point = placements[row, :3] + turned[row] @ np.array(instrument.target)
        seen = frame.T @ (point - np.array(instrument.frame.origin))
        if name == "separation":
            assert measurements.other_placements is not None
            other = measurements.other_placements[row]
            arm = np.array(instrument.target)
            far = other[:3] + rotation_matrix(other[3:]) @ arm
            values[at] = np.linalg.norm(far - point)
        elif is_parameter(measurements.observable[at]):
            values[at] = machine.nominal[strut]
        elif name in "xyz":
            values[at] = seen["xyz".index(name)]
        elif name in "abc":
            values[at] = _angles(frame.T @ turned[row])["abc".index(name)]
        elif name == "distance":
            values[at] = np.linalg.norm(seen)
        elif name == "length":
            values[at] = lengths[row, strut]
        else:
            unit = along[row, strut] / lengths[row, strut]
            axes = turned[row] if instrument.end == "platform" and name == "angle" else frame
            direction = axes.T @ unit
            if name == "angle":
                zero = np.array(instrument.zero)
                across = np.cross(instrument.axis, zero)
                values[at] = np.arctan2(direction @ across, direction @ zero)
            else:
                values[at] = direction["xyz".index(name[-1])]
    return values


def _angles(rotation: Floats) -> Floats:
    """a b c of R = Rz(c) Ry(b) Rx(a)."""
    return np.array(
        [
            np.arctan2(rotation[2, 1], rotation[2, 2]),
            np.arcsin(-np.clip(rotation[2, 0], -1.0, 1.0)),
            np.arctan2(rotation[1, 0], rotation[0, 0]),
        ]
    )
