"""Where a design holds: boxes, listed poses, what is out of reach; how many poses are looked at."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from designs import beyond, file_with, row, unseen
from truepose.design import judged_poses
from truepose.errors import RequestError


def with_workspace(folder: Path, workspace: str) -> Path:
    path = file_with(folder, "planar_two_slider")
    path.write_text(re.sub(r"grid = .*", workspace, path.read_text(), count=1))
    return path


@pytest.mark.parametrize(
    "workspace",
    [
        "box = { x = [220, 380], y = [120, 280], step = 80 }",
        "grid = { x = [200, 400, 5], y = [200, 200, 1] }",
        "poses = [[300, 200], [320, 180]]",
        "path = { points = [[300, 200], [320, 180], [310, 180]], step = 5 }",
        "grid = { x = [300, 300, 1], y = [200, 200, 1] }",
    ],
)
def test_every_kind_of_workspace(tmp_path: Path, workspace: str) -> None:
    machine = tp.load(with_workspace(tmp_path, workspace))
    found = tp.allocate(machine)
    found.save(tmp_path / "designed.toml")
    designed = tp.load(tmp_path / "designed.toml")
    assert beyond(designed, machine.poses()) == 0
    assert found.proven == "these poses"
    assert machine.workspace is not None
    if machine.workspace.axes:
        assert beyond(designed, unseen(machine, 2000)) == 0
    else:
        every = {pose.tobytes() for pose in machine.poses()}
        assert all(one.pose.tobytes() in every for one in found.worst_poses)


def test_poses_out_of_reach_do_not_count_but_are_told(tmp_path: Path) -> None:
    path = with_workspace(tmp_path, "grid = { x = [-100, 400, 5], y = [100, 300, 5] }")
    found = tp.allocate(tp.load(path))
    assert found.left_out > 0
    assert found.dataset.attrs["poses_left_out"] == found.left_out
    nowhere = with_workspace(tmp_path, "grid = { x = [-1000, -900, 5], y = [100, 300, 5] }")
    with pytest.raises(RequestError) as caught:
        tp.allocate(tp.load(nowhere))
    assert caught.value.problems[0].code == "no-pose-left"


def test_a_machine_without_any_other_error(tmp_path: Path) -> None:
    """Cold, free, and without a tolerance in its file: all that errs is what is chosen."""
    path = file_with(tmp_path, "planar_two_slider")
    text = path.read_text().replace("length_tolerance = [-0.3, 0.3]\n", "")
    text = text.replace("temperature = 35", "temperature = 20").replace("force = {", "# force = {")
    path.write_text(text)
    found = tp.allocate(tp.load(path, ["accuracy.target=0.1 mm"]))
    parts = {one.name: one for one in found.contributions}
    assert parts["known deviations"].after == pytest.approx(0.0, abs=1e-12)
    assert parts["strut.*.length"].before == 0.0
    total = sum(one.after for one in found.contributions)
    assert total == pytest.approx(found.worst_poses[0].linear)
    found.save(tmp_path / "designed.toml")
    designed = tp.load(tmp_path / "designed.toml")
    assert beyond(designed, unseen(designed, 2000)) == 0


def test_data_files_are_found_from_another_folder(tmp_path: Path) -> None:
    (tmp_path / "cost.csv").write_text("band (um), cost\n20, 8\n50, 3\n")
    table = '[[cost.tolerance]]\nof = "strut.*.length"\ntable = "cost.csv"\n'
    choice = (
        '[[cost.choice]]\nname = "rods"\nof = "strut.*"\noptions = [{ name = "a", set = {}, '
        'cost = 1 }, { name = "b", set = { expansion = "1e-6 1/K" }, cost = 2 }]\n'
    )
    path = file_with(tmp_path, "planar_two_slider", choice, rows=(table,))
    found = tp.allocate(tp.load(path))
    assert found.cost == pytest.approx(7.0)
    other = tmp_path / "other"
    other.mkdir()
    found.save(other / "designed.toml")
    assert 'table = "../cost.csv"' in (other / "designed.toml").read_text()
    assert tp.allocate(tp.load(other / "designed.toml")).cost == pytest.approx(7.0)


def test_few_or_many_first_poses_agree(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    machine = tp.load(file_with(tmp_path, "five_bar"))
    costs = []
    for count in (64, 1024, 16384):
        monkeypatch.setattr(judged_poses, "EVEN", count)
        costs.append(tp.allocate(machine, gap=0.0).cost)
    assert costs == pytest.approx([costs[0]] * 3, rel=1e-9)


def test_bounds_at_the_worst_poses_are_within_the_target(tmp_path: Path) -> None:
    machine = tp.load(file_with(tmp_path, "five_bar"), ["accuracy.target=0.165 mm"])
    found = tp.allocate(machine)
    found.save(tmp_path / "designed.toml")
    designed = tp.load(tmp_path / "designed.toml")
    poses = unseen(designed, 20_000)
    order = np.argsort(tp.budget(designed, poses)["linear_maximum"].values[:, 0])
    proven = tp.bounds(designed, poses[order[-100:]])
    assert proven.sizes["pose"] == 100
    assert (proven["status"] == "proven").all()
    assert designed.accuracy.target is not None
    assert proven["magnitude"].sel(quantity="position").max() <= designed.accuracy.target


def test_a_single_grade_leaves_nothing_to_choose(tmp_path: Path) -> None:
    rows = (row("strut.*.length", bands='["50 um"]'), row("drive.*.offset", bands='["20 um"]'))
    found = tp.allocate(tp.load(file_with(tmp_path, "planar_two_slider", rows=rows)))
    assert found.cost == pytest.approx(2 * 4.0 * 10 / 50 + 2 * 4.0 * 10 / 20)
    assert found.gap <= 1e-6
