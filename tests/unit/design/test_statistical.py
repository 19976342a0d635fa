"""Designs for a share of all machines, against machines drawn in closed form and by other calls."""

from __future__ import annotations

import math
import re
from functools import cache
from itertools import product
from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from command_line import call
from costed_slider import COSTS, LENGTHS, OFFSETS, ROWS, errors
from designs import file_with, row, unseen
from sweeps import long_member, sweep
from truepose.errors import RequestError

Capture = pytest.CaptureFixture[str]

TARGET, RESERVE, SHARE, DRAWS = 0.42, 0.01, 0.95, 20_000
"""mm, and machines that are drawn here, by formulas of the test's own."""


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return file_with(tmp_path_factory.mktemp("costs"), "planar_two_slider", rows=ROWS)


def sizes(grades: tuple[int, ...], poses: np.ndarray, seed: int = 5) -> np.ndarray:
    """(pose, draw) mm: lengths of the errors of machines whose bands are uniform."""
    t = np.random.default_rng(seed).uniform(-1.0, 1.0, (DRAWS, 4))
    rod = t[:, :2] * [LENGTHS[grades[0]], LENGTHS[grades[1]]]
    offset = t[:, 2:] * [OFFSETS[grades[2]], OFFSETS[grades[3]]]
    return np.linalg.norm(errors(poses[:, np.newaxis], rod, offset), axis=-1)


def grid(count: int) -> np.ndarray:
    """(n, 2) poses of the workspace, mm."""
    x, y = np.meshgrid(np.linspace(200.0, 400.0, count), np.linspace(100.0, 300.0, count))
    return np.stack([x.ravel(), y.ravel()], axis=-1)


def grades_of(found: tp.Allocation) -> tuple[int, ...]:
    halves = {one.name: round(1e3 * one.halves[0], 9) for one in found.grades}
    return (
        LENGTHS.index(halves["strut.1.length"]),
        LENGTHS.index(halves["strut.2.length"]),
        OFFSETS.index(halves["drive.d1.offset"]),
        OFFSETS.index(halves["drive.d2.offset"]),
    )


