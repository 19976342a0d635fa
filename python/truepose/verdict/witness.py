"""A witness: one machine inside the set, at one pose, solved exactly.

    actual parameters = nominal + shift + sum over columns of half_width t[variable]

with one value t of every variable. What is told of it, to people and to programs: which parameter
stands at which end, from where the force of unknown direction comes, at which pose.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.files.dimensions import BY_UNIT, FREEDOMS
from truepose.files.shown_units import Shown
from truepose.language import marked, say
from truepose.machine import Machine
from truepose.representation import Represented
from truepose.runs.displacement import ParameterDeviation
from truepose.runs.first_order import first_order
from truepose.runs.poses import pose_in_words
from truepose.runs.quantities import quantities
from truepose.runs.variables import Variables
from truepose.sources import PoseBlock, acting
from truepose.spatial import rotate_quaternions
from truepose.verdict.states import AFTER, BEFORE

NAMED = 4
"""Causes that are named; more are counted."""

COARSE = 10.0
"""Of the least length that is a dimension: a deviation said as one, 400 mm and not 400000 µm."""

AT_END = 1e-9
"""Of a variable's interval: how near to an end it stands at the end."""


@dataclass(frozen=True)
class Cause:
    """One variable of a witness, or the force of unknown direction.

    `parameter`: of the family what the variable is, else the first that it moves, `more` how many
    others move with it; `end` is "upper" or
    "lower" where that parameter stands at an end of its band, else empty; `deviation` of that
    parameter by its source, `unit` m, rad or 1. `sigmas`: of a distribution that has no end, the
    standard deviations at which the variable stands, else 0. `share`: of the witness's size, to
    first order; nan where no error is known. `force` (3,) N, base axes, and no parameter, of a
    force of unknown direction.
    """

    source: str
    parameter: str
    more: int
    end: str
    deviation: float
    unit: str
    sigmas: float
    share: float
    force: tuple[float, float, float] | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Witness(Represented):
    """One machine inside the set at one pose, in a state: `BEFORE` or `AFTER` compensation.

    `machine` is the nominal one in the condition of the run; `pose` (n_commanded,), m or rad, and
    its `number` in the run; `joints` (n_joint,) as commanded there; `spread` the variables at this
    pose alone (`Variables.at`) and `t` (n_variable,) their values. `error` (n_component,), m
    and rad, is exact, its part `quantity` ("position" or "orientation") of length `size`. Of a
    machine that cannot be assembled `error` is None, `size` is inf and `status` the kernel's
    word for why; it is not `commanded` where the machine at its shifts cannot follow the
    command.
    """

    state: str
    quantity: str
    machine: Machine
    pose: Floats
    number: int
    joints: Floats
    spread: Variables
    t: Floats
    error: Floats | None
    size: float
    status: str = "ok"
    commanded: bool = True

    @property
    def moved(self) -> ParameterDeviation:
        """Parameters (k,), each once, and their deviations (1, k) from nominal."""
        return self.spread.parameters_moved(np.asarray(self.t, np.float64)[np.newaxis])

    @property
    def components(self) -> Indices:
        """Numbers of the error's components that the quantity has."""
        return quantities(self.machine.components)[self.quantity]

    @cached_property
    def by_source(self) -> Mapping[str, Floats]:
        """(n_parameter,) deviation from each source alone; their sum is all of it."""
        names = [source.name for source in acting(self.machine, self.machine.condition)]
        by_source = {name: np.zeros(len(self.machine.parameters)) for name in names}
        for name, (parameters, shift) in zip(names, self.spread.alone, strict=True):
            np.add.at(by_source[name], parameters, shift[0])
        variables = self.spread
        deviations = variables.half_width[0] * self.t[variables.variable_of]
        for column, variable in enumerate(variables.variable_of):
            by_source[variables.sources[variable]][variables.columns[column]] += deviations[column]
        return by_source

    @property
    def force(self) -> Floats | None:
        """(3,) N, base axes, of the force of unknown direction; None where there is none."""
        envelope = self.machine.condition.envelope
        if envelope is None or not self.spread.directions:
            return None
        (members,) = self.spread.directions
        return np.asarray(envelope.force * (self.t[members] @ envelope.directions))

    @cached_property
    def block(self) -> PoseBlock:
        """The pose as sources see it, with the joints commanded."""
        machine = self.machine
        pose = np.asarray(self.pose, np.float64)[np.newaxis]
        _, placements, _ = machine.kernel.place(pose)
        joints = np.asarray(self.joints, np.float64)[np.newaxis]
        first = np.zeros(1, np.intp)
        return PoseBlock(machine, machine.condition, pose, first, joints, placements)

    @cached_property
    def joint_centres(self) -> Floats | None:
        """(n_strut, 2, 3) where this machine's joint centres are, base side first, base frame, m.

        None of a machine that cannot be assembled.
        """
        if self.error is None:
            return None
        machine = self.machine
        columns, values = self.moved
        actual = machine.kernel.replace(
            {
                machine.parameters[column]: float(machine.nominal[column] + value)
                for column, value in zip(columns.tolist(), values[0].tolist(), strict=True)
            }
        )
        placement = self.block.placements.copy()
        placement[:, :3] += in_space(machine.components, self.error, "xyz")
        turned = in_space(machine.components, self.error, ("rx", "ry", "rz"))
        placement[:, 3:] = rotate_quaternions(placement[:, 3:], turned[np.newaxis])
        joints = np.asarray(self.joints, np.float64)[np.newaxis]
        return np.asarray(actual.joint_centres(joints, placement)[0])

    @cached_property
    def _parts(self) -> Floats:
        """(n_variable,) what each variable adds to the size, to first order.

        Of a machine that cannot be assembled the length of what it moves the tool by.
        """
        _, effects, _ = first_order(self.machine, self.block, self.spread)
        along = np.nan_to_num(effects[0][self.components]) * self.t
        if self.error is None or not self.size > 0.0:
            return np.asarray(np.sqrt(np.square(along).sum(axis=0)))
        return np.asarray(self.error[self.components] / self.size @ along)

    def causes(self) -> list[Cause]:
        """Every variable, the one with the largest part in the error first."""
        known = self.error is not None and self.size > 0.0
        directed = [int(v) for members in self.spread.directions for v in members]
        shares = self._parts / self.size if known else np.full(len(self._parts), math.nan)
        causes = [
            (float(abs(self._parts[v])), self._cause(v, float(shares[v])))
            for v in range(len(self.spread.names))
            if v not in directed
        ]
        force = self.force
        if force is not None:
            # Components are orthogonal; to first order their parts add up with their signs.
            part = float(self._parts[directed].sum())
            share = part / self.size if known else math.nan
            x, y, z = force.tolist()
            causes.append((abs(part), Cause("loads", "", 0, "", 0.0, "N", 0.0, share, (x, y, z))))
        return [cause for _, cause in sorted(causes, key=lambda ranked: -ranked[0])]

    def _cause(self, variable: int, share: float) -> Cause:
        variables, machine = self.spread, self.machine
        columns = np.flatnonzero(variables.variable_of == variable)
        source, half_width = variables.sources[variable], float(variables.half_width[0, columns[0]])
        parameter = int(variables.columns[columns[0]])
        value = float(self.t[variable])
        same = [
            column
            for column in np.flatnonzero(variables.columns == parameter)
            if variables.sources[variables.variable_of[column]] == source
        ]
        # Where a source has several bands on a parameter its middle is none of theirs alone.
        deviation = half_width * value
        if len(same) == 1:
            deviation = float(self.by_source[source][parameter])
        distribution = variables.distributions[variable]
        lower, upper = (
            float(variables.domain.lower[variable]),
            float(variables.domain.upper[variable]),
        )
        room = AT_END * (upper - lower)
        end = 1.0 if value >= upper - room else -1.0 if value <= lower + room else 0.0
        name, unit = machine.parameters[parameter], machine.units[parameter]
        more = len({int(variables.columns[column]) for column in columns}) - 1
        family = machine.family
        if family is not None and variables.names[variable] in family.names:
            # The owner's word for it, and its own deviation, of which all others are the effect.
            moved, name = name, variables.names[variable]
            slope, more, unit = family.effects(name)[moved], 0, family.unit(name)
            half_width, deviation = half_width / slope, half_width * value / slope
        end *= math.copysign(1.0, half_width)
        return Cause(
            source,
            name,
            more,
            {1.0: "upper", -1.0: "lower"}.get(end, ""),
            deviation,
            unit,
            0.0 if distribution.bounded else value * math.copysign(distribution.sigmas, half_width),
            share,
        )

    def words(self, most: int = NAMED) -> list[str]:
        """For people: the pose, then the causes, the most important first.

        More than `most` are counted. In the units in which the machine's file is answered.
        """
        causes = self.causes()
        pose = pose_in_words(self.machine, self.pose)
        if self.state == BEFORE:
            lines = [say("before compensation, at {pose}", pose=pose)]
        else:
            lines = [say("after compensation, at {pose}", pose=pose)]
        lines += [self._said(cause) for cause in causes[:most]]
        if len(causes) > most:
            lines.append(say("and {count} more", count=len(causes) - most))
        return lines

    def _said(self, cause: Cause) -> str:
        shown = self.machine.shown
        if cause.force is not None:
            size = math.hypot(*cause.force)
            unit = [component / size if size else 0.0 for component in cause.force]
            direction = ", ".join(marked(f"{component + 0.0:.3f}") for component in unit)
            return say(
                "force of {force} along ({direction})",
                force=shown.force.text(size),
                direction=direction,
            )
        small: Shown = shown.small(cause.unit)
        if cause.unit == "m" and abs(cause.deviation) >= COARSE * shown.least_dimension:
            small = shown.length
        sign = "-" if cause.deviation < 0.0 else "+"
        amount = f"{sign}{small.text(abs(cause.deviation))}"
        if cause.sigmas:
            where = say(
                "at {sigmas} standard deviations ({amount})",
                sigmas=marked(f"{cause.sigmas:+.3g}"),
                amount=amount,
            )
        elif cause.end == "upper":
            where = say("at its upper end ({amount})", amount=amount)
        elif cause.end:
            where = say("at its lower end ({amount})", amount=amount)
        else:
            where = say("at {amount}", amount=amount)
        what = cause.parameter
        if cause.more:
            what = say(
                "{parameter} and {count} that vary with it", parameter=what, count=cause.more
            )
        of = "" if cause.source == "tolerance" else f" ({cause.source})"
        return f"{what}{of} {where}"

    def as_data(self) -> dict[str, Any]:
        """For programs, ready for JSON, in the units of the machine's file.

        `parameters`: total deviation of each from nominal. `causes`: as `Cause`, the most
        important first. Without numbers that JSON has not: `size` is None of a machine that cannot
        be assembled.
        """
        machine = self.machine
        columns, values = self.moved
        freedoms = zip(machine.commanded, self.pose.tolist(), strict=True)
        size = self._in_file_units(self.size, "m" if self.quantity == "position" else "rad")
        data: dict[str, Any] = {
            "state": self.state,
            "quantity": self.quantity,
            "pose": {
                name: self._in_file_units(value, "m" if FREEDOMS[name] == "length" else "rad")
                for name, value in freedoms
            },
            "pose_number": int(self.number),
            "status": self.status,
            "size": None if self.error is None else size,
            "parameters": {
                machine.parameters[column]: self._in_file_units(value, machine.units[column])
                for column, value in zip(columns.tolist(), values[0].tolist(), strict=True)
            },
            "causes": [self._cause_data(cause) for cause in self.causes()],
        }
        force = self.force
        if force is not None:
            unit = machine.file_units["force"]
            sizes = unit.to_file(force).tolist()
            data["force"] = {"value": sizes, "unit": unit.label}
        return data

    def _in_file_units(self, value: float, si: str) -> dict[str, Any]:
        unit = self.machine.file_units[BY_UNIT[si]]
        number = float(unit.to_file(value)) if math.isfinite(value) else None
        return {"value": number, "unit": unit.label}

    def _cause_data(self, cause: Cause) -> dict[str, Any]:
        share = cause.share if math.isfinite(cause.share) else None
        if cause.force is not None:
            return {"source": cause.source, "parameter": None, "end": None, "share": share}
        return {
            "source": cause.source,
            "parameter": cause.parameter,
            "more": cause.more,
            "end": cause.end or None,
            "deviation": self._in_file_units(cause.deviation, cause.unit),
            "standard_deviations": cause.sigmas or None,
            "share": share,
        }


def in_space(components: Sequence[str], error: Floats, axes: Sequence[str]) -> Floats:
    """(3,) the components of an error along three axes, zero where the tool cannot move."""
    by_name = dict(zip(components, error.tolist(), strict=True))
    return np.array([by_name.get(axis, 0.0) for axis in axes])


__all__ = ["AFTER", "BEFORE", "Cause", "Witness", "in_space"]
