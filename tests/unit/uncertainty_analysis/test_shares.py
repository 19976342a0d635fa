"""Shares of machines and plain functions: the Dataset, groups, and what cannot be answered."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import truepose as tp
from build_machine import MACHINES, machine_files
from made_source import MadeSource, sizes, with_sources
from truepose.errors import RequestError
from truepose.machine import Machine
from truepose.runs.first_order import first_order
from truepose.runs.poses import Progress
from truepose.runs.run import Run
from truepose.sources import OWN_GROUP, Deviation, PoseBlock, normal
from truepose.uncertainty_analysis.functions.inputs import Input
from truepose.uncertainty_analysis.shapley import factors
from truepose.uncertainty_analysis.shares import (
    CORRELATED,
    SCHEMA,
    first_to_tighten,
    over_position,
    shares,
)

POSES = 2


def planar() -> Machine:
    return tp.load(MACHINES / "planar_two_slider.toml")


def made(machine: Machine, **given: Any) -> Deviation:
    """Every parameter off, each by a size that it may well have."""
    return Deviation.of(np.arange(len(machine.parameters)), half=sizes(machine), **given)


def test_the_dataset_of_a_machine() -> None:
    machine = planar()
    found = tp.shares(machine)
    assert list(found.data_vars) == list(SCHEMA)
    for name, variable in SCHEMA.items():
        assert found[name].dims == variable.dims
        assert found[name].attrs["long_name"]
    assert found.sizes["pose"] == 25
    assert found["parameter"].values.tolist() == ["strut.1.length", "strut.2.length"]
    assert found["parameter_source"].values.tolist() == ["tolerance"] * 2
    assert found["source"].values.tolist() == ["tolerance"]
    assert found.attrs["seed"] == 0
    assert found.attrs["samples"] == 256
    assert found.attrs["confidence"] == 0.95
    assert (found["evaluations"] == 256 * 5).all()
    assert (found["failed"] == 0).all()
    assert found["standard_deviation"].attrs["units"] == "m"


def test_a_nearly_linear_machine_has_the_linear_shares() -> None:
    """Of 0.3 mm on struts of 500 mm, what is not linear is some thousandths."""
    found = tp.shares(planar())
    for name in ("first", "total", "source_first", "source_total"):
        of_linear = found[name.replace("first", "linear").replace("total", "linear")]
        assert float(np.abs(found[name] - of_linear).max()) < 2e-3
    assert float(found["first_confidence"].max()) < 1e-3
    assert found["linear"].sum("parameter").values == pytest.approx(np.ones((25, 2)))
    assert (found["first"].sum("parameter") < 1.0 + 5e-4).all()
    assert (found["total"].sum("parameter") > 1.0 - 5e-4).all()
    assert found["source_first"].values == pytest.approx(np.ones((25, 1, 2)), abs=1e-3)
    uncertainty = tp.budget(planar())["uncertainty"].sel(source="tolerance")
    assert found["standard_deviation"].values == pytest.approx(uncertainty.values, rel=2e-3)


@pytest.mark.parametrize("path", machine_files(), ids=lambda path: path.stem)
def test_small_deviations_have_the_linear_shares(path: Path) -> None:
    """Of a thousandth of the deviations, to a few digits; sources are exchanged as a whole."""
    machine = tp.load(path)
    count = len(machine.parameters)
    half = 1e-3 * sizes(machine)
    split = count // 3
    some = Deviation.of(np.arange(split), half=half[:split], distribution=normal(2.0))
    others = Deviation.of(
        np.arange(split, count),
        half=half[split:],
        groups=np.where(np.arange(split, count) < split + 4, 0, OWN_GROUP),
    )
    machine = with_sources(machine, MadeSource("one", some), MadeSource("two", others))
    found = tp.shares(machine, machine.poses()[:POSES], samples=64)
    assert found.sizes["parameter"] == count - 3
    assert found["source"].values.tolist() == ["one", "two"]
    scale = float(np.abs(found["linear"]).max())
    for each in ("first", "total", "source_first", "source_total"):
        of_linear = found[each.replace("first", "linear").replace("total", "linear")]
        assert float(np.abs(found[each] - of_linear).max()) < 1e-4 * scale
    assert found["source_linear"].sum("source").values == pytest.approx(1.0)


def correlated_pair(machine: Machine, coefficient: float) -> Machine:
    columns = [machine.parameters.index(f"strut.{number}.length") for number in (1, 2)]
    correlation = [[1.0, coefficient], [coefficient, 1.0]]
    deviation = Deviation.of(columns, half=3e-6, distribution=normal(3.0), correlation=correlation)
    return with_sources(machine, MadeSource("lengths", deviation))


def test_correlated_variables_have_shapley_shares() -> None:
    """Of the pair, by Owen & Prieur's closed form."""
    machine, rho = planar(), 0.6
    poses = machine.poses()[:POSES]
    free = tp.shares(correlated_pair(machine, 0.0), poses)
    assert "shapley" not in free
    found = tp.shares(correlated_pair(machine, rho), poses)
    assert set(found.data_vars) == {*SCHEMA, *CORRELATED}
    assert found["shapley"].sum("parameter").values == pytest.approx(1.0)
    columns = [machine.parameters.index(f"strut.{number}.length") for number in (1, 2)]
    one, other = np.moveaxis(machine.sensitivity(poses)[..., columns], -1, 0)
    variance = one**2 + 2.0 * rho * one * other + other**2
    shapley = (one**2 * (1.0 - rho**2 / 2) + rho * one * other + other**2 * rho**2 / 2) / variance
    pair = found.isel(parameter=0)
    assert pair["shapley"].values == pytest.approx(shapley, abs=1e-4)
    assert pair["linear"].values == pytest.approx((one**2 + rho * one * other) / variance, abs=1e-6)
    first = (one + rho * other) ** 2 / variance
    assert pair["first"].values == pytest.approx(first, abs=1e-4)
    total = one**2 * (1.0 - rho**2) / variance
    assert pair["total"].values == pytest.approx(total, abs=1e-4)
    assert found["source_total"].values == pytest.approx(1.0)
    # 256 base samples of A, B and 5 others (the pair at once is one), 256 walks of three points.
    assert (found["evaluations"] == 256 * (2 + 5 + 3)).all()


