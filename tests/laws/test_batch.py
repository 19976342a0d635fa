"""A batch is its samples one by one: on every instruction set, of any layout, pickled or not."""

from __future__ import annotations

import pickle
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from numpy.typing import NDArray

from instruction_sets import SETS, computing_or_skipped
from machine_under_test import OK, MachineUnderTest
from random_machines import DrawnMachine
from truepose import _kernel

AGREES = 1e-12
# One short of the lanes, as many, one more, and several blocks with a rest.
SIZES = (1, 7, 8, 9, 37)

Results = dict[str, NDArray[np.float64]]


def everything(machine: MachineUnderTest, poses: NDArray) -> Results:
    """What every batched call says of the poses (n, n_commanded), each with its status."""
    kernel = machine.kernel
    joints, placements, status = kernel.place(poses)
    start = kernel.pose_of(placements)
    random = np.random.default_rng(machine.seed + 9)
    values = 1e-3 * machine.unit_of_parameter * random.uniform(-1, 1, (1, len(kernel.parameters)))
    columns, flexible = machine.all_columns, machine.soft_columns
    soft = np.full((1, len(flexible)), 1e-8)
    wrench = np.array([[100.0, -50.0, 30.0, 4.0, 5.0, -6.0]])
    with_status = {
        "inverse": kernel.inverse(poses, status=True),
        "forward": kernel.forward(joints + 1e-3, start, status=True),
        "displacement": kernel.displacement(joints, placements, columns, values),
        "corrected": kernel.corrected(poses, columns, values)[::2],
        "corrected placements": kernel.corrected(poses, columns, values)[1:],
        "sensitivity": kernel.sensitivity(poses, status=True),
        "sensitivity_at": kernel.sensitivity_at(joints, placements, columns),
        "jac_pose_joint": kernel.jac_pose_joint(poses, status=True),
        "conditioning": kernel.conditioning(poses, status=True),
        "forces": kernel.forces(poses, wrench[0], status=True),
        "loads": kernel.loads_at(joints, placements, wrench, columns),
        "compliance": kernel.compliance_at(joints, placements, flexible, soft),
        "stiffness": kernel.stiffness_at(joints, placements, flexible, soft),
    }
    results: Results = {
        "joints": joints,
        "placements": placements,
        "status": status,
        "lengths": kernel.lengths_at(joints, placements),
        "joint_centres": kernel.joint_centres(joints, placements),
    }
    for name, (found, found_status) in with_status.items():
        results |= {name: found, f"{name} status": found_status}
    return results


def assert_agree(one: Results, other: Results) -> None:
    for name, expected in one.items():
        if "status" in name:
            assert np.array_equal(other[name], expected), name
            continue
        # A displacement is a difference of positions and rotations, which are of the order of 1.
        size = 1.0 if name == "displacement" else np.abs(expected).max()
        assert np.abs(other[name] - expected).max() <= AGREES * size, name


@pytest.mark.parametrize("size", SIZES)
def test_a_batch_is_its_samples_one_by_one(machine: MachineUnderTest, size: int) -> None:
    poses = machine.poses[:size]
    together = everything(machine, poses)
    alone = [everything(machine, poses[i : i + 1]) for i in range(size)]
    one_by_one = {name: np.concatenate([a[name] for a in alone]) for name in together}
    assert_agree(together, one_by_one)


def test_a_wild_batch_is_its_samples_one_by_one(machine: MachineUnderTest) -> None:
    # Neighbours that have nothing in common: what serves one of them may not serve the next.
    kernel, poses = machine.kernel, machine.wild_poses
    together, status = kernel.sensitivity(poses, status=True)
    conditioning, _ = kernel.conditioning(poses, status=True)
    for i, pose in enumerate(poses):
        alone, alone_status = kernel.sensitivity(pose, status=True)
        assert status[i] == alone_status
        # Out of travel a machine has its sensitivities all the same.
        if _kernel.STATUS[status[i]] in ("ok", "out_of_travel"):
            limit = 1e-13 / conditioning[i] * np.abs(alone).max()
            assert np.abs(together[i] - alone).max() < limit


@pytest.mark.parametrize("bad", ["out of reach", "no number"])
@pytest.mark.parametrize("first", ["a good one", "a bad one"])
def test_a_bad_neighbour_changes_nothing(machine: MachineUnderTest, bad: str, first: str) -> None:
    good, other = (0, 1) if first == "a good one" else (1, 0)
    poses = np.repeat(machine.poses, 2, axis=0)
    poses[other::2] += 50.0 if bad == "out of reach" else np.nan
    mixed = everything(machine, poses)
    assert not (mixed["status"][other::2] == OK).any()
    kept = {name: found[good::2] for name, found in mixed.items()}
    assert_agree(everything(machine, machine.poses), kept)


@pytest.fixture
def restored() -> Iterator[None]:
    """Whatever a test chose, the threads of before come back."""
    threads = _kernel.threads()
    yield
    _kernel.threads(threads)


@pytest.mark.parametrize("name", SETS)
def test_instruction_sets_agree(machine: MachineUnderTest, name: str) -> None:
    best = everything(machine, machine.poses)
    with computing_or_skipped(name):
        assert _kernel.instruction_set() == name
        assert_agree(best, everything(machine, machine.poses))


