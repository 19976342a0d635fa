"""The warning that guides carry load: what each carries, by the balance of the platform."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from functools import cache

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray

import truepose as tp
from build_machine import MACHINES
from guided_machines import guided
from machine_under_test import MachineUnderTest
from reference_kinematics import rotation_of_quaternion
from truepose.machine import Envelope

Vector = NDArray[np.float64]

CARRIES = re.compile(r"(\w+) carries up to (\S+) (N m|N)[,;]")
CODE = "guide-taken-rigid"
DIGITS = 0.6e-3
"""Half a unit of the fourth digit, relatively, at the least."""


@cache
def under_test(name: str) -> MachineUnderTest:
    return MachineUnderTest(guided(name))


@cache
def machine(name: str) -> tp.Machine:
    """Without what its file says to act."""
    found = tp.load(guided(name))
    return found.with_condition(found.condition.replace(force=(0, 0, 0), moment=(0, 0, 0)))


def warnings(found: object) -> list[dict[str, str]]:
    parsed: list[dict[str, str]] = json.loads(found.attrs["warnings"])  # type: ignore[attr-defined]
    return parsed


def stated(name: str, **condition: object) -> dict[str, tuple[float, str]]:
    """Guide -> largest load and its unit, as the warning says."""
    it = machine(name)
    found = tp.budget(it, under_test(name).poses, it.condition.replace(**condition))
    (warning,) = warnings(found)
    assert warning["code"] == CODE
    return {
        guide: (float(load), unit) for guide, load, unit in CARRIES.findall(warning["sentence"])
    }


def reactions(name: str, wrench: ArrayLike) -> Vector:
    """(n, n_closure) N, or N m over the machine's size: what balances a wrench on the platform."""
    this = under_test(name)
    joints, placements = this.placed
    return np.array(
        [
            np.linalg.solve(
                this.reference.rows(at, placement[:3], rotation_of_quaternion(placement[3:])).T,
                np.asarray(wrench, float),
            )
            for at, placement in zip(joints, placements, strict=True)
        ]
    )


def test_the_planes_of_a_3prs_under_a_force() -> None:
    found = stated("3prs", force=(1000.0, 0.0, 0.0))
    planes = np.abs(reactions("3prs", [1000, 0, 0, 0, 0, 0]))[:, 3:].max(axis=0)
    assert planes.min() > 100.0
    assert found == {
        f"g{number}": (pytest.approx(force, rel=DIGITS), "N")
        for number, force in enumerate(planes, start=1)
    }


def test_the_tube_of_a_tricept_carries_a_force_and_its_joint_a_moment() -> None:
    wrench = [300, -200, 400, 20, 10, -30]
    found = stated("tricept", force=tuple(wrench[:3]), moment=tuple(wrench[3:]))
    loads = reactions("tricept", wrench)
    tube = np.hypot(loads[:, 3], loads[:, 4]).max()
    joint = under_test("tricept").reference.characteristic_length * np.abs(loads[:, 5]).max()
    assert found == {
        "tube": (pytest.approx(tube, rel=DIGITS), "N"),
        "joint": (pytest.approx(joint, rel=DIGITS), "N m"),
    }


def test_weight_is_a_load_like_another() -> None:
    heavy = tp.load(guided("3prs"), settings=["platform.mass=20 kg", "mounting.a=60"])
    still = heavy.condition.replace(force=(0, 0, 0))
    (warning,) = warnings(tp.budget(heavy, under_test("3prs").poses, still))
    weight = 20 * 9.80665 * np.array([0.0, -np.sin(np.pi / 3), -np.cos(np.pi / 3)])
    _, placements = under_test("3prs").placed
    planes = np.zeros((len(placements), 3))
    for at, placement in enumerate(placements):
        # At the platform's origin, 120 mm above the tool point.
        arm = rotation_of_quaternion(placement[3:]) @ [0.0, 0.0, 0.12]
        wrench = np.r_[weight, np.cross(arm, weight)]
        planes[at] = reactions("3prs", wrench)[at, 3:]
    loads = [float(load) for _, load, _ in CARRIES.findall(warning["sentence"])]
    assert loads == pytest.approx(np.abs(planes).max(axis=0), rel=DIGITS)


@pytest.mark.parametrize("normal", [None, (0.0, 0.0, 1.0)])
def test_a_force_of_any_direction(normal: Sequence[float] | None) -> None:
    size = 700.0
    envelope = Envelope(size, normal)  # type: ignore[arg-type]
    pushed = [reactions("tricept", [*axis, 0, 0, 0]) for axis in np.eye(3)]
    columns = np.stack(pushed, axis=2)  # (n, n_closure, 3): of a unit force along each axis
    random = np.random.default_rng(3)
    ways = random.normal(size=(20000, 3))
    ways[:, 2] = ways[:, 2] if normal is None else 0.0
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    loads = size * np.einsum("ncx,wx->nwc", columns, ways)
    tube, _ = stated("tricept", envelope=envelope)["tube"]
    reached = np.hypot(loads[..., 3], loads[..., 4]).max()
    assert reached <= tube * (1 + DIGITS)
    assert reached == pytest.approx(tube, rel=2e-3)
    joint, _ = stated("tricept", envelope=envelope)["joint"]
    length = under_test("tricept").reference.characteristic_length
    assert length * np.abs(loads[..., 5]).max() == pytest.approx(joint, rel=2e-3)


def test_without_load_or_guides_nothing_is_said() -> None:
    assert warnings(tp.budget(machine("3prs"))) == []
    assert warnings(tp.budget(tp.load(MACHINES / "rotary_delta.toml"))) == []


def test_a_guide_that_carries_nothing_but_rounding_is_not_named() -> None:
    # A force along the tube's axis, in the middle: the struts alone carry it.
    it = machine("tricept")
    middle = it.condition.replace(force=(0.0, 0.0, -500.0))
    assert it.home.size == len(it.dof)
    poses = it.home[[it.dof.index(name) for name in it.commanded]]
    tilt = [poses[it.commanded.index(name)] for name in it.commanded if name != "z"]
    assert tilt == [0.0, 0.0]
    assert warnings(tp.budget(it, poses, middle)) == []
