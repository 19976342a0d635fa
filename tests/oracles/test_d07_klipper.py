"""D07 once more: the calibrated printers' configurations, and the points they probed, by export.

The shipped deltas have the configurations' geometry. Exported at their reference temperature and
without a force, with their endstops where the configurations have them, the blocks must be those
configurations, and the exported model must count the steps that the printers counted.
"""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import firmware
import truepose as tp
from build_machine import MACHINES
from oracle_cases import case
from truepose.compensation.commands import actual_of_joints
from truepose.controllers._export import options_of
from truepose.controllers.klipper import Klipper
from truepose.controllers.klipper.linear import KlipperLinear
from truepose.controllers.klipper.rotary import Rotary

CASE = case("d07_delta_stable_positions")
MM = 1e-3
Array = NDArray[np.float64]


def cold(kind: str, folder: Path) -> tp.Machine:
    """The shipped delta at its reference temperature, unloaded."""
    text = (MACHINES / f"{kind}_delta.toml").read_text(encoding="utf-8")
    text = re.sub(r"^force = \{.*\n", "", text, flags=re.MULTILINE)
    path = folder / f"{kind}_delta.toml"
    path.write_text(text, encoding="utf-8")
    return tp.load(path, ["condition.temperature=20"])


def wanted() -> Array:
    """(7, 3) points, m."""
    return np.column_stack([np.array(CASE["linear"]["expected_xy"]) * MM, np.zeros(7)])


def test_linear(tmp_path: Path) -> None:
    data, machine = CASE["linear"], cold("linear", tmp_path)
    arms, endstops = np.array(data["arms"]), np.array(data["endstops"])
    tops = endstops + np.sqrt(arms**2 - data["delta_radius"] ** 2)
    options = options_of(
        Klipper, machine, {"switches": ", ".join(f"{top!r} mm" for top in tops.tolist())}
    )
    (text,) = Klipper.export(machine, options).files.values()
    cfg = firmware.read_cfg(text)
    # The file's coordinates have ten decimals of a millimetre, its block six.
    assert float(cfg["printer"]["delta_radius"]) == pytest.approx(data["delta_radius"], abs=1e-6)
    for at, letter in enumerate("abc"):
        stepper = {key: float(value) for key, value in cfg[f"stepper_{letter}"].items()}
        assert stepper["arm_length"] == pytest.approx(arms[at], abs=1e-6)
        assert stepper["position_endstop"] == pytest.approx(endstops[at], abs=1e-6)
        assert stepper["angle"] == pytest.approx(data["angles"][at], abs=1e-6)

    # What the block's printer counts from its endstops to the points that were probed ...
    towers = firmware.klipper_linear(text)
    steps = np.array(data["steps"])
    probed = np.array([towers.position(towers.home - row * data["step_mm"]) for row in steps])
    assert np.abs(probed[:, :2] - data["expected_xy"]).max() < 2e-4
    assert np.abs(probed[:, 2]).max() < 1e-5
    # ... what the exported model counts: half a step and what the points are off ...
    model = KlipperLinear(machine, options)
    values = model.parse(model.format(np.array([p.start for p in model.parameters])))
    joints = model.joints(values, wanted())
    counted = (tops - joints / MM) / data["step_mm"]
    assert np.abs(counted - steps).max() < 2.5
    # ... and where the actual machine goes with the printer's steps.
    reached, status = actual_of_joints(machine, (tops - steps * data["step_mm"]) * MM)
    assert not status.any()
    assert np.abs(reached[:, :2] / MM - data["expected_xy"]).max() < 2e-4


def test_rotary(tmp_path: Path) -> None:
    data, machine = CASE["rotary"], cold("rotary", tmp_path)
    ends = np.radians(data["endstop_angle_deg_computed"])
    options = options_of(
        Klipper, machine, {"switches": ", ".join(f"{end!r} rad" for end in ends.tolist())}
    )
    (text,) = Klipper.export(machine, options).files.values()
    cfg = firmware.read_cfg(text)
    # The endstops' angles are published to 1e-6 degrees: 3e-6 mm at the elbow.
    assert float(cfg["printer"]["shoulder_radius"]) == pytest.approx(
        data["shoulder_radius"], abs=5e-6
    )
    assert float(cfg["printer"]["shoulder_height"]) == pytest.approx(
        data["shoulder_height"], abs=5e-6
    )
    for at, letter in enumerate("abc"):
        stepper = {key: float(value) for key, value in cfg[f"stepper_{letter}"].items()}
        assert stepper["angle"] == pytest.approx(data["shoulder_angles"][at], abs=2e-6)
        assert stepper["upper_arm_length"] == pytest.approx(data["upper_arm"], abs=5e-6)
        assert stepper["lower_arm_length"] == pytest.approx(data["lower_arms"][at], abs=5e-6)
        assert stepper["position_endstop"] == pytest.approx(data["endstop_z"][at], abs=1e-5)

    arms = firmware.klipper_rotary(text)
    steps = np.array(data["steps"])
    probed = np.array([arms.position(arms.home - row * data["step_rad"]) for row in steps])
    assert np.abs(probed[:, :2] - data["expected_xy"]).max() < 2e-3
    assert np.abs(probed[:, 2]).max() < 6.5e-4
    model = Rotary(machine, options)
    values = model.parse(model.format(np.array([p.start for p in model.parameters])))
    counted = (ends - model.joints(values, wanted())) / data["step_rad"]
    assert np.abs(counted - steps).max() < 1.5
    reached, status = actual_of_joints(machine, ends - steps * data["step_rad"])
    assert not status.any()
    assert np.abs(reached[:, :2] / MM - data["expected_xy"]).max() < 2e-3
    assert math.isclose(
        math.degrees(arms.home[0]), data["endstop_angle_deg_computed"][0], abs_tol=1e-5
    )
