"""Where the endstops or home switches trip, from which a controller counts its joints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from truepose.arrays import Floats
from truepose.controllers._export import Option
from truepose.controllers._small_model import in_file_units, quantities
from truepose.errors import Problem, ReadingError, RequestError
from truepose.machine import Machine

END_OF_TRAVEL = "end of travel"

BEYOND = 0.1
"""How far a switch may lie beyond the travel, in the travel: farther, another unit was meant."""


def switch_option(default: str) -> Option:
    """The option `switches`; `default` says in words which end of travel it is."""
    return Option(
        END_OF_TRAVEL,
        "joint coordinates at which the switches trip, in the machine file's sense: one for all "
        f"drives or one for each with commas; default: {default}",
        dimension=None,
    )


def switches(
    machine: Machine, options: Mapping[str, float | str], ends: Sequence[float], controller: str
) -> Floats:
    """(n_joint,) joint coordinates, SI, at which the endstops trip: given, else `ends`.

    Raises `RequestError` (bad-option).
    """
    text = str(options["switches"])
    if text == END_OF_TRAVEL:
        return np.array(ends, np.float64)
    count = len(machine.drives)
    try:
        given = quantities(machine, text, machine.drives[0].coordinate)
    except ReadingError as failure:
        found = failure.found or repr(text)
        raise _bad_switches(controller, found, failure.message, failure.hint) from None
    if len(given) not in (1, count):
        raise _bad_switches(controller, f"{len(given)} quantities")
    found_at = np.broadcast_to(np.array(given), (count,)).copy()
    for drive, place in zip(machine.drives, found_at, strict=True):
        low, high = drive.travel
        if not 0.0 <= place - low + BEYOND * (high - low) <= (1.0 + 2.0 * BEYOND) * (high - low):
            ends_of = " to ".join(in_file_units(machine, e, drive.coordinate) for e in drive.travel)
            raise RequestError(
                Problem(
                    "bad-option",
                    f"option switches of {controller}: the switch of drive {drive.name} is out of "
                    "the drive's reach",
                    file=machine.file,
                    found=in_file_units(machine, float(place), drive.coordinate),
                    expected=f"about the travel, {ends_of}",
                    hint="it is a coordinate of the machine file; bare numbers are in its units",
                )
            )
    return found_at


def switch_words(machine: Machine, places: Floats) -> str:
    """Where the switches trip, for people: of each drive its name and coordinate, (n_joint,)."""
    switches = [
        f"{drive.name} {in_file_units(machine, float(place), drive.coordinate)}"
        for drive, place in zip(machine.drives, places, strict=True)
    ]
    return f"switches trip at {', '.join(switches)}"


def _bad_switches(
    controller: str, found: str, why: str = "it cannot be read", hint: str | None = None
) -> RequestError:
    return RequestError(
        Problem(
            "bad-option",
            f"option switches of {controller}: {why}",
            found=found,
            expected="one joint coordinate for all drives, or one for each with commas",
            hint=hint,
        )
    )


__all__ = ["END_OF_TRAVEL", "switch_option", "switch_words", "switches"]
