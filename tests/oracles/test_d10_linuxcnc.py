"""D10, LinuxCNC's default hexapod (inches): two sets of strut lengths, computed independently."""

from __future__ import annotations

import numpy as np
import pytest

from build_machine import MACHINES, description_of, hexapod
from oracle_cases import Published, case
from truepose import _kernel

CASE = case("d10_linuxcnc_genhex")
INCH = 0.0254
BUILT = hexapod(np.array(CASE["base_points"]) * INCH, np.array(CASE["platform_points"]) * INCH)
MACHINES_OF_CASE = [
    pytest.param(_kernel.Machine(BUILT), id="built"),
    pytest.param(_kernel.Machine(description_of(MACHINES / "hexapod.toml")), id="shipped"),
]


@pytest.mark.parametrize("machine", MACHINES_OF_CASE)
@pytest.mark.parametrize("one", CASE["computed_reference"]["cases"])
def test_lengths(
    machine: _kernel.Machine, one: dict[str, list[float]], published: Published
) -> None:
    # R = Rz(c) Ry(b) Rx(a): the kernel's own order.
    pose = np.r_[np.array(one["position"]) * INCH, one["rpy_rad"]]
    joints = machine.inverse(pose)
    lengths = joints / INCH
    published("strut lengths", one["lengths"], lengths, within=1e-12, unit="in", by="reference")
    assert np.abs(machine.forward(joints, pose + 0.01) - pose).max() < 1e-12
