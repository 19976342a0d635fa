"""With which geometry a controller works: a correction is of what the controller does.

Everywhere the nominal geometry of a machine is taken for the controller's. Of a calibrated file
this holds where the file says so (`[controller] holds`): one of former versions has the geometry
that was found as its nominal one, and no controller need know of it.
"""

from __future__ import annotations

from truepose.errors import Problem, RequestError
from truepose.machine import Machine
from truepose.probability.distributions import normal
from truepose.sources.deviation import Deviation
from truepose.sources.tolerance import bands_of

_NORMAL = normal().name

CODE = "nothing-to-correct"

ROUNDING = 1e-10
"""m and rad: an error that no result of a correction shows."""

WAYS = (
    '[controller] with holds = "drawing" where the controller was not touched and the nominal '
    'geometry of this file is still that of the drawing, or with holds = "calibrated" where the '
    "nominal geometry of this file was loaded into the controller"
)


def require_known_controller(machine: Machine) -> None:
    """Refuse a calibrated file of which it is not known what its controller works with.

    Raises `RequestError` (controller-unsaid, controller-contradicted).
    """
    if machine.calibration is None or machine.controller_holds == "calibrated":
        return
    bands = bands_of(machine)
    shifted = bands is not None and _about_shifts(bands)
    if machine.controller_holds is None:
        raise RequestError(
            Problem(
                "controller-unsaid",
                "this calibrated file does not say which geometry its controller works with, and "
                "what is to be corrected depends on it",
                machine.file,
                path="controller.holds",
                found="[calibration], but no [controller]",
                expected=WAYS,
                hint=_written_as_shifts() if shifted else _again(machine),
            )
        )
    # What a calibration finds is correlated: bands that are, about no shift, are about what it
    # found as nominal values.
    if bands is not None and bands.correlation is not None and not shifted:
        raise RequestError(
            Problem(
                "controller-contradicted",
                "a controller that holds the drawing, in a file whose nominal geometry is the one "
                "that was found",
                machine.file,
                path="controller.holds",
                found='holds = "drawing", and no known deviation in [tolerance]',
                expected='holds = "calibrated" where the nominal geometry of this file was loaded '
                "into the controller",
                hint=_again(machine),
            )
        )


def _about_shifts(bands: Deviation) -> bool:
    """Whether what was found stands as known deviations; a calibration writes normal bands."""
    found = [distribution.name == _NORMAL for distribution in bands.distribution]
    return bool(bands.shift[:, found].any())


def nothing_to_correct(machine: Machine) -> dict[str, str]:
    """The warning, code and sentence, where no error before was above `ROUNDING`, and why so."""
    why = {
        "calibrated": 'the file says that the controller holds the calibrated geometry (holds = "'
        'calibrated"), which is the nominal one here',
        "drawing": "the file knows no deviation from the geometry of the drawing, which it says "
        'that the controller holds (holds = "drawing")',
        None: "the file knows no deviation from its nominal geometry, which is taken for the "
        "controller's",
    }[machine.controller_holds]
    sentence = f"there is nothing to correct, the error before is below rounding: {why}"
    if machine.controller_holds == "calibrated" and machine.calibration is not None:
        said = machine.calibration
        sentence += (
            f"; for a controller that was not touched calibrate {said.machine} with {said.data} "
            "again"
        )
    return {"code": CODE, "sentence": sentence}


def _written_as_shifts() -> str:
    return (
        "this file has known deviations in [tolerance], as --as-shifts wrote them: its nominal "
        'geometry is that of before the calibration; --set controller.holds="drawing" says so'
    )


def _again(machine: Machine) -> str:
    assert machine.calibration is not None
    said = machine.calibration
    return (
        "the nominal geometry of this file is the one that was found; for a controller that was "
        f"not touched calibrate {said.machine} with {said.data} again: the file is now written "
        "for it"
    )


__all__ = ["CODE", "ROUNDING", "nothing_to_correct", "require_known_controller"]
