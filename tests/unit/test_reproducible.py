"""Results are the same to the last bit in every run: nothing goes by the order of a set."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from sweeps import thinned

MACHINES = Path(__file__).parents[2] / "machines"

RUN = """
import hashlib, sys
import numpy as np
import truepose
from truepose.runs.poses import PoseRun
from truepose.sources import acting
machine = truepose.load(sys.argv[1], ["frame.material=steel"])
poses = machine.poses()[:16]
state = hashlib.sha256()
for block in PoseRun(machine, poses, machine.condition):
    for source in acting(machine):
        moved = source.deviation(machine, machine.condition, block)
        state.update(np.ascontiguousarray(moved.parameters))
for result in (truepose.budget(machine, poses), truepose.compensate(machine, poses)):
    for variable in result.data_vars.values():
        if variable.dtype.kind == "f":
            state.update(np.ascontiguousarray(variable.values))
print(state.hexdigest())
"""


@pytest.mark.parametrize("kind", thinned(["hexapod_all_sources", "overconstrained"]))
def test_a_result_does_not_depend_on_the_hash_of_names(kind: str) -> None:
    found = set()
    for seed in ("1", "2"):
        done = subprocess.run(
            [sys.executable, "-c", RUN, str(MACHINES / f"{kind}.toml")],
            env={**os.environ, "PYTHONHASHSEED": seed},
            capture_output=True,
            text=True,
            check=True,
        )
        found.add(done.stdout)
    assert len(found) == 1
