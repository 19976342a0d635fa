"""The numbers of a printer.cfg, each with its place: what is wrong is told at once."""

from __future__ import annotations

import math
from collections.abc import Iterable
from difflib import get_close_matches

from truepose.controllers.klipper.config import Config, Entry
from truepose.errors import Fault, MachineFileError, Problem
from truepose.files.wording import did_you_mean, one_of

SLIP = 0.85
"""Likeness of a misspelt option: `print_radius` is not `delta_radius`."""

STEPPERS = ("stepper_a", "stepper_b", "stepper_c")
"""The sections of the three drives."""


LARGEST = 1e12
"""Of any number, and of one by it: no machine has a larger one, and products stay numbers."""


class Numbers:
    """Reads options; what cannot be read is NaN, and among the `problems`.

    `read`: what was read, "section.option" -> as it is written.
    """

    def __init__(self, config: Config) -> None:
        self.config = config
        self.problems: list[Problem] = []
        self.read: dict[str, str] = {}

    def has(self, section: str, name: str) -> bool:
        """Whether an option is there."""
        return self.config.get(section, name) is not None

    def number(
        self,
        section: str,
        name: str,
        default: float | None = None,
        *,
        above: float = -math.inf,
        at_least: float = -math.inf,
        expected: str = "a number",
    ) -> float:
        """A number, greater than `above`; without a default it must be there."""
        option = self.config.get(section, name)
        if option is None:
            if default is not None:
                return default
            self.missing(section, name, expected)
            return math.nan
        value = finite(option.text)
        if value is None:
            message = "this is no number of a machine"
            self.refuse(option, section, name, "not-a-number", message, expected)
            return math.nan
        if not value > above or value < at_least:
            code, message = "import-value", f"Klipper wants more than {above:.10g} here"
            if value < at_least:
                code, message = "negative", "this is below zero"
            elif above == 0.0:
                code, message = "not-positive", "this is not above zero"
            self.refuse(option, section, name, code, message, expected)
            return math.nan
        self.read[f"{section}.{name}"] = option.text
        return value

    def number_if(self, section: str, name: str) -> float | None:
        """A number above zero, in mm, or None where there is none."""
        if not self.has(section, name):
            return None
        return self.number(section, name, above=0.0, expected="mm, above zero")

    def inherited(
        self, name: str, *, above: float = -math.inf, at_least: float = -math.inf, expected: str
    ) -> list[float]:
        """A number of each stepper a, b, c; the last two have that of the first by default."""
        numbers: list[float] = []
        for section in STEPPERS:
            default = numbers[0] if numbers else None
            numbers.append(
                self.number(
                    section, name, default, above=above, at_least=at_least, expected=expected
                )
            )
        return numbers

    def word(self, section: str, name: str, words: Iterable[str], *, of: str) -> str | None:
        """One of some words; None where it is none."""
        known = list(words)
        option = self.config.get(section, name)
        if option is None:
            self.missing(section, name, one_of(known))
            return None
        if option.text not in known:
            hint = did_you_mean(option.text, known)
            message = f"truepose imports {of} of Klipper's, and no other machine"
            self.refuse(option, section, name, "import-declined", message, one_of(known), hint)
            return None
        self.read[f"{section}.{name}"] = option.text
        return option.text

    def refuse(
        self,
        option: Entry,
        section: str,
        name: str,
        code: str,
        message: str,
        expected: str,
        hint: str | None = None,
        found: str | None = None,
    ) -> None:
        """Note what is wrong with an option; what is found is by default its text."""
        path = f"{section}.{name}"
        shown = option.text[:80] or "nothing" if found is None else found
        fault = Fault(code, f"{path}: {message}", shown, expected, hint)
        self.problems.append(option.file.problem(fault, option.line, path))

    def done(self) -> None:
        """Raise `MachineFileError` with all problems, if any, in the order of the lines."""
        if self.problems:
            files = list(dict.fromkeys(problem.file for problem in self.problems))
            self.problems.sort(key=lambda problem: (files.index(problem.file), problem.line or 0))
            raise MachineFileError(*dict.fromkeys(self.problems))

    def missing(self, section: str, name: str, expected: str) -> None:
        """Note that an option is not there."""
        place = self.config.sections.get(section)
        hidden = self.config.unread_line
        written = {key: e for (of, key), e in self.config.options.items() if of == section}
        hint = None
        for near in get_close_matches(name, written, n=1, cutoff=SLIP):
            hint = f'line {written[near].line} has "{near}": is it meant?'
        if hidden is not None:
            hint = (
                f"what SAVE_CONFIG wrote is not read, by Klipper neither: line {hidden} is no line "
                "of its block"
            )
        fault = Fault(
            "missing-key",
            f"{section}.{name}: missing",
            "nothing" if place is not None else f"no section [{section}]",
            f"{name}: {expected}, in [{section}]",
            hint,
        )
        file = self.config.file if place is None else place.file
        line = None if place is None else place.line
        self.problems.append(file.problem(fault, line, f"{section}.{name}"))


def finite(text: str) -> float | None:
    """A number as Klipper reads it, zero or from 1 / `LARGEST` to `LARGEST` in size."""
    try:
        value = float(text)
    except ValueError:
        return None
    return value if value == 0.0 or 1.0 / LARGEST <= abs(value) <= LARGEST else None


__all__ = ["STEPPERS", "Numbers", "finite"]
