"""What exact stops really take: programs with and without corrections in the real LinuxCNC."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from real_linuxcnc import ANSWERS, required, run
from scipy.spatial import cKDTree
from test_corrected_program import hot

import truepose as tp
from sweeps import sweep

CLOSELY = 100
"""Points of a path for every millisecond."""
SPACING = 3e-7
"""m: half of what lies between two of them, at 50 mm/s."""

TRIES, LOST = 4, 2e-3
"""How often LinuxCNC may lose its position, and the mm beside its end that tell of it.

Without a real-time kernel and with all processors busy a blended program was seen to go on 7.5 um
beside its path from the first block after the dwell to its end. A block that reaches the planner
while the one before it slows down is known to be blended wrongly (LinuxCNC/linuxcnc, 4543).
"""

PART = """\
G21 G90 G17 G94 {mode}
G0 X280 Y180
G4 P0.2
G3 X280 Y180 I20 J0 F3000
G2 X320 Y180 I20 J20
M2
"""


def feeds(trace: np.ndarray) -> np.ndarray:
    """Both joints, mm, every millisecond from the dwell to where they stand in the end."""
    joints = trace[:, :2]
    changes = np.flatnonzero(np.any(np.diff(joints, axis=0), axis=1))
    pause = int(np.argmax(np.diff(changes)))
    return joints[changes[pause + 1] : changes[-1] + 1]


@sweep
@pytest.mark.parametrize("mode", ["G61", "G61.1"])
def test_the_estimate_is_what_linuxcnc_takes(mode: str, tmp_path: Path) -> None:
    required()
    machine = hot("planar_two_slider")
    acceleration = float(ANSWERS["TRAJ"]["MAX_LINEAR_ACCELERATION"]) * 1e-3
    source = tmp_path / "part.ngc"
    source.write_text(PART.format(mode=mode))
    programs = {"before.ngc": source.read_text()}
    proofs = {}
    for name, path_mode in (("stopping", None), ("blended", "G64 P0.002")):
        target = tmp_path / f"{name}.ngc"
        proofs[name] = tp.correct_program(
            machine,
            source,
            target,
            tolerance=2e-6,
            interpolation="pose",
            path_mode=path_mode,
            acceleration=acceleration,
        )
        programs[target.name] = target.read_text()
    steps: list[dict[str, object]] = [{"do": "home"}]
    for name in programs:
        steps += [
            {"do": "sample", "file": name.replace(".ngc", ".trace")},
            {"do": "program", "file": name},
            {"do": "stop_sampling"},
        ]
    steps.append({"do": "read", "label": "end"})
    files = tp.export(machine, "linuxcnc").files
    for number in range(TRIES):
        folder = tmp_path / f"run{number}"
        folder.mkdir()
        done = run(folder, files, steps, axes="XY", joints=2, programs=programs)
        assert not done["end"]["errors"]
        joints = {name: feeds(trace) for name, trace in done.traces.items()}
        if np.abs(joints["blended"][-1] - joints["stopping"][-1]).max() < LOST:
            break
    else:
        pytest.fail(f"LinuxCNC lost its position in all of {TRIES} blended programs")
    # Blended, the tool leaves the pieces by no more than P.
    stopping, blended = (machine.forward(joints[name] * 1e-3) for name in ("stopping", "blended"))
    cycles = np.arange(len(stopping))
    closely = np.linspace(0.0, cycles[-1], CLOSELY * cycles[-1] + 1)
    path = np.stack([np.interp(closely, cycles, column) for column in stopping.T], axis=1)
    off, _ = cKDTree(path).query(blended)
    assert off.max() < 2e-6 + SPACING
    took = {name: 1e-3 * len(cycles) for name, cycles in joints.items()}
    stops = proofs["stopping"].exact_stops
    assert stops.after > 100
    assert took["before"] == pytest.approx(stops.seconds_before, rel=0.02)
    assert took["stopping"] == pytest.approx(stops.seconds_after, rel=0.1)
    assert took["blended"] == pytest.approx(stops.seconds_before, rel=0.02)
