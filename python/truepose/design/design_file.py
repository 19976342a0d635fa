"""A design as a machine file: the file as it was read, options and tolerances written into it.

Only what was chosen changes; comments, order and all other keys stay. A pattern whose parameters
all get one band keeps its place; what differs is written by full names. What was written is read
again, and has to be the design.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import tomlkit
from tomlkit.items import Table

from truepose.arrays import Floats
from truepose.calibration.result.toml_edits import MachineText, inline_table
from truepose.design.allocated_bands import AllocatedBands, allocated_bands
from truepose.errors import Problem, ReadingError, RequestError
from truepose.files.dimensions import BY_UNIT
from truepose.files.tolerance import read_tolerance
from truepose.files.units import UnitSystem
from truepose.machine import Machine
from truepose.machine.families.parameters import is_of_family
from truepose.machine.loader import load_text
from truepose.sources import REGISTRY

if TYPE_CHECKING:
    from truepose.design.result import Allocation

_SAME = 1e-9
"""Share by which a half width may differ that was written and read again."""

_WILDCARDS = frozenset("*?[")
_WIDTHS = ("band", "standard_deviation", "scale")
_TABLE = "tolerance"
_STRUT = "length_tolerance"


def design_text(allocation: Allocation, beside: str | Path | None = None) -> str:
    """The text of the design's machine file; `beside` the file that it is to be.

    Raises `RequestError` (bad-allocation) where the file cannot say what was chosen.
    """
    machine = allocation.machine
    assert machine.costs is not None
    settings = dict(machine.settings)
    settings |= dict(change.split("=", 1) for change in allocation.changes)
    wanted = {
        feature: (half, grade.grade)
        for grade in allocation.grades
        for feature, half in zip(grade.features, grade.halves, strict=True)
    }
    for by_patterns in (True, False):
        text = _written(machine, machine.costs.text, settings, wanted, by_patterns=by_patterns)
        if _is_design(machine, text.text(), wanted):
            if beside is not None:
                text.move_to(Path(beside))
            return text.text()
    raise RequestError(
        Problem(
            "bad-allocation",
            "the machine file cannot say the tolerances that were chosen",
            machine.file,
            path=_TABLE,
            found="other bands, when the design's file was read again",
            expected="tolerances of single parameters, or of patterns that do not overlap",
        )
    )


def _written(
    machine: Machine,
    content: str,
    settings: Mapping[str, str],
    wanted: Mapping[str, tuple[float, str]],
    *,
    by_patterns: bool,
) -> MachineText:
    assert machine.costs is not None
    path = machine.costs.path(machine.file)
    read = load_text(path, content, settings=settings, registry=REGISTRY)
    changed = RequestError(
        Problem("machine-file-changed", "the file changed while it was edited", machine.file)
    )
    text = MachineText(path, read, changed, content)
    bands = allocated_bands(read, list(wanted), [0] * len(wanted))
    _Edit(text, read, bands, wanted).write(by_patterns=by_patterns)
    return text


def _is_design(machine: Machine, content: str, wanted: Mapping[str, tuple[float, str]]) -> bool:
    """Whether the machine of a text has the half widths that are wanted."""
    assert machine.costs is not None
    written = load_text(machine.costs.path(machine.file), content, registry=REGISTRY)
    bands = allocated_bands(written, list(wanted), [0] * len(wanted))
    halves = np.array([half for half, _ in wanted.values()])
    return bool((np.abs(bands.filed - halves) <= _SAME * halves).all())


@dataclass(frozen=True)
class _Key:
    """A key of `[tolerance]`, or a strut's own (`strut` its number), and the parameters it has."""

    key: str
    value: Any
    names: tuple[str, ...]
    strut: int | None = None


