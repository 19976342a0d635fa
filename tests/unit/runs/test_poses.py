"""Which poses a run takes, which it leaves out, and what it says when none is left."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from build_machine import MACHINES
from machine_texts import PLANAR, edited, load_text
from made_source import MadeSource, with_sources
from truepose.errors import RequestError
from truepose.runs.poses import PoseRun, Travel
from truepose.sources import Deviation, PoseBlock

GOOD = [0.3, 0.2]
HIGH = [0.3, 0.6]  # carriages at 1 m, travel ends at 0.9 m
WIDE = [1.3, 0.2]  # further from both guideways than the struts are long


@pytest.fixture(scope="module")
def machine() -> tp.Machine:
    return tp.load(MACHINES / "planar_two_slider.toml")


@pytest.mark.parametrize("run", [tp.budget, tp.compensate])
def test_poses_that_cannot_be_used_are_left_out_and_counted(run: object, machine: object) -> None:
    found = run(machine, [WIDE, GOOD, HIGH, GOOD])  # type: ignore[operator]
    assert found.pose.values.tolist() == [1, 3]
    assert found.pose_x.values.tolist() == [0.3, 0.3]
    assert found.attrs["poses_used"] == 2
    assert found.attrs["poses_left_out"] == 2
    assert found.left_out_index.values.tolist() == [0, 2]
    assert found.left_out_status.values.tolist() == ["unreachable", "out_of_travel"]
    assert found.left_out_x.values.tolist() == [1.3, 0.3]
    assert found.left_out_y.values.tolist() == [0.2, 0.6]
    assert not any(np.isnan(found[name]).any() for name in ("joint_nominal", "pose_y"))


def test_a_pose_that_one_source_makes_unreachable_is_left_out(machine: tp.Machine) -> None:
    def far_at_the_second(block: PoseBlock) -> Deviation:
        shift = np.where(block.indices == 1, 0.4, 1e-4)[:, np.newaxis]
        return Deviation.of(machine.kernel.length_parameters[:1], -shift)

    source = MadeSource("far", of_block=far_at_the_second)
    found = tp.budget(with_sources(machine, source), [GOOD, GOOD, [0.35, 0.2]])
    assert found.pose.values.tolist() == [0, 2]
    assert found.left_out_index.values.tolist() == [1]
    assert found.highest_lower.values.max() < 1e-3


def test_a_correction_out_of_travel_is_left_out(tmp_path: Path) -> None:
    # The carriage stands at 600 mm and its travel ends there; the warm strut wants 0.3 mm more.
    text = edited(PLANAR, ("travel = [0, 900]", "travel = [0, 600]"))
    machine = load_text(tmp_path, text)
    assert tp.budget(machine, [[0.3, 0.2]]).attrs["poses_left_out"] == 0
    found = tp.compensate(machine, [[0.3, 0.2], [0.3, 0.1]])
    assert found.left_out_status.values.tolist() == ["correction_out_of_travel"]
    assert found.pose.values.tolist() == [1]


@pytest.mark.parametrize("run", [tp.budget, tp.compensate])
def test_none_left_says_what_fails_and_by_how_much(run: object, machine: object) -> None:
    with pytest.raises(RequestError) as caught:
        run(machine, [WIDE, [1.2, 0.2], HIGH])  # type: ignore[operator]
    (problem,) = caught.value.problems
    assert problem.code == "no-pose-left"
    assert "none of the 3 poses" in problem.message
    assert problem.found is not None
    assert "1 out of travel, 2 unreachable" in problem.found
    # The nearest of them, in the file's units: both carriages at 1000 of 900 mm.
    assert "x = 300 mm, y = 600 mm" in problem.found
    assert re.search(r"drive d1 is 100 mm out of travel; drive d2 is 100 mm", problem.found)


def test_none_left_names_the_strut(machine: tp.Machine) -> None:
    with pytest.raises(RequestError) as caught:
        tp.budget(machine, [[1.3, 0.2], [1.2, 0.2]])
    found = str(caught.value.problems[0].found)
    # At x = 1200 mm strut 2 (guideway at 600) would have to bridge 600 mm, strut 1 all of 1200.
    assert "strut 1 misses by 700 mm" in found
    assert "strut 2 misses by 100 mm" in found


def test_none_left_by_an_error_source_is_not_laid_to_the_workspace(machine: tp.Machine) -> None:
    hot = machine.condition.replace(temperature=1e9)
    with pytest.raises(RequestError) as caught:
        tp.budget(machine, [GOOD], condition=hot)
    (problem,) = caught.value.problems
    assert problem.code == "no-pose-left"
    assert "a number of the wrong size or unit" in str(problem.hint)


def test_none_left_of_a_singular_pose(machine: tp.Machine) -> None:
    # Both struts in one line: a machine 1 m wide, so that two of 0.5 m just meet.
    wide = machine.replace({"drive.d2.origin.x": 1.0})
    with pytest.raises(RequestError) as caught:
        tp.budget(wide, [[0.5, 0.2]])
    assert "singular" in str(caught.value.problems[0].found)


@pytest.mark.parametrize(
    ("poses", "words"),
    [
        ([[0.3, 0.2, 0.1]], "shape (1, 3)"),
        (0.3, "shape ()"),
        ([], "shape (0,)"),
        (np.empty((0, 2)), "no pose"),
        ([[0.3, np.nan], GOOD, [np.inf, 0.2]], "2 poses with a value not finite, first 0"),
        ([["a", "b"]], "not an array of numbers"),
    ],
)
def test_what_is_no_pose_is_refused(machine: tp.Machine, poses: object, words: str) -> None:
    with pytest.raises(RequestError) as caught:
        tp.budget(machine, poses)  # type: ignore[arg-type]
    (problem,) = caught.value.problems
    assert problem.code == "bad-poses"
    assert words in str(problem.found)
    assert problem.expected == "(..., 2) numbers: x, y in m, rad"


def test_poses_come_in_any_shape_and_type(machine: tp.Machine) -> None:
    flat = tp.budget(machine, [GOOD, [0.25, 0.2]])
    shaped = tp.budget(machine, np.asfortranarray([[GOOD], [[0.25, 0.2]]], np.float64))
    single = tp.budget(machine, np.array(GOOD, np.float64))
    assert np.array_equal(shaped.error, flat.error)
    assert np.array_equal(single.error[0], flat.error[0])


def test_no_source_is_said(tmp_path: Path) -> None:
    bare = edited(
        PLANAR,
        ("length_tolerance = [-0.3, 0.3]\n", ""),
        ("temperature = 35\n", ""),
        ("force = { x = 1200, y = -1500 }\n", ""),
    )
    for run in (tp.budget, tp.compensate):
        with pytest.raises(RequestError) as caught:
            run(load_text(tmp_path, bare))
        assert caught.value.problems[0].code == "no-source"


def test_progress_and_interruption_between_blocks(
    machine: tp.Machine, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("truepose.runs.poses.BLOCK", 10)
    seen: list[tuple[int, int]] = []
    tp.budget(machine, progress=lambda done, total: seen.append((done, total)))
    assert seen == [(10, 25), (20, 25), (25, 25)]

    def stop(done: int, total: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        tp.compensate(machine, progress=stop)


def test_the_package_answers_the_call_however_it_was_imported() -> None:
    import truepose.error_budget  # puts the package where the function is asked for

    machine = tp.load(MACHINES / "planar_two_slider.toml")
    assert truepose.budget(machine).sizes["pose"] == 25
    assert callable(truepose.budget)


def test_the_direction_in_which_a_joint_last_moved(machine: tp.Machine) -> None:
    nan = np.nan
    path = [[0.1, 0.5], [0.1, 0.4], [0.2, 0.4], [nan, nan], [0.1, 0.4], [0.1 + 1e-15, 0.5]]
    expected = [[0, 0], [0, -1], [1, -1], [1, -1], [-1, -1], [-1, 1]]
    assert Travel(machine).into(np.array(path)).tolist() == expected
    # Wherever a block ends.
    for cut in range(1, len(path)):
        travel = Travel(machine)
        parts = [travel.into(np.array(part)) for part in (path[:cut], path[cut:])]
        assert np.concatenate(parts).tolist() == expected


def test_travel_and_times_are_those_of_the_poses_that_are_left(machine: tp.Machine) -> None:
    poses = np.array([GOOD, HIGH, [0.3, 0.25], WIDE, GOOD])
    times = np.arange(5.0)
    (block,) = PoseRun(machine, poses, machine.condition, path=True, times=times)
    assert block.indices.tolist() == [0, 2, 4]
    assert block.travel is not None
    assert block.times is not None
    assert block.times.tolist() == [0.0, 2.0, 4.0]
    assert block.travel.tolist() == [[0, 0], [-1, -1], [-1, -1]], "the way down from HIGH counts"
    (plain,) = PoseRun(machine, poses, machine.condition)
    assert plain.travel is None
    assert plain.times is None


def test_a_condition_of_parts_that_are_not_there_is_refused(machine: tp.Machine) -> None:
    condition = machine.condition.replace(temperature={"strut.7": 300.0})
    for run in (tp.budget, tp.compensate):
        with pytest.raises(RequestError) as caught:
            run(machine, condition=condition)  # type: ignore[operator]
        assert [problem.code for problem in caught.value.problems] == ["unknown-part"]
