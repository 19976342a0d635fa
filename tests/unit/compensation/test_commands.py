"""Corrected commands for controllers with nominal kinematics, on every machine shipped."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from build_machine import MACHINES, machine_files
from machine_under_test import MachineUnderTest
from made_source import MadeSource, random_deviation, with_sources
from truepose import _kernel
from truepose.compensation import commands
from truepose.compensation.commands import actual_of_joints, actual_poses, corrected_poses
from truepose.errors import RequestError
from truepose.machine import Condition, Machine
from truepose.sources import Deviation, PoseBlock

OK = _kernel.STATUS.index("ok")
ROUNDING = 3e-12
"""Of a pose, in characteristic lengths or rad: the solvers' stop, and over-constrained machines."""


def hot_and_loaded(machine: Machine) -> Condition:
    hot = machine.condition.reference_temperature + 25.0
    return machine.condition.replace(temperature=hot, force=(300.0, 200.0, -150.0))


def poses_of(path: Path) -> np.ndarray:
    """(37, n_commanded) of the workspace, its borders included."""
    return MachineUnderTest(path).poses


def measured(machine: Machine, one: np.ndarray, other: np.ndarray) -> float:
    """The largest difference of two tables of poses, in characteristic lengths or rad."""
    length = machine.characteristic_length
    unit = np.array([length if name in "xyz" else 1.0 for name in machine.commanded])
    return float(np.abs((one - other) / unit).max())


@pytest.fixture(params=machine_files(), ids=lambda path: path.stem)
def path(request: pytest.FixtureRequest) -> Path:
    found: Path = request.param
    return found


def test_a_corrected_command_takes_the_actual_tool_to_the_pose(path: Path) -> None:
    machine, poses = tp.load(path), poses_of(path)
    condition = hot_and_loaded(machine)
    commanded, status = corrected_poses(machine, poses, condition)
    assert (status == OK).all()
    assert measured(machine, commanded, poses) > 1e-5
    reached, status = actual_poses(machine, commanded, condition)
    assert (status == OK).all()
    assert measured(machine, reached, poses) < ROUNDING


def test_the_nominal_controller_then_sets_the_corrected_joints(path: Path) -> None:
    machine, poses = tp.load(path), poses_of(path)
    condition = hot_and_loaded(machine)
    commanded, _ = corrected_poses(machine, poses, condition)
    joints = machine.inverse(commanded)
    compensated = tp.compensate(machine, poses, condition)
    assert compensated.attrs["poses_left_out"] == 0
    scale = np.maximum(np.abs(joints), machine.characteristic_length)
    assert (np.abs(joints - compensated["joint_corrected"].values) / scale).max() < ROUNDING
    reached, status = actual_of_joints(machine, joints, condition)
    assert (status == OK).all()
    assert measured(machine, reached, poses) < ROUNDING


def test_the_tool_stands_where_its_own_shifts_take_it(path: Path) -> None:
    """An uncorrected command, by another machine with the parameters that it has there."""
    machine, poses = tp.load(path), poses_of(path)[:5]
    condition = hot_and_loaded(machine)
    reached, status = actual_poses(machine, poses, condition)
    assert (status == OK).all()
    assert measured(machine, reached, poses) > 1e-5
    for pose, there in zip(poses, reached, strict=True):
        known = commands.ActualMachine(machine, condition).deviations_at(there[np.newaxis])
        columns, values = known.moved
        actual = machine.replace(
            {
                machine.parameters[c]: machine.nominal[c] + values[0, k]
                for k, c in enumerate(columns)
            }
        )
        at = actual.forward(machine.inverse(pose), pose)
        assert measured(machine, at[[machine.dof.index(n) for n in machine.commanded]], there) < (
            ROUNDING
        )


def test_any_known_deviation_is_corrected(path: Path) -> None:
    known = MadeSource("known", random_deviation(tp.load(path), 5, half=False))
    machine, poses = with_sources(tp.load(path), known), poses_of(path)
    commanded, status = corrected_poses(machine, poses)
    reached, settled = actual_poses(machine, commanded)
    assert (status == OK).all()
    assert (settled == OK).all()
    assert measured(machine, reached, poses) < ROUNDING


def test_a_band_is_not_corrected(path: Path) -> None:
    band = MadeSource("band", random_deviation(tp.load(path), 5, shift=False))
    machine, poses = with_sources(tp.load(path), band), poses_of(path)
    commanded, status = corrected_poses(machine, poses)
    assert (status == OK).all()
    assert measured(machine, commanded, poses) < ROUNDING


