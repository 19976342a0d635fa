"""The budget without poses: the numbers of the one with them, of any number, in any parts."""

from __future__ import annotations

import csv
import io
import json
import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import truepose as tp
from build_machine import MACHINES
from command_line import call
from guided_machines import guided
from machine_texts import with_workspace
from truepose.error_budget import summary
from truepose.error_budget.summary import SUMMARY
from truepose.errors import RequestError
from truepose.runs import divided, poses
from truepose.runs.divided import in_order

Capture = pytest.CaptureFixture[str]

OVER_POSES = {
    "highest_error": "error",
    "highest_reach": "reach",
    "overall_highest_error": "overall_error",
    "highest_linear_maximum": "linear_maximum",
}
EVERY = sorted(path.stem for path in MACHINES.glob("*.toml"))
WIDE = "grid = { x = [-300, 900, 41], y = [-200, 700, 33] }"
FINE = "grid = { x = [200, 400, 20001], y = [100, 300, 10001] }"
ZIGZAG = "path = { points = [[-50, 0, 50], [50, 10, 90], [-50, 20, 50], [50, 30, 90]], step = 1 }"


def same_numbers(summary: Any, budget: Any) -> None:
    """To the bit, whether the budget kept them or they are found in what it kept."""
    assert set(summary.data_vars) == set(SUMMARY)
    for name in summary.data_vars:
        if name in budget:
            expected, found = budget[name].values, summary[name].values
            assert found.dtype == expected.dtype, name
            assert found.tobytes() == expected.tobytes(), name
    for name, of in OVER_POSES.items():
        most = np.fmax.reduce(np.abs(budget[of].values), axis=0)
        assert np.array_equal(summary[name].values, most), name
    assert summary["distribution"].values.tolist() == budget["distribution"].values.tolist()
    worst = budget["linear_maximum"].values.argmax(axis=0)
    at = np.stack([budget[f"pose_{c}"].values[worst] for c in summary.commanded.values], axis=-1)
    assert np.array_equal(summary["highest_at"].values, at)
    assert summary.attrs["warnings"] == budget.attrs["warnings"]
    for name in ("poses_used", "poses_left_out", "machine_hash", "condition", "not_included"):
        assert summary.attrs[name] == budget.attrs[name], name
    left_out = dict(
        zip(summary["reason"].values.tolist(), summary["left_out_count"].values, strict=True)
    )
    names, counts = np.unique(budget["left_out_status"].values, return_counts=True)
    assert left_out == dict(zip(names.tolist(), counts.tolist(), strict=True))


@pytest.fixture
def small_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    for module in (poses, divided, summary):
        monkeypatch.setattr(module, "BLOCK", 16)


@pytest.mark.usefixtures("small_blocks")
@pytest.mark.parametrize("name", EVERY)
def test_every_machine(name: str) -> None:
    machine = tp.load(MACHINES / f"{name}.toml")
    same_numbers(tp.budget(machine, summary=True), tp.budget(machine))


