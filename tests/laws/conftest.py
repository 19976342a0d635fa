"""Every law runs for every machine file shipped; many for awkward ones of the tests or random ones.

A new file in machines/ or tests/machines/ is tested as it stands.
"""

from __future__ import annotations

import pytest

from build_machine import awkward_files, machine_files
from machine_under_test import MachineUnderTest
from random_machines import DRAWN, MORE, DrawnMachine
from sweeps import thinned

SHIPPED = [MachineUnderTest(path) for path in machine_files()]
AWKWARD = [MachineUnderTest(path) for path in awkward_files()]


@pytest.fixture(params=[*SHIPPED, *AWKWARD], ids=lambda machine: machine.path.stem)
def machine(request: pytest.FixtureRequest) -> MachineUnderTest:
    """One of the machines shipped, or an awkward one."""
    found: MachineUnderTest = request.param
    return found


@pytest.fixture(params=SHIPPED, ids=lambda machine: machine.path.stem)
def shipped(request: pytest.FixtureRequest) -> MachineUnderTest:
    """One of the machines shipped."""
    found: MachineUnderTest = request.param
    return found


@pytest.fixture(params=thinned(DRAWN, DRAWN[::20]), ids=lambda machine: f"drawn-{machine.name}")
def drawn(request: pytest.FixtureRequest) -> DrawnMachine:
    """One of the 100 random machines."""
    found: DrawnMachine = request.param
    return found


@pytest.fixture(
    params=thinned([*DRAWN, *MORE], DRAWN[::20]), ids=lambda machine: f"drawn-{machine.name}"
)
def drawn_of_200(request: pytest.FixtureRequest) -> DrawnMachine:
    """One of 200 random machines."""
    found: DrawnMachine = request.param
    return found