def test_the_cheapest_of_all_designs(file: Path) -> None:
    """All 81, each by machines of its own: but for what draws leave open, none is cheaper."""
    found = tp.allocate(tp.load(file, [f"accuracy.target={TARGET}"]), statistical=SHARE, gap=0.0)
    poses = grid(5)
    cost = {
        grades: sum(COSTS[tie // 2][grade] for tie, grade in enumerate(grades))
        for grades in product(range(3), repeat=4)
    }
    quantile = {
        grades: float(np.quantile(sizes(grades, poses), SHARE, axis=1).max()) for grades in cost
    }
    surely = min(cost[one] for one in cost if quantile[one] <= TARGET * (1.0 - 2.0 * RESERVE))
    perhaps = min(cost[one] for one in cost if quantile[one] <= TARGET)
    assert perhaps <= found.cost <= surely
    assert found.cost == pytest.approx(cost[grades_of(found)])
    assert quantile[grades_of(found)] <= TARGET
    assert found.cost < tp.allocate(tp.load(file, [f"accuracy.target={TARGET}"])).cost
    assert math.isnan(found.lower_bound)
    assert math.isnan(found.gap)
    assert found.proven == "none"


def test_at_all_poses_asks_more(file: Path) -> None:
    machine = tp.load(file, [f"accuracy.target={TARGET}"])
    each = tp.allocate(machine, statistical=SHARE, gap=0.0)
    every = tp.allocate(machine, statistical=SHARE, all_poses=True, gap=0.0)
    assert each.kept is not None
    assert every.kept is not None
    assert every.cost >= each.cost
    assert every.kept.all_poses - 3.0 * every.kept.all_poses_error >= SHARE
    assert each.kept.all_poses <= each.kept.each_pose
    for found in (each, every):
        assert found.kept is not None
        size = sizes(grades_of(found), grid(21))
        share = float((size.max(axis=0) <= TARGET).mean())
        assert share == pytest.approx(found.kept.all_poses, abs=0.01)
        assert float((size <= TARGET).mean(axis=1).min()) == pytest.approx(
            found.kept.each_pose, abs=0.01
        )


@pytest.mark.parametrize("reserve", [0.0, 0.01])
def test_check_finds_the_share_too(reserve: float, tmp_path: Path) -> None:
    """At poses and with seeds that no search had, also where no part of the target is left."""
    machine = tp.load(file_with(tmp_path, "five_bar"), ["accuracy.target=0.1 mm"])
    found = tp.allocate(machine, statistical=SHARE, reserve=reserve)
    found.save(tmp_path / "designed.toml")
    designed = tp.load(tmp_path / "designed.toml", ["accuracy.at=95 %", "accuracy.target=0.1 mm"])
    (answer,) = [
        one
        for one in tp.accuracy(designed, unseen(designed, 5_000), states=("before compensation",))
        if one.asked is not None
    ]
    assert answer.answer == "met"
    assert found.kept is not None
    assert found.kept.each_pose - 3.0 * found.kept.each_pose_error >= SHARE
    assert found.cost < tp.allocate(machine).cost


@cache
def hexapod_costs() -> tuple[tp.Machine, float]:
    """A machine with options and cases, and the cost of its design for the worst case."""
    machine = tp.load(Path("examples/data/hexapod_costs.toml"))
    return machine, tp.allocate(machine).cost


@pytest.mark.parametrize("all_poses", [pytest.param(False, marks=sweep), long_member(True)])
def test_a_hexapod_with_options_and_cases(all_poses: bool) -> None:
    machine, worst_case_cost = hexapod_costs()
    found = tp.allocate(machine, statistical=SHARE, all_poses=all_poses)
    assert found.kept is not None
    kept = found.kept
    told = (
        (kept.all_poses, kept.all_poses_error)
        if all_poses
        else (kept.each_pose, kept.each_pose_error)
    )
    assert told[0] - 3.0 * told[1] >= SHARE
    poses = unseen(found.designed, 300)
    for condition in (machine.condition, *machine.cases.values()):
        sampled = tp.monte_carlo(found.designed, poses, 20_000, 11, 0.95, condition=condition)
        largest = sampled["magnitude_upper"].max("pose")
        assert float(largest.sel(quantity="position")) <= 0.15e-3
        assert float(largest.sel(quantity="orientation")) <= np.deg2rad(0.03)
    assert found.cost < worst_case_cost


def test_after_compensation_listed_poses_and_the_share_of_the_file(tmp_path: Path) -> None:
    path = file_with(tmp_path, "planar_two_slider")
    listed = "poses = [[300, 200], [320, 180]]"
    path.write_text(re.sub(r"grid = .*", listed, path.read_text(), count=1))
    machine = tp.load(path, ["accuracy.at=90 %", "accuracy.target=60 um"])
    found = tp.allocate(machine, state="after compensation")
    assert found.share == 0.9
    found.save(tmp_path / "designed.toml")
    settings = ["accuracy.at=90 %", "accuracy.target=60 um"]
    designed = tp.load(tmp_path / "designed.toml", settings)
    (answer,) = tp.accuracy(designed, states=("after compensation",))
    assert answer.answer == "met"
    assert {tuple(one.pose) for one in found.worst_poses} <= {(0.3, 0.2), (0.32, 0.18)}


def test_what_a_share_refuses(file: Path, tmp_path: Path) -> None:
    machine = tp.load(file)
    for options in (
        {"statistical": 95},
        {"statistical": 1.0},
        {"statistical": 0.95, "worst": True},
        {"all_poses": True},
        {"statistical": 0.95, "alternatives": 2},
    ):
        with pytest.raises(RequestError) as caught:
            tp.allocate(machine, **options)
        assert caught.value.problems[0].code == "bad-allocation"
    with pytest.raises(RequestError) as caught:
        tp.allocate(tp.load(file, ["accuracy.target=0.2 mm"]), statistical=0.95)
    (problem,) = caught.value.problems
    assert problem.code == "target-out-of-reach"
    assert "of 95 % of the machines" in problem.message


def test_the_command_tells_both_shares(file: Path, capsys: Capture) -> None:
    done = call(
        capsys, "allocate", file, "--set", f"accuracy.target={TARGET}", "--statistical", "95"
    )
    assert done.code == 0
    assert "of machines drawn anew" in done.out.lower()
    assert "asked were 95 % at each pose" in done.out
    assert "no bound is claimed" in done.out


def test_the_same_twice(tmp_path: Path) -> None:
    path = file_with(tmp_path, "planar_two_slider", rows=(row("strut.*.length"),))
    texts = {
        tp.allocate(tp.load(path, ["accuracy.target=0.45 mm"]), statistical=0.9).text()
        for _ in range(2)
    }
    assert len(texts) == 1


def test_csv_has_a_row_for_each_tolerance_or_target(file: Path, capsys: Capture) -> None:
    settings = ("--set", f"accuracy.target={TARGET}", "--statistical", "95 %")
    done = call(capsys, "allocate", file, *settings, "--format", "csv")
    assert done.code == 0
    lines = done.out.splitlines()
    assert lines[0] == "feature,half,unit,tie,grade,tie_of"
    assert len(lines) == 5
    cells = lines[1].split(",")
    assert cells[0] == cells[3] == "strut.1.length"
    assert cells[2] == "mm"
    assert float(cells[1]) == pytest.approx(1e-3 * float(cells[4].split()[0]))
    assert "of machines drawn anew" in done.err.lower()
    curve = call(capsys, "allocate", file, "--curve", "0.2 mm:0.42 mm:2", "--format", "csv")
    first, second = curve.out.splitlines()[1:]
    assert first.startswith("0.2,,")
    assert float(second.split(",")[1]) >= float(second.split(",")[2])
