"""Measured temperatures of parts over time: a CSV file of columns `time` and parts' paths."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike

from truepose.arrays import Flags, Floats
from truepose.errors import Fault, Problem, RequestError
from truepose.files.data_file import Column, DataFiles, DataTable
from truepose.files.document import Document, Key
from truepose.files.units import FileUnit
from truepose.machine.condition import DEFAULT_PART

TIME = "time"
"""The column of times."""

_KEY: Key = ("condition", "temperature_log")


@dataclass(frozen=True, eq=False)
class TemperatureLog:
    """Temperatures (n_time,) in K of parts by their path, at `times` (n_time,) s, ascending.

    `default` stands for every part that has no column of its own. `name` is the file's.

    Raises `RequestError` (bad-condition) where values or shapes contradict this.
    """

    times: Floats
    temperatures: Mapping[str, Floats]
    name: str = ""

    def __post_init__(self) -> None:
        times = _frozen(self.times)
        temperatures = {part: _frozen(values) for part, values in self.temperatures.items()}
        if times.ndim != 1 or not times.size or not np.isfinite(times).all():
            raise _bad("times that are no list of finite numbers", "(n_time,) times, s")
        if (np.diff(times) <= 0.0).any():
            raise _bad("times that do not ascend", "ascending times, s")
        for part, values in temperatures.items():
            if values.shape != times.shape:
                raise _bad(
                    f"{part}: temperatures of shape {values.shape}",
                    f"one for each of {times.size} times",
                )
            if not (np.isfinite(values) & (values > 0.0)).all():
                raise _bad(
                    f"{part}: a temperature that is none", "temperatures above absolute zero, K"
                )
        object.__setattr__(self, "times", times)
        object.__setattr__(self, "temperatures", MappingProxyType(temperatures))

    def __eq__(self, other: object) -> bool:
        """Whether it says the same, whatever file that is in."""
        if not isinstance(other, TemperatureLog):
            return NotImplemented
        return (
            np.array_equal(self.times, other.times)
            and self.temperatures.keys() == other.temperatures.keys()
            and all(
                np.array_equal(values, other.temperatures[part])
                for part, values in self.temperatures.items()
            )
        )

    def __hash__(self) -> int:
        return hash((self.times.tobytes(), *sorted(self.temperatures)))

    @property
    def span(self) -> tuple[float, float]:
        """First and last time, s."""
        return float(self.times[0]), float(self.times[-1])

    def names(self, part: str) -> bool:
        """Whether the log has a temperature for a part, be it that of `default`."""
        return part in self.temperatures or DEFAULT_PART in self.temperatures

    def without(self, part: str) -> TemperatureLog | None:
        """The log without the temperature of one part; None where it has no other."""
        others = {name: values for name, values in self.temperatures.items() if name != part}
        return TemperatureLog(self.times, others, self.name) if others else None

    def covers(self, times: ArrayLike) -> Flags:
        """Whether each time is within the log."""
        given = np.asarray(times, np.float64)
        first, last = self.span
        inside: Flags = (given >= first) & (given <= last)
        return inside

    def require(self, times: ArrayLike) -> None:
        """Raise `RequestError` (outside-log) where a time is not within the log."""
        outside = np.asarray(times, np.float64)[~self.covers(times)]
        if outside.size:
            raise RequestError(_outside(self, float(outside.flat[0])))

    def at(self, part: str, times: ArrayLike) -> Floats:
        """Temperature in K of a part that the log names, at `times` (...), linear in between.

        Raises `RequestError` (outside-log) for a time before the first or after the last: what was
        not measured is not guessed.
        """
        given = np.asarray(times, np.float64)
        self.require(given)
        return np.asarray(np.interp(given, self.times, self.temperatures[part]), np.float64)

    def __getstate__(self) -> dict[str, object]:
        return vars(self) | {"temperatures": dict(self.temperatures)}

    def __setstate__(self, state: dict[str, object]) -> None:
        temperatures = state["temperatures"]
        assert isinstance(temperatures, dict)
        vars(self).update(state | {"temperatures": MappingProxyType(temperatures)})


def _frozen(values: ArrayLike) -> Floats:
    copied = np.array(values, np.float64)
    copied.flags.writeable = False
    return copied


def _bad(found: str, expected: str) -> RequestError:
    return RequestError(
        Problem(
            "bad-condition",
            "this is not a temperature log",
            path="condition.temperature_log",
            found=found,
            expected=expected,
        )
    )


def _outside(log: TemperatureLog, time: float) -> Problem:
    first, last = log.span
    return Problem(
        "outside-log",
        "the temperature log does not cover this time",
        path="condition.time",
        found=f"{time:.10g} s",
        expected=f"a time from {first:.10g} s to {last:.10g} s",
    )


def read_temperature_log(
    data_files: DataFiles,
    name: str,
    parts: Iterable[str],
    time: float | None = None,
    fixed: Iterable[str] = (),
) -> TemperatureLog | None:
    """The log in the data file `name`, whose columns are `time`, `default` and `parts`.

    `time`, s, must be within it; parts of a `fixed` temperature must not be in it. None, and
    problems in `data_files`, where it is not good.
    """
    columns = [Column(TIME, "time")]
    columns += [Column(part, "temperature", required=False) for part in (DEFAULT_PART, *parts)]
    table = data_files.read(name, columns, _KEY)
    if table is None:
        return None
    problems = [*_not_ascending(table), *_too_cold(table)]
    document = data_files.document
    given = [*fixed, DEFAULT_PART] if _default_is_set(document) else fixed
    problems += [_twice(document, part, name) for part in given if part in table.numbers]
    if len(table.columns) == 1:
        problems.append(
            table.problem(
                Fault(
                    "missing-column",
                    "the log has no temperature",
                    found="the column time alone",
                    expected='a column for a part, such as "strut.1 (degC)" or "default (degC)"',
                )
            )
        )
    data_files.problems += problems
    if problems:
        return None
    times = table.numbers[TIME]
    log = TemperatureLog(times, {n: v for n, v in table.numbers.items() if n != TIME}, name)
    if time is not None and not log.covers(time):
        data_files.problems.append(_time_outside(data_files.document, log, time, table.units[TIME]))
        return None
    return log


def _not_ascending(table: DataTable) -> Iterable[Problem]:
    times = table.numbers[TIME]
    for row in (np.flatnonzero(np.diff(times) <= 0.0) + 1).tolist():
        before = table.shown(TIME, row - 1)
        yield table.problem(
            Fault(
                "time-backwards",
                "the time stands still"
                if times[row] == times[row - 1]
                else "the time goes backwards",
                found=f"{table.shown(TIME, row)} after {before} in line {table.lines[row - 1]}",
                expected=f"a time after {before}",
            ),
            row=row,
            column=TIME,
        )


def _too_cold(table: DataTable) -> Iterable[Problem]:
    for part, temperatures in table.numbers.items():
        if part == TIME:
            continue
        for row in np.flatnonzero(temperatures <= 0.0).tolist():
            yield table.problem(
                Fault(
                    "not-positive",
                    "a temperature is above absolute zero",
                    found=table.shown(part, row),
                    expected="a temperature above absolute zero",
                ),
                row=row,
                column=part,
            )


def _default_is_set(document: Document) -> bool:
    """Whether a setting gives the temperature of all other parts, and none gives the log.

    In a file, or beside a log that a setting names, it is what the log's own default goes before; a
    setting that the file's log goes before would do nothing.
    """
    key = document.key(f"condition.temperature.{DEFAULT_PART}")
    given = document.value(key) is not None and document.setting(key) is not None
    return given and document.setting(_KEY) is None


def _twice(document: Document, part: str, name: str) -> Problem:
    whose = "every other part" if part == DEFAULT_PART else part
    return document.problem(
        Fault(
            "excluding-keys",
            f"the temperature of {whose} is given twice",
            found=f"a temperature, and the column {part} of {name}",
            expected="one of them",
        ),
        document.key(f"condition.temperature.{part}"),
    )


def _time_outside(document: Document, log: TemperatureLog, time: float, unit: FileUnit) -> Problem:
    first, last, asked = (f"{float(unit.to_file(t)):.10g} {unit.label}" for t in (*log.span, time))
    return document.problem(
        Fault(
            "outside-log",
            "the temperature log does not cover this time",
            found=asked,
            expected=f"a time from {first} to {last}",
        ),
        ("condition", "time"),
    )
