"""D03, a 6-6 hexapod: strut lengths at seven poses, published to four decimals (no unit)."""

from __future__ import annotations

import numpy as np
import pytest

from build_machine import hexapod
from oracle_cases import Published, case
from truepose import _kernel

CASE = case("d03_hexapod_ik")
MACHINE = _kernel.Machine(hexapod(CASE["base_points"], CASE["platform_points"]))
HALF_DIGIT = 5e-5


@pytest.mark.parametrize("one", CASE["cases"], ids=lambda one: str(one["rpy"]))
def test_lengths(one: dict[str, list[float]], published: Published) -> None:
    # R = Rz(yaw) Ry(pitch) Rx(roll): the kernel's own order; another one is 0.02 off.
    pose = np.array(one["position"] + one["rpy"], float)
    joints = MACHINE.inverse(pose)
    published("strut lengths at a pose", one["lengths"], joints, within=HALF_DIGIT)
    assert np.abs(MACHINE.forward(joints, pose + 0.01) - pose).max() < 1e-9
