"""A complete machine file from a family's parameters: `truepose init KIND --radius 138 ...`.

What the parameters do not say is the library's machine of the family. Its workspace goes with the
size of the machine (`MachineFamily.size`, about `level`), smaller where not all of it is reached;
a travel is what the workspace needs and a tenth of it at either end. Tolerances, sections,
materials, temperatures and forces stay.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np
import tomlkit
from pydantic import BaseModel

from truepose.errors import MachineFileError, Problem, RequestError
from truepose.files.dimensions import DIMENSIONS, FREEDOMS
from truepose.files.document import Document
from truepose.files.toml_text import TomlError, parse_toml
from truepose.files.units import UnitSystem, unit_of
from truepose.machine.families._family import MachineFamily
from truepose.machine.library import machine_of
from truepose.machine.tables import owners
from truepose.machine.validation import units_of, validate_alone

if TYPE_CHECKING:
    from truepose.machine.model import Machine

Load = Callable[[Path], "Machine"]

UNITS = {"length": "mm", "angle": "deg"}
"""Of bare numbers among the parameters given, and of the file written."""

_WIDE = 1e3
"""Travel with which a workspace is tried, in sizes of the machine."""

_SHORTEST = 0.75
"""Of the shortest strut of the library's machine at this size, where its limb has beams."""

_MARGIN = 0.1
_SMALLER = 0.9
_TRIES = 60
_DIGITS = 3
"""Of a workspace; a travel has them of its span."""

_TABLES = ("drive", "strut", "guide")


def template(family: type[MachineFamily], given: Mapping[str, str], load: Load) -> str:
    """The text of a machine file; `given`: parameters as written, bare numbers in `UNITS`.

    Raises `RequestError` with all that is wrong with what was given, or home-unreachable where the
    machine reaches nothing of its workspace.
    """
    made = _parameters(family, given)
    library = machine_of(family.kind)
    return _Template(family, given, made, tomlkit.parse(library.text), load).text()


def _parameters(family: type[MachineFamily], given: Mapping[str, str]) -> MachineFamily:
    table = {"kind": family.kind, **{key: _value(text) for key, text in given.items()}}
    document = Document("", "", "", {"units": UNITS, "family": table})
    validated, problems = validate_alone(document, owners(()), "family")
    if validated.family is None:
        raise RequestError(*(_of_option(problem) for problem in problems))
    return validated.family


def _of_option(problem: Problem) -> Problem:
    """A problem of a key told of the option that gave it."""
    option = "--" + (problem.path or "").removeprefix("family.").replace("_", "-")
    fault = problem.fault.about(None)
    message = fault.message.removeprefix(f"{problem.path}: ")
    return Problem(
        problem.code,
        f"{option}: {message}",
        path=option,
        found=problem.found,
        expected=problem.expected,
        hint=problem.hint,
    )


