"""What was never looked at: random poses of designed machines, and judges that look less well."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import truepose as tp
from designs import ROWS, beyond, file_with, unseen
from sweeps import thinned
from truepose.design import allocate as allocating
from truepose.design.judge import Effort
from truepose.design.judged_poses import JudgedPoses

TARGETS = {"hexapod": "0.15 mm", "linear_delta": "0.3 mm"}
"""Of machines whose files ask for less than these grades can do, or for little."""

MANY = 100_000


def machine_of(folder: Path, kind: str, *settings: str) -> tp.Machine:
    target = [f"accuracy.target={TARGETS[kind]}"] if kind in TARGETS else []
    return tp.load(file_with(folder, kind), [*target, *settings])


def designed(folder: Path, allocated: object) -> tp.Machine:
    """The machine of the file that a design is written to, as every command reads it."""
    assert hasattr(allocated, "save")
    allocated.save(folder / "designed.toml")
    return tp.load(folder / "designed.toml")


@pytest.mark.parametrize(
    "kind", thinned(ROWS, quick={"planar_two_slider", "hexapod", "linear_delta"})
)
def test_no_pose_that_was_never_used_exceeds_the_target(kind: str, tmp_path: Path) -> None:
    found = tp.allocate(machine_of(tmp_path, kind))
    machine = designed(tmp_path, found)
    poses = unseen(machine, MANY)
    assert beyond(machine, poses) == 0
    # Exactly too, where the first order is largest.
    order = np.argsort(tp.budget(machine, poses)["linear_maximum"].values.max(axis=1))
    worst = tp.accuracy(machine, poses[order[-40:]], states=("before compensation",))
    asked = [answer for answer in worst if answer.asked is not None]
    assert asked
    assert all(answer.witness.value <= answer.asked * (1.0 + 1e-6) for answer in asked)
    assert found.lower_bound <= found.cost
    assert found.gap <= 0.01


def test_corners_alone_are_no_judge(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without reserve; the judge as it is passes the same test."""
    target = 'accuracy.target="0.132 mm"'
    machine = machine_of(tmp_path, "five_bar", target)
    good = designed(tmp_path, tp.allocate(machine, reserve=0.0))
    assert beyond(good, unseen(good, MANY)) == 0

    def corners(places: JudgedPoses) -> np.ndarray:
        ends = np.stack([places.lower, places.upper])
        return np.array(np.meshgrid(*ends.T)).reshape(ends.shape[1], -1).T

    monkeypatch.setattr(JudgedPoses, "first", corners)
    monkeypatch.setattr(allocating, "THOROUGH", Effort(starts=0, kept=4))
    poor = designed(tmp_path, tp.allocate(machine, reserve=0.0))
    assert beyond(poor, unseen(poor, MANY)) > 0


def test_random_poses_without_an_ascent_are_no_judge(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    machine = machine_of(tmp_path, "hexapod")
    good = designed(tmp_path, tp.allocate(machine, reserve=0.0))
    assert beyond(good, unseen(good, MANY)) == 0
    monkeypatch.setattr(JudgedPoses, "first", lambda _: unseen(machine, 1000, seed=1))
    monkeypatch.setattr(allocating, "THOROUGH", Effort(starts=0, kept=24))
    poor = designed(tmp_path, tp.allocate(machine, reserve=0.0))
    assert beyond(poor, unseen(poor, MANY)) > 0


def test_the_bound_is_below_every_design_of_a_local_search(tmp_path: Path) -> None:
    """Random designs made cheaper grade by grade, each judged by the budget at the worst poses."""
    machine = machine_of(tmp_path, "five_bar")
    found = tp.allocate(machine)
    assert machine.costs is not None
    poses = np.concatenate([[one.pose for one in found.worst_poses], unseen(machine, 200)])
    rows = machine.costs.tolerances
    ties = [(row, tie) for row in rows for tie in range(len(row.ties))]
    target = machine.accuracy.target
    assert target is not None
    random = np.random.default_rng(3)

    def keeps(grades: list[int]) -> bool:
        settings = [
            f"tolerance.{row.features[feature]}={1e3 * row.halves[grade][feature]}"
            for (row, tie), grade in zip(ties, grades, strict=True)
            for feature in row.ties[tie]
        ]
        lengths = [one for one in settings if one.split("=")[0].endswith(".length")]
        others = [one for one in settings if one not in lengths]
        own = [
            one.replace("tolerance.", "", 1).replace(".length=", ".length_tolerance=")
            for one in lengths
        ]
        path = machine_of(tmp_path, "five_bar", *others, *own)
        largest = tp.budget(path, poses)["linear_maximum"].values[:, 0].max()
        return bool(largest <= 0.99 * target)

    for _ in range(3):
        grades = [0] * len(ties)
        assert keeps(grades)
        for tie in random.permutation(np.repeat(np.arange(len(ties)), 5)).tolist():
            if grades[tie] + 1 < len(ties[tie][0].grades):
                coarser = grades.copy()
                coarser[tie] += 1
                if keeps(coarser):
                    grades = coarser
        cost = sum(row.costs[grade][tie] for (row, tie), grade in zip(ties, grades, strict=True))
        assert found.lower_bound <= cost
        assert any(grades)


def test_what_the_verdict_finds_cuts_the_design_off(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of cheap designs it tells that they cannot be assembled, or err: a dearer one is chosen."""
    machine = machine_of(tmp_path, "planar_two_slider")
    cheapest = tp.allocate(machine, gap=0.0).cost
    own = allocating.OneAllocation.beyond
    for size in (float("inf"), 0.6e-3):

        def beyond_it(self: Any, candidate: Any, design: Any, size: float = size) -> list[Any]:
            clean = own(self, candidate, design)
            if design.cost > 1.5 * cheapest:
                return clean
            worst = design.judgement.witnesses[0]
            assert not clean
            return [dataclasses.replace(worst, exact=size, share=size / 0.495e-3)]

        monkeypatch.setattr(allocating.OneAllocation, "beyond", beyond_it)
        found = tp.allocate(machine, gap=0.0)
        assert found.cost > 1.5 * cheapest
        assert found.lower_bound == pytest.approx(cheapest, rel=1e-6)
        assert found.gap > 0.3
