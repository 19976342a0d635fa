"""How answers of two installations are compared, and which files are for this machine."""

from __future__ import annotations

import math
import platform
import sys
from pathlib import Path
from subprocess import CompletedProcess

import pytest

from release.try_wheels import (
    Installed,
    asked,
    difference,
    reported,
    runs_here,
    under_qemu_only,
)


@pytest.mark.parametrize(
    ("one", "other", "apart"),
    [
        ({"a": [1.0, "x", None]}, {"a": [1.0, "x", None]}, 0.0),
        ({"a": 200.0}, {"a": 100.0}, 0.5),
        ({"a": 1e-3}, {"a": 2e-3}, 1e-3),
        ({"a": 1}, {"a": 1.0}, 0.0),
        ({"a": "met"}, {"a": "NOT met"}, math.inf),
        ({"a": 1.0}, {"b": 1.0}, math.inf),
        ({"a": [1.0]}, {"a": [1.0, 2.0]}, math.inf),
        ({"a": None}, {"a": 1.0}, math.inf),
        ({"a": 1.0, "pose": 3}, {"a": 1.0, "pose": 4}, 0.0),
        ({"a": 1.0, "b": [{"c": 4.0}]}, {"a": 1.0, "b": [{"c": 5.0}]}, 0.2),
    ],
)
def test_difference(one: object, other: object, apart: float) -> None:
    assert difference(one, other) == pytest.approx(apart)
    assert difference(other, one) == pytest.approx(apart)


@pytest.mark.skipif(sys.platform != "linux", reason="names of Linux wheels")
def test_files_for_this_machine() -> None:
    mine = Path(f"truepose-0.1.0-cp311-abi3-manylinux_2_17_{platform.machine()}.whl")
    arm = Path("truepose-0.1.0-cp311-abi3-manylinux_2_17_aarch64.whl")
    assert runs_here(mine)
    assert runs_here(Path("truepose-0.1.0.tar.gz"))
    assert not under_qemu_only(mine)
    assert under_qemu_only(arm) == (platform.machine() != "aarch64")
    for other in ("musllinux_1_2_x86_64", "macosx_11_0_arm64", "win_amd64"):
        file = Path(f"truepose-0.1.0-cp311-abi3-{other}.whl")
        assert not runs_here(file)
        assert not under_qemu_only(file)


def test_a_machine_that_fails_is_told(tmp_path: Path) -> None:
    def run(arguments):
        out = '{"machines": [{"kind": "good"}, {"kind": "bad"}]}' if "--list" in arguments else "{}"
        bad = "check" in arguments and "bad.toml" in arguments[1]
        return CompletedProcess(arguments, 3 if bad else 1 if "check" in arguments else 0, out, "!")

    answers, faults = asked(Installed(run, 0.0), tmp_path)
    assert answers == {"good": {}}
    assert faults == ["bad: exit 3: !"]
    # Both commands are done, and neither wrote a file.
    assert len(reported(Installed(run, 0.0), ("report", "netcdf"), tmp_path)) == 2
