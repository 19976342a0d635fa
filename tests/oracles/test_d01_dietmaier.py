"""D01, Dietmaier's hexapod: forty real poses for one set of strut lengths (no unit)."""

from __future__ import annotations

import numpy as np
import pytest

from build_machine import hexapod
from oracle_cases import Published, case, pose
from reference_kinematics import Reference, Vector, rotation_by_vector, rotation_of
from truepose import _kernel

CASE = case("d01_dietmaier")
LENGTHS = np.array(CASE["leg_lengths"], float)
ROOTS = [
    (np.array(row[:3]), np.array(row[3:]).reshape(3, 3))
    for row in CASE["computed_reference"]["solutions"]
]
DESCRIPTION = hexapod(CASE["base_points"], CASE["platform_points"])
MACHINE = _kernel.Machine(DESCRIPTION)
REFERENCE = Reference(DESCRIPTION)

RESIDUAL = 1e-9  # the case's own
START_DISTANCE, START_ANGLE, STARTS = 1e-3, np.radians(0.1), 100


def distance(pose_found: Vector, root: tuple[Vector, Vector]) -> float:
    """Position plus rotation matrix, as the case measures it (its roots are 0.337 apart)."""
    rotation = rotation_of(pose_found[3:])
    return float(np.linalg.norm(np.r_[pose_found[:3] - root[0], (rotation - root[1]).ravel()]))


def test_there_are_forty(published: Published) -> None:
    closed = [np.abs(MACHINE.inverse(pose(*root)) - LENGTHS).max() < RESIDUAL for root in ROOTS]
    found = sum(closed)
    published("real poses", CASE["published"]["real_solutions"], found, within=0.5)
    assert len(ROOTS) == found == 40


@pytest.mark.parametrize("number", range(40))
def test_each_pose_has_the_lengths(number: int) -> None:
    joints, status = MACHINE.inverse(pose(*ROOTS[number]), status=True)
    assert _kernel.STATUS[int(status)] == "ok"
    assert np.abs(joints - LENGTHS).max() < RESIDUAL


@pytest.mark.parametrize("number", range(40))
def test_found_again_from_nearby_or_never_a_false_ok(number: int) -> None:
    position, rotation = ROOTS[number]
    random = np.random.default_rng(1000 + number)
    directions = random.normal(size=(STARTS, 2, 3))
    directions /= np.linalg.norm(directions, axis=2, keepdims=True)
    reach = random.uniform(size=(STARTS, 2, 1))
    starts = np.array(
        [
            pose(position + shift, rotation_by_vector(turn) @ rotation)
            for shift, turn in directions * reach * [[[START_DISTANCE], [START_ANGLE]]]
        ]
    )

    found, status = MACHINE.forward(np.tile(LENGTHS, (STARTS, 1)), starts, status=True)

    again = 0
    for one, code in zip(found, status, strict=True):
        if _kernel.STATUS[code] != "ok":
            continue
        closures = REFERENCE.closures(LENGTHS, one[:3], rotation_of(one[3:]))
        assert np.abs(closures).max() < RESIDUAL
        assert min(distance(one, root) for root in ROOTS) < 1e-4
        again += distance(one, ROOTS[number]) < 1e-4
    # Five roots lie so near a singularity that a start may stand nearer to the next root.
    near_singular = MACHINE.conditioning(pose(position, rotation)) < 1e-4
    assert again >= (STARTS / 3 if near_singular else STARTS)