@pytest.fixture(scope="module")
def hexapod() -> Machine:
    return tp.load(MACHINES / "hexapod.toml")


@pytest.fixture(scope="module")
def two_slider() -> Machine:
    return tp.load(MACHINES / "planar_two_slider.toml")


def test_without_sources_the_command_is_the_pose(two_slider: Machine) -> None:
    machine = with_sources(two_slider)
    poses = [[0.3, 0.2], [0.25, 0.1]]
    assert np.allclose(corrected_poses(machine, poses)[0], poses, rtol=0, atol=1e-15)
    assert np.allclose(actual_poses(machine, poses)[0], poses, rtol=0, atol=1e-15)


def test_by_hand_on_the_planar_machine(two_slider: Machine) -> None:
    """Both struts 0.1 mm longer: the tool of a nominal command is lower by the slope's share."""
    longer = MadeSource("longer", Deviation.of(two_slider.kernel.length_parameters, 1e-4))
    machine = with_sources(two_slider, longer)
    drop = np.sqrt(0.5001**2 - 0.3**2) - 0.4
    assert np.allclose(actual_poses(machine, [0.3, 0.2])[0], [[0.3, 0.2 - drop]], atol=1e-15)
    assert np.allclose(corrected_poses(machine, [0.3, 0.2])[0], [[0.3, 0.2 + drop]], atol=1e-15)


@pytest.mark.parametrize(
    "turned",
    [
        [0.0, 0.0, 4 * np.pi],
        [-2 * np.pi, 0.0, 2 * np.pi],
        [np.pi, np.pi, np.pi],
        [-np.pi, np.pi, 3 * np.pi],
    ],
)
def test_angles_stay_near_those_asked_for(hexapod: Machine, turned: list[float]) -> None:
    """Whole turns more, and the other triple of angles of one rotation: a, pi - b, c."""
    plain = np.array([[0.05, 0.02, 0.5, 0.1, 0.06, 0.03]])
    poses = plain.copy()
    poses[0, 3:] += turned
    if turned[1]:
        poses[0, 4] = np.pi - plain[0, 4]
    commanded, status = corrected_poses(hexapod, poses)
    assert status == OK
    reference, _ = corrected_poses(hexapod, plain)
    assert np.abs(commanded - poses).max() < 0.01
    assert np.allclose(hexapod.inverse(commanded), hexapod.inverse(reference), rtol=0, atol=1e-14)
    reached, _ = actual_poses(hexapod, commanded)
    assert np.allclose(reached, poses, rtol=0, atol=1e-12)
    by_joints, _ = actual_of_joints(hexapod, hexapod.inverse(commanded), near=commanded)
    assert np.allclose(by_joints, poses, rtol=0, atol=1e-12)


def test_shifts_are_those_of_the_pose_reached(two_slider: Machine) -> None:
    """A deviation that rises steeply with x, so that the pose asked for will not do for it."""

    def rising(block: PoseBlock) -> Deviation:
        x = block.placements[:, :1]
        return Deviation.of(two_slider.kernel.length_parameters, np.hstack([0.02 * x, -0.02 * x]))

    machine = with_sources(two_slider, MadeSource("rising", of_block=rising))
    reached, status = actual_poses(machine, [0.3, 0.2])
    assert status == OK
    x = reached[0, 0]
    assert abs(x - 0.3) > 1e-3
    actual = two_slider.replace(
        {"strut.1.length": 0.5 + 0.02 * x, "strut.2.length": 0.5 - 0.02 * x}
    )
    at = actual.forward(two_slider.inverse([0.3, 0.2]))
    assert np.allclose(at, reached[0], rtol=0, atol=1e-13)
    commanded, _ = corrected_poses(machine, [0.3, 0.2])
    assert np.allclose(actual_poses(machine, commanded)[0], [[0.3, 0.2]], rtol=0, atol=1e-13)


def test_what_jumps_back_and_forth_has_a_status(two_slider: Machine) -> None:
    """Left of x = 0.3 the tool is pushed right, right of it left: it stands at no pose."""

    def fleeing(block: PoseBlock) -> Deviation:
        side = np.where(block.placements[:, :1] < 0.3, 1e-3, -1e-3)
        return Deviation.of(two_slider.kernel.length_parameters, np.hstack([side, -side]))

    machine = with_sources(two_slider, MadeSource("fleeing", of_block=fleeing))
    reached, status = actual_poses(machine, [[0.3, 0.2], [0.2, 0.2]])
    assert [_kernel.STATUS[code] for code in status] == ["not_converged", "ok"]
    assert np.isnan(reached[0]).all()
    assert np.isfinite(reached[1]).all()