@pytest.mark.usefixtures("restored")
def test_threads_agree(machine: MachineUnderTest) -> None:
    poses = np.tile(machine.poses, (300, 1))
    found = []
    for threads in (1, 2):
        _kernel.threads(threads)
        assert _kernel.threads() == threads
        found.append(machine.kernel.sensitivity(poses))
    assert np.array_equal(*found)
    once = machine.kernel.sensitivity(machine.poses)
    assert np.abs(found[0].reshape(300, *once.shape) - once).max() < AGREES * np.abs(once).max()


def every_other(array: NDArray) -> NDArray:
    wide = np.full((array.shape[0], 2 * array.shape[1]), np.nan)
    wide[:, ::2] = array
    return wide[:, ::2]


def read_only(array: NDArray) -> NDArray:
    copy = array.copy()
    copy.setflags(write=False)
    return copy


LAYOUTS: dict[str, Callable[[NDArray], NDArray]] = {
    "column major": np.asfortranarray,
    "every other": every_other,
    "backwards twice": lambda array: array[::-1].copy()[::-1],
    "read only": read_only,
    "other byte order": lambda array: array.astype(array.dtype.newbyteorder()),
}


@pytest.mark.parametrize("layout", LAYOUTS)
def test_any_layout(machine: MachineUnderTest, layout: str) -> None:
    kernel, change = machine.kernel, LAYOUTS[layout]
    joints = kernel.inverse(machine.poses)
    assert np.array_equal(kernel.inverse(change(machine.poses)), joints)
    assert np.array_equal(kernel.forward(change(joints)), kernel.forward(joints))
    assert np.array_equal(
        kernel.sensitivity(change(machine.poses)), kernel.sensitivity(machine.poses)
    )


@pytest.mark.parametrize("dtype", ["float32", "float16", "int64", "int8", "uint16"])
def test_any_type_of_number(machine: MachineUnderTest, dtype: str) -> None:
    kernel = machine.kernel
    if np.issubdtype(dtype, np.integer):
        # Whole metres and radians: no workspace has two, so this is about 0 where it is usable.
        poses = np.zeros((2, len(kernel.commanded)), dtype)
    else:
        poses = machine.poses.astype(dtype)
    as_given = kernel.inverse(poses, status=True)
    as_float = kernel.inverse(poses.astype(float), status=True)
    assert np.array_equal(as_given[0], as_float[0], equal_nan=True)
    assert np.array_equal(as_given[1], as_float[1])
    assert as_given[0].dtype == np.float64


def test_any_leading_shape(machine: MachineUnderTest) -> None:
    kernel = machine.kernel
    poses = machine.poses[:36].reshape(3, 4, 3, -1)
    flat = machine.poses[:36]
    assert kernel.inverse(poses[0, 0, 0]).shape == (len(kernel.joints),)
    for call in (kernel.inverse, kernel.sensitivity, kernel.jac_pose_joint, kernel.conditioning):
        shaped, status = call(poses, status=True)
        assert status.shape == (3, 4, 3)
        assert np.array_equal(shaped.reshape(36, *shaped.shape[3:]), call(flat))
    joints = kernel.inverse(poses)
    assert kernel.forward(joints).shape == (3, 4, 3, len(kernel.dof))
    assert np.array_equal(
        kernel.forward(joints).reshape(36, -1), kernel.forward(joints.reshape(36, -1))
    )
    # Lists are arrays, and one start serves all.
    start = kernel.forward(joints[0, 0, 0])
    near = kernel.forward(joints[0, 0].tolist(), start.tolist())
    assert np.array_equal(near, kernel.forward(joints[0, 0], np.tile(start, (3, 1))))


def test_no_pose_is_a_batch_too(machine: MachineUnderTest) -> None:
    kernel = machine.kernel
    none = np.empty((0, len(kernel.commanded)))
    assert kernel.inverse(none).shape == (0, len(kernel.joints))
    assert kernel.forward(np.empty((0, len(kernel.joints)))).shape == (0, len(kernel.dof))
    expected = (0, len(kernel.components), len(kernel.parameters))
    assert kernel.sensitivity(none).shape == expected


def test_pickle_round_trip(machine: MachineUnderTest) -> None:
    kernel = machine.kernel
    changed = kernel.replace({kernel.parameters[0]: kernel.nominal[0] + 1e-3})
    for before in (kernel, changed):
        after = pickle.loads(pickle.dumps(before))  # noqa: S301 (our own bytes)
        for name in ("dof", "commanded", "components", "joints", "closures", "parameters", "units"):
            assert getattr(after, name) == getattr(before, name)
        assert np.array_equal(after.nominal, before.nominal)
        assert np.array_equal(after.home, before.home)
        found, status = after.inverse(machine.poses, status=True)
        assert (status == OK).all()
        assert np.array_equal(found, before.inverse(machine.poses))
        assert np.array_equal(after.forward(found), before.forward(found))


def test_a_batch_of_a_drawn_machine_is_its_samples_one_by_one(drawn: DrawnMachine) -> None:
    test_a_batch_is_its_samples_one_by_one(drawn, 9)
