"""`[[correlation]]`: variables of tolerances that are correlated, but not one and the same.

Every pair of the variables that a row names has its coefficient, Pearson's: one for all pairs, or a
matrix of them. A variable is a parameter's own, or that of a group of tolerances.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
from pydantic import Field

from truepose.arrays import Floats
from truepose.errors import Fault
from truepose.files.file_table import FileTable
from truepose.files.varies import HINT
from truepose.files.wording import counted
from truepose.probability.semidefinite import clash
from truepose.sources.deviation import Deviation

if TYPE_CHECKING:
    from truepose.machine import SourceBuilder


class CorrelationTable(FileTable):
    """Tolerances that are correlated: made alike, on one machine, say, or in one batch."""

    between: list[str] = Field(
        min_length=1,
        description="What is correlated: parameter names or patterns over them, as in "
        "`[tolerance]`, or groups of tolerances; at least two variables in all.",
    )
    coefficient: float | None = Field(
        None, description="Pearson correlation coefficient of every two of them, from -1 to 1."
    )
    matrix: list[list[float]] | None = Field(
        None,
        description="In its place, the coefficient of each two: the correlation matrix below its "
        "diagonal, row by row. Its first row is the second name with the first, its second row "
        "the third name with the first and the second, and so on. `between` is then full names.",
    )


def read_correlation(parts: SourceBuilder, bands: Deviation) -> Floats | None:
    """(n_variable, n_variable) of the variables of `bands`; None where all are independent.

    Or where a problem is recorded: names that match nothing, fewer than two variables, a pair that
    is given twice, coefficients that are none or cannot all hold.
    """
    rows = parts.rows(CorrelationTable)
    if not rows:
        return None
    names = _Names(parts, bands)
    matrix = np.eye(bands.n_variable)
    ways = dict(zip(bands.variables.tolist(), (way.word for way in bands.variation), strict=True))
    given: dict[tuple[int, int], str] = {}
    before = len(parts.problems)
    for index, row in enumerate(rows):
        path = f"correlation.#{index + 1}"
        pairs = _coefficients(parts, names, row, path)
        doubled = [pair for pair in pairs if pair in given]
        if doubled:
            one, other = (names.of_variable[number] for number in doubled[0])
            parts.refuse(
                Fault(
                    "correlation-twice",
                    f"{one} and {other} are given a correlation twice",
                    found=f"in {path} and in {given[doubled[0]]}",
                    expected="one coefficient for each pair",
                ),
                path,
            )
        given |= dict.fromkeys(pairs, path)
        _require_one_way(parts, names.of_variable, ways, pairs, path)
        for (i, j), coefficient in pairs.items():
            matrix[i, j] = matrix[j, i] = coefficient
    if len(parts.problems) > before:
        return None
    problem = clash(names.of_variable, matrix)
    if problem is None:
        return matrix
    parts.refuse(problem.fault, "correlation")
    return None


def _coefficients(
    parts: SourceBuilder, names: _Names, row: CorrelationTable, path: str
) -> dict[tuple[int, int], float]:
    """The coefficient of each pair of variables (the lower number first) that a row states.

    None of them, and problems, where something is wrong.
    """
    if (row.coefficient is None) == (row.matrix is None):
        given = row.coefficient is not None
        parts.refuse(
            Fault(
                "excluding-keys" if given else "missing-key",
                "a correlation is given by one coefficient or by a matrix of them",
                found="coefficient and matrix" if given else "neither",
                expected="coefficient or matrix",
            ),
            path,
        )
        return {}
    if row.coefficient is not None:
        _require_coefficients(parts, [row.coefficient], f"{path}.coefficient")
        return dict.fromkeys(combinations(names.numbers(row.between, path), 2), row.coefficient)
    assert row.matrix is not None
    before = len(parts.problems)
    _require_shape(parts, row.between, row.matrix, f"{path}.matrix")
    for index, line in enumerate(row.matrix):
        where = f"{row.between[index + 1]}: " if index + 1 < len(row.between) else ""
        _require_coefficients(parts, line, f"{path}.matrix", where)
    numbers = names.in_order(row.between, path)
    if len(parts.problems) > before:
        return {}
    return {
        (min(numbers[i + 1], numbers[j]), max(numbers[i + 1], numbers[j])): coefficient
        for i, line in enumerate(row.matrix)
        for j, coefficient in enumerate(line)
    }


def _require_one_way(
    parts: SourceBuilder,
    names: Sequence[str],
    ways: Mapping[int, str],
    pairs: Mapping[tuple[int, int], float],
    path: str,
) -> None:
    """Record a problem for the first correlated pair that varies with two things."""
    for (i, j), coefficient in pairs.items():
        if coefficient != 0.0 and ways[i] != ways[j]:
            parts.refuse(
                Fault(
                    "excluding-keys",
                    f"{names[i]} varies with the {ways[i]} and {names[j]} with the {ways[j]}: "
                    "they are not drawn together",
                    found=f'varies = "{ways[i]}" and "{ways[j]}" in one correlation',
                    expected="variables that vary with the same",
                    hint=HINT,
                ),
                path,
            )
            return


def _require_coefficients(
    parts: SourceBuilder, coefficients: Sequence[float], path: str, where: str = ""
) -> None:
    """Record a problem for the first of them that is no number from -1 to 1."""
    for coefficient in coefficients:
        if not -1.0 <= coefficient <= 1.0:
            parts.refuse(
                Fault(
                    "bad-correlation",
                    f"{where}a correlation coefficient is from -1 to 1",
                    found=f"{coefficient:g}",
                    expected="a number from -1 to 1",
                ),
                path,
            )
            return


def _require_shape(
    parts: SourceBuilder, between: Sequence[str], matrix: Sequence[Sequence[float]], path: str
) -> None:
    """Record a problem where a matrix has not one row for each name after the first."""
    found, wanted = [len(line) for line in matrix], list(range(1, len(between)))
    if found == wanted:
        return
    shown = counted(len(matrix), "row")
    message = f"a matrix of {shown} for {counted(len(between), 'name')}"
    if len(found) == len(wanted):
        row = next(at for at in range(len(found)) if found[at] != wanted[at])
        shown = counted(found[row], "coefficient")
        message = f"row {row + 1} ({between[row + 1]}) has {shown}"
    parts.refuse(
        Fault(
            "correlation-matrix-shape",
            message,
            found=shown,
            expected=f"{counted(len(wanted), 'row')} of 1, 2, ... coefficients: each name after "
            "the first with all before it",
        ),
        path,
    )


class _Names:
    """What the words of `between` may stand for.

    `of_variable` (n_variable): what each variable is called: its group, or its parameter.
    """

    def __init__(self, parts: SourceBuilder, bands: Deviation) -> None:
        self._parts = parts
        self._parameters = parts.kernel.parameters
        self._groups: dict[str, int] = {}
        self._variable: dict[str, int] = {}
        self.of_variable = [""] * bands.n_variable
        columns = zip(bands.parameters, bands.groups, bands.variables.tolist(), strict=True)
        for parameter, group, number in columns:
            name = self._parameters[parameter]
            # What a family's parameter moves does not stand for it.
            if int(group) not in bands.group_quantities:
                self._variable[name] = number
            self.of_variable[number] = bands.group_names.get(int(group), name)
            if int(group) in bands.group_names:
                self._groups[bands.group_names[int(group)]] = number

    def numbers(self, between: Sequence[str], path: str) -> list[int]:
        """Numbers of the variables, ascending, each named by one entry; none where one is wrong."""
        taken: dict[int, str] = {}
        fine = True
        for word in between:
            variable = self._of(word, path)
            doubled = next((number for number in variable if number in taken), None)
            if doubled is not None:
                self._parts.refuse(
                    Fault(
                        "correlation-twice",
                        f"{taken[doubled]!r} and {word!r} are one variable: "
                        f"{self.of_variable[doubled]}",
                        found=f"{taken[doubled]}, {word}",
                        expected="each variable once; a group is one",
                    ),
                    f"{path}.between",
                )
            fine = fine and bool(variable) and doubled is None
            taken |= dict.fromkeys(variable, word)
        if fine and len(taken) < 2:
            self._parts.refuse(
                Fault(
                    "correlation-too-few",
                    "a correlation is between two variables or more",
                    found=f"{counted(len(taken), 'variable')}: "
                    f"{', '.join(self.of_variable[number] for number in taken)}",
                    expected="two parameters or more that vary by themselves, or groups",
                ),
                f"{path}.between",
            )
        return sorted(taken) if fine and len(taken) > 1 else []

    def in_order(self, between: Sequence[str], path: str) -> list[int]:
        """Numbers of the variables in the order named; none where one is wrong, or a pattern."""
        if self.numbers(between, path) == []:
            return []
        for word in between:
            if word not in self._groups and word not in self._variable:
                self._parts.refuse(
                    Fault(
                        "correlation-pattern",
                        f"{word!r} is a pattern, and a matrix has its names in their order",
                        found=word,
                        expected="full names of parameters, or groups",
                    ),
                    f"{path}.between",
                )
        return [self._groups.get(word, self._variable.get(word, -1)) for word in between]

    def _of(self, word: str, path: str) -> list[int]:
        """The variables that a group's name, a parameter's or a pattern stands for."""
        if word in self._groups:
            return [self._groups[word]]
        if word in self._variable:
            return [self._variable[word]]
        matching = [name for name in self._variable if fnmatchcase(name, word)]
        if matching:
            return list(dict.fromkeys(self._variable[name] for name in matching))
        without = [name for name in self._parameters if name == word or fnmatchcase(name, word)]
        self._parts.refuse(
            Fault(
                "correlation-matches-nothing",
                f"{without[0]} has no tolerance"
                if without
                else f"no tolerance is of, or is grouped as, {word!r}",
                found=word,
                expected="a parameter that has a tolerance, a pattern over such, or a group of "
                "them",
                hint=None
                if without
                else self._parts.suggest(word, [*self._groups, *self._variable, *self._parameters]),
            ),
            f"{path}.between",
        )
        return []