@pytest.mark.usefixtures("small_blocks")
@pytest.mark.parametrize(
    ("most", "fewest", "count"), [(1, 8, 85), (3, 8, 29), (32, 8, 9), (7, 1, 13)]
)
def test_parts_do_not_matter_and_what_is_left_out_is_counted(
    most: int, fewest: int, count: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(divided, "MOST_BLOCKS", most)
    monkeypatch.setattr(divided, "FEWEST_PARTS", fewest)
    machine = tp.load(with_workspace("planar_two_slider", tmp_path, WIDE))
    budget = tp.budget(machine)
    assert len(np.unique(budget["left_out_status"].values)) > 1
    seen: list[tuple[int, int]] = []
    summary = tp.budget(machine, summary=True, progress=lambda *done: seen.append(done))
    same_numbers(summary, budget)
    total = 41 * 33
    assert [done for done, _ in seen] == sorted({done for done, _ in seen})
    assert {of for _, of in seen} == {total}
    assert seen[-1] == (total, total)
    assert len(seen) == count


@pytest.mark.usefixtures("small_blocks")
def test_what_guides_carry_is_the_most_of_all_parts() -> None:
    machine = tp.load(guided("3prs"))
    loaded = machine.condition.replace(force=(30.0, -80.0, 10.0))
    for order in (1, -1):
        given = np.repeat(machine.poses(), 4, axis=0)[::order]
        budget = tp.budget(machine, given, loaded)
        assert "carries up to" in budget.attrs["warnings"]
        same_numbers(tp.budget(machine, given, loaded, summary=True), budget)


@pytest.mark.usefixtures("small_blocks")
def test_of_poses_with_the_same_error_the_first_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    evaluated = summary.evaluate_block

    def alike(*given: Any) -> Any:
        usable = evaluated(*given)
        given[3]["linear_maximum"][:] = 1e-3
        return usable

    monkeypatch.setattr(summary, "evaluate_block", alike)
    machine = tp.load(with_workspace("planar_two_slider", tmp_path, WIDE))
    told = tp.budget(machine, summary=True)
    first = machine.poses()[tp.budget(machine)["pose"].values[0]]
    assert told["highest_at"].values.tolist() == [first.tolist()]


@pytest.mark.usefixtures("small_blocks")
def test_poses_may_be_given(tmp_path: Path) -> None:
    machine = tp.load(with_workspace("planar_two_slider", tmp_path, WIDE))
    given = machine.poses()[::-1][:700]
    same_numbers(tp.budget(machine, given, summary=True), tp.budget(machine, given))


@pytest.mark.usefixtures("small_blocks")
def test_a_path_is_come_along_into_each_part(tmp_path: Path) -> None:
    machine = tp.load(
        with_workspace("linear_delta", tmp_path, ZIGZAG),
        settings=['drive.*.backlash={play="0.2 mm"}'],
    )
    assert "backlash" in [source.name for source in machine.sources]
    budget = tp.budget(machine)
    same_numbers(tp.budget(machine, summary=True), budget)

    def run() -> poses.PoseRun:
        return poses.PoseRun(machine, machine.poses(), machine.condition, path=True)

    whole = np.concatenate([block.travel for block in run()])
    assert len(np.unique(whole, axis=0)) > 4
    starts = range(0, len(whole), 48)
    for start, travel in zip(starts, run().arrivals(starts), strict=True):
        part = run()
        part.arrive(travel)
        blocks = part.between(start, min(start + 48, len(whole)))
        came = np.concatenate([block.travel for block in blocks])
        assert np.array_equal(came, whole[start : start + 48])


def test_a_grid_is_made_as_it_is_looked_at_to_the_bits_of_a_whole_one() -> None:
    from truepose.machine.workspace import GridAxis, GridPoses, grid

    draw = np.random.default_rng(5)
    for _ in range(200):
        counts = draw.integers(1, 12, draw.integers(1, 4))
        ends = draw.normal(size=(2, counts.size)) * 10.0 ** draw.integers(-9, 3)
        still = draw.random(counts.size) < 0.2
        ends[1, still] = ends[0, still]
        axes = tuple(
            GridAxis("x", *end, int(count)) for end, count in zip(ends.T, counts, strict=True)
        )
        whole, made = grid(axes), GridPoses(axes)
        assert len(made) == len(whole)
        assert made[:].tobytes() == whole.tobytes()
        numbers = draw.integers(0, len(whole), 7)
        assert made[numbers].tobytes() == whole[numbers].tobytes()
        assert made[numbers[0]].tobytes() == whole[numbers[0]].tobytes()
        assert made[2:5].tobytes() == whole[2:5].tobytes()


def test_a_grid_of_subnormal_steps_as_well() -> None:
    from truepose.machine.workspace import GridAxis, GridPoses, grid

    axes = (GridAxis("x", 0.0, 5e-324, 4),)
    assert GridPoses(axes)[:].tobytes() == grid(axes).tobytes()


def test_more_poses_than_are_kept_are_for_a_summary_alone(tmp_path: Path) -> None:
    path = with_workspace("planar_two_slider", tmp_path, FINE)
    machine = tp.load(path)
    assert "200030001 poses" in str(machine)
    for command in (machine.poses, lambda: tp.budget(machine), lambda: tp.accuracy(machine)):
        with pytest.raises(RequestError) as refused:
            command()
        (problem,) = refused.value.problems
        assert problem.code == "grid-too-large"
        assert "--summary" in str(problem.hint)
        assert (problem.path, problem.line) == ("workspace", machine.workspace.line)  # type: ignore[union-attr]


def test_its_memory_does_not_grow_with_the_poses(tmp_path: Path) -> None:
    def peak(count: int) -> int:
        workspace = f"grid = {{ x = [200, 400, {count}], y = [100, 300, 500] }}"
        machine = tp.load(with_workspace("planar_two_slider", tmp_path, workspace))
        tracemalloc.start()
        try:
            summary = tp.budget(machine, summary=True)
            assert summary.attrs["poses_used"] == 500 * count
            return tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()

    peak(20)  # what is imported
    assert peak(2000) < 1.1 * peak(200)


def test_where_no_pose_is_left_it_says_why(tmp_path: Path) -> None:
    path = with_workspace(
        "planar_two_slider", tmp_path, "grid = { x = [5e3, 6e3, 99], y = [0, 9, 9] }"
    )
    machine = tp.load(path)
    told = []
    for summed in (False, True):
        with pytest.raises(RequestError) as refused:
            tp.budget(machine, summary=summed)
        told.append(refused.value.problems)
    assert told[0] == told[1]
    assert told[0][0].code == "no-pose-left"


def test_what_comes_early_waits() -> None:
    order = [3, 0, 2, 1, 5, 4]
    assert list(in_order((number, -number) for number in order)) == [0, -1, -2, -3, -4, -5]


# --- the command


@pytest.fixture
def wide(tmp_path: Path) -> Path:
    return with_workspace("planar_two_slider", tmp_path, WIDE)


def test_the_command_says_where_and_how_many(wide: Path, capsys: Capture) -> None:
    told = call(capsys, "budget", wide, "--summary")
    assert (told.code, told.err) == (0, "")
    summary = tp.budget(tp.load(wide), summary=True)
    at = summary["highest_at"].values[0] * 1e3
    assert f"x {at[0]:.6g} mm, y {at[1]:.6g} mm" in told.out.replace("−", "-")
    assert f"{summary['highest_linear_maximum'].values[0] * 1e6:.2f} µm" in told.out
    for count in summary["left_out_count"].values:
        assert f"{count:,}" in told.out.replace(" ", ",")


def test_its_tables_are_those_of_the_whole_budget(capsys: Capture) -> None:
    for name in ("planar_two_slider", "hexapod", "overconstrained"):
        whole = call(capsys, "budget", MACHINES / f"{name}.toml").out
        found = call(capsys, "budget", MACHINES / f"{name}.toml", "--summary").out
        for title in ("The sources compared", "Highest absolute error"):
            table = whole[whole.index(title) :].split("\n\n")[:2]
            assert "\n\n".join(table) in found


def test_files_for_programs(wide: Path, capsys: Capture) -> None:
    machine = tp.load(wide)
    summary = tp.budget(machine, summary=True)
    text = json.loads(call(capsys, "budget", wide, "--summary", "--format", "json").out)
    rows = list(
        csv.DictReader(
            io.StringIO(call(capsys, "budget", wide, "--summary", "--format", "csv").out)
        )
    )
    assert set(text["variables"]) == set(SUMMARY)
    reach = text["variables"]["highest_reach"]
    assert np.allclose(reach["values"], summary["highest_reach"].values * 1e3, rtol=1e-15)
    of = {(row["name"], row["of"]): (row["value"], row["unit"]) for row in rows}
    assert len(of) == sum(variable.size for variable in summary.data_vars.values())
    value, unit = of["highest_error", "thermal y"]
    assert float(value) == pytest.approx(
        float(summary["highest_error"].sel(source="thermal", component="y")) * 1e3, rel=1e-15
    )
    assert unit == "mm"
    count, unit = of["left_out_count", str(summary["reason"].values[0])]
    assert (int(count), unit) == (int(summary["left_out_count"].values[0]), "1")


REFUSALS: list[tuple[tuple[str, ...], str]] = [
    (("--summary", "--require-accuracy"), "go without --summary"),
    (("--summary", "--witness", "w.toml"), "go without --summary"),
    (("--workers", "2"), "give --summary too"),
    (("--summary", "--strict"), "error[unusable-pose]"),
    (("--summary", "--workers", "0"), "error[bad-workers]"),
]


@pytest.mark.parametrize(("options", "said"), REFUSALS)
def test_what_a_summary_cannot_say_is_refused(
    options: tuple[str, ...], said: str, wide: Path, capsys: Capture
) -> None:
    told = call(capsys, "budget", wide, *options)
    assert (told.code, told.out) == (2, "")
    assert said in told.err


def test_workers_are_refused_for_rows_of_poses(planar: tp.Machine) -> None:
    with pytest.raises(RequestError) as refused:
        tp.budget(planar, workers=2)
    assert refused.value.problems[0].code == "bad-workers"


@pytest.fixture
def planar() -> tp.Machine:
    return tp.load(MACHINES / "planar_two_slider.toml")
