"""Two exported modules with prefixes of their own, loaded side by side."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from module_under_test import CYCLE, exported

import truepose as tp
from benchmarks.kinematics_host import NEEDED, available, compiled, the_host
from build_machine import MACHINES
from system_package import missing
from truepose.controllers._prefix import LONGEST_PREFIX

HAL_NAME_LEN = 47
"""Characters of a name: LinuxCNC's hal.h."""


def test_each_has_pins_of_its_own() -> None:
    if not available():
        missing(f"no LinuxCNC headers: apt-get install --no-install-recommends {NEEDED}")
    # The longest that there is: with it, names of pins are as long as HAL takes them.
    host, right = the_host(), "right" + "t" * (LONGEST_PREFIX - 5)
    before = len(host.names)
    machines = {
        "left": tp.load(MACHINES / "planar_two_slider.toml"),
        right: tp.load(MACHINES / "linear_delta.toml"),
    }
    with tempfile.TemporaryDirectory() as folder:
        modules = {}
        for prefix, machine in machines.items():
            source = Path(folder) / prefix / "kins.c"
            source.parent.mkdir()
            source.write_text(exported(machine, prefix=prefix)["c"])
            modules[prefix] = host.load(compiled(source), len(machine.joints))
    names = host.names[before:]
    assert len(names) == len(set(names))
    assert {name.partition(".")[0] for name in names} == {"left", right}
    assert max(map(len, names)) <= HAL_NAME_LEN

    for name in names:
        if name.endswith("temperature"):
            host.connect(name)
            host.set(name, 30.0)
    host.set("left.enable", 1.0)
    for _ in range(2000):
        host.run("left.update", CYCLE)
        host.run(f"{right}.update", CYCLE)
    assert host.get("left.fault") == host.get(f"{right}.fault") == 0.0
    assert abs(host.get("left.compensation-0")) > 1e-3
    assert host.get(f"{right}.compensation-0") == 0.0

    # The right one is off: its joints are the nominal ones of its machine.
    machine = machines[right]
    pose = machine.home[:3]
    joints = modules[right].inverse([*(pose / 1e-3).tolist(), 0.0, 0.0, 0.0])
    assert joints is not None
    assert np.abs(np.array(joints) * 1e-3 - machine.inverse(pose)).max() < 1e-12
