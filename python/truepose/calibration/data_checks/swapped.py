"""Columns in each other's place: x for y, one strut for another, one joint for another."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations, permutations

from truepose.calibration.data_checks._base import (
    Hypothesis,
    HypothesisKind,
    MeasuredColumn,
    View,
    listed,
)

FAMILIES = (("x", "y", "z"), ("a", "b", "c"))
"""Columns whose exchange is no wonder; those of struts go by what they measure."""


def propose(view: View) -> Iterator[Hypothesis]:
    """Measured columns of one family in another order; two joints; two commanded freedoms."""
    for family in FAMILIES:
        yield from _reordered(view, [c for c in view.columns if c.name in family])
    of_strut: dict[int, list[MeasuredColumn]] = {}
    for column in view.columns:
        if column.strut >= 0:
            of_strut.setdefault(column.strut, []).append(column)
    for one, other in combinations(of_strut.values(), 2):
        if [c.observable for c in one] == [c.observable for c in other]:
            count = len(one)
            order = [*range(count, 2 * count), *range(count)]
            yield from _exchanged(view, [*one, *other], order)
    if not view.readings_only:
        yield from _joints(view)
        yield from _commands(view)


def _reordered(view: View, columns: Sequence[MeasuredColumn]) -> Iterator[Hypothesis]:
    for order in permutations(range(len(columns))):
        if order != tuple(range(len(columns))):
            yield from _exchanged(view, columns, order)


def _exchanged(
    view: View, columns: Sequence[MeasuredColumn], order: Sequence[int]
) -> Iterator[Hypothesis]:
    pairs = [(a, columns[order[k]]) for k, a in enumerate(columns) if order[k] != k]
    if len({column.observations.size for pair in pairs for column in pair}) != 1:
        return
    value = view.readings.value.copy()
    for into, out in pairs:
        target, source = view.by_row([into, out]).T
        value[target] = view.readings.value[source]
    names = tuple(column.name for column, _ in pairs)
    words = f"the readings {listed(names)} stand in each other's place"
    yield Hypothesis(words, names, view.suppose(value))


def _joints(view: View) -> Iterator[Hypothesis]:
    names = view.machine.joints
    for i, j in combinations(range(len(names)), 2):
        joints = view.own.joints.copy()
        joints[:, [i, j]] = joints[:, [j, i]]
        where = (f"joint.{names[i]}", f"joint.{names[j]}")
        words = f"the joints {names[i]} and {names[j]} stand in each other's place"
        yield from view.other_command(view.at_joints(joints), words, where)


def _commands(view: View) -> Iterator[Hypothesis]:
    freedoms = view.machine.commanded
    for i, j in combinations(range(len(freedoms)), 2):
        if (freedoms[i] in "xyz") != (freedoms[j] in "xyz"):
            continue
        poses = view.poses.copy()
        poses[:, [i, j]] = poses[:, [j, i]]
        where = (f"command.{freedoms[i]}", f"command.{freedoms[j]}")
        words = f"the commands {freedoms[i]} and {freedoms[j]} stand in each other's place"
        yield from view.other_command(view.at_poses(poses), words, where)


KIND = HypothesisKind(
    "swapped-columns",
    "two or three columns stand in each other's place",
    propose,
    of_readings="columns",
)
