"""D06, Sauer's planar platform on three struts: all forward poses of three sets (no unit)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from build_machine import hexapod
from oracle_cases import Published, case
from reference_kinematics import Vector
from truepose import _kernel

CASE = case("d06_sauer_planar")
OK = _kernel.STATUS.index("ok")


def machine_of(data: dict[str, Any]) -> _kernel.Machine:
    base = [[0, 0, 0], [data["x1"], 0, 0], [data["x2"], data["y2"], 0]]
    gamma = data["gamma"]
    platform = [
        [0, 0, 0],
        [data["L3"], 0, 0],
        [data["L2"] * math.cos(gamma), data["L2"] * math.sin(gamma), 0],
    ]
    return _kernel.Machine(hexapod(base, platform, dof=["x", "y", "c"]))


def all_roots(machine: _kernel.Machine, lengths: list[float], *, starts: int = 800) -> Vector:
    """(n, 3) distinct poses x y c, by angle, that forward calls ok from all over the plane."""
    random = np.random.default_rng(6)
    start = random.uniform([-8, -8, -math.pi], [8, 8, math.pi], size=(starts, 3))
    found, status = machine.forward(np.tile(lengths, (starts, 1)), start, status=True)
    distinct: list[Vector] = []
    for one in found[status == OK]:
        if not any(apart(one, other) < 1e-6 for other in distinct):
            distinct.append(one)
    return np.array(sorted(distinct, key=lambda one: one[2])).reshape(-1, 3)


def apart(one: Vector, other: Vector) -> float:
    turn = (one[2] - other[2] + math.pi) % (2 * math.pi) - math.pi
    return max(float(np.abs(one[:2] - other[:2]).max()), abs(turn))


def test_set_a() -> None:
    data = CASE["set_a"]
    machine = machine_of(data)
    for angle, position in zip(data["published_roots"], [(1, 2), (2, 1)], strict=True):
        pose = np.array([*position, angle])
        assert np.abs(machine.inverse(pose) - data["p"]).max() < 1e-12
        assert apart(machine.forward(data["p"], pose + 0.05), pose) < 1e-9


@pytest.mark.parametrize(("name", "middle"), [("set_b", 5.0), ("set_c", 7.0)])
def test_all_poses(name: str, middle: float, published: Published) -> None:
    machine, lengths = machine_of(CASE["set_b"]), [5.0, middle, 3.0]
    expected = np.array(CASE[name]["computed_theta_x_y"])[:, [1, 2, 0]]
    assert len(expected) == CASE[name]["published_root_count"]
    for pose in expected:
        assert np.abs(machine.inverse(pose) - lengths).max() < 1e-9
    found = all_roots(machine, lengths)
    published("number of poses", len(expected), len(found), within=0.5)
    assert found.shape == expected.shape
    assert max(apart(one, other) for one, other in zip(found, expected, strict=True)) < 1e-8


@pytest.mark.parametrize(("middle", "count"), CASE["pose_count_vs_p2"]["computed"].items())
def test_count_of_poses(middle: str, count: int) -> None:
    assert len(all_roots(machine_of(CASE["set_b"]), [5.0, float(middle), 3.0])) == count


def side(data: dict[str, Any], pose: Vector) -> float:
    """Which side of the singularities a pose lies on: the sign of the struts' determinant."""
    base = np.array([[0, 0], [data["x1"], 0], [data["x2"], data["y2"]]], float)
    spans = np.array(
        [
            [0, 0],
            [data["L3"], 0],
            [data["L2"] * math.cos(data["gamma"]), data["L2"] * math.sin(data["gamma"])],
        ]
    )
    cosine, sine = math.cos(pose[2]), math.sin(pose[2])
    arms = spans @ np.array([[cosine, sine], [-sine, cosine]])
    along = pose[:2] + arms - base
    moments = arms[:, 0] * along[:, 1] - arms[:, 1] * along[:, 0]
    return float(np.sign(np.linalg.det(np.column_stack([along, moments]))))


def test_what_forward_finds_lies_on_the_side_it_started_from() -> None:
    data, count = CASE["set_b"], 400
    random = np.random.default_rng(66)
    starts = random.uniform([-8, -8, -math.pi], [8, 8, math.pi], size=(count, 3))
    lengths = np.tile([5.0, 7.0, 3.0], (count, 1))
    found, status = machine_of(data).forward(lengths, starts, status=True)
    good = status == OK
    assert [side(data, one) for one in found[good]] == [side(data, one) for one in starts[good]]
    # A root on the other side is no answer, and is told from having found none.
    assert good.mean() > 0.5
    assert (status[~good] == _kernel.STATUS.index("branch_lost")).any()
