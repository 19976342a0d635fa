"""How far a drive of Klipper's goes for a step, and positions that are counted in steps.

rotation_distance / (full_steps_per_rotation * microsteps * gear_ratio), mm, with one turn instead
of rotation_distance for a drive that turns; full_steps_per_rotation is 200 where it is not given.
Before 2021-11-02 there was step_distance, which says it at once. Facts from Klipper's configuration
reference and its list of changes (https://www.klipper3d.org/Config_Changes.html).
"""

from __future__ import annotations

import math

import numpy as np

from truepose.arrays import Floats
from truepose.controllers.klipper.config import Entry
from truepose.controllers.klipper.numbers import STEPPERS, Numbers, finite

TURN = 2.0 * math.pi


def step_distances(numbers: Numbers, *, turning: bool, microsteps: float | None = None) -> Floats:
    """(3,) mm, or rad of drives that are `turning`; NaN where it cannot be said.

    `microsteps`: of another day, instead of those in the file.
    """
    return np.array([_step(numbers, section, turning, microsteps) for section in STEPPERS])


def _step(numbers: Numbers, section: str, turning: bool, microsteps: float | None) -> float:
    direct = numbers.config.get(section, "step_distance")
    if direct is not None:
        other = numbers.config.get(section, "rotation_distance")
        if other is not None:
            expected = "rotation_distance, which step_distance was before"
            message = "this and rotation_distance exclude each other"
            numbers.refuse(direct, section, "step_distance", "excluding-keys", message, expected)
            return math.nan
        if microsteps is None:
            return numbers.number(section, "step_distance", above=0.0, expected="mm or rad a step")
    distance = TURN
    if not turning:
        distance = numbers.number(
            section, "rotation_distance", above=0.0, expected="mm a turn of the motor"
        )
    a_turn = numbers.number(
        section, "full_steps_per_rotation", 200.0, above=0.0, expected="200, or 400"
    )
    if microsteps is None:
        microsteps = numbers.number(section, "microsteps", above=0.0, expected="16, or the like")
    return distance / (a_turn * microsteps * _gearing(numbers, section, needed=turning))


def _gearing(numbers: Numbers, section: str, *, needed: bool) -> float:
    """Turns of the motor for one of what it drives: `107:16, 60:16` is their product."""
    entry = numbers.config.get(section, "gear_ratio")
    if entry is None:
        if needed:
            numbers.missing(section, "gear_ratio", "107:16, or the like")
            return math.nan
        return 1.0
    ratio = 1.0
    for pair in entry.text.split(","):
        teeth = [finite(number.strip()) for number in pair.split(":")]
        if len(teeth) != 2 or not all(number and number > 0.0 for number in teeth):
            message = "this is no ratio of gears"
            expected = "two numbers above zero, 107:16, with commas between ratios"
            numbers.refuse(entry, section, "gear_ratio", "not-a-number", message, expected)
            return math.nan
        ratio *= float(teeth[0] or 1.0) / float(teeth[1] or 1.0)
    numbers.read[f"{section}.gear_ratio"] = entry.text
    return ratio


def counts(numbers: Numbers, section: str, name: str) -> tuple[Floats, Entry | None]:
    """(3,) steps from the endstops, as `delta_calibrate` has them, and where they stand."""
    entry = numbers.config.get(section, name)
    expected = "three numbers of steps with commas between them, of stepper_a, _b and _c"
    if entry is None:
        numbers.missing(section, name, expected)
        return np.full(3, np.nan), None
    steps = [finite(number.strip()) for number in entry.text.split(",")]
    if len(steps) != len(STEPPERS) or None in steps:
        message = "these are no positions of three drives"
        numbers.refuse(entry, section, name, "not-a-number", message, expected)
        return np.full(3, np.nan), None
    return np.array(steps, np.float64), entry


__all__ = ["counts", "step_distances"]
