"""Instruments for a plan, before anything is measured: from the head of a file, or from a word.

* `tracker.csv`: the instruments that the head of a file of measurements declares
* `tracker.csv:tracker`: one of them
* `position=10um`: a kind and the standard uncertainty of what it reads, its frame unknown
* `coordinate:z=10um`: the same of one coordinate
* `pose=10um,20urad`: lengths and angles
"""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Iterator
from pathlib import Path

from truepose.calibration.instruments import REGISTRY, Frame, Instrument
from truepose.calibration.measurements.declarations import (
    expected_name,
    name_is_good,
    read_header,
    reserved_names,
    separated,
)
from truepose.calibration.observables import si_unit
from truepose.calibration.planning.poses import workspace_poses
from truepose.calibration.planning.readings import observed
from truepose.errors import MachineFileError, Problem, RequestError
from truepose.files.dimensions import BY_UNIT
from truepose.files.text_file import FileKind, read_text
from truepose.files.units import QuantityError, UnitSystem
from truepose.files.wording import did_you_mean, one_of
from truepose.machine import Machine

_WORD = re.compile(r"(?P<kind>[a-z-]++)(?::(?P<reads>[a-z.,]++))?=(?P<amounts>.++)\Z")
_FILE = FileKind("a file of measurements (CSV), of which only the head is read", ".csv")
_EXPECTED = "KIND=UNCERTAINTY, such as position=10um, or a file of measurements that declares it"


def instruments_named(machine: Machine, text: str) -> tuple[Instrument, ...]:
    """The instruments that a text names, as the top of this module has it.

    Raises `RequestError` with all that is wrong (plan-instrument, and what a file's head has).
    """
    match = _WORD.match(text.strip())
    return (_of_word(machine, text, match),) if match else _of_file(machine, text.strip())


def _of_word(machine: Machine, text: str, match: re.Match[str]) -> Instrument:
    kind = REGISTRY.get(match["kind"])
    if kind is None:
        raise _refusal(
            f"there is no kind of instrument called {match['kind']}",
            found=text,
            expected=one_of(sorted(REGISTRY)),
            hint=did_you_mean(match["kind"], REGISTRY),
        )
    reads = tuple(match["reads"].split(",")) if match["reads"] else ()
    for word in reads:
        if word not in kind.reads:
            raise _refusal(
                f"the kind {kind.name} does not read {word}",
                found=text,
                expected=one_of(sorted(kind.reads)) if kind.reads else "no readings",
            )
    chosen = [kind.reads[word] for word in reads] or list(kind.reads.values())
    uncertainty: dict[str, float] = {}
    for amount in match["amounts"].split(","):
        value, unit = _amount(text, amount, chosen)
        uncertainty |= {name: value for name in chosen if si_unit(name) == unit}
    name = "-".join([kind.name, *(word.replace(".", "-") for word in reads)])
    instrument = Instrument(name, kind.name, Frame(), uncertainty=uncertainty)
    return _with_frame_unknown(machine, instrument)


def _amount(text: str, amount: str, reads: list[str]) -> tuple[float, str]:
    """An uncertainty above zero, SI, and the unit of what it is one of."""
    units = dict.fromkeys(map(si_unit, reads))
    error: QuantityError | None = None
    for unit in units:
        try:
            value = UnitSystem({}).read(amount.strip(), BY_UNIT[unit])
        except QuantityError as failure:
            error = failure
            continue
        if value > 0.0:
            return value, unit
        raise _refusal(
            "a standard uncertainty is above zero", found=text, expected="a quantity above zero"
        )
    raise _refusal(
        f"the uncertainty cannot be read: {error.message}" if error else "nothing is read",
        found=text,
        expected=(error.expected if error else None) or _EXPECTED,
        hint=error.hint if error else None,
    )


