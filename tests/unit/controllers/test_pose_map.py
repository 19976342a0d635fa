"""The pose map, read back from both formats and interpolated by SciPy."""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.interpolate import RegularGridInterpolator
from scipy.spatial.transform import Rotation

import truepose as tp
from build_machine import MACHINES
from sweeps import thinned
from truepose.compensation.commands import actual_poses, corrected_poses
from truepose.controllers._export import Export, options_of
from truepose.controllers.pose_map import PoseMap
from truepose.errors import RequestError
from truepose.machine import Machine

Array = NDArray[np.float64]
UM = 1e-6
SCALES = {"mm": 1e-3, "in": 0.0254, "m": 1.0, "deg": np.pi / 180.0, "rad": 1.0}
SHIPPED = ["planar_two_slider", "linear_delta", "rotary_delta", "hexapod", "3prs", "five_bar"]


def exported(machine: Machine, *options: str) -> Export:
    return PoseMap.export(machine, options_of(PoseMap, machine, options))


def of_csv(export: Export) -> tuple[list[str], list[Array], Array, list[str]]:
    """Freedoms, nodes along each axis, corrections (*shape, n), SI, and the status of each node."""
    text = next(text for name, text in export.files.items() if name.endswith(".csv"))
    rows = list(csv.reader(line for line in text.splitlines() if not line.startswith("#")))
    header = [re.fullmatch(r"(add_)?(\w) \((\w+)\)", cell) for cell in rows[0][:-1]]
    count = len(header) // 2
    assert rows[0][-1] == "status"
    assert [bool(cell and cell[1]) for cell in header] == [False] * count + [True] * count
    names = [cell[2] for cell in header if cell][:count]
    assert [cell[2] for cell in header if cell][count:] == names
    scales = np.array([SCALES[cell[3]] for cell in header if cell])
    table = np.array([[float(cell or "nan") for cell in row[:-1]] for row in rows[1:]]) * scales
    axes = [np.unique(table[:, at]) for at in range(count)]
    values = np.full([*(axis.size for axis in axes), count], np.nan)
    for row in table:
        place = tuple(int(np.searchsorted(axes[at], row[at])) for at in range(count))
        assert np.isnan(values[place]).all()  # no node twice
        values[place] = row[count:]
    return names, axes, values, [row[-1] for row in rows[1:]]


def of_json(export: Export) -> tuple[dict[str, Any], list[Array], Array]:
    text = next(text for name, text in export.files.items() if name.endswith(".json"))
    found: dict[str, Any] = json.loads(text)
    scales = [SCALES[axis["unit"]] for axis in found["axes"]]
    axes = [np.array(a["nodes"]) * scale for a, scale in zip(found["axes"], scales, strict=True)]
    columns = [
        # The first axis runs fastest: Fortran's order.
        np.array(found["corrections"][axis["name"]], float).reshape(
            [a.size for a in axes], order="F"
        )
        * scale
        for axis, scale in zip(found["axes"], scales, strict=True)
    ]
    return found, axes, np.stack(columns, axis=-1)


def interpolated(axes: list[Array], values: Array, points: Array) -> Array:
    moving = [at for at, axis in enumerate(axes) if axis.size > 1]
    squeezed = values.reshape([axes[at].size for at in moving] + [len(axes)])
    found = RegularGridInterpolator([axes[at] for at in moving], squeezed)(points[:, moving])
    return np.asarray(found)


def wrong(machine: Machine, axes: list[Array], values: Array, points: Array) -> tuple[Array, Array]:
    """(n,) what the interpolated command is off, m and rad, against the exact one."""
    exact, status = corrected_poses(machine, points)
    assert not status.any()
    added = points + interpolated(axes, values, points)
    linear = [at for at, name in enumerate(machine.commanded) if name in "xyz"]
    turned = np.zeros(len(points))
    if len(machine.commanded) == 6:
        one, other = (Rotation.from_euler("ZYX", p[:, [5, 4, 3]]) for p in (added, exact))
        turned = (one * other.inv()).magnitude()
    return np.linalg.norm((added - exact)[:, linear], axis=1), turned


def inside(axes: list[Array], count: int, seed: int) -> Array:
    generator = np.random.default_rng(seed)
    return generator.uniform([a[0] for a in axes], [a[-1] for a in axes], (count, len(axes)))


@pytest.mark.parametrize("name", SHIPPED)
def test_nodes_are_exact_and_both_formats_agree(name: str) -> None:
    machine = tp.load(MACHINES / f"{name}.toml")
    export = exported(machine)
    names, axes, values, status = of_csv(export)
    document, other_axes, other_values = of_json(export)
    assert tuple(names) == machine.commanded
    assert document["status"] == status
    for one, other in zip(axes, other_axes, strict=True):
        assert np.abs(one - other).max() < 1e-12
    assert np.allclose(values, other_values, rtol=0, atol=1e-15, equal_nan=True)
    # First axis fastest, as the file's own grid: so the poses are those of the workspace.
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    flat = nodes.reshape(-1, len(axes), order="F")
    assert np.abs(flat - machine.poses()).max() < 1e-11
    exact, _ = corrected_poses(machine, flat)
    off = np.abs(flat + values.reshape(-1, len(axes), order="F") - exact)
    assert np.nanmax(off) < 1e-10  # as far as they are written