def test_a_component_that_does_not_vary_has_no_shares() -> None:
    """Both carriages off by the same along y: x does not move."""
    machine = planar()
    columns = [machine.parameters.index(f"drive.d{number}.offset") for number in (1, 2)]
    deviation = Deviation.of(columns, half=1e-4, groups=0)
    found = tp.shares(with_sources(machine, MadeSource("lift", deviation)))
    along_x, along_y = found.sel(component="x"), found.sel(component="y")
    assert (along_x["standard_deviation"] == 0.0).all()
    for name in ("first", "total", "linear", "first_confidence", "source_first", "source_linear"):
        assert along_x[name].isnull().all()
    for name in ("first", "total", "linear"):
        assert along_y[name].values == pytest.approx(1.0)
    assert first_to_tighten(found) == (str(found["parameter"].values[0]), pytest.approx(1.0))


def test_the_same_seed_the_same_shares_whatever_poses() -> None:
    machine = planar()
    whole = tp.shares(machine, samples=64, seed=3)
    part = tp.shares(machine, machine.poses()[7:9], samples=64, seed=3)
    xr.testing.assert_equal(
        whole["first"].isel(pose=slice(7, 9)).drop_vars("pose"), part["first"].drop_vars("pose")
    )
    other = tp.shares(machine, samples=64, seed=4)
    assert not np.allclose(whole["first"], other["first"], rtol=0.0, atol=1e-9)