class _Edit:
    """The tolerances of one text, to be written anew."""

    def __init__(
        self,
        text: MachineText,
        machine: Machine,
        bands: AllocatedBands,
        wanted: Mapping[str, tuple[float, str]],
    ) -> None:
        self._text, self._machine, self._bands, self._wanted = text, machine, bands, wanted
        self._units = UnitSystem(machine.file_units)
        self._filed = dict(zip(bands.features, bands.filed.tolist(), strict=True))
        self._middle = dict(zip(bands.features, _middles(bands).tolist(), strict=True))
        self._new: dict[str, Any] = {}

    def write(self, *, by_patterns: bool) -> None:
        """Write them: in place where a key has one band for all, else by names."""
        table: Any = self._text.toml.get(_TABLE)
        rest = dict.fromkeys(self._wanted)
        for key in self._keys():
            chosen = [name for name in key.names if name in self._wanted]
            for name in chosen:
                rest.pop(name, None)
            if not chosen:
                continue
            values = [self._value(name, key.value) for name in chosen]
            if key.strut is not None:
                self._text.row("strut", self._machine.struts[key.strut].name)[_STRUT] = _item(
                    values[0]
                )
                continue
            if len(chosen) == len(key.names):
                if by_patterns and all(value == values[0] for value in values):
                    table[key.key] = _item(values[0])
                    continue
                del table[key.key]
            self._new |= dict(zip(chosen, values, strict=True))
        self._new |= {name: self._value(name, None) for name in rest}
        if self._new:
            self._append(by_patterns=by_patterns)

    # --- inside

    def _append(self, *, by_patterns: bool) -> None:
        if _TABLE not in self._text.toml:
            self._text.append(f"[{_TABLE}]\n")
        table = self._text.toml[_TABLE]
        entries = self._of_joints(self._new) if by_patterns else self._new
        # What stands below its last key, tomlkit takes for the table's: comments of the next one.
        body = table.value.body if isinstance(table, Table) else []
        last = max((place for place, (key, _) in enumerate(body) if key is not None), default=-1)
        below = body[last + 1 :]
        del body[last + 1 :]
        for name, value in entries.items():
            table[name] = _item(value)
        body.extend(below)

    def _of_joints(self, entries: Mapping[str, Any]) -> dict[str, Any]:
        """Entries with one pattern for the coordinates of a joint that have one band."""
        joined: dict[str, Any] = {}
        for name, value in entries.items():
            pattern = f"{name.rpartition('.')[0]}.*"
            matches = [one for one in self._machine.parameters if fnmatchcase(one, pattern)]
            alike = all(one in entries and entries[one] == value for one in matches)
            if name[-2:] in (".x", ".y", ".z") and len(matches) > 1 and alike:
                joined[pattern] = value
            else:
                joined[name] = value
        return joined

    def _keys(self) -> list[_Key]:
        """What the file says, the parameters of a key being those that it counts for."""
        names = self._machine.parameters
        taken: set[str] = set()
        keys: list[_Key] = []
        data = self._text.document.data
        columns = self._machine.kernel.length_parameters[: len(self._machine.struts)]
        for number, (row, column) in enumerate(zip(data.get("strut", []), columns, strict=False)):
            if _STRUT in row:
                keys.append(_Key(_STRUT, row[_STRUT], (names[column],), number))
                taken.add(names[column])
        entries = data.get(_TABLE, {})
        for rank in range(3):
            decided = set(taken)
            for key, value in entries.items():
                if is_of_family(key):
                    if rank == 0:
                        keys.append(_Key(key, value, (key,)))
                    continue
                if _rank(key, names) != rank:
                    continue
                own = [
                    name
                    for name in names
                    if (name == key or fnmatchcase(name, key)) and name not in decided
                ]
                keys.append(_Key(key, value, tuple(own)))
                taken.update(own)
        return keys

    def _value(self, name: str, old: Any) -> Any:
        """What the file then says of a parameter: the old value with another width."""
        half, grade = self._wanted[name]
        dimension = self._dimension(name)
        plain = self._plain(name, dimension, half, grade, old)
        if not isinstance(old, dict):
            return plain
        kept = dict(old)
        width = next((key for key in _WIDTHS if key in kept), "band")
        if width == "band":
            return kept | {"band": plain}
        filed = self._filed[name]
        if filed > 0.0:
            value = self._units.read(kept[width], dimension) * half / filed
            return kept | {width: self._text.written(value, dimension, kept[width])}
        usual = {"standard_deviation": "normal", "scale": "student-t"}[width]
        del kept[width]
        return {"band": plain, "distribution": usual} | kept

    def _plain(self, name: str, dimension: str, half: float, grade: str, old: Any) -> Any:
        """A band: the grade as the cost's row has it, if a tolerance is read so; else its ends."""
        middle = self._middle[name]
        if middle != 0.0:
            ends = old if isinstance(old, list) and len(old) == 2 else [None, None]
            return [
                self._text.written(end, dimension, as_before)
                for end, as_before in zip((middle - half, middle + half), ends, strict=True)
            ]
        try:
            band = read_tolerance(grade, dimension, self._units).band(self._size(name))
            if abs(band.half - half) <= _SAME * half:
                return grade
        except ReadingError:
            pass
        return self._text.written(half, dimension, None)

    def _dimension(self, name: str) -> str:
        if is_of_family(name):
            assert self._machine.family is not None
            return self._machine.family.dimension(name)
        return BY_UNIT[self._machine.units[self._machine.parameters.index(name)]]

    def _size(self, name: str) -> float:
        if is_of_family(name):
            assert self._machine.family is not None
            return self._machine.family.value(name)
        return float(self._machine.kernel.nominal[self._machine.parameters.index(name)])


def _middles(bands: AllocatedBands) -> Floats:
    """(f,) middles of the bands, in the features' own units."""
    middle = np.zeros(len(bands.features))
    middle[bands.feature_of] = bands.template.shift[0, bands.places] / bands.slopes
    return middle


def _rank(key: str, names: Sequence[str]) -> int:
    """0: a full name, 1: a pattern that names its part, 2: any other; the lower goes first."""
    if key in names:
        return 0
    part = key.split(".")[:2]
    return 1 if len(part) == 2 and not _WILDCARDS & set("".join(part)) else 2


def _item(value: Any) -> Any:
    return inline_table(value) if isinstance(value, dict) else tomlkit.item(value)


__all__ = ["design_text"]
