"""A controller's file as a machine: whose it is, and what its reader makes of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from truepose import sources
from truepose.controllers._adapters import by_name
from truepose.controllers._declined import declined
from truepose.controllers._export import unread
from truepose.controllers._reader import Assumption, ControllerFile, Reader
from truepose.controllers._registry import READERS
from truepose.errors import Fault, MachineFileError, ReadingError, RequestError
from truepose.files.dimensions import DIMENSIONS
from truepose.files.units import UnitSystem, unit_of
from truepose.files.wording import did_you_mean, one_of
from truepose.machine import Machine
from truepose.machine.loader import load_text
from truepose.representation import Facts, Represented
from truepose.runs.arguments import checked

if TYPE_CHECKING:
    from truepose.calibration import Measurements

BARE = {"length": "mm", "angle": "deg"}
"""The units of a setting's bare numbers."""


@dataclass(frozen=True, repr=False)
class Import(Represented):
    """What a controller's file says.

    `machine`, and the `measurements` that the controller kept, or None. `holds`, `assumptions` and
    `lost` as a `ControllerReading` has them. `text` is the machine file's, `measurements_text` that
    of the file of measurements. `kind`: whose file it is.
    """

    kind: str
    machine: Machine
    measurements: Measurements | None
    holds: Mapping[str, str]
    assumptions: tuple[Assumption, ...]
    lost: tuple[str, ...]
    text: str
    measurements_text: str | None

    def _facts(self) -> Facts:
        yield "kind", self.kind
        yield "machine", self.machine.name
        yield "measurements", 0 if self.measurements is None else self.measurements.n_row
        yield "holds", " ".join(f"{key}={value}" for key, value in self.holds.items())
        yield "assumptions", " ".join(assumption.sentence for assumption in self.assumptions)
        yield "lost", " ".join(self.lost)


def reader(name: str) -> type[Reader]:
    """The reader of a name. Raises `RequestError` (unknown-controller)."""
    found: type[Reader] = by_name(name, READERS, "reader")
    return found


def reader_of(file: ControllerFile) -> type[Reader]:
    """The reader that recognises a file.

    Raises `MachineFileError`: import-unrecognised, import-declined.
    """
    found = [each for each in map(reader, READERS) if each.recognises(file.text)]
    if len(found) == 1:
        return found[0]
    if not found and (fault := declined(file.text)) is not None:
        raise MachineFileError(file.problem(fault))
    names = [each.name for each in found]
    raise MachineFileError(
        file.problem(
            Fault(
                "import-unrecognised",
                "whose file this is cannot be told from its content",
                found=f"what {' and '.join(names)} might have written" if names else "no known one",
                expected=f"a file of {one_of(READERS)}",
                hint=f"say it: --from {names[0] if names else next(iter(READERS))}",
            )
        )
    )


@checked
def import_machine(
    path: str | Path,
    kind: str | None = None,
    settings: Mapping[str, str] | Sequence[str] = (),
) -> Import:
    """The machine that a controller's file describes, and the measurements that it keeps.

    `kind`: whose file it is, told from its content where it is None. `settings`: what the file does
    not say, as text, `{"family.spacing": "45"}`; bare numbers are mm and degrees. Nothing is
    written: `text` of the result is the machine file's, `measurements_text` that of the
    measurements.

    Raises `MachineFileError` with everything that is wrong in the file, each with its line;
    `RequestError`: unknown-controller, bad-setting.
    """
    file = ControllerFile.at(Path(path))
    chosen = reader_of(file) if kind is None else reader(kind)
    reading = chosen.read(file, settings_of(chosen, settings))
    stem = Path(path).stem.strip("<>") or "machine"
    machine = load_text(f"{stem}.toml", reading.machine, registry=sources.REGISTRY)
    measurements = None
    if reading.measurements is not None:
        from truepose.calibration.measurements.read_csv import measurements_of_text

        written = reading.measurements
        measurements = measurements_of_text(f"{stem}.csv", written.encode(), written, machine)
    return Import(
        chosen.name,
        machine,
        measurements,
        reading.holds,
        reading.assumptions,
        reading.lost,
        reading.machine,
        reading.measurements,
    )


def settings_of(
    reader: type[Reader], given: Mapping[str, str] | Sequence[str]
) -> dict[str, float | str]:
    """The settings that are given, read: SI, or text. Raises `RequestError` (bad-setting)."""
    bare = {dimension: unit_of(unit, DIMENSIONS[dimension]) for dimension, unit in BARE.items()}
    units = UnitSystem(bare)
    pairs = given.items() if isinstance(given, Mapping) else (s.partition("=")[::2] for s in given)
    values: dict[str, float | str] = {}
    problems = []
    for written, text in pairs:
        key = written.strip()
        setting = reader.settings.get(key)
        try:
            if setting is None:
                raise ReadingError(
                    "bad-setting",
                    "nothing that an import takes",
                    found=repr(key),
                    expected=one_of(sorted(reader.settings)),
                    hint=did_you_mean(key, reader.settings)
                    or "change the machine file once it is written",
                )
            dimension = setting.dimension
            values[key] = text.strip() if dimension is None else units.read(text.strip(), dimension)
        except ReadingError as failure:
            doc = "" if setting is None else setting.doc
            problems.append(unread("bad-setting", f"--set {key}", failure, text, doc))
    if problems:
        raise RequestError(*problems)
    return values


__all__ = ["Import", "import_machine", "reader", "reader_of", "settings_of"]