def test_samples_that_the_machine_cannot_reach_are_counted() -> None:
    """Struts that may be 250 mm shorter do not always meet: 600 mm apart, 500 mm long."""
    machine = planar()
    columns = [machine.parameters.index(f"strut.{number}.length") for number in (1, 2)]
    deviation = Deviation.of(columns, half=0.25)
    found = tp.shares(
        with_sources(machine, MadeSource("lengths", deviation)), machine.poses()[:1], samples=2000
    )
    assert 0 < int(found["failed"][0]) < 2000
    assert np.isfinite(found["first"]).all()


def test_progress_and_poses_that_cannot_be_used() -> None:
    machine = planar()
    poses = np.vstack([machine.poses()[:2], [[5.0, 5.0]]])
    seen: list[tuple[int, int]] = []
    found = tp.shares(machine, poses, samples=16, progress=lambda *at: seen.append(at))
    assert found.sizes["pose"] == 2
    assert found["left_out_index"].values.tolist() == [2]
    assert seen[-1] == (3, 3)


def test_no_pose_can_be_used() -> None:
    with pytest.raises(RequestError) as caught:
        tp.shares(planar(), [[5.0, 5.0]])
    assert caught.value.problems[0].code == "no-pose-left"


def first_order_of(machine: Machine) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Value, effects and status over the file's poses."""
    (block, variables), *_ = Run(machine).with_variables()
    return first_order(machine, block, variables)


