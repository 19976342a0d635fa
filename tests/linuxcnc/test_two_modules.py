"""Two exported modules with prefixes of their own, side by side, in the real LinuxCNC too."""

from __future__ import annotations

import os
import subprocess
import tempfile
from pathlib import Path

import numpy as np
import pytest
import real_linuxcnc
from module_under_test import CYCLE, exported

import truepose as tp
from benchmarks.kinematics_host import NEEDED, available, compiled, parameters_of, the_host
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
            text = exported(machine, prefix=prefix)["c"]
            source.write_text(text)
            library = compiled(source)
            modules[prefix] = host.load(library, len(machine.joints), parameters_of(text))
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


# Motion with both modules, run for a while; what `getp` prints are lines of a number each.
_HAL = """loadrt {first}_linear_delta {first_hash}
loadrt {second}_linear_delta {second_hash}
loadrt homemod
loadrt tpmod
loadrt motmod servo_period_nsec=1000000 num_joints=3
addf {first}.update servo-thread
addf {second}.update servo-thread
addf motion-command-handler servo-thread
addf motion-controller servo-thread
start
loadusr -w sleep 1
getp {first}.forward-calls
getp {second}.forward-calls
getp {first}.fault-code
getp {second}.fault-code
"""

_INSIDE = f"""set -e
mount --bind "$1" /mnt
mount -t tmpfs tmpfs /tmp
mkdir /tmp/modules
cp -a {real_linuxcnc.MODULES}/. /mnt/modules/. /tmp/modules
mount --bind /tmp/modules {real_linuxcnc.MODULES}
cd /mnt
exec setpriv --reuid {real_linuxcnc.NOBODY} --regid {real_linuxcnc.NOBODY} --clear-groups \\
    env HOME=/tmp halrun -f "$2"
"""


def test_linuxcnc_asks_the_module_loaded_first(tmp_path: Path) -> None:
    real_linuxcnc.required()
    machine = tp.load(MACHINES / "linear_delta.toml")
    (tmp_path / "modules").mkdir()
    hashes = {}
    for prefix in ("left", "right"):
        source = tmp_path / f"{prefix}_linear_delta.c"
        text = exported(machine, prefix=prefix)["c"]
        source.write_text(text)
        hashes[prefix] = " ".join(f"{key}={value}" for key, value in parameters_of(text).items())
        subprocess.run(
            ["/usr/bin/halcompile", "--compile", source.name],
            cwd=tmp_path,
            check=True,
            stdout=subprocess.DEVNULL,
            env={**os.environ, "PATH": real_linuxcnc.SYSTEM_PATH},
        )
        source.with_suffix(".so").rename(tmp_path / "modules" / f"{source.stem}.so")
    for first, second in (("left", "right"), ("right", "left")):
        name = f"{first}.hal"
        words = {"first_hash": hashes[first], "second_hash": hashes[second]}
        (tmp_path / name).write_text(_HAL.format(first=first, second=second, **words))
        log = real_linuxcnc.in_namespaces(tmp_path, _INSIDE, name)
        if log is None:
            pytest.skip("two modules are loaded in namespaces only")
        numbers = [int(line) for line in log.splitlines() if line.strip().isdigit()]
        assert len(numbers) == 4, log
        # Without sensors both have the fault of a temperature, each on its own pin.
        assert numbers[0] > 0
        assert numbers[1:] == [0, 1, 1]
