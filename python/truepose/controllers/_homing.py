"""Where the endstops or home switches trip, from which a controller counts its joints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from truepose.controllers._export import Option
from truepose.controllers._small_model import quantities
from truepose.errors import Problem, ReadingError, RequestError
from truepose.machine import Machine
from truepose.sources._base import Floats

END_OF_TRAVEL = "end of travel"


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
        raise _bad_switches(controller, failure.found or repr(text), failure.hint) from None
    if len(given) not in (1, count):
        raise _bad_switches(controller, f"{len(given)} quantities", None)
    return np.broadcast_to(np.array(given), (count,)).copy()


def _bad_switches(controller: str, found: str, hint: str | None) -> RequestError:
    return RequestError(
        Problem(
            "bad-option",
            f"option switches of {controller} cannot be read",
            found=found,
            expected="one joint coordinate for all drives, or one for each with commas",
            hint=hint,
        )
    )


__all__ = ["END_OF_TRAVEL", "switch_option", "switches"]
