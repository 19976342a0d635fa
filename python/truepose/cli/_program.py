"""Options of commands that read a program of G-code: what it does not say of itself."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from truepose.cli._options import FileName

if TYPE_CHECKING:
    from truepose.controllers.gcode.program import ProgramOptions
    from truepose.machine import Machine

program_options = (
    click.option(
        "--units",
        type=click.Choice(["mm", "inch"]),
        help="What holds before the first G20 or G21. Without it lengths before that are refused.",
    ),
    click.option(
        "--start",
        metavar="x=..,y=..",
        help="Where the machine stands before the program, in machine coordinates. Axes that are "
        "not named: the machine's home.",
    ),
    click.option(
        "--offset",
        "offsets",
        metavar="G54 x=..,y=..",
        type=(str, str),
        multiple=True,
        help="Offset of a coordinate system, G54 to G59.3, that the controller has stored; r is "
        "its rotation about Z. May be repeated. A program that selects one that is not given is "
        "refused.",
    ),
    click.option(
        "--var",
        "parameter_file",
        metavar="FILE",
        type=FileName(".var"),
        help="LinuxCNC's parameter file (linuxcnc.var), which has all offsets.",
    ),
    click.option(
        "--block-delete",
        type=click.Choice(["on", "off"]),
        help="Whether lines that begin with / are left out. Without it they are refused.",
    ),
)
"""In the order of the help. What they say is `Quantities.program`."""


class Quantities:
    """Reads quantities of options, bare numbers in the units of the machine file."""

    def __init__(self, machine: Machine) -> None:
        from truepose.files.units import UnitSystem

        self._units = UnitSystem(machine.file_units)

    def length(self, option: str, text: str) -> float:
        """M. Raises `RequestError` (bad-correction)."""
        return self._quantity(option, text, "length")

    def acceleration(self, option: str, text: str) -> float:
        """m/s^2. Raises `RequestError` (bad-correction)."""
        return self._quantity(option, text, "acceleration")

    def program(
        self,
        units: str | None,
        start: str | None,
        offsets: tuple[tuple[str, str], ...],
        parameter_file: Path | None,
        block_delete: str | None,
    ) -> ProgramOptions:
        """What `program_options` say. Raises `RequestError` (bad-correction)."""
        from truepose.controllers.gcode.program import ProgramOptions

        return ProgramOptions(
            units,
            self._position("--start", start or ""),
            {name: self._position("--offset", text, "abcr") for name, text in offsets},
            parameter_file,
            None if block_delete is None else block_delete == "on",
        )

    def said(self, text: str) -> str:
        """A length as it was asked for, a bare number with the unit of the file."""
        try:
            return f"{float(text):.15g} {self._units.shown()['length'].label}"
        except ValueError:
            return text.strip()

    def _position(self, option: str, text: str, turning: str = "abc") -> dict[str, float]:
        """Coordinates by axis, m and rad, of "x=10,y=2 in"."""
        offsets = {}
        for part in filter(None, (part_text.strip() for part_text in text.split(","))):
            name, equals, value = part.partition("=")
            axis = name.strip().lower()
            if not equals:
                raise self._refusal(option, part, "an axis and a coordinate, such as x=10")
            if axis in offsets:
                raise self._refusal(option, part, "every axis once")
            offsets[axis] = self._quantity(option, value, "angle" if axis in turning else "length")
        return offsets

    def _quantity(self, option: str, text: str, dimension: str) -> float:
        from truepose.errors import ReadingError
        from truepose.files.dimensions import DIMENSIONS

        try:
            try:
                return self._units.read(float(text), dimension)
            except ValueError:
                return self._units.read(text, dimension)
        except ReadingError as failure:
            expected = failure.expected or DIMENSIONS[dimension].phrase
            raise self._refusal(option, failure.found or text, expected) from None

    @staticmethod
    def _refusal(option: str, found: str, expected: str) -> Exception:
        from truepose.errors import Problem, RequestError

        return RequestError(
            Problem("bad-correction", f"{option} cannot be read", found=found, expected=expected)
        )
