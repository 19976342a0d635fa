"""The worst case of all sources together, against every corner driven through the machine."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.typing import NDArray

import truepose as tp
from build_machine import MACHINES
from machine_texts import HEXAPOD, PLANAR, edited, load_text
from truepose.errors import RequestError
from truepose.machine import Machine
from truepose.runs.poses import PoseRun, required_sources
from truepose.runs.variables import variables_at
from truepose.uncertainty_analysis import corners
from truepose.uncertainty_analysis.functions.inputs import Input
from truepose.uncertainty_analysis.worst_case import SCHEMA

Array = NDArray[np.float64]
BOTH = edited(PLANAR, ("length = 500\nsection", "length = 500\nlength_tolerance = 0.2\nsection"))


def load(name: str) -> Machine:
    return tp.load(MACHINES / f"{name}.toml")


@cache
def of(name: str, poses: int) -> xr.Dataset:
    machine = load(name)
    return tp.worst_case(machine, machine.poses()[:poses])


def at_corner(machine: Machine, pose: Array, moved: dict[str, float]) -> Array:
    """Where the moved machine takes the nominal command, less where it was sent; x and y, m."""
    kernel, at = machine.kernel, machine.parameters.index
    values = {name: float(machine.nominal[at(name)]) + each for name, each in moved.items()}
    reached: Array = kernel.replace(values).forward(kernel.inverse(pose), pose)
    return reached - pose


def test_two_lengths_at_all_their_corners(tmp_path: Path) -> None:
    text = edited(BOTH, ("temperature = 35\nforce", "force"), ("x = 1200, y = -1500", "x = 0"))
    machine = load_text(tmp_path, text)
    poses = machine.poses()
    found = tp.worst_case(machine)
    bands = {"strut.1.length": 0.3e-3, "strut.2.length": 0.2e-3}
    for number, pose in enumerate(poses):
        errors = np.array(
            [
                at_corner(
                    machine,
                    pose,
                    {
                        name: sign * half
                        for (name, half), sign in zip(bands.items(), signs, strict=True)
                    },
                )
                for signs in product((-1.0, 1.0), repeat=2)
            ]
        )
        here = found.isel(pose=number)
        assert np.allclose(here.exact_lower, errors.min(axis=0), rtol=0, atol=1e-14)
        assert np.allclose(here.exact_upper, errors.max(axis=0), rtol=0, atol=1e-14)
        assert np.allclose(here.exact, np.abs(errors).max(axis=0), rtol=0, atol=1e-14)
        norm = np.linalg.norm(errors, axis=1).max()
        assert float(here.magnitude_exact.sel(quantity="position")) == pytest.approx(norm)
    assert (found.search == "every vertex").all()
    assert (found.vertices == 4).all()


def test_linear_is_the_sum_of_sensitivities_by_half_bands(tmp_path: Path) -> None:
    machine = load_text(tmp_path, BOTH)
    found = tp.worst_case(machine)
    budget = tp.budget(machine)
    (block,) = PoseRun(machine, machine.poses(), machine.condition)
    moves = variables_at(machine, block, required_sources(machine, machine.condition))
    columns = [machine.parameters.index(f"strut.{i}.length") for i in (1, 2)]
    about_shift, _ = machine.kernel.sensitivity_moved(
        block.joints, block.placements, columns, *moves.shift
    )
    slopes = about_shift * [0.3e-3, 0.2e-3]
    shift = budget.overall_error.values
    assert np.allclose(found.linear, np.abs(shift) + np.abs(slopes).sum(axis=2), rtol=1e-12)
    corners = [shift + slopes @ np.array(signs) for signs in product((-1.0, 1.0), repeat=2)]
    norm = np.linalg.norm(corners, axis=2).max(axis=0)
    assert np.allclose(found.magnitude_linear.sel(quantity="position"), norm, rtol=1e-12)
    assert (found.linear >= budget.worst.max("source")).all()


def test_the_schema_is_what_there_is() -> None:
    found = of("planar_two_slider", 3)
    assert list(found.data_vars) == list(SCHEMA)
    for name, variable in SCHEMA.items():
        assert found[name].dims == variable.dims
    assert found.linear.attrs["units"] == "m"
    assert found.search.dtype.kind == "U"
    assert found.attrs["unbounded"] == "none"
    assert found.attrs["poses_used"] == 3
    turns = of("3rpr", 2)
    assert turns["quantity"].values.tolist() == ["position", "orientation"]
    assert turns.quantity_units.values.tolist() == ["m", "rad"]


@pytest.mark.parametrize("name", ["hexapod", "linear_delta", "3rpr", "overconstrained"])
def test_small_bands_are_nearly_linear(name: str) -> None:
    found = of(name, 6)
    assert (found.search == "directed").all()
    assert np.abs(found.exact / found.linear - 1.0).max() < 0.02
    assert np.abs(found.magnitude_exact / found.magnitude_linear - 1.0).max() < 0.02
    larger = np.maximum(-found.exact_lower, found.exact_upper)
    assert np.array_equal(found.exact, larger)


def test_a_directed_search_and_every_corner_agree(monkeypatch: pytest.MonkeyPatch) -> None:
    machine = load("planar_two_slider")
    every = tp.worst_case(machine)
    monkeypatch.setattr(corners, "EVERY_VERTEX", 1)
    directed = tp.worst_case(machine)
    assert (directed.search == "directed").all()
    for name in ("linear", "exact_lower", "exact_upper", "magnitude_exact"):
        assert np.allclose(directed[name], every[name], rtol=1e-12)


def test_no_corner_of_many_drawn_is_worse_than_the_one_found(tmp_path: Path) -> None:
    machine = load_text(
        tmp_path, f'{HEXAPOD}\n[tolerance]\n"strut.*" = 1.0\n"drive.*.offset" = 1.0\n'
    )
    pose = machine.poses()[:1]
    found = tp.worst_case(machine, pose).isel(pose=0)
    assert str(found.search.values) == "directed"
    random = np.random.default_rng(7)
    joints, placement, _ = machine.kernel.place(pose)
    moved = ("strut.", "drive.")
    columns = [
        at
        for at, name in enumerate(machine.parameters)
        if name.startswith(moved) and not name.endswith(".scale")
    ]
    count = 40_000
    corners = random.choice([-1e-3, 1e-3], size=(count, len(columns)))
    errors, status = machine.kernel.displacement(
        np.repeat(joints, count, axis=0), np.repeat(placement, count, axis=0), columns, corners
    )
    errors = errors[status == 0]
    assert (errors.max(axis=0) <= found.exact_upper).all()
    assert (errors.min(axis=0) >= found.exact_lower).all()
    assert np.linalg.norm(errors[:, :3], axis=1).max() <= found.magnitude_exact[0]


def test_members_of_a_group_go_together(tmp_path: Path) -> None:
    table = '[tolerance]\n"strut.*.length" = { band = 0.2, group = "batch" }\n'
    text = edited(PLANAR, ("length_tolerance = [-0.3, 0.3]\n", ""), ("[workspace]", ""))
    text = edited(text, ("grid = {", f"{table}[workspace]\ngrid = {{"))
    found = tp.worst_case(load_text(tmp_path, text))
    assert (found.vertices == 2).all()


def test_a_distribution_without_ends_is_taken_at_its_band(tmp_path: Path) -> None:
    stated = '{ band = 0.3, distribution = "normal", sigmas = 2 }'
    machine = load_text(tmp_path, edited(BOTH, ("[-0.3, 0.3]", stated)))
    found = tp.worst_case(machine)
    assert found.attrs["unbounded"] == "normal, 2 sigma: strut.1.length"
    bounded = tp.worst_case(load_text(tmp_path, BOTH))
    assert np.allclose(found.exact, bounded.exact, rtol=1e-13)


def test_what_is_known_is_all_where_nothing_has_a_band(tmp_path: Path) -> None:
    machine = load_text(tmp_path, edited(PLANAR, ("length_tolerance = [-0.3, 0.3]\n", "")))
    found = tp.worst_case(machine)
    error = tp.budget(machine).overall_error
    assert np.allclose(found.exact_lower, error, rtol=0, atol=1e-15)
    assert np.allclose(found.exact_upper, error, rtol=0, atol=1e-15)
    assert np.allclose(found.linear, np.abs(error), rtol=0, atol=1e-15)
    assert (found.vertices == 0).all()


def test_a_pose_where_the_machine_cannot_close_at_a_corner_is_left_out(tmp_path: Path) -> None:
    # Carriages 600 mm apart: struts of 500 -+ 160 mm reach some poses at some corners only.
    text = edited(BOTH, ("[-0.3, 0.3]", "[-160, 160]"), ("tolerance = 0.2", "tolerance = 160"))
    machine = load_text(tmp_path, text)
    poses = [[0.3, 0.2], [0.4, 0.2], [0.12, 0.2]]
    found = tp.worst_case(machine, poses)
    assert 0 < found.attrs["poses_left_out"] < 3
    assert np.isfinite(found.exact).all()
    with pytest.raises(RequestError) as caught:
        tp.worst_case(machine, [poses[int(found.left_out_index[0])]])
    assert caught.value.problems[0].code == "no-pose-left"


def test_poses_in_parts_are_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    machine = load("3rpr")
    poses = machine.poses()[:7]
    whole = tp.worst_case(machine, poses)
    monkeypatch.setattr("truepose.runs.poses.BLOCK", 3)
    parts = tp.worst_case(machine, poses)
    xr.testing.assert_allclose(parts, whole, rtol=1e-13)


def test_progress_and_poses_left_out() -> None:
    machine = load("planar_two_slider")
    seen: list[tuple[int, int]] = []
    poses = np.concatenate([machine.poses()[:2], [[9.0, 9.0]]])
    found = tp.worst_case(machine, poses, progress=lambda done, total: seen.append((done, total)))
    assert seen == [(3, 3)]
    assert found.left_out_index.values.tolist() == [2]


def code_of(call: Callable[..., Any], *arguments: Any, **named: Any) -> str:
    with pytest.raises(RequestError) as caught:
        call(*arguments, **named)
    return caught.value.problems[0].code


def test_bad_requests(tmp_path: Path) -> None:
    machine = load("planar_two_slider")
    assert code_of(tp.worst_case, machine, [[1.0]]) == "bad-poses"
    assert code_of(tp.worst_case, machine, [[9.0, 9.0]]) == "no-pose-left"
    bare = load_text(tmp_path, HEXAPOD)
    assert code_of(tp.worst_case, bare) == "no-source"


def test_a_plain_function() -> None:
    inputs = {"a": Input.uniform(1.0, 3.0), "b": Input.normal(0.0, 0.5), "c": Input.exact(2.0)}
    found = tp.worst_case(lambda a, b, c: a * b + c * a**2, inputs)
    # b at 3 standard deviations: at the corners a = 1 or 3, b = -1.5 or 1.5.
    assert float(found.exact_upper.squeeze()) == pytest.approx(3 * 1.5 + 2 * 9)
    assert float(found.exact_lower.squeeze()) == pytest.approx(-1.5 + 2)
    assert float(found.linear.squeeze()) == pytest.approx(8 + 8 + 3)
    assert "pose" not in found.dims
    assert "magnitude_exact" not in found
    assert found.attrs["unbounded"] == "normal, 3 sigma: b"
    assert int(found.vertices) == 8
    assert xr.Dataset.identical(
        found, tp.worst_case(lambda a, b, c: a * b + c * a**2, inputs=inputs)
    )


def test_a_function_of_many_inputs_with_two_results() -> None:
    names = [f"x{i}" for i in range(20)]
    inputs = {name: Input.uniform(-1.0, 1.0) for name in names}

    def both(**x: Array) -> dict[str, Array]:
        total = sum(x.values())
        return {"sum": total, "bent": total + 0.01 * total**2}

    found = tp.worst_case(both, inputs)
    assert str(found.search.values) == "directed"
    assert np.allclose(found.exact_upper, [20.0, 24.0])
    assert np.allclose(found.exact_lower, [-20.0, -16.0])
    assert found["component"].values.tolist() == ["sum", "bent"]


def test_a_function_that_is_not_finite_at_a_corner() -> None:
    inputs = {"x": Input.uniform(-1.0, 3.0)}
    with np.errstate(invalid="ignore"):
        assert code_of(tp.worst_case, lambda x: np.sqrt(x), inputs) == "not-finite"
