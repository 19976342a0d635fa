"""pose: position and orientation of the platform."""

from __future__ import annotations

from collections.abc import Sequence

from truepose.calibration.instruments._base import ANGLES, AXES, Kind, of_readings


def _phrase(observables: Sequence[str]) -> str:
    read = [observable for observable in (*AXES, *ANGLES) if observable in observables]
    return f"by whole poses ({' '.join(read)})" if read else "by whole poses"


KIND = Kind(
    "pose",
    "Position and orientation of the platform, such as a tracker with several targets finds.",
    "by whole poses",
    {observable: observable for observable in (*AXES, *ANGLES)},
    least=None,
    frame=of_readings,
    phrases=_phrase,
)
