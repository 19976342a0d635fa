"""Klipper's printer.cfg as a machine: linear and rotary deltas, and what was measured of them."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import ClassVar

from truepose.controllers._reader import ControllerFile, ControllerReading, Setting
from truepose.controllers.klipper.config import read_config
from truepose.controllers.klipper.numbers import Numbers
from truepose.controllers.klipper.read_linear import read_linear
from truepose.errors import MachineFileError

_SECTIONS = re.compile(r"^\[(printer|stepper_[a-z]\d*|mcu|include [^\]]+)\]", re.MULTILINE)

KINEMATICS = {"delta": read_linear}
"""What `kinematics` may say -> what reads its numbers."""


class KlipperReader:
    """A printer.cfg."""

    name: ClassVar[str] = "klipper"
    doc: ClassVar[str] = "printer.cfg of a linear or rotary delta, what it includes and saved"
    settings: ClassVar[Mapping[str, Setting]] = {}

    @classmethod
    def recognises(cls, text: str) -> bool:
        """Whether there is a section that only Klipper's configuration has."""
        return _SECTIONS.search(text) is not None

    @classmethod
    def read(cls, file: ControllerFile, settings: Mapping[str, float | str]) -> ControllerReading:
        """Raises `MachineFileError` with everything that is wrong, each with its own line."""
        config = read_config(file)
        numbers = Numbers(config)
        kind = numbers.word("printer", "kinematics", KINEMATICS, of="a delta")
        if kind is None:
            raise MachineFileError(*numbers.problems)
        return KINEMATICS[kind](numbers, settings)


__all__ = ["KlipperReader"]
