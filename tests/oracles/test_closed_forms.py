"""Weight, inertia and heat on machines so symmetric that the tool's new place is Pythagoras'.

What a symmetric machine carries is shared equally, each strut becomes longer by a known amount, and
the tool point goes to where the struts meet again. The budget's errors are exact, so they agree to
rounding (SI).
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import truepose
from build_machine import described, file_text, hexapod

GRAVITY = 9.80665
ROUNDING = 1e-12

HEIGHT, BASE, PLATFORM = 0.7, 0.5, 0.2
STRUT_STIFFNESS, STRUT_MASS, PLATFORM_MASS = 2e7, 3.0, 40.0
SPREAD = np.radians([-50.0, 50.0])
STRUT = f"""
stiffness = "{STRUT_STIFFNESS} N/m"
mass = "{STRUT_MASS} kg"
expansion = "1.2e-5 1/K"
"""


def ring(radius: float, spread: np.ndarray) -> np.ndarray:
    """(6, 3) three pairs of points a third of a turn apart."""
    angles = np.repeat(2 * math.pi / 3 * np.arange(3), 2) + np.tile(spread, 3)
    return np.column_stack([radius * np.cos(angles), radius * np.sin(angles), np.zeros(6)])


def errors(path: Path, description: dict[str, Any], strut: str, more: str, source: str) -> Any:
    """(n_component,) of the one pose, exact, by the budget of a machine read from a file."""
    path.write_text(file_text(description, strut=strut, more=more), encoding="utf-8")
    budget = truepose.budget(truepose.load(path))
    return budget.error.sel(source=source).values[0]


def six(path: Path, more: str, source: str) -> Any:
    """The same of a symmetric hexapod at its middle, z upwards."""
    base, platform = ring(BASE, 0.2 * SPREAD), ring(PLATFORM, SPREAD)
    description = hexapod(base, platform)
    grid = f"[workspace]\nhome = {{ z = {HEIGHT} }}\ngrid = {{ z = [{HEIGHT}, {HEIGHT}, 1] }}\n"
    return errors(path, description, STRUT, grid + more, source)


def raised(longer: float) -> float:
    """m that the platform of `six` goes up where each strut is `longer`, m."""
    base, platform = ring(BASE, 0.2 * SPREAD)[0], ring(PLATFORM, SPREAD)[0]
    across = math.dist(base, platform)
    return math.sqrt((math.hypot(across, HEIGHT) + longer) ** 2 - across**2) - HEIGHT


def strut_length() -> float:
    return math.hypot(HEIGHT, math.dist(ring(BASE, 0.2 * SPREAD)[0], ring(PLATFORM, SPREAD)[0]))


@pytest.mark.parametrize(
    ("mounting", "up"), [("", 1.0), ('[mounting]\na = "180 deg"', -1.0)], ids=["on", "under"]
)
def test_a_hexapod_sags_under_its_platform(tmp_path: Path, mounting: str, up: float) -> None:
    # Half of each strut's weight hangs on the platform; the rest stands on the frame.
    more = f'[platform]\nmass = "{PLATFORM_MASS} kg"\n{mounting}'
    found = six(tmp_path / "six.toml", more, "loads")
    weight = (PLATFORM_MASS + 6 * STRUT_MASS / 2) * GRAVITY * up
    tension = -weight / 6 * strut_length() / HEIGHT
    expected = [0, 0, raised(tension / STRUT_STIFFNESS), 0, 0, 0]
    assert np.abs(found - expected).max() < ROUNDING


def test_a_hexapod_under_acceleration(tmp_path: Path) -> None:
    # Inertia is the platform's; it pushes downwards where the platform goes up.
    more = (
        f'[platform]\nmass = "{PLATFORM_MASS} kg"\n'
        '[condition]\ngravity = "0 m/s^2"\nacceleration = { z = "20 m/s^2" }'
    )
    found = six(tmp_path / "six.toml", more, "loads")
    tension = -PLATFORM_MASS * 20.0 / 6 * strut_length() / HEIGHT
    expected = [0, 0, raised(tension / STRUT_STIFFNESS), 0, 0, 0]
    assert np.abs(found - expected).max() < ROUNDING


def test_a_hexapod_on_warm_struts(tmp_path: Path) -> None:
    more = "[condition]\nreference_temperature = 20\ntemperature = 45"
    found = six(tmp_path / "six.toml", more, "thermal")
    expected = [0, 0, raised(1.2e-5 * 25.0 * strut_length()), 0, 0, 0]
    assert np.abs(found - expected).max() < ROUNDING


def test_a_tool_hung_between_two_carriages(tmp_path: Path) -> None:
    # y is upwards: carriages on two vertical rails 0.6 m apart, struts of 0.5 m that hang to the
    # tool point, 0.4 m lower. Every part weighs, and the drives give way under their share.
    drives = [
        {
            "kind": "slider",
            "origin": [x, 0.0, 0.0],
            "axis": [0.0, 1.0, 0.0],
            "working_mode": "+",
            "stiffness": "1e7 N/m",
            "mass": "6 kg",
        }
        for x in (0.0, 0.6)
    ]
    struts = [
        {"drive": f"d{i}", "base": [0.0] * 3, "platform": [0.0] * 3, "length": 0.5} for i in (1, 2)
    ]
    more = (
        '[mounting]\na = "90 deg"\n[platform]\nmass = "10 kg"\n'
        "[workspace]\ngrid = { x = [0.3, 0.3, 1], y = [0.2, 0.2, 1] }"
    )
    strut = 'stiffness = "2e6 N/m"\nmass = "2 kg"\ncentre_of_mass = 0.25'
    found = errors(
        tmp_path / "two.toml", described(["x", "y"], drives, struts), strut, more, "loads"
    )
    hung = (10.0 + 2 * 0.25 * 2.0) * GRAVITY / 2  # on each strut, N, vertically
    tension = hung * 0.5 / 0.4
    carriage = (hung + (6.0 + 0.75 * 2.0) * GRAVITY) / 1e7
    lower = math.sqrt((0.5 + tension / 2e6) ** 2 - 0.3**2) - 0.4
    assert np.abs(found - [0.0, -carriage - lower]).max() < ROUNDING
