"""Klipper's own kinematics, asked from the tests: skipped where `make klipper` has not built it."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from system_package import missing

Array = NDArray[np.float64]
DRIVER = Path(__file__).with_name("driver.py")
BUILT = Path(__file__).parents[2] / "build" / "klipper"
HELPER = BUILT / "source" / "klippy" / "chelper" / "c_helper.so"


@dataclass(frozen=True)
class Klipper:
    """What Klipper makes of a printer.cfg and positions (n, 3), mm. Steppers a, b, c: mm or rad.

    `home` (3,) mm and `home_joints` (3,) once homed; `joints` (n, 3); `back` (n, 3), mm, what it
    finds from them; `refused`: positions to which it would not move; `calibrated`: what
    DELTA_CALIBRATE would save, by section and key; `steps` (3,): mm or rad a step.
    """

    home: Array
    home_joints: Array
    joints: Array
    back: Array
    refused: Sequence[int]
    calibrated: dict[str, dict[str, str]]
    steps: Array


def klipper(
    config: str,
    positions: ArrayLike,
    probed: ArrayLike | None = None,
    *,
    extended: bool = False,
) -> Klipper:
    """Ask Klipper. `probed` (m, 3): steppers' positions where a probe touched the bed.

    `extended`: calibrate from what was measured, as the config's [delta_calibrate] has it.
    """
    if not HELPER.exists():
        missing("Klipper's kinematics are not built: make klipper (it asks the package index)")
    asked = {
        "config": config,
        "positions": np.asarray(positions, float).tolist(),
        "probed": None if probed is None else np.asarray(probed, float).tolist(),
        "extended": extended,
    }
    done = subprocess.run(
        [BUILT / "env" / "bin" / "python", DRIVER, BUILT / "source"],
        input=json.dumps(asked),
        check=False,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    answer = json.loads(done.stdout)
    numbers = [np.array(answer[key]) for key in ("home", "home_joints", "joints", "back")]
    steps = np.array(answer["steps"])
    return Klipper(*numbers, answer["refused"], answer["calibrated"], steps)