@pytest.mark.parametrize("name", thinned(["planar_two_slider", "linear_delta", "hexapod"]))
def test_the_interpolation_error_is_as_stated(name: str) -> None:
    machine = tp.load(MACHINES / f"{name}.toml")
    export = exported(machine)
    document, axes, values = of_json(export)
    said = document["interpolation_error"]
    position, orientation = wrong(machine, axes, values, inside(axes, 30_000, 99))
    pairs = [("position_m", position)]
    if said["orientation_rad"] is not None:
        pairs.append(("orientation_rad", orientation))
    for key, found in pairs:
        # Other points: none is worse than what was searched for, the worst nearly as bad.
        assert found.max() <= 1.001 * said[key]["highest"]
        assert found.max() >= 0.85 * said[key]["highest"]
        assert np.sqrt(np.mean(found**2)) == pytest.approx(said[key]["rms"], rel=0.02)
        there = np.array([said[key]["highest_at"]])
        at_place = wrong(machine, axes, values, there)[0 if key == "position_m" else 1][0]
        assert at_place == pytest.approx(said[key]["highest"], rel=1e-6)
    line = next(line for line in export.statement if line.startswith("interpolation"))
    one, unit = (25.4e-9, "µin") if machine.file_units["length"].label == "in" else (UM, "µm")
    assert f"at most {said['position_m']['highest'] / one:.2f} {unit}" in line
    assert f"rms {said['position_m']['rms'] / one:.2f} {unit}" in line
    text = next(text for file, text in export.files.items() if file.endswith(".csv"))
    assert f"# {line.replace('µ', 'u')}\n" in text


@pytest.mark.parametrize("name", thinned(["planar_two_slider", "linear_delta", "hexapod"]))
def test_added_to_the_command_it_takes_the_error_away(name: str) -> None:
    machine = tp.load(MACHINES / f"{name}.toml")
    document, axes, values = of_json(exported(machine))
    points = inside(axes, 500, 5)
    linear = [at for at, freedom in enumerate(machine.commanded) if freedom in "xyz"]
    before, _ = actual_poses(machine, points)
    after, _ = actual_poses(machine, points + interpolated(axes, values, points))
    was = np.linalg.norm((before - points)[:, linear], axis=1)
    left = np.linalg.norm((after - points)[:, linear], axis=1)
    assert left.max() < 1.1 * document["interpolation_error"]["position_m"]["highest"]
    assert left.max() < 0.05 * was.max()


def test_more_nodes_and_fewer() -> None:
    machine = tp.load(MACHINES / "linear_delta.toml")
    highest = []
    for count in ("count=3", "count=5", "count=9"):
        document, axes, _ = of_json(exported(machine, count))
        assert [axis.size for axis in axes] == [int(count[-1])] * 3
        highest.append(document["interpolation_error"]["position_m"]["rms"])
    # The error falls with the square of the step.
    assert highest[0] / highest[1] == pytest.approx(4.0, rel=0.25)
    assert highest[1] / highest[2] == pytest.approx(4.0, rel=0.25)
    _, axes, _ = of_json(exported(machine, "count=x 4 z 7"))
    assert [axis.size for axis in axes] == [4, 5, 7]


def test_the_head_says_what_it_is_of() -> None:
    machine = tp.load(MACHINES / "hexapod.toml", ["condition.temperature=31"])
    machine = machine.replace({"strut.1.base.x": -0.58})
    export = exported(machine)
    document, *_ = of_json(export)
    assert document["machine"] == "Hexapod (genhexkins)"
    assert document["machine_file"] == "hexapod.toml"
    assert document["machine_file_sha256"] == machine.file_hash
    assert document["settings"] == "condition.temperature=31"
    assert document["replaced"] == "strut.1.base.x=-0.58"
    assert document["condition"]["temperature_K"]["default"] == pytest.approx(304.15)
    assert document["condition"]["force_N"] == [300.0, 200.0, -150.0]
    assert document["orientation"] == "R = Rz(c) Ry(b) Rx(a)"
    assert "base frame" in document["frame"]
    assert "commanded = wanted + correction" in document["use"]
    assert document["truepose_version"] == tp.__version__
    text = next(text for name, text in export.files.items() if name.endswith(".csv"))
    for key in ("format", "machine_file_sha256", "condition", "frame", "orientation", "use"):
        assert re.search(f"^# {key}: .+$", text, flags=re.MULTILINE), key
    assert text.isascii()
    assert sorted(export.files) == ["hexapod_pose_map.csv", "hexapod_pose_map.json"]


