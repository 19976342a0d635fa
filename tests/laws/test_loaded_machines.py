"""What the loader reads of a shipped file is what the standard library reads, and it all works."""

from __future__ import annotations

import numpy as np

import truepose
from machine_under_test import OK, MachineUnderTest


def test_the_loader_makes_the_same_machine(machine: MachineUnderTest) -> None:
    loaded = truepose.load(machine.path)
    assert loaded.parameters == machine.kernel.parameters
    assert np.abs(loaded.nominal - machine.kernel.nominal).max() < 1e-14
    assert loaded.commanded == machine.kernel.commanded
    assert np.allclose(loaded.home, machine.kernel.home, rtol=0, atol=1e-15)
    assert (
        np.abs(loaded.inverse(machine.poses) - machine.kernel.inverse(machine.poses)).max() < 1e-13
    )
    poses = loaded.poses()
    assert np.allclose([poses.min(0), poses.max(0)], machine.box.T, atol=1e-12)


def test_almost_every_pose_of_the_workspace_is_usable(shipped: MachineUnderTest) -> None:
    loaded = truepose.load(shipped.path)
    _, status = loaded.sensitivity(loaded.poses(), status=True)
    assert (status == OK).mean() > 0.98


def test_a_shipped_file_is_ready_for_a_report(shipped: MachineUnderTest) -> None:
    loaded = truepose.load(shipped.path)
    assert len(loaded.origin) > 200  # where its numbers come from, a paragraph
    assert 0 < len(loaded.description) <= 88  # one line of `truepose init --list`
    assert loaded.accuracy.target is not None
    assert {source.name for source in loaded.sources} >= {"tolerance", "thermal", "elastic"}
    assert loaded.stiffness_known.all()
    assert all(strut.expansion is not None for strut in loaded.struts)