def test_a_play_pressed_to_one_side_is_corrected() -> None:
    """Where the load of a drive is just about nil, the side after the move may be the other one."""
    machine = tp.load(MACHINES / "hexapod_all_sources.toml")
    condition = hot_and_loaded(machine)
    poses = machine.poses()
    commanded, status = corrected_poses(machine, poses, condition)
    assert (status == OK).all()
    joints = machine.inverse(commanded)
    reached, _ = actual_of_joints(machine, joints, condition, near=poses)
    assert measured(machine, reached, poses) < ROUNDING
    freely, _ = actual_poses(machine, commanded, condition)
    off = np.abs(freely - poses).max(axis=1) > 1e-9
    assert off.mean() < 0.01


def test_every_bad_pose_has_a_status_and_no_other_a_nan(path: Path) -> None:
    machine, wild = tp.load(path), MachineUnderTest(path).wild_poses
    condition = hot_and_loaded(machine)
    for found, status in (
        corrected_poses(machine, wild, condition),
        actual_poses(machine, wild, condition),
    ):
        undefined = np.isnan(found).any(axis=1)
        assert not undefined[status == OK].any()
        assert (status[undefined] != OK).all()
        assert (status != OK).any()
        alone = [0, 13, 77, 399]
    one_by_one = np.concatenate([corrected_poses(machine, wild[i], condition)[0] for i in alone])
    together, codes = corrected_poses(machine, wild, condition)
    assert np.allclose(one_by_one, together[alone], rtol=0, atol=1e-11, equal_nan=True)
    singly = [int(corrected_poses(machine, wild[i], condition)[1][0]) for i in alone]
    assert singly == codes[alone].tolist()


def test_out_of_travel_counts_of_the_corrected_joints(two_slider: Machine) -> None:
    # Struts 1 mm longer than nominal need carriages 1.25 mm higher, beyond their travel.
    shift = Deviation.of(two_slider.kernel.length_parameters, 1e-3)
    machine = with_sources(two_slider, MadeSource("longer", shift))
    top = [0.3, 0.9 - 0.4]
    poses = [[0.3, top[1] - 5e-4], [0.3, top[1] - 5e-3]]
    assert (two_slider.inverse(poses) < 0.9).all()
    found, status = corrected_poses(machine, poses)
    assert [_kernel.STATUS[code] for code in status] == ["out_of_travel", "ok"]
    assert np.isfinite(found).all()
    # 1 mm shorter: what the nominal machine just cannot reach, the actual one does.
    shorter = with_sources(
        two_slider,
        MadeSource("shorter", Deviation.of(two_slider.kernel.length_parameters, -1e-3)),
    )
    beyond = [0.3, top[1] + 5e-4]
    assert _kernel.STATUS[two_slider.inverse(beyond, status=True)[1]] == "out_of_travel"
    found, status = corrected_poses(shorter, beyond)
    assert status == OK
    reached, _ = actual_poses(shorter, found)
    assert np.allclose(reached, beyond, rtol=0, atol=1e-13)


def test_more_poses_than_a_block(two_slider: Machine, monkeypatch: pytest.MonkeyPatch) -> None:
    poses = np.random.default_rng(8).uniform([0.2, 0.1], [0.4, 0.3], (100, 2))
    whole = corrected_poses(two_slider, poses)[0]
    joints = two_slider.inverse(whole)
    monkeypatch.setattr(commands, "BLOCK", 7)
    assert np.allclose(corrected_poses(two_slider, poses)[0], whole, rtol=0, atol=1e-15)
    assert np.allclose(actual_poses(two_slider, whole)[0], poses, rtol=0, atol=1e-12)
    assert np.allclose(actual_of_joints(two_slider, joints)[0], poses, rtol=0, atol=1e-12)


def test_bad_input_is_refused(two_slider: Machine) -> None:
    for bad in ([[0.3]], [[np.nan, 0.2]], "here"):
        for function in (corrected_poses, actual_poses, actual_of_joints):
            with pytest.raises(RequestError) as refused:
                function(two_slider, bad)
            assert refused.value.problems[0].code == "bad-poses"
    with pytest.raises(RequestError, match="one pose for each"):
        actual_of_joints(two_slider, [[0.6, 0.6]], near=[[0.3, 0.2], [0.3, 0.2]])
    elsewhere = two_slider.condition.replace(temperature={"strut.9": 300.0})
    with pytest.raises(RequestError) as refused:
        corrected_poses(two_slider, [0.3, 0.2], elsewhere)
    assert refused.value.problems[0].code == "unknown-part"
