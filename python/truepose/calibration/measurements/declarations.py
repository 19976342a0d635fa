"""The head of a file of measurements: lines that begin with `#:`, together a TOML document.

    #: machine = "Planar two-slider PKM"
    #: [instrument.camera]
    #: kind = "position"
    #: frame = "unknown"
    #: uncertainty = "10 um"

`docs/measurements.md` describes the keys for users.
"""

from __future__ import annotations

import csv
import dataclasses
import math
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from typing import Any, NoReturn

import numpy as np

from truepose.calibration.instruments import FRAME_FREEDOMS, REGISTRY, Frame, Instrument, Kind
from truepose.calibration.instruments._base import Vector
from truepose.calibration.observables import si_unit
from truepose.errors import Fault, Problem
from truepose.files.dimensions import BY_UNIT, DIMENSIONS
from truepose.files.document import Document, Key
from truepose.files.toml_text import TomlError, lines_of, parse_toml
from truepose.files.units import QuantityError, UnitSystem, shown_value, type_phrase
from truepose.files.wording import did_you_mean, one_of
from truepose.machine import Machine
from truepose.spatial import Quaternion, euler_to_quaternion

LINE_END = re.compile(r"\r\n|\r|\n")
_MARK = "#:"
_PADDING = ",;\t"
_NAME = re.compile(r"[A-Za-z0-9_-]++\Z")

UNKNOWN = "unknown"

NEARLY = 1e-6
"""How far a quaternion's length may be from 1: what digits leave, and less than a slip."""

ROUNDING = 1e-14
"""A length so near to 1, or a cosine so near to 0, is as good as it can be written."""

_NO_UNITS = UnitSystem({})

_NOWHERE: Vector = (0.0, 0.0, 0.0)

TOP_KEYS = ("machine", "instrument")
COMMON_KEYS = ("kind", "bias", "uncertainty")


@dataclass
class Header:
    """What the head says. `whole`: instruments whose frame is wholly to be found.

    `declared`: every name, also of instruments that have problems.
    """

    machine: str | None = None
    machine_line: int | None = None
    instruments: list[Instrument] = field(default_factory=list)
    whole: frozenset[str] = frozenset()
    declared: tuple[str, ...] = ()
    problems: list[Problem] = field(default_factory=list)


def separated(text: str) -> tuple[str, str]:
    """The head as TOML, and the table as CSV, each with the lines where they stand in the file.

    Spreadsheets put a line with commas in quotation marks, and fill it up with empty cells: that is
    undone.
    """
    head, table = [], []
    for line in LINE_END.split(text):
        plain = line.strip()
        if plain.startswith('"#'):
            plain = _unquoted(plain)
        if not plain.startswith("#"):
            head.append("")
            table.append(line)
            continue
        table.append("")
        marked = plain.startswith(_MARK)
        head.append(_without_padding(plain.removeprefix(_MARK)) if marked else "")
    return "\n".join(head), "\n".join(table)


def _without_padding(line: str) -> str:
    """The line without the empty cells, two or more, with which a spreadsheet fills its row."""
    text = line.rstrip()
    bare = text.rstrip(_PADDING)
    return bare if len(text) - len(bare) >= 2 else line


def _unquoted(line: str) -> str:
    try:
        cells = next(csv.reader([line]))
    except (csv.Error, StopIteration):
        return line
    while cells and not cells[-1].strip():
        cells.pop()
    return ",".join(cells)


def read_header(head: str, file: str, name: str, reserved: frozenset[str]) -> Header:
    """Instruments from the head of the file; `reserved`: names that none of them may have."""
    header = Header()
    try:
        data = parse_toml(head)
    except TomlError as error:
        header.problems.append(_not_toml(error, head, file))
        return header
    _Reader(Document(file, name, "", data, lines_of(head)), header, reserved).read()
    return header


def _not_toml(error: TomlError, head: str, file: str) -> Problem:
    all_lines = head.split("\n")
    line, found = error.line, None
    if line is not None:
        # The head has an empty line for every row of the table: the end is its last own one.
        line = max((at for at in range(1, line + 1) if all_lines[at - 1]), default=line)
        found = all_lines[line - 1].strip()[:80]
    return Problem(
        "not-toml",
        f"the lines that begin with {_MARK} are not TOML: {error.reason}",
        file,
        line,
        found=found or None,
        expected='TOML behind the mark, such as: #: frame = "unknown"',
    )


