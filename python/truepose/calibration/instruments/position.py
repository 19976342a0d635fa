"""position: where a target on the platform is, in all directions in which the platform moves."""

from __future__ import annotations

from collections.abc import Sequence

from truepose.calibration.instruments._base import AXES, Kind, listed, of_readings


def _phrase(observables: Sequence[str]) -> str:
    return f"by positions in {listed(axis for axis in AXES if axis in observables)}"


KIND = Kind(
    "position",
    "Where a target on the platform is: a laser tracker, a camera.",
    "by positions",
    {axis: axis for axis in AXES},
    least=None,
    frame=of_readings,
    phrases=_phrase,
)
