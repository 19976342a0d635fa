"""Arrays -> `Measurements`, checked as a file is; several made one."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from truepose.arrays import Floats
from truepose.calibration.instruments import REGISTRY, Instrument
from truepose.calibration.measurements.columns import (
    TO,
    UNCERTAINTY,
    MeasurementRows,
    ReadingColumn,
    reading_columns,
)
from truepose.calibration.measurements.declarations import (
    expected_name,
    name_is_good,
    reserved_names,
)
from truepose.calibration.measurements.measurements import Measurements
from truepose.calibration.measurements.rows import measurements_in
from truepose.errors import Fault, Problem, RequestError
from truepose.files.data_file import cut_short
from truepose.files.wording import did_you_mean, one_of
from truepose.machine import Condition, Machine


def measurements_of(
    machine: Machine,
    instrument: Instrument,
    *,
    poses: ArrayLike | None = None,
    joints: ArrayLike | None = None,
    to: ArrayLike | None = None,
    values: Mapping[str, ArrayLike] | None = None,
    uncertainty: float | Mapping[str, ArrayLike] | None = None,
    condition: Condition | Sequence[Condition] | None = None,
    held_out: ArrayLike | None = None,
    frame_unknown: bool = False,
) -> Measurements:
    """Measurements of one instrument, from arrays; SI, radians and kelvin.

        tracker = Instrument("tracker", "position", Frame())
        measurements_of(
            machine, tracker, poses=poses, values={"x": x, "y": y, "z": z},
            uncertainty=10e-6, frame_unknown=True,
        )

    Commanded `poses` (n_row, n_commanded), or `joints` (n_row, n_joint), neither of a kind that
    needs no pose; `to`: of a kind that measures between two poses, the second ones likewise.
    `values`: (n_row,) by the columns of a file ("x", "strut.1.length", "parameter.strut.1.length"),
    NaN where nothing was read; none of a contact.
    `uncertainty`: standard, one for all, or by column one or (n_row,); default the instrument's.
    `condition`: of all rows or of each; default at reference temperature, no load on the tool.
    `held_out` (n_row,): kept from the fit. `frame_unknown`: all of the instrument's frame that its
    kind sees is to be found, from the frame given on.

    Raises `RequestError` with everything that is wrong.
    """
    problems: list[Problem] = []
    arguments = _Arguments(machine, instrument, problems)
    columns = arguments.columns(values or {})
    commanded = arguments.commanded(poses, joints)
    if problems:
        raise RequestError(*problems)
    others = arguments.others(to, commanded, joints is not None)
    if problems:
        raise RequestError(*problems)
    n = arguments.n_row(values or {}) if commanded is None else len(commanded)
    table = {name: arguments.of_rows(name, column, n) for name, column in columns.items()}
    stated = arguments.uncertainties(uncertainty, table, n)
    flags = np.zeros(n, np.bool_) if held_out is None else np.array(held_out, np.bool_)
    if flags.shape != (n,):
        arguments.refuse("held_out", f"shape {flags.shape}", f"({n},) flags")
    conditions = arguments.conditions(condition, n)
    if problems:
        raise RequestError(*problems)
    rows = MeasurementRows(
        instrument=np.zeros(n, np.intp),
        readings=table,
        uncertainties=stated,
        held_out=flags,
        lines=np.zeros(n, np.intp),
        commands=commanded if poses is not None else None,
        joints=commanded if joints is not None else None,
        to_commands=others if poses is not None else None,
        to_joints=others if joints is not None else None,
        whole=frozenset({instrument.name} if frame_unknown else ()),
    )
    measurements = measurements_in(machine, (instrument,), rows, _Report(problems, rows))
    if problems:
        raise RequestError(*cut_short(problems))
    if conditions is None:
        return measurements
    return dataclasses.replace(measurements, conditions=conditions)


def joined(*several: Measurements) -> Measurements:
    """Measurements of one machine, one after the other; instruments that are alike become one.

    Raises `RequestError` (bad-measurements) where there are none, where their joints are not as
    many, and where different instruments have one name.
    """
    if not several:
        raise RequestError(_bad("measurements", "nothing", "one or more"))
    instruments: dict[str, Instrument] = {}
    for part in several:
        for instrument in part.instruments:
            if instruments.setdefault(instrument.name, instrument) != instrument:
                raise RequestError(
                    _bad(
                        "instruments",
                        f"two instruments that differ, both named {instrument.name}",
                        "a name of its own for each instrument",
                    )
                )
    if len({part.joints.shape[1] for part in several}) > 1:
        raise RequestError(
            _bad("joints", "measurements of machines with other joints", "those of one machine")
        )
    names = list(instruments)
    numbers = [
        np.array([names.index(i.name) for i in part.instruments], np.intp) for part in several
    ]
    first = np.cumsum([0, *(part.n_row for part in several)])[:-1].tolist()
    files = dict.fromkeys(part.file for part in several)
    other_joints, other_placements = _second_poses(several)
    return Measurements(
        instruments=tuple(instruments.values()),
        joints=np.concatenate([part.joints for part in several]),
        placements=np.concatenate([part.placements for part in several]),
        instrument=np.concatenate(
            [of[part.instrument] for of, part in zip(numbers, several, strict=True)]
        ),
        conditions=_same_objects([c for part in several for c in part.conditions]),
        held_out=np.concatenate([part.held_out for part in several]),
        row=np.concatenate(
            [part.row + offset for part, offset in zip(several, first, strict=True)]
        ),
        observable=np.concatenate([part.observable for part in several]),
        strut=np.concatenate([part.strut for part in several]),
        value=np.concatenate([part.value for part in several]),
        uncertainty=np.concatenate([part.uncertainty for part in several]),
        lines=np.concatenate([part.lines for part in several]),
        file=", ".join(file for file in files if file),
        file_hash=", ".join(dict.fromkeys(part.file_hash for part in several if part.file_hash)),
        other_joints=other_joints,
        other_placements=other_placements,
    )


def _second_poses(several: Sequence[Measurements]) -> tuple[Floats | None, Floats | None]:
    """Joints and placements of all parts where one has any; in others the first poses again."""
    if all(part.other_joints is None for part in several):
        return None, None
    joints = [p.joints if p.other_joints is None else p.other_joints for p in several]
    placed = [p.placements if p.other_placements is None else p.other_placements for p in several]
    return np.concatenate(joints), np.concatenate(placed)


def _same_objects(conditions: Sequence[Condition]) -> tuple[Condition, ...]:
    """The conditions, equal ones as one object."""
    kept: list[Condition] = []
    by_identity: dict[int, Condition] = {}
    for condition in conditions:
        if id(condition) not in by_identity:
            same = next((other for other in kept if other == condition), None)
            if same is None:
                kept.append(condition)
            by_identity[id(condition)] = condition if same is None else same
    return tuple(by_identity[id(condition)] for condition in conditions)


def _bad(path: str, found: str, expected: str, hint: str | None = None) -> Problem:
    return Problem(
        "bad-measurements",
        f"{path}: this is not what measurements are made of",
        path=path,
        found=found,
        expected=expected,
        hint=hint,
    )


@dataclass
class _Arguments:
    """Arrays as the caller gave them -> arrays of the right shape, or problems."""

    machine: Machine
    instrument: Instrument
    problems: list[Problem]
    known: dict[str, ReadingColumn] = field(init=False)

    def __post_init__(self) -> None:
        self.known = reading_columns(self.machine)

    def refuse(self, path: str, found: str, expected: str, hint: str | None = None) -> None:
        """Note what is wrong with an argument."""
        self.problems.append(_bad(path, found, expected, hint))

    def columns(self, values: Mapping[str, ArrayLike]) -> dict[str, ArrayLike]:
        """The readings of known columns."""
        if self.instrument.kind not in REGISTRY:
            hint = did_you_mean(self.instrument.kind, REGISTRY)
            self.refuse("instrument.kind", self.instrument.kind, one_of(REGISTRY), hint)
        without = self.instrument.kind in REGISTRY and not REGISTRY[self.instrument.kind].poses
        if without and self.instrument.bias_unknown:
            self.refuse("instrument.bias_unknown", "True", "False, of a measured parameter")
        reserved = reserved_names(self.machine)
        if not name_is_good(self.instrument.name, reserved):
            self.refuse("instrument.name", self.instrument.name, expected_name(reserved))
        for path, vector in (
            ("frame.origin", self.instrument.frame.origin),
            ("frame.rotation", self.instrument.frame.rotation),
            ("target", self.instrument.target),
            ("target_uncertainty", self.instrument.target_uncertainty),
            ("axis", self.instrument.axis),
            ("zero", self.instrument.zero),
        ):
            wanted = 4 if path == "frame.rotation" else 3
            if len(vector) != wanted or not np.isfinite(vector).all():
                self.refuse(f"instrument.{path}", str(vector), f"{wanted} finite numbers")
            elif wanted == 4 and abs(float(np.linalg.norm(vector)) - 1.0) > 1e-9:
                self.refuse(f"instrument.{path}", str(vector), "a unit quaternion w x y z")
        known = self.instrument.target_uncertainty
        if any(known) and not (self.instrument.target_unknown is False and min(known) > 0.0):
            self.refuse(
                "instrument.target_uncertainty",
                str(known),
                "three above zero of a target that is not unknown, or three zeros",
            )
        if len(self.instrument.frame.unknown) != 6:
            self.refuse("instrument.frame.unknown", str(self.instrument.frame.unknown), "6 flags")
        for name, amount in self.instrument.uncertainty.items():
            if not (np.isfinite(amount) and amount > 0.0):
                self.problems.append(_not_positive(f"instrument.uncertainty.{name}", float(amount)))
        for name in values:
            if name not in self.known:
                hint = did_you_mean(name, self.known)
                self.refuse(f"values.{name}", name, one_of(self.known, limit=16), hint)
        return {name: column for name, column in values.items() if name in self.known}

    def others(self, to: ArrayLike | None, commanded: Floats | None, joints: bool) -> Floats | None:
        """The second poses or joints, as many as there are first ones; None of other kinds."""
        two = self.instrument.kind in REGISTRY and REGISTRY[self.instrument.kind].poses == 2
        if to is None or commanded is None:
            if two:
                self.refuse("to", "nothing", "the second pose of each row")
            return None
        if not two:
            self.refuse("to", "second poses", f"none, of kind {self.instrument.kind}")
            return None
        table = self._numbers("to", to)
        if table is None:
            return None
        if table.shape != commanded.shape or not np.isfinite(table).all():
            what = "joints" if joints else "poses"
            found = f"shape {table.shape}"
            found = found if table.shape != commanded.shape else "a number that is not finite"
            self.refuse("to", found, f"{commanded.shape} finite numbers, as {what} have")
        return table

    def commanded(self, poses: ArrayLike | None, joints: ArrayLike | None) -> Floats | None:
        """(n_row, n_commanded) poses or (n_row, n_joint) joints, whichever is given.

        None where that is wrong, and of a kind that needs no pose.
        """
        if self.instrument.kind in REGISTRY and not REGISTRY[self.instrument.kind].poses:
            if poses is not None or joints is not None:
                found = "poses" if joints is None else "joints"
                self.refuse("poses", found, f"none, of kind {self.instrument.kind}")
            return None
        if (poses is None) == (joints is None):
            found = "neither" if poses is None else "both"
            self.refuse("poses", found, "either poses or joints, as they were commanded")
            return None
        path, argument = ("poses", poses) if joints is None else ("joints", joints)
        names = self.machine.commanded if joints is None else self.machine.joints
        table = self._numbers(path, argument)
        if table is None:
            return None
        expected = f"(n_row, {len(names)}) finite numbers: {', '.join(names)}"
        if table.ndim != 2 or table.shape[1] != len(names) or not len(table):
            self.refuse(path, f"shape {table.shape}", expected)
            return None
        if not np.isfinite(table).all():
            row = int(np.flatnonzero(~np.isfinite(table).all(axis=1))[0])
            self.refuse(path, f"a number that is not finite, in row {row}", expected)
            return None
        return table

    def n_row(self, values: Mapping[str, ArrayLike]) -> int:
        """How many rows values without poses are: as many as the longest has, at least one."""
        return max((np.size(column) for column in values.values()), default=1)

    def of_rows(self, name: str, values: ArrayLike, n: int, what: str = "values") -> Floats:
        """(n_row,) of one column; one number stands for all rows."""
        table = self._numbers(f"{what}.{name}", values)
        if table is not None and table.shape in ((), (n,)) and not np.isinf(table).any():
            return np.broadcast_to(table, (n,)).copy()
        if table is not None:
            found = f"shape {table.shape}" if table.shape not in ((), (n,)) else "an infinity"
            self.refuse(f"{what}.{name}", found, f"({n},) numbers, NaN where nothing was read")
        return np.full(n, np.nan)

    def uncertainties(
        self,
        uncertainty: float | Mapping[str, ArrayLike] | None,
        readings: Mapping[str, Floats],
        n: int,
    ) -> dict[str, Floats]:
        """Columns of uncertainties, by the name that they have in a file."""
        if uncertainty is None or self.instrument.kind not in REGISTRY:
            return {}
        kind = REGISTRY[self.instrument.kind]
        columns = [name for name, column in self.known.items() if column.word in kind.reads]
        read = [
            name
            for name in columns or kind.fixed
            if name in readings or kind.fixed or kind.optional
        ]
        by_column: Mapping[str, ArrayLike]
        by_column = (
            uncertainty if isinstance(uncertainty, Mapping) else dict.fromkeys(read, uncertainty)
        )
        result = {}
        for name, amount in by_column.items():
            if name not in self.known:
                hint = did_you_mean(name, self.known)
                self.refuse(f"uncertainty.{name}", name, one_of(read, limit=16), hint)
                continue
            column = self.of_rows(name, amount, n, "uncertainty")
            if name in readings and not isinstance(uncertainty, Mapping):
                column[np.isnan(readings[name]) & (not kind.optional)] = np.nan
            result[name + UNCERTAINTY] = column
        return result

    def conditions(
        self, condition: Condition | Sequence[Condition] | None, n: int
    ) -> tuple[Condition, ...] | None:
        """(n_row,) conditions, of parts that the machine has; None: the default."""
        if condition is None:
            return None
        if self.instrument.kind in REGISTRY and not REGISTRY[self.instrument.kind].poses:
            expected = "none: a part is measured at the reference temperature, without loads"
            self.refuse("condition", "a condition", expected)
            return None
        every = (condition,) * n if isinstance(condition, Condition) else tuple(condition)
        if len(every) != n:
            self.refuse(
                "condition", f"{len(every)} conditions", f"one, or one for each of {n} rows"
            )
            return None
        same = _same_objects(every)
        for condition in {id(condition): condition for condition in same}.values():
            try:
                self.machine.check_condition(condition)
            except RequestError as error:
                self.problems += error.problems
        return same

    def _numbers(self, path: str, values: ArrayLike | None) -> Floats | None:
        try:
            return np.array(values, np.float64)
        except (TypeError, ValueError):
            self.refuse(path, "something that is not an array of numbers", "numbers")
            return None


def _not_positive(path: str, found: float) -> Problem:
    return Problem(
        "not-positive",
        f"{path}: a standard uncertainty is above zero",
        path=path,
        found=str(found),
        expected="a standard uncertainty above zero, SI",
    )


@dataclass
class _Report:
    """Problems of rows, by their number."""

    problems: list[Problem]
    rows: MeasurementRows

    def __call__(self, fault: Fault, *, row: int | None = None, column: str | None = None) -> None:
        problem = fault.about(column).at(path=column)
        where = "" if row is None else f" (row {row})"
        self.problems.append(replace(problem, message=problem.message + where))

    def shown(self, column: str, row: int) -> str:
        """A number as it was given, SI."""
        joints = self.rows.to_joints if column.startswith(TO) else self.rows.joints
        if column.removeprefix(TO).startswith("joint.") and joints is not None:
            return str(joints[row].tolist())
        table = self.rows.uncertainties if column.endswith(UNCERTAINTY) else self.rows.readings
        return f"{table[column][row]:.10g}" if column in table else "nothing"
