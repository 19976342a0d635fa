"""A table of joint centres read: in the platform's axes, or all in the base frame."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from truepose.errors import MachineFileError

numbers = np.random.default_rng(7)
TURN = np.radians([15, 45, 135, 165, 255, 285])
BASE = np.column_stack([300 * np.cos(TURN), 300 * np.sin(TURN), numbers.uniform(-5, 5, 6)])
PLATFORM = np.column_stack([120 * np.cos(TURN), 120 * np.sin(TURN), numbers.uniform(-5, 5, 6)])
TOOL = np.array([3.0, -2.0, 540.0])


def table(base: np.ndarray, platform: np.ndarray, *more: str, unit: str = "mm") -> str:
    rows = [f"name, x ({unit}), y ({unit}), z ({unit}), role"]
    for at in range(len(base)):
        for role, point in (("base", base[at]), ("platform", platform[at])):
            rows.append(", ".join([f"leg {at + 1}", *(repr(float(v)) for v in point), role]))
    return "\n".join([*rows, *more, ""])


def imported(folder: Path, text: str, **settings: str) -> tp.Machine:
    (folder / "centres.csv").write_text(text, "utf-8")
    return tp.import_machine(folder / "centres.csv", settings=settings).machine


def refusal(folder: Path, text: str) -> str:
    with pytest.raises(MachineFileError) as failure:
        imported(folder, text)
    return str(failure.value)


def test_either_frame_is_the_same_hexapod(tmp_path: Path) -> None:
    own = imported(tmp_path, table(BASE, PLATFORM), **{"workspace.home.z": "540"})
    measured = imported(
        tmp_path, table(BASE / 25.4, (PLATFORM + TOOL) / 25.4, _tool(TOOL / 25.4), unit="in")
    )
    np.testing.assert_allclose(measured.home[:3], TOOL / 1e3, atol=1e-12)
    poses = numbers.uniform(
        [-0.05, -0.05, 0.5, -0.1, -0.1, -0.1], [0.05, 0.05, 0.6, 0.1, 0.1, 0.1], (100, 6)
    )
    for machine in (own, measured):
        expected = []
        for pose in poses:
            a, b, c = pose[3:]
            turn = (
                np.array([[np.cos(c), -np.sin(c), 0], [np.sin(c), np.cos(c), 0], [0, 0, 1]])
                @ np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
                @ np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
            )
            joints = pose[:3] + PLATFORM / 1e3 @ turn.T
            expected.append(np.linalg.norm(joints - BASE / 1e3, axis=1))
        assert np.abs(machine.inverse(poses) - expected).max() < 1e-12
    assert own.joints[0] == "leg 1"


def _tool(point: np.ndarray) -> str:
    return ", ".join(["t", *(repr(float(value)) for value in point), "tool"])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (table(BASE, PLATFORM), "--set workspace.home.z"),
        (table(BASE[:5], PLATFORM[:5], _tool(TOOL)), "5 struts"),
        (table(BASE, PLATFORM).replace("base", "frame"), "base, platform, tool"),
        (table(BASE, PLATFORM, "leg 1, 1, 2, 3, base"), "twice"),
        (table(BASE, PLATFORM, _tool(TOOL), "leg 7, 1, 2, 3, base"), "one end"),
        (table(BASE, PLATFORM).replace("x (mm)", "x"), "unit"),
        (table(BASE * 1e30, PLATFORM), "too-large"),
        (table(BASE, PLATFORM).replace("leg 3", 'leg" 3'), "name"),
    ],
)
def test_what_is_wrong_is_told(text: str, said: str, tmp_path: Path) -> None:
    assert said in refusal(tmp_path, text)