@pytest.mark.parametrize("name", ["planar_two_slider", "hexapod", "tricept"])
def test_shared_samples_give_the_shares_of_each_pose(name: str) -> None:
    machine = tp.load(MACHINES / f"{name}.toml")
    poses = machine.poses()[:: len(machine.poses()) // 3][:3]
    shared = tp.shares(machine, poses, samples=128)
    for at, pose in enumerate(poses):
        alone = tp.shares(machine, pose, samples=128)
        for variable in ("first", "total", "linear", "standard_deviation"):
            np.testing.assert_allclose(
                alone[variable].values[0], shared[variable].values[at], rtol=1e-12, atol=1e-15
            )
        others = tp.shares(machine, pose, samples=128, seed=1)
        for variable in ("first", "total"):
            width = np.hypot(
                others[f"{variable}_confidence"].values[0],
                shared[f"{variable}_confidence"].values[at],
            )
            away = np.abs(others[variable].values[0] - shared[variable].values[at])
            # Of 95 % intervals of half the width: three times it leaves none of a few hundred.
            assert (away <= 3.0 * width + 1e-9).all()


def test_shared_samples_of_correlated_variables() -> None:
    machine = correlated_pair(planar(), 0.6)
    poses = machine.poses()[:3]
    shared = tp.shares(machine, poses, samples=128)
    for at, pose in enumerate(poses):
        alone = tp.shares(machine, pose, samples=128)
        for variable in ("shapley", "first", "total"):
            np.testing.assert_allclose(
                alone[variable].values[0], shared[variable].values[at], rtol=1e-12, atol=1e-15
            )


def test_ctrl_c_gives_the_poses_done() -> None:
    machine = planar()

    def stop(at: int) -> Progress:
        def progress(done: int, total: int) -> None:
            if done == at:
                raise KeyboardInterrupt

        return progress

    found = tp.shares(machine, samples=16, progress=stop(3))
    assert found.sizes["pose"] == 3
    assert found.attrs["interrupted"] == 1
    assert found.attrs["poses_used"] == 3
    assert found.attrs["poses_left_out"] == 0
    whole = tp.shares(machine, samples=16)
    assert whole.attrs["interrupted"] == 0
    # The worst three by the first order, and what stands of them is what all of them have.
    _, effects, _ = first_order_of(machine)
    worst = np.sort(np.argsort(-np.square(effects[:, :2]).sum(axis=(1, 2)), kind="stable")[:3])
    assert found.pose.values.tolist() == worst.tolist()
    assert (found["total"] == whole["total"].isel(pose=worst)).all()

    def at_once(machine: Machine, block: PoseBlock) -> Deviation:
        raise KeyboardInterrupt

    never = MadeSource("never", of_block=lambda block: at_once(machine, block))
    with pytest.raises(KeyboardInterrupt):
        tp.shares(with_sources(machine, never))


def test_what_varies_at_some_poses_only(monkeypatch: pytest.MonkeyPatch) -> None:
    """Blocks of poses whose bands differ: what has none has no part there."""
    monkeypatch.setattr("truepose.runs.poses.BLOCK", 2)
    machine = planar()

    def of_block(block: PoseBlock) -> Deviation:
        bands = [1e-4, 0.0] if block.indices[0] == 0 else [0.0, 1e-4]
        columns = [machine.parameters.index(f"strut.{number}.length") for number in (1, 2)]
        return Deviation.of(columns, half=bands)

    changing = with_sources(machine, MadeSource("lengths", of_block=of_block))
    found = tp.shares(changing, machine.poses()[:4], samples=16)
    assert found["parameter"].values.tolist() == ["strut.1.length", "strut.2.length"]
    wanted = np.array([[1, 0], [1, 0], [0, 1], [0, 1]])[:, :, np.newaxis] * np.ones(2)
    for name in ("first", "total", "linear"):
        assert found[name].values == pytest.approx(wanted, abs=1e-4)


def test_the_first_to_tighten_is_judged_by_position() -> None:
    machine = planar()
    columns = [machine.parameters.index(f"strut.{number}.length") for number in (1, 2)]
    deviation = Deviation.of(columns, half=[1e-4, 2e-4])
    found = tp.shares(with_sources(machine, MadeSource("lengths", deviation)), samples=64)
    variance = found["standard_deviation"] ** 2
    by_hand = (found["total"] * variance).sum(["pose", "component"]) / variance.sum()
    assert over_position(found).values == pytest.approx(by_hand.values)
    name, share = first_to_tighten(found)
    assert name == "strut.2.length"
    assert share == pytest.approx(0.8, abs=0.05)


def test_rotations_count_where_the_tool_only_turns() -> None:
    """And not beside positions: of a hexapod, only x, y and z."""
    machine = tp.load(MACHINES / "hexapod.toml")
    found = tp.shares(machine, machine.poses()[:1], samples=16)
    only = over_position(found.isel(component=slice(0, 3)))
    assert over_position(found).values == pytest.approx(only.values)
    turning = found.isel(component=slice(3, 6))
    assert float(over_position(turning).sum()) == pytest.approx(1.0, abs=0.02)


def polynomial(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> dict[str, np.ndarray]:
    return {"sum": 2.0 * x + y, "product": x * y, "constant": 5.0 + 0.0 * z}


INPUTS = {
    "x": Input.normal(0.0, 1.0),
    "y": Input.uniform(-1.0, 1.0),
    "z": Input.exact(4.0),
}


def test_a_plain_function_with_several_outputs() -> None:
    found = tp.shares(polynomial, INPUTS)
    assert found["first"].dims == ("parameter", "component")
    assert found["component"].values.tolist() == ["sum", "product", "constant"]
    assert found["parameter"].values.tolist() == ["x", "y", "z"]
    of_sum = np.array([4.0, 1.0 / 3.0, 0.0]) / (4.0 + 1.0 / 3.0)
    for name in ("first", "total", "linear"):
        assert found[name].sel(component="sum").values == pytest.approx(of_sum, abs=1e-9)
    product = found.sel(component="product")
    width = product["first_confidence"].values
    assert (np.abs(product["first"].values) <= 1.5 * width + 1e-12).all()
    assert product["total"].values == pytest.approx([1.0, 1.0, 0.0], abs=0.1)
    assert product["linear"].isnull().all()  # level at the estimates
    assert found["first"].sel(component="constant").isnull().all()
    assert found.attrs["samples"] == 8192
    same = tp.shares(polynomial, inputs=INPUTS)
    xr.testing.assert_identical(same, found)


def test_a_linear_function_of_correlated_inputs() -> None:
    found = tp.shares(
        lambda a, b: a + b,
        {"a": Input.uniform(-1.0, 1.0), "b": Input.uniform(-1.0, 1.0)},
        correlation={("a", "b"): 0.5},
    )
    assert found["shapley"].values[:, 0] == pytest.approx([0.5, 0.5], abs=0.01)
    assert found["linear"].values[:, 0] == pytest.approx([0.5, 0.5])
    # Var E[a + b | a] / V, nearly that of normal ones: (1 + r)^2 / (2 + 2 r)
    assert found["first"].values[:, 0] == pytest.approx([0.75, 0.75], abs=0.02)
    assert found["total"].values[:, 0] == pytest.approx([0.25, 0.25], abs=0.02)
    assert float(found["standard_deviation"][0]) == pytest.approx(1.0, rel=0.01)
    assert first_to_tighten(found)[1] == pytest.approx(0.5, abs=0.01)


@pytest.mark.parametrize(
    ("given", "code"),
    [
        ({"samples": 0}, "bad-samples"),
        ({"samples": 7}, "bad-samples"),
        ({"samples": 100.5}, "bad-samples"),
        ({"seed": "one"}, "bad-seed"),
        ({"seed": 1.0}, "bad-seed"),
        ({"seed": -1}, "bad-seed"),
        ({"seed": 2**64}, "bad-seed"),
        ({"confidence": 95.0}, "bad-probability"),
        ({"confidence": 1.0}, "bad-probability"),
    ],
)
def test_requests_that_cannot_be_answered(given: dict[str, Any], code: str) -> None:
    with pytest.raises(RequestError) as caught:
        shares(planar(), **given)
    assert [problem.code for problem in caught.value.problems] == [code]


def test_nothing_varies() -> None:
    machine = planar()
    known = MadeSource("warm", Deviation.of([0], shift=1e-4))
    with pytest.raises(RequestError) as caught:
        tp.shares(with_sources(machine, known))
    assert caught.value.problems[0].code == "nothing-varies"
    with pytest.raises(RequestError) as caught:
        tp.shares(lambda x: x, {"x": Input.exact(1.0)})
    assert caught.value.problems[0].code == "nothing-varies"
    constant = tp.shares(lambda x: 1.0 + 0.0 * x, {"x": Input.uniform(0.0, 1.0)})
    with pytest.raises(RequestError) as caught:
        first_to_tighten(constant)
    assert caught.value.problems[0].code == "nothing-varies"


def test_the_largest_seed() -> None:
    machine = planar()
    found = tp.shares(machine, machine.poses()[:1], samples=16, seed=2**64 - 1)
    assert np.isfinite(found["first"]).all()


def test_shares_are_written_and_read_again(tmp_path: Any) -> None:
    found = tp.shares(planar(), samples=16)
    found.to_netcdf(tmp_path / "shares.nc", engine="h5netcdf")
    with xr.open_dataset(tmp_path / "shares.nc", engine="h5netcdf") as read:
        assert first_to_tighten(read) == first_to_tighten(found)


@pytest.mark.parametrize("rank", [7, 4])
def test_cholesky_factors_are_those_of_the_matrix_in_every_order(rank: int) -> None:
    """Also of a singular matrix: L L' is the matrix, and what follows from others adds nothing."""
    random = np.random.default_rng(rank)
    rows = random.normal(size=(7, rank))
    rows /= np.linalg.norm(rows, axis=1)[:, np.newaxis]
    latent = rows @ rows.T
    orders = np.argsort(random.random((50, 7)), axis=1)
    for order, lower in zip(orders, factors(latent, orders), strict=True):
        ordered = latent[np.ix_(order, order)]
        np.testing.assert_allclose(lower @ lower.T, ordered, rtol=0.0, atol=1e-12)
        assert not np.triu(lower, 1).any()
        assert (np.diagonal(lower) >= 0.0).all()
        # The columns that are there: as many as the rank, and NumPy's where there are all.
        assert int(lower.any(axis=0).sum()) == rank
        if rank == 7:
            np.testing.assert_allclose(lower, np.linalg.cholesky(ordered), rtol=0.0, atol=1e-12)
