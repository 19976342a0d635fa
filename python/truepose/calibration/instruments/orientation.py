"""orientation: some of the platform's angles."""

from __future__ import annotations

from collections.abc import Sequence

from truepose.calibration.instruments._base import ANGLES, Kind, listed, of_readings


def _phrase(observables: Sequence[str]) -> str:
    return f"by the angles {listed(angle for angle in ANGLES if angle in observables)} alone"


KIND = Kind(
    "orientation",
    "Some of the platform's angles: an inclinometer, an autocollimator.",
    "by angles alone",
    {angle: angle for angle in ANGLES},
    frame=of_readings,
    has_target=False,
    phrases=_phrase,
)
