"""Struts between free joints that say what they are made of: the families UPS and PUS.

Against frames of beams and joints, and, of UPS, against the one stiffness that such a chain has:
what is in series along the strut adds up, and nothing else counts.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

import truepose as tp
from build_machine import MACHINES
from frame_of_machine import MachineFrame
from truepose.machine import Machine

AGREE = 1e-9

PUS = """
[each.limb]
chain = [
  { joint = "prismatic", across = ["60 N/um", "90 N/um"], axis = [0.3, 0.5, 0.1], tilt = "2e5 N m/rad" },
  { joint = "universal", radial = "200 N/um", axial = "150 N/um", tilt = "1e5 N m/rad" },
  { beam = "box", height = "40 mm", width = "30 mm", wall = "4 mm", material = "steel", length = "300 mm" },
  { beam = "h", height = "40 mm", width = "30 mm", web = "5 mm", flange = "6 mm", material = "aluminium" },
  { joint = "spherical", radial = "200 N/um", axial = "100 N/um" },
]
"""  # noqa: E501
UPS = """
[each.limb]
chain = [
  { joint = "universal", radial = "200 N/um", axial = "150 N/um", tilt = "1e5 N m/rad" },
  { beam = "tube", outside = "60 mm", wall = "5 mm", material = "steel", length = "300 mm" },
  { joint = "prismatic", across = "100 N/um", tilt = "1e5 N m/rad" },
  { beam = "rectangle", height = "40 mm", width = "30 mm", material = "steel" },
  { joint = "spherical", radial = "200 N/um", axial = "100 N/um" },
]
"""


def machine_of(name: str, chain: str, folder: Path) -> Machine:
    """The shipped hexapod with a limb of this chain for each strut, which says no stiffness."""
    text = (MACHINES / f"{name}.toml").read_text(encoding="utf-8")
    text = re.sub(r"^(section_area|stiffness|base_stiffness) = .*\n", "", text, flags=re.M)
    rows = "".join(f'[[limb]]\nname = "{n}"\nstrut = "{n}"\n\n' for n in range(1, 7))
    path = folder / f"{name}.toml"
    path.write_text(text.replace("[workspace]", f"{chain}\n{rows}[workspace]"), encoding="utf-8")
    return tp.load(path)


def agrees_with_the_frame(machine: Machine) -> None:
    poses = machine.poses()[:: max(1, len(machine.poses()) // 9)]
    joints, placements, status = machine.kernel.place(poses)
    assert (status == 0).all()
    size = np.repeat([1.0, machine.characteristic_length], 3)
    compliance = machine.compliance(poses) * np.outer(size, size)
    for at in range(len(poses)):
        frame = MachineFrame(machine, joints[at], placements[at])
        expected = np.stack([frame.moved(unit) for unit in np.eye(6)], axis=1)
        expected = expected * np.outer(size, size)
        assert np.abs(compliance[at] - expected).max() < AGREE * np.abs(expected).max()


def test_struts_on_carriages(tmp_path: Path) -> None:
    machine = machine_of("linapod", PUS, tmp_path)
    assert {limb.family for limb in machine.limbs} == {"PUS"}
    agrees_with_the_frame(machine)


def test_telescopic_struts_are_as_stiff_as_their_parts_in_series(tmp_path: Path) -> None:
    machine = machine_of("hexapod", UPS, tmp_path)
    assert {limb.family for limb in machine.limbs} == {"UPS"}
    agrees_with_the_frame(machine)
    poses = machine.poses()[:5]
    joints, placements, _ = machine.kernel.place(poses)
    lengths = machine.kernel.lengths_at(joints, placements)
    tube = np.pi / 4 * (0.06**2 - 0.05**2) * 210e9
    rod = 0.04 * 0.03 * 210e9
    expected = 1 / 150e6 + 0.3 / tube + (lengths - 0.3) / rod + 1 / 100e6
    np.testing.assert_allclose(
        machine.kernel.limb_compliances_at(joints, placements), expected, rtol=1e-12
    )
    # A parameter more there is none.
    assert machine.parameters == tp.load(MACHINES / "hexapod.toml").parameters
