"""`[cost]` of a file that validates, for the machine that it describes."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from itertools import pairwise
from pathlib import Path
from typing import Any

import tomlkit

from truepose._kernel import Machine as KernelMachine
from truepose.errors import Fault, Problem, ReadingError
from truepose.files.data_file import Column, DataFiles, DataTable
from truepose.files.dimensions import BY_UNIT, DIMENSIONS
from truepose.files.document import Document, Key
from truepose.files.tolerance_standards import canonical, designations, half_band
from truepose.files.units import shown_value, type_phrase
from truepose.files.wording import did_you_mean, one_of
from truepose.machine.costs import CostLaw, Costs, DesignChoice, DesignOption, ToleranceCost, tie_of
from truepose.machine.families.parameters import FamilyParameters
from truepose.machine.parts import gives_way_only
from truepose.machine.tables.cost import ChoiceTable, CostTable, OptionTable, ToleranceCostTable
from truepose.machine.validation import Validated

_PLUS_MINUS = re.compile(r"^\s*+(?:\+-|\+/-|±)\s*+")
_RANGE = re.compile(r"[^:,]++:[^:,]++")
_GRADE = "IT"


def costs(
    document: Document,
    validated: Validated,
    kernel: KernelMachine,
    family: FamilyParameters | None,
    parts: Iterable[str],
    data_files: DataFiles,
    problems: list[Problem],
) -> Costs | None:
    """What may be chosen; None where the file says nothing of it.

    `parts`: paths of the machine's parts. Every problem of it goes into `problems`.
    """
    table = validated.table(CostTable)
    if table is None:
        return None
    reading = _Reading(document, validated, kernel, family, tuple(parts), data_files, problems)
    tolerances = [
        read
        for number, row in enumerate(table.tolerance)
        if (read := reading.tolerance(row, ("cost", "tolerance", number))) is not None
    ]
    choices = [
        chosen
        for number, choice in enumerate(table.choice)
        if (chosen := reading.choice(choice, ("cost", "choice", number))) is not None
    ]
    return Costs(
        table.unit.strip(),
        tuple(tolerances),
        tuple(choices),
        document.text,
        str(Path(document.file).parent),
    )


@dataclass
class _Feature:
    """A parameter that may have a tolerance: its name, SI unit and nominal size."""

    name: str
    unit: str
    size: float


class _Reading:
    """The rows one by one, with what the rows before them are about."""

    def __init__(
        self,
        document: Document,
        validated: Validated,
        kernel: KernelMachine,
        family: FamilyParameters | None,
        parts: tuple[str, ...],
        data_files: DataFiles,
        problems: list[Problem],
    ) -> None:
        self._document, self._units = document, validated.units
        self._parts, self._data_files, self._problems = parts, data_files, problems
        sizes = zip(kernel.parameters, kernel.units, kernel.nominal.tolist(), strict=True)
        self._features = [_Feature(*one) for one in sizes if not gives_way_only(one[0])]
        if family is not None:
            self._features += [
                _Feature(name, family.unit(name), family.value(name)) for name in family.names
            ]
        self._taken: dict[str, str] = {}
        self._choice_names: dict[str, str] = {}

    def _refuse(self, fault: Fault, key: Key) -> None:
        self._problems.append(self._document.problem(fault, key))

    # --- tolerances

    def tolerance(self, row: ToleranceCostTable, key: Key) -> ToleranceCost | None:
        """One `[[cost.tolerance]]`; None, and a problem, where it is no good."""
        path, before = self._document.path(key), len(self._problems)
        features = self._matching(row.of, key)
        self._distinct([feature.name for feature in features], path, key)
        if not features or len(self._problems) > before:
            return None
        unit = features[0].unit
        law = self._law(row, BY_UNIT[unit], key)
        grades, halves, told = self._grades(row, features, key)
        if len(self._problems) > before or not grades:
            return None
        names = dict.fromkeys(tie_of(feature.name, row.tie) for feature in features)
        ties = tuple(
            tuple(at for at, one in enumerate(features) if tie_of(one.name, row.tie) == name)
            for name in names
        )
        costs = [
            tuple(told[grade] if law is None else law.of(min(half[m] for m in tie)) for tie in ties)
            for grade, half in enumerate(halves)
        ]
        if not all(math.isfinite(cost) for of_grade in costs for cost in of_grade):
            self._refuse(
                Fault(
                    "not-finite",
                    "the finest of these bands costs more than any number",
                    found=f"{grades[0]} at a scale of {shown_value(row.scale)}",
                    expected="a scale that is not tiny beside the bands",
                ),
                key,
            )
            return None
        return ToleranceCost(
            path,
            self._document.line(key),
            row.of,
            unit,
            tuple(feature.name for feature in features),
            ties,
            tuple(names),
            tuple(grades),
            tuple(halves),
            tuple(costs),
            law,
        )

    def _matching(self, of: str, key: Key) -> list[_Feature]:
        """The parameters that a row is for, of one dimension; none, and a problem, if not so."""
        where = (*key, "of")
        matches = [one for one in self._features if one.name == of]
        matches = matches or [one for one in self._features if fnmatchcase(one.name, of)]
        kinds = {one.unit: one.name for one in reversed(matches)}
        if not matches:
            names = [one.name for one in self._features]
            self._refuse(
                Fault(
                    "cost-matches-nothing",
                    f"no parameter of this machine matches {of!r}",
                    found=of,
                    expected='a parameter name, or a pattern such as "strut.*.base.x"',
                    hint=did_you_mean(of, names),
                ),
                where,
            )
        elif len(kinds) > 1:
            named = [DIMENSIONS[BY_UNIT[unit]].plural for unit in kinds]
            self._refuse(
                Fault(
                    "tolerance-mixes-kinds",
                    f"{of!r} matches {' and '.join(named)}, which cannot be tied or have one band",
                    found=", ".join(kinds.values()),
                    expected="parameters of one kind in one [[cost.tolerance]]",
                    hint='a row for each kind, such as of = "drive.*.offset"',
                ),
                where,
            )
            return []
        return matches

    def _distinct(self, names: Sequence[str], path: str, key: Key) -> None:
        doubled = [name for name in names if name in self._taken]
        if doubled:
            more = f", as are {len(doubled) - 1} more" if len(doubled) > 1 else ""
            self._refuse(
                Fault(
                    "cost-twice",
                    f"{doubled[0]} is given two costs{more}",
                    found=f"{path} and {self._taken[doubled[0]]}",
                    expected="one [[cost.tolerance]] for a parameter",
                ),
                (*key, "of"),
            )
        self._taken |= dict.fromkeys(names, path)

    def _law(self, row: ToleranceCostTable, dimension: str, key: Key) -> CostLaw | None:
        if row.table is not None:
            return None
        at = self._half(row.at, dimension, (*key, "at"))
        scale = None
        if row.scale is not None:
            scale = self._half(row.scale, dimension, (*key, "scale"))
        if at is None or (row.scale is not None and scale is None):
            return None
        assert row.cost is not None
        return CostLaw(row.cost, at, 2 if row.model == "reciprocal-square" else 1, scale)

    def _half(self, value: Any, dimension: str, key: Key) -> float | None:
        """A half width above zero, SI; None, and a problem, where it is none."""
        if isinstance(value, str):
            value = _PLUS_MINUS.sub("", value)
        try:
            half = self._units.read(value, dimension)
        except ReadingError as error:
            self._refuse(error.fault, key)
            return None
        if half > 0.0:
            return half
        self._refuse(
            Fault(
                "not-positive",
                "a half width is above zero",
                found=shown_value(value),
                expected=f"{DIMENSIONS[dimension].phrase} above zero",
                hint="what has no tolerance at all needs no cost",
            ),
            key,
        )
        return None

    def _grades(
        self, row: ToleranceCostTable, features: list[_Feature], key: Key
    ) -> tuple[list[str], list[tuple[float, ...]], list[float]]:
        """Names, half widths (n_feature,) and, of a table, costs of the grades from the finest."""
        dimension = BY_UNIT[features[0].unit]
        if row.grades is not None:
            names = self._standard(row.grades, dimension, (*key, "grades"))
            return names, self._sized(names, features, (*key, "grades")), []
        if row.table is not None:
            table = self._data_files.read(
                row.table,
                (Column("band", dimension), Column("cost", "ratio")),
                (*key, "table"),
            )
            listed = [] if table is None else self._tabled(table)
        else:
            listed = self._listed(row.bands, dimension, (*key, "bands"))
        listed.sort(key=lambda one: one[1])
        return (
            [name for name, _, _ in listed],
            [(half,) * len(features) for _, half, _ in listed],
            [cost for _, _, cost in listed],
        )

    def _listed(self, given: Any, dimension: str, key: Key) -> list[tuple[str, float, float]]:
        if not isinstance(given, list) or not given:
            self._refuse(
                Fault(
                    "wrong-type",
                    f"expected a list of half widths, found {type_phrase(given)}",
                    found=shown_value(given),
                    expected='a list, such as ["5 um", "10 um", "20 um"]',
                ),
                key,
            )
            return []
        listed: list[tuple[str, float, float]] = []
        for number, value in enumerate(given):
            half = self._half(value, dimension, (*key, number))
            if half is None:
                continue
            if any(half == other for _, other, _ in listed):
                self._refuse(
                    Fault(
                        "duplicate-name",
                        "the same half width twice",
                        found=shown_value(value),
                        expected="every half width once",
                    ),
                    (*key, number),
                )
            unit = self._units.shown()[dimension].label
            name = value.strip() if isinstance(value, str) else f"{value:g} {unit}"
            listed.append((name, half, 0.0))
        return listed

    def _tabled(self, table: DataTable) -> list[tuple[str, float, float]]:
        """The rows of a table of bands and costs; problems where costs fall with a finer band."""
        bands, costs = table.numbers["band"], table.numbers["cost"]
        for row in range(table.n_row):
            for column, low in (("band", 0.0), ("cost", -math.inf)):
                value = float(table.numbers[column][row])
                if value <= low or value < 0.0:
                    self._problems.append(
                        table.problem(
                            Fault(
                                "not-positive" if column == "band" else "negative",
                                "a half width is above zero, and a cost zero or more",
                                found=table.shown(column, row),
                                expected="a number above zero",
                            ),
                            row=row,
                            column=column,
                        )
                    )
        order = sorted(range(table.n_row), key=lambda row: float(bands[row]))
        for finer, wider in pairwise(order):
            if bands[finer] == bands[wider] or costs[finer] < costs[wider]:
                twice = bool(bands[finer] == bands[wider])
                self._problems.append(
                    table.problem(
                        Fault(
                            "cost-twice" if twice else "cost-falls",
                            f"{table.shown('band', finer)} "
                            + ("stands there twice" if twice else "costs less than a wider band"),
                            found=f"{table.shown('cost', finer)}, and "
                            f"{table.shown('cost', wider)} for {table.shown('band', wider)}",
                            expected="a cost that never falls as the band gets finer",
                        ),
                        row=finer,
                        column="cost",
                    )
                )
        return [
            (table.shown("band", row), float(bands[row]), float(costs[row]))
            for row in range(table.n_row)
        ]

    def _standard(self, text: str, dimension: str, key: Key) -> list[str]:
        """The grades that a text such as "IT5:IT12" names, from the finest."""
        every = [name for name in designations("length") if name.startswith(_GRADE)]
        if dimension != "length":
            self._refuse(
                Fault(
                    "unknown-tolerance-class",
                    f"grades of ISO 286-1 for {DIMENSIONS[dimension].plural}",
                    found=shown_value(text),
                    expected="bands, as grades are of lengths",
                ),
                key,
            )
            return []
        try:
            if _RANGE.fullmatch(text):
                first, last = (every.index(canonical(one)) for one in text.split(":"))
                return every[min(first, last) : max(first, last) + 1]
            return sorted({canonical(one) for one in text.split(",")}, key=every.index)
        except ReadingError as error:
            self._refuse(error.fault, key)
        except ValueError:  # a class of ISO 2768, which is no grade
            self._refuse(
                Fault(
                    "unknown-tolerance-class",
                    "a class that is no grade of ISO 286-1",
                    found=shown_value(text),
                    expected='grades, such as "IT5:IT12"',
                ),
                key,
            )
        return []

    def _sized(
        self, names: Sequence[str], features: list[_Feature], key: Key
    ) -> list[tuple[float, ...]]:
        """Half widths (n_feature,) of grades: by each feature's own size."""
        halves: list[tuple[float, ...]] = []
        for name in names:
            try:
                halves.append(tuple(half_band(name, feature.size) for feature in features))
            except ReadingError as error:
                lacking = next((one for one in features if one.size == 0.0), None)
                fault = error.fault.about(lacking.name if lacking else None)
                self._refuse(fault, key)
                return []
        return halves

    # --- choices

    def choice(self, row: ChoiceTable, key: Key) -> DesignChoice | None:
        """One `[[cost.choice]]`; None, and a problem, where it is no good."""
        path, before = self._document.path(key), len(self._problems)
        parts = [part for part in self._parts if fnmatchcase(part, row.of)]
        if not parts:
            self._refuse(
                Fault(
                    "cost-matches-nothing",
                    f"this machine has no part {row.of!r}",
                    found=row.of,
                    expected=one_of(self._parts),
                    hint=did_you_mean(row.of, self._parts),
                ),
                (*key, "of"),
            )
        if row.name in self._choice_names:
            self._refuse(
                Fault(
                    "duplicate-name",
                    "two choices of one name",
                    found=f"{row.name}: {path} and {self._choice_names[row.name]}",
                    expected="a name of its own for every choice",
                ),
                (*key, "name"),
            )
        self._choice_names[row.name] = path
        keys = dict.fromkeys(name for option in row.options for name in option.set)
        self._distinct([f"{part}.{name}" for part in parts for name in keys], path, key)
        options = tuple(
            self._option(option, (*key, "options", number))
            for number, option in enumerate(row.options)
        )
        if len(self._problems) > before:
            return None
        line = self._document.line(key)
        return DesignChoice(row.name, tuple(parts), row.tie, options, path, line)

    def _option(self, option: OptionTable, key: Key) -> DesignOption:
        settings = tuple((name, as_toml(value)) for name, value in option.set.items())
        path, line = self._document.path(key), self._document.line(key)
        return DesignOption(option.name, settings, option.cost, path, line)


def as_toml(value: Any) -> str:
    """A value as one line of TOML."""
    if isinstance(value, dict):
        inner = ", ".join(
            f"{tomlkit.key(key).as_string()} = {as_toml(entry)}" for key, entry in value.items()
        )
        return f"{{ {inner} }}" if inner else "{}"
    if isinstance(value, list):
        return f"[{', '.join(map(as_toml, value))}]"
    text: str = tomlkit.item(value).as_string()
    return text