class _Template:
    def __init__(
        self,
        family: type[MachineFamily],
        given: Mapping[str, str],
        made: MachineFamily,
        toml: tomlkit.TOMLDocument,
        load: Load,
    ) -> None:
        self._family, self._given, self._made = family, given, made
        self._toml, self._load = toml, load
        plain: dict[str, Any] = toml.unwrap()
        document = Document(
            "", "", "", {**plain, "family": {"kind": family.kind, **family.example}}
        )
        library = validate_alone(document, owners(()), "family")[0].family
        assert library is not None
        self._ratio = made.size() / library.size()
        self._levels = library.level(), made.level()
        self._old_units = units_of(document)
        self._units = UnitSystem(
            {name: unit_of(word, DIMENSIONS[name]) for name, word in UNITS.items()}
        )
        common = plain.get("each", {}).get("drive", {})
        travels = [(common | row)["travel"] for row in plain["drive"]]
        self._alike = all(travel == travels[0] for travel in travels)
        self._rows = {
            table: {row.name: row for row in made.real_rows() if row.table == table}
            for table in _TABLES
        }

    def text(self) -> str:
        """The file, with the largest workspace of the library's form that is reached."""
        self._scale_lengths()
        rows = {table: self._own_rows(table) for table in _TABLES}
        axes = self._workspace(1.0)
        share = 1.0
        for _ in range(_TRIES):
            axes = self._workspace(share)
            machine = self._tried(rows, axes)
            joints, status = machine.inverse(machine.poses(), status=True)
            # Within the travel there is, or with an angle that does not scale.
            if not status.any():
                self._set_travels(rows, machine, joints)
                return self._written(rows, axes)
            share *= _SMALLER
        raise RequestError(
            Problem(
                "home-unreachable",
                f"a {self._family.kind} of these parameters reaches nothing of its workspace",
                found=", ".join(f"{key} {text}" for key, text in self._given.items()),
                expected="parameters of which a machine can be made",
                hint=f"`truepose init {self._family.kind} --help` has the drawing",
            )
        )

    # --- what goes with the size

    def _length(self, value: Any) -> float:
        """A length of the library's file, m."""
        return self._old_units.read(value, "length")

    def _mm(self, metres: float) -> float:
        return float(self._units.declared["length"].to_file(metres))

    def _scale_lengths(self) -> None:
        machine = self._toml["machine"]
        if "tool" in machine:
            machine["tool"] = [self._mm(self._length(v) * self._ratio) for v in machine["tool"]]
        for row in (*self._toml.get("limb", ()), self._toml.get("each", {}).get("limb", {})):
            for part in row.get("chain", ()):
                if "length" in part:
                    part["length"] = self._mm(self._length(part["length"]) * self._ratio)
        anchor = self._toml.get("frame", {}).get("anchor")
        if anchor is not None:
            self._toml["frame"]["anchor"] = [
                self._mm(self._length(v) * self._ratio) for v in anchor
            ]
        if self._toml["units"].get("length") != UNITS["length"]:
            # Bands of a file in other units keep theirs.
            self._keep_units(self._toml.get("tolerance", {}))
        self._toml["units"]["length"] = UNITS["length"]

    def _keep_units(self, table: Any) -> None:
        unit = self._old_units.declared["length"].label
        for key, value in table.items():
            if isinstance(value, list):
                table[key] = [f"{entry!r} {unit}" for entry in value]
            elif isinstance(value, float | int):
                table[key] = f"{value!r} {unit}"

    def _workspace(self, share: float) -> dict[str, dict[str, Any]]:
        """The library's grid and home at this size; `share` of it about its middle."""
        workspace = self._toml["workspace"]
        axes = {}
        for freedom, (start, stop, count) in workspace["grid"].items():
            if FREEDOMS[freedom] == "length":
                ends = np.array([self._place(freedom, end) for end in (start, stop)])
                middle = ends.mean()
                low, high = (self._mm(middle + share * (end - middle)) for end in ends)
                digits = _DIGITS - 1 - math.floor(math.log10(max(high - low, 1e-9)))
                axes[freedom] = [round(low, digits), round(high, digits), count]
            else:
                axes[freedom] = [start * share, stop * share, count]
        made: dict[str, dict[str, Any]] = {"grid": axes}
        home = dict(workspace.get("home", {}))
        if home and "z" not in self._made.home():
            made["home"] = {
                freedom: self._mm(self._place(freedom, value))
                if FREEDOMS[freedom] == "length"
                else value
                for freedom, value in home.items()
            }
        return made

    def _place(self, freedom: str, value: Any) -> float:
        """A coordinate of the library's machine at this one's size, m."""
        before, after = self._levels if freedom == "z" else (0.0, 0.0)
        return after + self._ratio * (self._length(value) - before)

    # --- rows

    def _own_rows(self, table: str) -> dict[str, dict[str, Any]]:
        """Of each row what the family does not give, by name, `[each.*]` in it."""
        common = dict(self._toml.get("each", {}).get(table, {}))
        there = {row["name"]: dict(row) for row in self._toml.get(table, ())}
        return {
            name: {
                key: value
                for key, value in {**common, **there.get(name, {})}.items()
                if key not in {"name", *row.words, *row.numbers, *row.defaults}
            }
            for name, row in self._rows[table].items()
        }

    def _tried(self, rows: dict[str, dict[str, dict[str, Any]]], axes: Any) -> Machine:
        """The machine with travels in which lengths are free."""
        wide = self._mm(self._made.size()) * _WIDE
        tried = {table: {name: dict(row) for name, row in of.items()} for table, of in rows.items()}
        for name, row in tried["drive"].items():
            if self._is_length(name):
                row.pop("fixed_at", None)
                row.pop("offset", None)
                row["travel"] = [self._shortest(row) if self._sets_length(name) else -wide, wide]
        with TemporaryDirectory() as folder:
            path = Path(folder) / f"{self._family.kind}.toml"
            path.write_text(self._written(tried, axes), encoding="utf-8")
            try:
                return self._load(path)
            except MachineFileError as error:
                raise RequestError(
                    *(
                        Problem(
                            problem.code,
                            problem.message,
                            path=problem.path,
                            found=problem.found,
                            expected=problem.expected,
                            hint=problem.hint,
                        )
                        for problem in error.problems
                    )
                ) from error

    def _kind(self, drive: str) -> str:
        return self._rows["drive"][drive].words["kind"]

    def _is_length(self, drive: str) -> bool:
        return self._kind(drive) != "crank"

    def _sets_length(self, drive: str) -> bool:
        return self._kind(drive) == "telescopic"

    def _shortest(self, row: Mapping[str, Any]) -> float:
        """Of a telescopic strut, mm: it has to hold what its limb is made of."""
        if "limb" not in self._toml:
            return self._mm(1e-9)
        return self._mm(_SHORTEST * self._ratio * self._length(row["travel"][0]))

    def _set_travels(self, rows: Any, machine: Machine, joints: np.ndarray) -> None:
        spans = [
            (float(of.min()), float(of.max())) for of in joints.reshape(-1, joints.shape[-1]).T
        ]
        by_name = dict(zip(machine.joints, spans, strict=True))
        home = machine.inverse(
            machine.home[[machine.dof.index(name) for name in machine.commanded]]
        )
        for name, row in rows["drive"].items():
            if not self._is_length(name):
                continue
            ends = by_name[name]
            if "offset" in row:
                # The coordinate is the stroke from home.
                at_home = float(home[machine.joints.index(name)])
                row["offset"] = self._mm(at_home)
                ends = (ends[0] - at_home, ends[1] - at_home)
            low, high = (self._mm(end) for end in ends)
            more = max(_MARGIN * (high - low), 1e-3 * max(abs(low), abs(high)))
            digits = _DIGITS - 1 - math.floor(math.log10(high - low + 2.0 * more))
            travel = [
                _round(low - more, digits, math.floor),
                _round(high + more, digits, math.ceil),
            ]
            if self._sets_length(name) and "offset" not in row:
                travel[0] = max(travel[0], _round(0.5 * low, digits, math.floor), 0.0)
            if "fixed_at" in row:
                # A bearing at an end of the travel is there again.
                old = [self._length(end) for end in row["travel"]]
                fixed = self._length(row["fixed_at"])
                row["fixed_at"] = (
                    travel[old.index(fixed)] if fixed in old else self._mm(fixed * self._ratio)
                )
            row["travel"] = travel
        # Drives that are alike in the library have one travel, which takes in all.
        travels = [row["travel"] for row in rows["drive"].values()]
        if self._alike and all(self._is_length(name) for name in rows["drive"]):
            one = [min(low for low, _ in travels), max(high for _, high in travels)]
            for row in rows["drive"].values():
                if row.get("fixed_at") in row["travel"]:
                    row["fixed_at"] = one[row["travel"].index(row["fixed_at"])]
                row["travel"] = one

    # --- the text

    def _written(self, rows: dict[str, dict[str, dict[str, Any]]], axes: Any) -> str:
        toml = tomlkit.parse(tomlkit.dumps(self._toml))
        for key in ("dof", "commanded"):
            toml["machine"].pop(key, None)
        toml["machine"]["name"] = self._family.kind.replace("_", " ").capitalize()
        toml["machine"]["description"] = self._family.doc
        toml["machine"]["origin"] = tomlkit.string(
            f"The parameters of the family as given; all else is that of the library's "
            f"{self._family.kind}, its workspace\ngone with the size of the machine.\n",
            multiline=True,
        )
        workspace = toml["workspace"]
        for key in [key for key in workspace if key != "grid"]:
            del workspace[key]
        workspace["grid"] = _inline({freedom: list(axis) for freedom, axis in axes["grid"].items()})
        if "home" in axes:
            workspace["home"] = _inline(axes["home"])
        each = toml.pop("each", {})
        for table in _TABLES:
            toml.pop(table, None)
        before = "".join(
            (
                self._family_text(),
                *(_rows_text(table, of, self._numbers) for table, of in rows.items()),
                *(
                    tomlkit.dumps({"each": {table: each[table]}}) + "\n"
                    for table in each
                    if table not in _TABLES
                ),
            )
        )
        text = tomlkit.dumps(toml)
        text = f"# {self._family.doc}\n" + text[text.index("schema = ") :]
        # What is the machine's shape stands after its units.
        at = re.search(r"^\[(?!machine\]|units\])", text, re.MULTILINE)
        assert at is not None
        return text[: at.start()] + before + text[at.start() :]

    def _family_text(self) -> str:
        lines = ["[family] # the joint centres follow: truepose check --expand writes them out"]
        lines.append(f'kind = "{self._family.kind}"')
        for key, text in self._given.items():
            value = tomlkit.item(_value(text)).as_string()
            doc = _model_field(self._family, key)
            lines.append(f"{key} = {value} # {doc}")
        return "\n".join([*lines, "", ""])

    def _numbers(self, key: str, value: Any) -> Any:
        """A value of a row: of a file in other units with its own."""
        if key == "length_tolerance" and self._old_units.declared["length"].label != "mm":
            unit = self._old_units.declared["length"].label
            return [f"{entry!r} {unit}" for entry in value]
        return value


