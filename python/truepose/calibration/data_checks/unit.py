"""A wrong unit: lengths by a power of ten or by the inch, angles in degrees for radians."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.calibration.data_checks._base import (
    Hypothesis,
    HypothesisKind,
    MeasuredColumn,
    View,
    listed,
)

LENGTHS = ((10.0, "10"), (25.4, "25.4, the inch"), (100.0, "100"), (1000.0, "1000"))
ANGLES = ((180.0 / math.pi, "180/pi"),)


def propose_length(view: View) -> Iterator[Hypothesis]:
    """All lengths, or one column, too large or too small by a factor; so the commands."""
    yield from _measured(view, [c for c in view.columns if c.unit == "m"], LENGTHS)
    if not view.readings_only:
        yield from _commanded(view, "m", LENGTHS)


def propose_angle(view: View) -> Iterator[Hypothesis]:
    """Degrees declared as radians, or radians as degrees, in angles read or commanded."""
    yield from _measured(view, [c for c in view.columns if c.unit == "rad"], ANGLES)
    if not view.readings_only:
        yield from _commanded(view, "rad", ANGLES)


def _factors(factors: Sequence[tuple[float, str]]) -> Iterator[tuple[float, str]]:
    for factor, word in factors:
        yield factor, f"too large by a factor {word}"
        yield 1.0 / factor, f"too small by a factor {word}"


def _measured(
    view: View, columns: Sequence[MeasuredColumn], factors: Sequence[tuple[float, str]]
) -> Iterator[Hypothesis]:
    if not columns:
        return
    sets = [columns, *([column] for column in columns if len(columns) > 1)]
    for chosen in sets:
        names = tuple(column.name for column in chosen)
        observations = np.concatenate([column.observations for column in chosen])
        for factor, word in _factors(factors):
            value = view.readings.value.copy()
            if factor > 1.0 and chosen[0].unit == "rad":
                value[observations] = _unwrapped(view, observations, factor)
            value[observations] /= factor
            uncertainty = view.own.uncertainty.copy()
            uncertainty[observations] /= factor
            are = "are" if len(names) > 1 else "is"
            yield Hypothesis(
                f"{listed(names)} {are} {word}",
                names,
                view.suppose(value, uncertainty=uncertainty),
                partial=len(chosen) < len(columns),
            )


def _unwrapped(view: View, observations: Indices, factor: float) -> Floats:
    """Angles that were read a factor too large: how many turns were taken off them is not known.

    The number of turns that comes nearest to what is expected is put back.
    """
    value = view.readings.value[observations]
    expected = value - view.as_given.residual[observations]
    turns = np.round((factor * expected - value) / (2.0 * math.pi))
    unwrapped: Floats = value + 2.0 * math.pi * turns
    return unwrapped


def _commanded(view: View, unit: str, factors: Sequence[tuple[float, str]]) -> Iterator[Hypothesis]:
    machine, joints = view.machine, view.own.joints
    parameters = machine.parameters
    # A drive's coordinate has the unit of its offset.
    of_unit = [
        k
        for k, name in enumerate(machine.joints)
        if machine.units[parameters.index(f"drive.{name}.offset")] == unit
    ]
    freedoms = [k for k, name in enumerate(machine.commanded) if (name in "xyz") == (unit == "m")]
    for factor, word in _factors(factors):
        if of_unit:
            scaled = joints.copy()
            scaled[:, of_unit] /= factor
            where = tuple(f"joint.{machine.joints[k]}" for k in of_unit)
            commanded = view.at_joints(scaled)
            yield from view.other_command(commanded, f"the joints are {word}", where)
        if freedoms:
            poses = view.poses.copy()
            poses[:, freedoms] /= factor
            names = [machine.commanded[k] for k in freedoms]
            where = tuple(f"command.{name}" for name in names)
            words = f"the commands {listed(names)} are {word}"
            yield from view.other_command(view.at_poses(poses), words, where)


LENGTH = HypothesisKind(
    "wrong-unit", "lengths in another unit than declared", propose_length, of_readings="numbers"
)
ANGLE = HypothesisKind(
    "degrees-radians", "degrees for radians, or the reverse", propose_angle, of_readings="numbers"
)
