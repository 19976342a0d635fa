"""A process that is forked after a batch works on: it has none of its parent's threads."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

PLANAR = Path(__file__).parents[2] / "machines" / "planar_two_slider.toml"
LIMIT = 60.0
"""s; a child that hangs does so for good."""

PROGRAM = """
import os, sys
import numpy as np
import truepose

truepose.threads(2)
machine = truepose.load(sys.argv[1])
poses = np.tile(machine.poses()[:1], (20_000, 1))
before = machine.inverse(poses)
child = os.fork()
if child == 0:
    same = np.array_equal(machine.inverse(poses), before)
    os._exit(0 if same and truepose.threads() == 2 else 3)
_, status = os.waitpid(child, 0)
assert np.array_equal(machine.inverse(poses), before)
sys.exit(os.waitstatus_to_exitcode(status))
"""


def test_a_batch_in_a_forked_child() -> None:
    words = [sys.executable, "-c", PROGRAM, str(PLANAR)]
    with subprocess.Popen(words, start_new_session=True) as process:
        try:
            assert process.wait(LIMIT) == 0
        finally:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