def _rows_text(
    table: str, rows: dict[str, dict[str, Any]], numbers: Callable[[str, Any], Any]
) -> str:
    """`[each.*]` of what all rows say, and a row for each that says more."""
    if not rows:
        return ""
    first = next(iter(rows.values()))
    common = {
        key: value
        for key, value in first.items()
        if all(row.get(key) == value for row in rows.values())
    }
    blocks = [(f"[each.{table}]", common)] if common else []
    for name, row in rows.items():
        own = {key: value for key, value in row.items() if key not in common}
        if own:
            blocks.append((f"[[{table}]]", {"name": name, **own}))
    return "".join(f"{head}\n{''.join(_lines(keys, numbers))}\n" for head, keys in blocks)


def _lines(keys: Mapping[str, Any], numbers: Callable[[str, Any], Any]) -> Iterator[str]:
    for key, value in keys.items():
        written = numbers(key, value.unwrap() if hasattr(value, "unwrap") else value)
        shown = _inline(written) if isinstance(written, dict) else tomlkit.item(written)
        yield f"{key} = {shown.as_string()}\n"


def _inline(values: Mapping[str, Any]) -> Any:
    inline = tomlkit.inline_table()
    for key, value in values.items():
        inline[key] = _inline(value) if isinstance(value, dict) else value
    return tomlkit.value(
        "{ " + inline.as_string().strip().removeprefix("{").removesuffix("}").strip() + " }"
    )


def _value(text: str) -> Any:
    """The TOML value that a text is, or the text itself: `501 mm`."""
    try:
        return text if "\n" in text else parse_toml(f"value = {text}")["value"]
    except TomlError:
        return text


def _round(value: float, digits: int, to: Callable[[float], int]) -> float:
    scale = 10.0**digits
    return round(to(value * scale) / scale, max(digits, 0))


def _model_field(model: type[BaseModel], key: str) -> str:
    """What a parameter is, in its first sentence."""
    description = model.model_fields[key].description or ""
    return description.split(". ")[0].split(": ")[0].rstrip(".")
