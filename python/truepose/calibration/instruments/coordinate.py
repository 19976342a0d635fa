"""coordinate: one or two coordinates of a target, such as the height that a probe finds."""

from __future__ import annotations

from collections.abc import Sequence

from truepose.calibration.instruments._base import AXES, Kind, listed, of_readings


def _phrase(observables: Sequence[str]) -> str:
    if list(observables) == ["z"]:
        return "by heights alone"
    return f"by {listed(axis for axis in AXES if axis in observables)} alone"


KIND = Kind(
    "coordinate",
    "One or two coordinates of a target: a height probe, a dial gauge, a straightness laser.",
    "by one or two coordinates alone",
    {axis: axis for axis in AXES},
    most=2,
    frame=of_readings,
    phrases=_phrase,
)
