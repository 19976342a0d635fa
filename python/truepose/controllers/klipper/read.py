"""Klipper's printer.cfg as a machine: linear and rotary deltas, and what was measured of them."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from typing import ClassVar

from truepose.controllers import _delta_file
from truepose.controllers._delta_file import Rods, rods_of
from truepose.controllers._reader import ControllerFile, ControllerReading, Setting
from truepose.controllers.klipper import raw_data
from truepose.controllers.klipper.config import Config, read_config
from truepose.controllers.klipper.geometry import Geometry
from truepose.controllers.klipper.numbers import Numbers
from truepose.controllers.klipper.read_linear import read_linear
from truepose.controllers.klipper.read_rotary import read_rotary

_SECTIONS = re.compile(r"^\[(printer|stepper_[a-z]\d*|mcu|include [^\]]+)\]", re.MULTILINE)

KINEMATICS: Mapping[str, Callable[[Numbers, Rods | None], Geometry | None]] = {
    "delta": read_linear,
    "rotary_delta": read_rotary,
}
"""What `kinematics` may say -> what reads its numbers."""

CORRECTIONS = {
    "bed_mesh": "a mesh of the bed",
    "skew_correction": "a correction of skew",
    "axis_twist_compensation": "a compensation of twist",
    "z_thermal_adjust": "a correction of z by a temperature",
}
"""Sections with which Klipper corrects what it commands, and what they are."""


class KlipperReader:
    """A printer.cfg."""

    name: ClassVar[str] = "klipper"
    doc: ClassVar[str] = "printer.cfg of a linear or rotary delta, what it includes and saved"
    settings: ClassVar[Mapping[str, Setting]] = {**_delta_file.SETTINGS, **raw_data.SETTINGS}

    @classmethod
    def recognises(cls, text: str) -> bool:
        """Whether there is a section that only Klipper's configuration has."""
        return _SECTIONS.search(text) is not None

    @classmethod
    def read(cls, file: ControllerFile, settings: Mapping[str, float | str]) -> ControllerReading:
        """Raises `MachineFileError` with everything that is wrong, each with its own line.

        `RequestError` for rods of which half is said.
        """
        config = read_config(file)
        numbers = Numbers(config)
        rods = rods_of(settings)
        kind = numbers.word("printer", "kinematics", KINEMATICS, of="a delta")
        numbers.done()
        assert kind is not None
        geometry = KINEMATICS[kind](numbers, rods)
        if geometry is None:
            raw_data.raw_rows(numbers)
        numbers.done()
        assert geometry is not None
        measured = raw_data.measurements(numbers, geometry, settings)
        numbers.done()
        assumptions = geometry.file.assumptions()
        if measured is not None:
            assumptions += raw_data.assumptions(measured)
        lost = tuple(_lost(config))
        return ControllerReading(geometry.file.text(), measured, numbers.read, assumptions, lost)


def _lost(config: Config) -> Iterator[str]:
    for section, what in CORRECTIONS.items():
        entry = config.sections.get(section)
        if entry is not None:
            yield f"[{section}], line {entry.line}: {what} is no geometry of the machine"
    for (section, name), entry in config.hidden.items():
        yield (
            f"{section}.{name} that SAVE_CONFIG wrote in line {entry.line}: it stands above too, "
            "and there it counts"
        )
    if config.unread_line is not None:
        yield (
            f"what SAVE_CONFIG wrote: line {config.unread_line} is none of its block, and Klipper "
            "reads nothing of it"
        )


__all__ = ["KlipperReader"]
