"""D05, NASA's CDSL platform turned by -30 degrees about z: six lengths (no unit stated)."""

from __future__ import annotations

import numpy as np

from build_machine import hexapod
from oracle_cases import Published, case, pose_in_order
from truepose import _kernel

CASE = case("d05_cdsl_stewart")
MACHINE = _kernel.Machine(
    hexapod(
        np.column_stack([CASE["base_xy"], np.zeros(6)]),
        np.column_stack([CASE["platform_xy"], np.zeros(6)]),
        home={"z": CASE["pose"]["z_between_planes"]},
    )
)
POSE = pose_in_order(
    "xyz",
    [CASE["pose"]["x"], CASE["pose"]["y"], CASE["pose"]["z_between_planes"]],
    np.radians([CASE["pose"][f"{name}_deg"] for name in ("roll", "pitch", "yaw")]),
)


def test_lengths(published: Published) -> None:
    # The source's lengths have three decimals and are not symmetric to the third.
    published("strut lengths", CASE["lengths"], MACHINE.inverse(POSE), within=5e-4)


def test_forward() -> None:
    start = POSE + np.array([1.0, -1.0, 2.0, 0.02, -0.02, 0.05])
    found = MACHINE.forward(MACHINE.inverse(POSE), start)
    assert np.abs(found - POSE).max() < 1e-9
    # And from the rounded lengths: 5e-4 in lengths of 110 to 160.
    assert np.abs(MACHINE.forward(CASE["lengths"], start) - POSE).max() < 1e-2
