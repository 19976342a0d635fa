"""Bounds that are stopped hold as far as they go, and a search over a region goes on from there."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import truepose as tp
from build_machine import MACHINES
from truepose.errors import RequestError
from truepose.machine import Machine
from truepose.reporting.uncertainty_tables import interrupted_bounds
from truepose.runs.poses import Progress
from truepose.uncertainty_analysis import bounds_over_region
from truepose.uncertainty_analysis.region_search import UNFINISHED

WHOLE = {"x": (0.2, 0.4), "y": (0.1, 0.3)}
"""The workspace of the planar machine, m."""
FINE = 0.02
BOXES, MORE = 150, 220
"""More than some that are looked at over it, and fewer than all."""


def planar() -> Machine:
    return tp.load(MACHINES / "planar_two_slider.toml")


def stopped_at(most: int) -> Progress:
    def progress(done: int, _: int) -> None:
        if done >= most:
            raise KeyboardInterrupt

    return progress


def part_of_a_search(machine: Machine, boxes: int = BOXES) -> xr.Dataset:
    return tp.bounds(machine, region=WHOLE, gap=FINE, progress=stopped_at(boxes))


def test_bounds_of_a_search_that_is_stopped_hold_and_are_not_as_close() -> None:
    machine = planar()
    whole, part = tp.bounds(machine, region=WHOLE, gap=FINE), part_of_a_search(machine)
    assert (part.attrs["interrupted"], whole.attrs["interrupted"]) == (1, 0)
    assert str(part.status.values) == "proven"
    assert BOXES <= int(part.boxes) < int(whole.boxes)
    assert (part.magnitude >= whole.reached_magnitude).all()
    assert (part.upper >= whole.reached_upper).all()
    assert (part.lower <= whole.reached_lower).all()
    assert part.attrs["gap_reached"] > FINE >= whole.attrs["gap_reached"]
    by_hand = (part.magnitude / part.reached_magnitude).max() - 1.0
    assert part.attrs["gap_reached"] >= float(by_hand) > FINE


def test_what_is_not_finished_has_bounds_of_its_own() -> None:
    machine = planar()
    part = part_of_a_search(machine)
    poses = machine.poses()
    there = tp.bounds(machine, poses)
    for at in range(part.sizes["part"]):
        low, high = part.part_from.values[at], part.part_to.values[at]
        inside = ((poses >= low) & (poses <= high)).all(axis=1)
        found = there.isel(pose=inside)
        assert (found.reached_magnitude <= part.part_magnitude.isel(part=at)).all()
        assert (found.reached_upper <= part.part_upper.isel(part=at)).all()
        assert (found.reached_lower >= part.part_lower.isel(part=at)).all()
    largest = np.maximum(part.part_magnitude.max("part"), part.finished_magnitude)
    assert (part.magnitude == largest).all()
    # Where a part lies above what is allowed, it is not finished.
    most = (1.0 + FINE) * part.reached_magnitude
    assert (part.finished_magnitude <= 1.0000001 * most).all()


def test_a_search_that_goes_on_ends_where_one_does_that_was_not_stopped(tmp_path: Path) -> None:
    machine = planar()
    whole, part = tp.bounds(machine, region=WHOLE, gap=FINE), part_of_a_search(machine)
    part.to_netcdf(tmp_path / "part.nc", engine="h5netcdf")
    kept = xr.load_dataset(tmp_path / "part.nc", engine="h5netcdf")
    further = tp.bounds(machine, region=WHOLE, gap=FINE, resume=kept, progress=stopped_at(MORE))
    assert int(part.boxes) < int(further.boxes) < int(whole.boxes)
    xr.testing.assert_identical(tp.bounds(machine, region=WHOLE, gap=FINE, resume=further), whole)
    assert not set(UNFINISHED) & set(whole.variables)


def test_a_search_that_ran_out_of_parts_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    machine = planar()
    whole = tp.bounds(machine, region=WHOLE, gap=FINE)
    monkeypatch.setattr(bounds_over_region, "MOST_BOXES", BOXES)
    part = tp.bounds(machine, region=WHOLE, gap=FINE)
    assert part.attrs["interrupted"] == 0
    assert part.attrs["gap_reached"] > FINE
    xr.testing.assert_identical(tp.bounds(machine, region=WHOLE, gap=FINE, resume=part), whole)


def test_while_a_part_is_without_a_proof_there_are_no_bounds_but_the_search_goes_on() -> None:
    machine = tp.load(MACHINES / "linear_delta.toml")
    middle = machine.poses().mean(axis=0)
    asked: dict[str, Any] = {
        "region": {
            name: (value - 0.006, value + 0.006)
            for name, value in zip(machine.commanded, middle.tolist(), strict=True)
        },
        "gap": 0.3,
    }
    part = tp.bounds(machine, **asked, progress=stopped_at(1))
    assert (part.attrs["interrupted"], str(part.status.values)) == (1, "box_too_wide")
    assert part.magnitude.isnull().all()
    assert part.upper.isnull().all()
    assert part.part_magnitude.isnull().any()
    assert "of 1 part of the region nothing is proven yet" in interrupted_bounds(part)
    whole = tp.bounds(machine, **asked)
    xr.testing.assert_identical(tp.bounds(machine, **asked, resume=part), whole)
    assert str(whole.status.values) == "proven"


def test_what_goes_wrong_in_the_progress_is_raised() -> None:
    def wrong(done: int, total: int) -> None:
        raise OSError("no terminal")

    with pytest.raises(OSError, match="no terminal"):
        tp.bounds(planar(), region=WHOLE, progress=wrong)


def test_how_many_boxes_there_are_is_told_once_a_part_is_finished() -> None:
    told: list[tuple[int, int]] = []
    found = tp.bounds(
        planar(), region=WHOLE, gap=FINE, progress=lambda done, total: told.append((done, total))
    )
    assert told[0] == (1, 0)
    assert told[-1][0] < int(found.boxes) <= 1.1 * told[-1][1]
    assert all(total == 0 or total >= done for done, total in told)


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"gap": 0.03}, "gap is another"),
        ({"region": {"x": (0.2, 0.4), "y": (0.1, 0.29)}}, "region is another"),
    ],
)
def test_another_question_is_refused(changed: dict[str, Any], said: str) -> None:
    machine = planar()
    asked: dict[str, Any] = {"region": WHOLE, "gap": FINE}
    part = part_of_a_search(machine)
    with pytest.raises(RequestError, match=said) as refused:
        tp.bounds(machine, resume=part, **{**asked, **changed})
    assert [problem.code for problem in refused.value.problems] == ["bad-resume"]


def test_another_machine_or_condition_is_refused() -> None:
    machine = planar()
    part = part_of_a_search(machine)
    asked: dict[str, Any] = {"region": WHOLE, "gap": FINE, "resume": part}
    longer = machine.replace({"strut.1.length": 0.6})
    with pytest.raises(RequestError, match="replaced is another"):
        tp.bounds(longer, **asked)
    warm = machine.condition.replace(temperature=machine.condition.reference_temperature + 5.0)
    with pytest.raises(RequestError, match="condition is another"):
        tp.bounds(machine, condition=warm, **asked)


def test_a_result_that_was_finished_or_is_none_of_a_region_is_refused() -> None:
    machine = planar()
    for result in (tp.bounds(machine, region=WHOLE), tp.budget(machine)):
        with pytest.raises(RequestError, match="there is nothing to go on with"):
            tp.bounds(machine, region=WHOLE, resume=result)
    with pytest.raises(RequestError, match="bounds are asked for at poses"):
        tp.bounds(machine, resume=part_of_a_search(machine))


def test_the_worst_poses_come_first(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("truepose.uncertainty_analysis.bounds.POSES", 4)
    machine = planar()
    whole = tp.bounds(machine)
    found = tp.bounds(machine, progress=stopped_at(8))
    assert (found.attrs["interrupted"], whole.attrs["interrupted"]) == (1, 0)
    assert found.attrs["poses_used"] == 8
    assert found.attrs["poses_left_out"] == 0
    worst = np.sort(np.argsort(-np.linalg.norm(whole.linear.values, axis=1), kind="stable")[:8])
    assert found.pose.values.tolist() == worst.tolist()
    for name in ("lower", "upper", "magnitude", "reached_magnitude", "status"):
        assert (found[name] == whole[name].isel(pose=worst)).all()


def test_before_any_pose_there_is_nothing_to_give(monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("truepose.uncertainty_analysis.bounds.worst_corners", interrupted)
    with pytest.raises(KeyboardInterrupt):
        tp.bounds(planar())
