"""Who says how much it expands: parts that have to say it, and parts that results leave out.

A part off the reference temperature grows. A strut that does not say by how much, and any part
whose temperature the condition names, is refused; any other part stays as it is drawn, and every
result says so: it is not included.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from truepose.arrays import Floats
from truepose.errors import Problem
from truepose.language import say
from truepose.machine.limbs import Limb
from truepose.machine.parts import Body, Drive, Guide, Strut, is_body

if TYPE_CHECKING:
    from truepose._kernel import Machine as KernelMachine
    from truepose.machine import Condition, Machine, SourceBuilder

ASKED_BY = ("condition.temperature", "condition.gradient", "condition.temperature_log")
"""Keys of a file that ask for thermal expansion."""

NO_MATERIAL = "no material"
"""Why a part is not included."""


def not_included(machine: Machine, condition: Condition) -> tuple[str, ...]:
    """Paths of the parts that are off the reference temperature and taken as rigid there.

    Nobody says how they expand: the frame, then the platform and the tool, the drives' screws,
    scales and arms, and the carriages. A part of which no point would move is not among them; nor
    is a tool on a platform that says it, for it is part of that; nor what measures a telescopic
    strut that says it, for the strut itself is the measure.
    """
    points = _Points(machine)
    struts = {strut.drive: strut for strut in machine.struts}
    platform = machine.platform

    def rigid(part: Body | Drive) -> bool:
        return part.expansion is None and _is_off(condition, part.part)

    names = [machine.frame.part] if rigid(machine.frame) else []
    if rigid(platform) and points.on_platform_away_from(platform.anchor):
        names.append(platform.part)
    if rigid(machine.tool) and platform.expansion is None and points.tool_is_held_elsewhere:
        names.append(machine.tool.part)
    for drive in machine.drives:
        if not rigid(drive):
            continue
        if drive.coordinate == "angle":
            counts = points.carried_off_axis(drive)
        else:
            counts = drive.carriage is not None or struts[drive.name].expansion is None
        if counts:
            names.append(drive.part)
    for drive in machine.drives:
        carriage = drive.carriage
        if carriage is not None and rigid(carriage) and points.carried_off_axis(drive):
            names.append(carriage.part)
    return tuple(names)


def not_included_text(machine: Machine, condition: Condition) -> str:
    """The same for people: `frame, drive.d1 (no material)`; empty where every part is in."""
    parts = not_included(machine, condition)
    return say("{parts} (no material)", parts=", ".join(parts)) if parts else ""


class _Points:
    """Whether bodies have points that growth would move."""

    def __init__(self, machine: Machine) -> None:
        self._machine = machine
        self._value = dict(zip(machine.parameters, machine.nominal.tolist(), strict=True))

    def on_platform_away_from(self, anchor: tuple[float, float, float]) -> bool:
        rows: tuple[Strut | Guide, ...] = (*self._machine.struts, *self._machine.guides)
        points = [f"{row.part}.platform" for row in rows]
        if any(self._value.get(f"{row.part}.ring_radius") for row in rows):
            return True
        return any(
            (self._at(point) != anchor).any()
            for point in (*points, "tool")
            if f"{point}.x" in self._value
        )

    @property
    def tool_is_held_elsewhere(self) -> bool:
        return bool((self._at("tool") != self._machine.tool.anchor).any())

    def carried_off_axis(self, drive: Drive) -> bool:
        """Whether base joints are away from the point that a carriage or an arm grows about."""
        carried = (strut for strut in self._machine.struts if strut.drive == drive.name)
        return any(self._at(f"{strut.part}.base").any() for strut in carried)

    def _at(self, point: str) -> Floats:
        return np.array([self._value[f"{point}.{axis}"] for axis in "xyz"])


def silent(
    condition: Condition,
    drives: Iterable[Drive],
    struts: Iterable[Strut],
    bodies: Iterable[Body],
) -> Iterator[Problem]:
    """Parts off the reference of which nobody says how they expand, and that have to.

    Every strut, and of the others those whose temperature the condition names: that a machine is
    warm does not yet say that its frame is to be looked at.
    """
    for strut in struts:
        if strut.expansion is None and _is_off(condition, strut.part):
            yield _no_expansion(strut.part, f"strut {strut.name}", "strut")
    named = condition.named_parts
    for drive in drives:
        if drive.expansion is None and drive.part in named and _is_off(condition, drive.part):
            measured = "the arm of " if drive.coordinate == "angle" else "what measures "
            yield _no_expansion(drive.part, f"{measured}drive {drive.name}", "screw, scale or arm")
    for body in bodies:
        if body.expansion is None and body.part in named and _is_off(condition, body.part):
            kind, _, of_drive = body.part.partition(".")
            what = f"the {kind} of drive {of_drive}" if of_drive else f"the {kind}"
            yield _no_expansion(body.part, what, kind)


def silent_limbs(condition: Condition, limbs: Iterable[Limb]) -> Iterator[Problem]:
    """Limbs that are warmer on one side, of whose beams nobody says how they expand."""
    for limb in limbs:
        unsaid = any(beam.expansion is None for beam in limb.beams)
        if unsaid and any(condition.gradient(limb.part)):
            yield Problem(
                code="no-expansion",
                message=f"limb {limb.name} is warmer on one side, but nothing says how much its "
                "beams expand",
                path=limb.part,
                found="a beam with neither expansion nor material",
                expected='expansion = "1.1e-5 1/K", or a material, of every beam of its chain',
                hint='a beam that does not expand has expansion = "0 1/K"',
            )


def located(parts: SourceBuilder, problem: Problem) -> Problem:
    """A part that the file does not describe is wrong where the condition names it."""
    part = str(problem.path)
    named = (f"condition.temperature.{part}", f"condition.gradient.{part}", ASKED_BY[2])
    stated = next((path for path in (part, *named) if parts.has(path)), part)
    return replace(problem, path=stated)


def twice(
    kernel: KernelMachine, drives: Iterable[Drive], struts: Iterable[Strut]
) -> Iterator[Problem]:
    """A telescopic strut whose length is measured by a scale grows by the scale or as a strut."""
    carried = {strut.drive: strut for strut in struts}
    for drive in drives:
        strut = carried.get(drive.name)
        sets_length = f"{drive.part}.origin.x" not in kernel.parameters
        if strut is not None and sets_length and drive.expansion and strut.expansion:
            yield Problem(
                code="excluding-keys",
                message=f"the length of strut {strut.name} would grow twice: with the strut, and "
                f"with what measures drive {drive.name}",
                path=f"{drive.part}.expansion",
                found="an expansion of the drive and one of the strut",
                expected="one of them",
                hint='expansion = "0 1/K" for the strut, where a scale along it measures its '
                "length; no expansion of the drive, where the strut itself is the measure",
            )


def _is_off(condition: Condition, part: str) -> bool:
    log = condition.temperature_log
    rise: float | Floats = condition.temperature_rise(part)
    if log is not None:
        rise = condition.temperature_rise(part, log.times)
    return bool(np.any(rise) or np.any(condition.gradient(part)))


def _no_expansion(part: str, what: str, word: str) -> Problem:
    table = "drive.carriage" if word == "carriage" else part
    return Problem(
        code="no-expansion",
        message=f"{what} is not at the reference temperature, but nothing says how much it expands",
        path=part,
        found="neither expansion nor material",
        expected='expansion = "1.1e-5 1/K", or a material'
        + (f", under [{table}]" if is_body(part) else ""),
        hint=f'a {word} that does not expand has expansion = "0 1/K"',
    )


__all__ = [
    "ASKED_BY",
    "NO_MATERIAL",
    "located",
    "not_included",
    "not_included_text",
    "silent",
    "silent_limbs",
    "twice",
]