def test_nodes_out_of_reach_stay_empty(tmp_path: Path) -> None:
    text = (MACHINES / "planar_two_slider.toml").read_text(encoding="utf-8")
    wide = re.sub(
        r"^grid = .*$", "grid = { x = [20, 400, 6], y = [100, 300, 5] }", text, flags=re.M
    )
    wide = wide.replace("length = 500", "length = 450")
    path = tmp_path / "machine.toml"
    path.write_text(wide, encoding="utf-8")
    machine = tp.load(path)
    export = exported(machine)
    _, axes, values, status = of_csv(export)
    document, _, other = of_json(export)
    out = np.isnan(values[..., 0]).reshape(-1, order="F")
    assert 0 < out.sum() < out.size
    assert [s == "unreachable" for s in status] == out.tolist()
    assert np.array_equal(np.isnan(values), np.isnan(other))
    assert None in document["corrections"]["x"]
    assert any(line.startswith(f"{out.sum()} nodes are unreachable") for line in export.statement)
    assert any("were not compared" in line for line in export.statement)
    # What is stated is of the cells that are whole.
    whole = inside(axes, 5000, 3)
    added = interpolated(axes, values, whole)
    whole = whole[np.isfinite(added).all(axis=1)]
    assert 0 < len(whole) < 5000
    position, _ = wrong(machine, axes, values, whole)
    assert position.max() <= 1.001 * document["interpolation_error"]["position_m"]["highest"]


def test_where_the_machine_may_go_is_stated_by_itself(tmp_path: Path) -> None:
    # Half of the map is out of travel, and worst there.
    text = (MACHINES / "linear_delta.toml").read_text(encoding="utf-8")
    path = tmp_path / "machine.toml"
    path.write_text(text.replace("travel = [0, 580]", "travel = [0, 400]"), encoding="utf-8")
    machine = tp.load(path)
    export = exported(machine)
    document, axes, values = of_json(export)
    said = document["interpolation_error"]
    points = inside(axes, 20_000, 77)
    exact, status = corrected_poses(machine, points)
    allowed = status == 0
    assert 0.1 < allowed.mean() < 0.9
    off = np.linalg.norm(points + interpolated(axes, values, points) - exact, axis=1)
    within = said["commandable"]
    for found, of in ((said, off), (within, off[allowed])):
        assert 0.85 * found["position_m"]["highest"] <= of.max()
        assert of.max() <= 1.001 * found["position_m"]["highest"]
        rms = np.sqrt(np.mean(of**2))
        assert found["position_m"]["rms"] == pytest.approx(rms, rel=0.03)
    assert within["position_m"]["highest"] < said["position_m"]["highest"]
    assert within["points"] < said["points"]
    line = next(line for line in export.statement if line.startswith("where the machine may be"))
    assert f"at most {within['position_m']['highest'] / UM:.2f} µm" in line
    assert not any(
        line.startswith("where the machine may be")
        for line in exported(tp.load(MACHINES / "linear_delta.toml")).statement
    )


def test_a_map_of_one_node() -> None:
    one = [f"workspace.grid.{axis}=[{at}, {at}, 1]" for axis, at in zip("xyz", "123", strict=True)]
    export = exported(tp.load(MACHINES / "linear_delta.toml", one))
    assert export.statement[0].startswith("1 node (1 x 1 x 1)")
    assert "one node: there is nothing to interpolate" in export.statement
    assert not any("between the nodes" in line for line in export.statement[1:])
    assert of_json(export)[0]["interpolation_error"]["points"] == 1


def refused(machine: Machine, *options: str) -> tuple[str, str]:
    with pytest.raises(RequestError) as failure:
        exported(machine, *options)
    (problem,) = failure.value.problems
    return problem.code, str(problem)


@pytest.mark.parametrize(
    ("option", "words"),
    [
        ("count=1", "two or more"),
        ("count=0", "two or more"),
        ("count=-3", "two or more"),
        ("count=2.5", "two or more"),
        ("count=many", "two or more"),
        ("count=x 3 y", "pose-map"),
        ("count=x 3 q 3", "q"),
        ("count=x 9 x 5", "one count for x"),
        ("count=x y", "two or more"),
        ("count=", "pose-map"),
    ],
)
def test_bad_counts(option: str, words: str) -> None:
    code, text = refused(tp.load(MACHINES / "linear_delta.toml"), option)
    assert code == "bad-option"
    assert words in text


def test_a_map_that_is_too_large() -> None:
    code, text = refused(tp.load(MACHINES / "hexapod.toml"), "count=16")
    assert code == "grid-too-large"
    assert f"{16**5} nodes" in text  # c has one pose only


def test_a_workspace_out_of_reach() -> None:
    machine = tp.load(
        MACHINES / "planar_two_slider.toml",
        ["workspace.grid.x=[2000, 2100, 3]", "workspace.grid.y=[2000, 2100, 3]"],
    )
    assert refused(machine)[0] == "no-pose-left"