def _of_file(machine: Machine, text: str) -> tuple[Instrument, ...]:
    path, name = text, ""
    if ":" in text and not _exists(text):
        path, _, name = text.rpartition(":")
    declared = read_instruments(path, machine)
    if not name:
        return declared
    named = tuple(instrument for instrument in declared if instrument.name == name)
    if not named:
        names = [instrument.name for instrument in declared]
        raise _refusal(
            f"the file declares no instrument called {name}",
            found=name,
            expected=one_of(names),
            hint=did_you_mean(name, names),
        )
    return named


def _exists(name: str) -> bool:
    try:
        return Path(name).exists()
    except (OSError, ValueError):  # no name that a file may have
        return False


def read_instruments(path: str | Path, machine: Machine) -> tuple[Instrument, ...]:
    """The instruments that the head of a file of measurements declares; its table is not read.

    Raises `RequestError` with all problems of the head, and plan-instrument where there is none.
    """
    file = str(path)
    if not Path(path).suffix:
        raise _refusal("this names no instrument", found=file, expected=_EXPECTED)
    try:
        _, content = read_text(Path(path), _FILE)
    except MachineFileError as error:
        raise RequestError(*error.problems) from None
    header = read_header(separated(content)[0], file, Path(path).name, reserved_names(machine))
    if header.problems:
        raise RequestError(*header.problems)
    if not header.instruments:
        raise _refusal(
            "the file declares no instrument",
            file=file,
            found="no line #: [instrument.NAME]",
            expected="kind, frame and uncertainty of an instrument in lines that begin with #:",
        )
    return tuple(
        _with_frame_unknown(machine, instrument) if instrument.name in header.whole else instrument
        for instrument in header.instruments
    )


def _with_frame_unknown(machine: Machine, instrument: Instrument) -> Instrument:
    """The instrument with every freedom of its frame unknown that its readings determine.

    One of distances stands beside the workspace, half its diagonal away along the last axis in
    which the platform moves, where no origin is stated: from within, distances determine little.
    """
    kind = REGISTRY[instrument.kind]
    if kind.frame is None:
        return instrument
    reads = observed(machine, instrument)
    frame = dataclasses.replace(instrument.frame, unknown=kind.frame(reads, machine.components))
    if "distance" in reads and not any(frame.origin):
        frame = dataclasses.replace(frame, origin=_beside(machine))
    return dataclasses.replace(instrument, frame=frame)


def _beside(machine: Machine) -> tuple[float, float, float]:
    _, placements, status = machine.kernel.place(workspace_poses(machine))
    points = placements[status == 0, :3]
    if not len(points):
        return (0.0, 0.0, 0.0)
    low, high = points.min(axis=0), points.max(axis=0)
    place = 0.5 * (low + high)
    axis = max(
        (number for number, name in enumerate("xyz") if name in machine.components), default=2
    )
    place[axis] = low[axis] - 0.5 * math.dist(low, high)
    x, y, z = place.tolist()
    return (x, y, z)


def distinct(machine: Machine, instruments: tuple[Instrument, ...]) -> tuple[Instrument, ...]:
    """The same with a number behind names that are there before, so that a file can hold them."""
    return tuple(_renamed(reserved_names(machine), instruments))


def _renamed(reserved: frozenset[str], instruments: tuple[Instrument, ...]) -> Iterator[Instrument]:
    used: set[str] = set()
    for instrument in instruments:
        name, number = instrument.name, 2
        if not name_is_good(name, reserved):
            raise _refusal(
                "an instrument cannot have this name", found=name, expected=expected_name(reserved)
            )
        while name in used:
            name, number = f"{instrument.name}-{number}", number + 1
        used.add(name)
        yield dataclasses.replace(instrument, name=name)


def _refusal(
    message: str, *, found: str, expected: str, hint: str | None = None, file: str | None = None
) -> RequestError:
    return RequestError(
        Problem("plan-instrument", message, file, found=found, expected=expected, hint=hint)
    )
