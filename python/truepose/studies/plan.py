"""The plan of a study: every variant with its settings, drawn once and kept with the results."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from truepose.arrays import Floats
from truepose.errors import Problem, RequestError, TrueposeError
from truepose.files.settings import unquoted
from truepose.studies.base_machine import BaseMachine
from truepose.studies.design import laid_out
from truepose.studies.varied_keys import VariedKey

TRIED = 20
"""Values of a variable that are tried alone on the base file before any variant is evaluated."""

OTHER_UNIT = "mol"
"""A unit of no key of a machine file: what takes a quantity refuses it as another dimension."""

WRITTEN_WRONG = frozenset(
    {
        "bad-setting", "unknown-key", "wrong-type", "unknown-choice", "unknown-material",
        "unknown-tolerance-class", "unknown-part", "unknown-drive", "unknown-unit",
        "wrong-dimension", "no-unit", "not-finite", "too-long", "too-large", "not-positive",
        "negative", "not-a-fraction", "zero-direction", "file-missing", "file-is-directory",
        "file-unreadable", "file-too-large", "not-utf8", "not-csv", "tolerance-matches-nothing",
    }
)  # fmt: skip
"""Codes of a value that is wrong in any variant. What other codes say may be another variant's."""


@dataclass(frozen=True, eq=False)
class StudyPlan:
    """The variants of a study: `settings` (n, k) as `--set` takes the values of the k variables.

    `values` (n, k): the same as numbers in the units of the variables, NaN of words.
    """

    keys: tuple[str, ...]
    units: tuple[str, ...]
    settings: NDArray[np.object_]
    values: Floats

    def __len__(self) -> int:
        return len(self.settings)

    def of_variant(self, number: int) -> tuple[str, ...]:
        """The settings of one variant, each "KEY=VALUE"."""
        row = self.settings[number].tolist()
        return tuple(f"{key}={text}" for key, text in zip(self.keys, row, strict=True))

    @property
    def digest(self) -> str:
        """SHA-256 of the table."""
        told = hashlib.sha256("\0".join(self.keys).encode())
        for row in self.settings.tolist():
            told.update("\0".join(["", *row]).encode())
        return told.hexdigest()


def plan_of(varied: Sequence[VariedKey], design: str, count: int | None, seed: int) -> StudyPlan:
    """Draw the plan of a design. Raises as `design.laid_out`."""
    columns = laid_out(varied, design, count, seed)
    settings = np.empty((len(columns[0][0]), len(varied)), object)
    values = np.empty(settings.shape)
    for at, (texts, numbers) in enumerate(columns):
        settings[:, at], values[:, at] = texts, numbers
    keys, units = tuple(one.key for one in varied), tuple(one.unit for one in varied)
    return StudyPlan(keys, units, settings, values)


def try_values(base: BaseMachine, varied: Sequence[VariedKey]) -> BaseMachine:
    """Try values of every variable alone on the base file -> the base with the data files of all.

    Raises `RequestError` with what is written wrong, once for each value: an unknown key, another
    dimension, a number without a unit that needs one. A machine that cannot be is no such thing: it
    is one of the study's results.
    """
    problems: list[Problem] = []
    for variable in varied:
        wrong: dict[tuple[str, str | None], Problem] = {}
        for text in variable.tried(TRIED):
            try:
                base = base.with_data_of(base.machine((f"{variable.key}={text}",)))
            except TrueposeError as failure:
                for problem in failure.problems:
                    # Of numbers each kind once, of words each word: rows have the same again.
                    kind = (problem.code, None if variable.is_number else problem.found)
                    if problem.code in WRITTEN_WRONG:
                        wrong.setdefault(kind, problem)
        problems += [_of_vary(problem) for problem in wrong.values()]
        if not (wrong or variable.unit) and variable.is_number:
            problems += _without_unit(base, variable)
    if problems:
        raise RequestError(*dict.fromkeys(problems))
    return base


def _of_vary(problem: Problem) -> Problem:
    """What is said of a setting, said of a variable."""
    return replace(problem, message=problem.message.replace("--set", "--vary"))


def _without_unit(base: BaseMachine, variable: VariedKey) -> Iterator[Problem]:
    """The problem of numbers without a unit where the key takes a quantity that has one."""
    text = variable.tried(1)[0]
    try:
        base.machine((f"{variable.key}={text} {OTHER_UNIT}",))
    except TrueposeError as failure:
        keys = {unquoted(change) for change in variable.changes}
        for problem in failure.problems:
            has_unit = problem.expected is not None and "such as" in problem.expected
            if problem.code == "wrong-dimension" and problem.path in keys and has_unit:
                yield Problem(
                    "no-unit",
                    f"{variable.key}: the values of a study say their unit",
                    path=variable.key,
                    found=f"the bare number {text}",
                    expected=problem.expected,
                    hint="write it after the last value: 30:120:4 N/um, or 30,60 N/um",
                )
                return


__all__ = ["StudyPlan", "plan_of", "try_values"]