def reserved_names(machine: Machine) -> frozenset[str]:
    """Names that no instrument has: parameters begin with them."""
    return frozenset({name.partition(".")[0] for name in machine.parameters} | {"default"})


def name_is_good(name: str, reserved: frozenset[str]) -> bool:
    """Whether an instrument can have this name."""
    return _NAME.match(name) is not None and name not in reserved


def expected_name(reserved: frozenset[str]) -> str:
    """What names are good, for people."""
    return f"letters, digits, - and _; none of {', '.join(sorted(reserved))}"


class _RefusedError(Exception):
    """A value is refused; its problem is noted already."""


class _Reader:
    """Reads every instrument of one head."""

    def __init__(self, document: Document, header: Header, reserved: frozenset[str]) -> None:
        self.document = document
        self.header = header
        self.reserved = reserved
        self.whole: set[str] = set()

    def read(self) -> None:
        data = self.document.data
        self._check_keys((), data, TOP_KEYS)
        if "machine" in data:
            self.header.machine = self._text(("machine",))
            self.header.machine_line = self.document.line(("machine",))
        tables = data.get("instrument", {})
        if not isinstance(tables, dict) or not all(isinstance(t, dict) for t in tables.values()):
            self._tell(
                Fault(
                    "wrong-type",
                    "instruments are tables with a name",
                    found=shown_value(tables),
                    expected=f"{_MARK} [instrument.tracker]",
                ),
                ("instrument",),
            )
            return
        self.header.declared = tuple(tables)
        for name in tables:
            instrument = self._instrument(name)
            if instrument is not None:
                self.header.instruments.append(instrument)
        self.header.whole = frozenset(self.whole)

    def _instrument(self, name: str) -> Instrument | None:
        key: Key = ("instrument", name)
        before = len(self.header.problems)
        if not name_is_good(name, self.reserved):
            self._tell(
                Fault(
                    "bad-name",
                    "an instrument cannot have this name",
                    found=shown_value(name),
                    expected=expected_name(self.reserved),
                ),
                key,
            )
        table = self.document.data["instrument"][name]
        kind = self._kind(key, table)
        if kind is None:
            return None
        self._check_keys(key, table, self._keys(kind))
        end = str(self._if_there(key, table, "end", self._end, "base"))
        frame = self._frame_of(key, table, kind, end)
        target = self._if_there(key, table, "target", self._target, (_NOWHERE, False, _NOWHERE))
        axis = self._if_there(key, table, "axis", self._direction, (0.0, 0.0, 1.0))
        zero = self._if_there(key, table, "zero", self._direction, None)
        if "axis" in kind.keys:
            zero = self._zero(key, table, axis, zero)
        uncertainty = self._if_there(
            key,
            table,
            "uncertainty",
            lambda place, value: self._uncertainty(place, value, kind),
            {},
        )
        bias = self._if_there(key, table, "bias", self._bias, False)
        if len(self.header.problems) > before:
            return None
        point, target_unknown, target_uncertainty = target
        return Instrument(
            name,
            kind.name,
            frame,
            point,
            target_unknown,
            bias,
            uncertainty,
            axis,
            zero or (1.0, 0.0, 0.0),
            end,
            target_uncertainty,
        )

    def _keys(self, kind: Kind) -> tuple[str, ...]:
        if kind.poses == 0:  # a constant of its own for each parameter would leave nothing
            return ("kind", "uncertainty")
        return (*COMMON_KEYS, "frame", *(("target",) if kind.has_target else ()), *kind.keys)

    def _kind(self, key: Key, table: dict[str, Any]) -> Kind | None:
        if "kind" not in table:
            self._tell(
                Fault(
                    "missing-key",
                    "missing",
                    found="nothing",
                    expected=one_of(f'"{name}"' for name in REGISTRY),
                ),
                (*key, "kind"),
            )
            return None
        word = table["kind"]
        if isinstance(word, str) and word in REGISTRY:
            return REGISTRY[word]
        self._tell(
            Fault(
                "unknown-choice",
                f"there is no instrument of kind {shown_value(word)}",
                found=shown_value(word),
                expected=one_of(f'"{name}"' for name in REGISTRY),
                hint=did_you_mean(word, REGISTRY) if isinstance(word, str) else None,
            ),
            (*key, "kind"),
        )
        return None

    def _if_there(
        self,
        key: Key,
        table: dict[str, Any],
        word: str,
        read: Callable[[Key, Any], Any],
        default: Any,
    ) -> Any:
        """What stands at a key, read; the default where nothing, or nothing good, does."""
        if word not in table:
            return default
        try:
            return read((*key, word), table[word])
        except _RefusedError:
            return default

    # Values. Each raises `_RefusedError` once it has noted what is wrong.

    def _frame_of(self, key: Key, table: dict[str, Any], kind: Kind, end: str) -> Frame:
        without = kind.frame is None or end == "platform"
        if "frame" not in table:
            if not without:
                self._tell(
                    Fault(
                        "missing-key",
                        "missing",
                        found="nothing",
                        expected='"base", "unknown" or a table: '
                        '{ origin = ["0 mm", "0 mm", "0 mm"], '
                        'rotation = ["0 deg", "0 deg", "0 deg"] }',
                        hint="readings mean nothing without the frame that they are in",
                    ),
                    (*key, "frame"),
                )
            return Frame()
        if without and table["frame"] != "base":
            self._tell(
                Fault(
                    "unknown-choice",
                    "what this instrument reads does not depend on a frame",
                    found=shown_value(table["frame"]),
                    expected='no frame, or "base"',
                ),
                (*key, "frame"),
            )
            return Frame()
        frame = self._if_there(key, table, "frame", self._frame, Frame())
        assert isinstance(frame, Frame)
        if table["frame"] == UNKNOWN:
            self.whole.add(str(key[1]))
        return frame

    def _frame(self, key: Key, value: Any) -> Frame:
        if value in ("base", UNKNOWN):
            return Frame()
        if not isinstance(value, dict):
            self._refuse(
                Fault(
                    "unknown-choice" if isinstance(value, str) else "wrong-type",
                    f"expected a frame, found {type_phrase(value)}",
                ),
                key,
                value,
                '"base", "unknown" or a table with origin, rotation, unknown',
            )
        self._check_keys(key, value, ("origin", "rotation", "unknown"))
        frame = Frame()
        if "origin" in value:
            origin = self._three((*key, "origin"), value["origin"], "length")
            frame = dataclasses.replace(frame, origin=origin)
        if "rotation" in value:
            rotation = self._rotation((*key, "rotation"), value["rotation"])
            frame = dataclasses.replace(frame, rotation=rotation)
        unknown = value.get("unknown", [])
        words = unknown if isinstance(unknown, list) else [unknown]
        for word in words:
            if word not in FRAME_FREEDOMS:
                expected = "a list of some of " + ", ".join(f'"{name}"' for name in FRAME_FREEDOMS)
                place = (*key, "unknown")
                self._refuse(
                    Fault("unknown-choice", "no freedom of a frame"), place, word, expected
                )
        return dataclasses.replace(frame, unknown=tuple(name in words for name in FRAME_FREEDOMS))

    def _rotation(self, key: Key, value: Any) -> Quaternion:
        """Three angles a b c, or the four numbers of a unit quaternion w x y z."""
        if not isinstance(value, list) or len(value) != 4:
            return euler_to_quaternion(self._three(key, value, "angle"))
        w, x, y, z = (
            self._number((*key, index), entry, "ratio") for index, entry in enumerate(value)
        )
        size = math.hypot(w, x, y, z)
        if abs(size - 1.0) > NEARLY:
            expected = "a unit quaternion [w, x, y, z], or three angles"
            self._refuse(
                Fault("wrong-type", "the quaternion is not of length 1"), key, value, expected
            )
        if abs(size - 1.0) <= ROUNDING:
            size = 1.0
        return (w / size, x / size, y / size, z / size)

    def _target(self, key: Key, value: Any) -> tuple[Vector, bool, Vector]:
        """The point, whether it is unknown, and how uncertain it is, exactly known where 0."""
        if value == UNKNOWN:
            return _NOWHERE, True, _NOWHERE
        if not isinstance(value, dict):
            return self._three(key, value, "length"), False, _NOWHERE
        self._check_keys(key, value, ("start", "unknown", "uncertainty"))
        start = _NOWHERE
        if "start" in value:
            start = self._three((*key, "start"), value["start"], "length")
        unknown = value.get("unknown", "uncertainty" not in value)
        if not isinstance(unknown, bool):
            self._refuse(
                Fault("wrong-type", "expected true or false"),
                (*key, "unknown"),
                unknown,
                "true or false",
            )
        if "uncertainty" not in value:
            return start, unknown, _NOWHERE
        place = (*key, "uncertainty")
        if unknown:
            self._refuse(
                Fault("excluding-keys", "the target is unknown, and how uncertain it is is said"),
                place,
                value["uncertainty"],
                "either unknown = true or an uncertainty",
            )
        return start, False, self._target_uncertainty(place, value["uncertainty"])

    def _target_uncertainty(self, key: Key, value: Any) -> Vector:
        """Standard uncertainties along the three axes, or one for all of them."""
        if not isinstance(value, list):
            amount = self._positive(key, value, ("length",))[0]
            return (amount, amount, amount)
        if len(value) != 3:
            expected = '"0.1 mm", or one for each axis: ["0.1 mm", "0.1 mm", "0.5 mm"]'
            self._refuse(Fault("wrong-type", "expected 3 lengths"), key, value, expected)
        x, y, z = (
            self._positive((*key, at), entry, ("length",))[0] for at, entry in enumerate(value)
        )
        return (x, y, z)

    def _bias(self, key: Key, value: Any) -> bool:
        if value != UNKNOWN:
            message = "a bias is either unknown, or taken off the readings"
            self._refuse(Fault("unknown-choice", message), key, value, '"unknown", or no such key')
        return True

    def _end(self, key: Key, value: Any) -> str:
        if value not in ("base", "platform"):
            expected = 'one of "base", "platform"'
            self._refuse(Fault("unknown-choice", "no end of a strut"), key, value, expected)
        return str(value)

    def _direction(self, key: Key, value: Any) -> Vector:
        x, y, z = self._three(key, value, "ratio")
        size = math.hypot(x, y, z)
        if not (math.isfinite(size) and size > 0.0):
            self._refuse(
                Fault("zero-direction", "a direction has a length above zero"),
                key,
                value,
                "at least one component that is not zero",
            )
        if abs(size - 1.0) <= ROUNDING:
            size = 1.0  # to the last digit as it is written
        return (x / size, y / size, z / size)

    def _zero(self, key: Key, table: dict[str, Any], axis: Vector, zero: Vector | None) -> Vector:
        """The zero direction, made across the axis; where none is given, some direction is."""
        around = np.array(axis)
        direction = np.eye(3)[int(np.argmin(np.abs(around)))] if zero is None else np.array(zero)
        if zero is not None and abs(direction @ around) <= ROUNDING:
            return zero
        across = direction - (direction @ around) * around
        size = float(np.linalg.norm(across))
        if size < 1e-6:
            self._tell(
                Fault(
                    "zero-direction",
                    "the zero direction is along the axis",
                    found=shown_value(table.get("zero")),
                    expected="a direction across the axis",
                ),
                (*key, "zero"),
            )
            return (1.0, 0.0, 0.0)
        x, y, z = (across / size).tolist()
        return (x, y, z)

    def _uncertainty(self, key: Key, value: Any, kind: Kind) -> dict[str, float]:
        """Standard uncertainties by observable: one text for each dimension, or by column."""
        observed = dict(kind.reads) or {observable: observable for observable in kind.fixed}
        if isinstance(value, dict):
            result = {}
            for word, entry in value.items():
                if word not in observed:
                    self._unknown_key((*key, word), observed)
                    continue
                dimension = _dimension(observed[word])
                result[observed[word]] = self._positive((*key, word), entry, (dimension,))[0]
            return result
        entries = value if isinstance(value, list) else [value]
        dimensions = tuple(dict.fromkeys(map(_dimension, observed.values())))
        result = {}
        for index, entry in enumerate(entries):
            where = (*key, index) if isinstance(value, list) else key
            amount, dimension = self._positive(where, entry, dimensions)
            same = [name for name in observed.values() if _dimension(name) == dimension]
            if not result.keys().isdisjoint(same):
                plural = DIMENSIONS[dimension].plural
                expected = f"one for all {plural}, or a table by column"
                self._refuse(
                    Fault("excluding-keys", f"two uncertainties of {plural}"),
                    where,
                    entry,
                    expected,
                )
            result.update(dict.fromkeys(same, amount))
        return result

    def _positive(self, key: Key, value: Any, dimensions: tuple[str, ...]) -> tuple[float, str]:
        """A number above zero of one of the dimensions, and of which.

        Of a unit vector's components an angle is as good: a small one is how far they move.
        """
        tried = (*dimensions, "angle") if dimensions == ("ratio",) else dimensions
        for dimension in tried:
            try:
                amount = _NO_UNITS.read(value, dimension)
            except QuantityError as error:
                if error.code == "wrong-dimension" and dimension != tried[-1]:
                    continue
                self._quantity(key, error, [DIMENSIONS[name].phrase for name in tried])
            if amount > 0.0:
                return amount, dimension if dimension in dimensions else dimensions[0]
            self._refuse(
                Fault("not-positive", "a standard uncertainty is above zero"),
                key,
                value,
                f"{DIMENSIONS[dimension].phrase} above zero",
            )
        raise _RefusedError

    def _three(self, key: Key, value: Any, dimension: str) -> Vector:
        example = DIMENSIONS[dimension].example.partition(" ")[2]
        unit = f" {example}" if example else ""
        if not isinstance(value, list) or len(value) != 3:
            found = f"a list of {len(value)}" if isinstance(value, list) else type_phrase(value)
            self._refuse(
                Fault(
                    "wrong-type",
                    f"expected a list of 3 {DIMENSIONS[dimension].plural}, found {found}",
                ),
                key,
                value,
                f'["0{unit}", "0{unit}", "1{unit}"]' if unit else "[0, 0, 1]",
            )
        x, y, z = (
            self._number((*key, index), entry, dimension) for index, entry in enumerate(value)
        )
        return (x, y, z)

    def _number(self, key: Key, value: Any, dimension: str) -> float:
        try:
            return _NO_UNITS.read(value, dimension)
        except QuantityError as error:
            self._quantity(key, error, [DIMENSIONS[dimension].phrase])

    def _text(self, key: Key) -> str | None:
        value = self.document.value(key)
        if isinstance(value, str):
            return value
        self._tell(
            Fault(
                "wrong-type",
                f"expected text, found {type_phrase(value)}",
                found=shown_value(value),
                expected="the name of a machine",
            ),
            key,
        )
        return None

    def _quantity(self, key: Key, error: QuantityError, wanted: list[str]) -> NoReturn:
        hint = error.hint
        if error.code == "no-unit":
            hint = "write the unit with the number, in quotation marks"
        expected = error.expected if len(wanted) == 1 else " or ".join(wanted)
        self._tell(replace(error.fault, expected=expected, hint=hint), key)
        raise _RefusedError

    def _refuse(self, fault: Fault, key: Key, value: Any, expected: str) -> NoReturn:
        self._tell(replace(fault, found=shown_value(value), expected=expected), key)
        raise _RefusedError

    def _check_keys(self, key: Key, table: dict[str, Any], known: Iterable[str]) -> None:
        """Refuse the keys of a table that are not among the `known` ones."""
        for word in table:
            if word not in known:
                self._unknown_key((*key, word), known)

    def _unknown_key(self, key: Key, known: Iterable[str]) -> None:
        word, words = str(key[-1]), list(known)
        self._tell(
            Fault(
                "unknown-key",
                "unknown key",
                found=word,
                expected=one_of(words) if words else "no key",
                hint=did_you_mean(word, words),
            ),
            key,
        )

    def _tell(self, fault: Fault, key: Key) -> None:
        self.header.problems.append(self.document.problem(fault, key))


def _dimension(observable: str) -> str:
    return BY_UNIT[si_unit(observable)]
