"""Machines of the library with masses, play, and bodies warmer on one side: settings for each."""

from __future__ import annotations

from collections.abc import Mapping

_MASSES = {
    "platform.mass": "25 kg",
    "platform.centre_of_mass": "[10, -20, 30]",
    "each.strut.mass": "3 kg",
    "each.strut.centre_of_mass": "0.3",
    "each.drive.mass": "8 kg",
}
_PLAY = {"each.drive.backlash": '{ play = "4 um", threshold = "20 N" }'}
_TURNING_PLAY = {"each.drive.backlash": '{ play = "0.02 deg", threshold = "0.3 N m" }'}
_LOOSE = {
    f"strut.{name}.{end}_joint": '{ kind = "spherical", clearance = "5 um", stiffness = "90 N/um" }'
    for name in "123456"
    for end in ("base", "platform")
}
_WARMER_BELOW = {"condition.gradient.platform": '["1 K/m", "2 K/m", "-3 K/m"]'}
_ACCELERATED = {"condition.acceleration": '{ x = "1 m/s^2", y = "2 m/s^2", z = "-3 m/s^2" }'}

WEIGHING: Mapping[str, Mapping[str, str]] = {
    "hexapod": _MASSES | _PLAY | _LOOSE | _WARMER_BELOW | _ACCELERATED,
    "tricept": _MASSES | _PLAY,
    "3prs": _MASSES | _PLAY,
    "linear_delta": _MASSES | _PLAY,
    "rotary_delta": _MASSES | _TURNING_PLAY,
}
"""By the machine's name in the library."""
