"""The page's kernel has the library's numbers: every machine, poses in and beside its workspace."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import truepose as tp
from build_machine import MACHINES, machine_files
from sweeps import thinned
from truepose import _kernel
from truepose.arrays import Floats
from truepose.runs.displacement import displacement, sum_deviations
from truepose.runs.quantities import POSITIONS, quantities
from truepose.runs.variables import Variables, stream_of
from truepose.sources import PoseBlock
from truepose.uncertainty_analysis.bounds import proven_bounds
from truepose.verdict.answer import AFTER, BEFORE
from web_kernel import WebKernel, numbers
from web_machine import WebMachine
from weighing_machines import WEIGHING

QUICK = {"hexapod", "tricept", "linear_delta", "planar_two_slider"}
POSES = 1000

ROUNDING = 1e-14
"""m and rad, of an error of a pose a few metres away."""

FINE = 3e-4
"""How closely the proof looks for the longest error: on what way follows from rounding."""

CLOSE = 1e-12
"""m and rad: of errors, which are at most a few millimetres."""


Given = tuple[Path, Mapping[str, str]]
PLAIN: list[Given] = [(path, {}) for path in machine_files()]
LOADED: list[Given] = [(MACHINES / f"{name}.toml", keys) for name, keys in WEIGHING.items()]


@pytest.fixture(
    scope="module",
    params=thinned(
        [*PLAIN, *LOADED],
        [*(one for one in PLAIN if one[0].stem in QUICK), LOADED[0]],
    ),
    ids=lambda given: given[0].stem + ("-weighing" if given[1] else ""),
)
def machine(request: pytest.FixtureRequest, kernel: WebKernel) -> Iterator[WebMachine]:
    yielded = WebMachine.of(kernel, *request.param)
    yield yielded
    kernel.ask("free", machine=yielded.number)


def words(status: np.ndarray) -> list[str]:
    return [_kernel.STATUS[code] for code in status]


def test_poses_are_placed_alike(machine: WebMachine) -> None:
    poses = machine.poses(POSES, 1)
    # Some of them far outside.
    poses[::7] *= 3.0
    placed = machine.ask("place", poses=poses)
    joints, placements, status = machine.machine.kernel.place(poses)
    assert placed["status"] == words(status)
    solved = np.isfinite(numbers(placed["joints"])).all(axis=1)
    assert solved.sum() > POSES / 10
    np.testing.assert_allclose(numbers(placed["joints"])[solved], joints[solved], atol=CLOSE)
    np.testing.assert_allclose(numbers(placed["placements"]), placements, atol=CLOSE)
    centres = machine.machine.kernel.joint_centres(joints[solved], placements[solved])
    lengths = machine.machine.kernel.lengths_at(joints[solved], placements[solved])
    np.testing.assert_allclose(numbers(placed["centres"])[solved], centres, atol=CLOSE)
    np.testing.assert_allclose(numbers(placed["lengths"])[solved], lengths, atol=CLOSE)


@pytest.mark.parametrize("command", ["nominal", "corrected"])
def test_errors_are_the_same(machine: WebMachine, command: str) -> None:
    poses = machine.poses(POSES, 2)
    page, condition = machine.condition(3)
    reply = machine.ask("errors", poses=poses, condition=page, command=command, shifts=True)
    block = machine.block(poses, condition)
    moved = machine.moved(block)
    joints = block.joints
    if command == "corrected":
        joints, _, _ = machine.machine.kernel.corrected(poses[block.indices], *moved)
    errors, status = displacement(machine.machine, joints, block.placements, moved)
    fine = status == 0
    found = numbers(reply["errors"])
    assert fine.any()
    np.testing.assert_allclose(found[block.indices[fine]], errors[fine], rtol=0.0, atol=CLOSE)
    assert all(word == "ok" for word in np.array(reply["status"])[block.indices[fine]])
    rest = np.setdiff1d(np.arange(POSES), block.indices[fine])
    assert np.isnan(found[rest]).all()
    assert not any(word == "ok" for word in np.array(reply["status"])[rest])


def test_each_source_alone_is_the_same(machine: WebMachine) -> None:
    poses = machine.poses(40, 4)
    page, condition = machine.condition(5)
    reply = machine.ask("errors", poses=poses, condition=page, sources=True)
    block = machine.block(poses, condition)
    assert sorted(reply["by_source"]) == sorted(source.name for source in machine.live)
    for source in machine.live:
        deviation = source.deviation(machine.machine, condition, block)
        moved = sum_deviations([(deviation.parameters, deviation.shift)])
        errors, status = displacement(machine.machine, block.joints, block.placements, moved)
        found = numbers(reply["by_source"][source.name])[block.indices]
        fine = status == 0
        np.testing.assert_allclose(found[fine], errors[fine], rtol=0.0, atol=CLOSE)


def test_sensitivities_and_loads_are_the_same(machine: WebMachine) -> None:
    poses = machine.poses(257, 6)
    kernel = machine.machine.kernel
    columns = np.arange(len(kernel.parameters))
    wrench = [10.0, -20.0, 300.0, 1.0, 2.0, -3.0]
    joints, placements, _ = kernel.place(poses)
    for op, expected, key, more in (
        ("sensitivities", kernel.sensitivity_at(joints, placements, columns), "effects", {}),
        (
            "loads",
            kernel.loads_at(joints, placements, np.array([wrench]), columns),
            "loads",
            {"wrench": wrench},
        ),
    ):
        reply = machine.ask(op, poses=poses, columns=columns.tolist(), **more)
        values, _ = expected
        found = numbers(reply[key])
        if op == "sensitivities":
            found = np.swapaxes(found, 1, 2)
        fine = np.array(reply["status"]) == "ok"
        assert fine.any()
        np.testing.assert_allclose(found[fine], values[fine], rtol=1e-9, atol=1e-9)
        assert np.isnan(found[~fine]).all()


def scaled(machine: WebMachine) -> tuple[dict[str, Any], dict[str, float]]:
    """Half widths of every group by a factor of its own."""
    groups = sorted({one["group"] for one in machine.bundle["variables"]})
    factors = {group: 0.5 + 0.1 * at for at, group in enumerate(groups)}
    return {"half_width": factors}, factors


def widened(
    machine: WebMachine, block: PoseBlock, variables: Variables, factors: dict[str, float]
) -> Variables:
    """The same with the half widths of every group, and the play behind a shift, by its factor."""
    groups = {(one["stream"], one["number"]): one["group"] for one in machine.bundle["variables"]}
    if not groups:
        return variables
    # A play that is taken up at every pose is no variable there.
    identities = zip(variables.streams.tolist(), variables.numbers.tolist(), strict=True)
    by = np.array([factors[groups[identity]] for identity in identities])
    shifts = []
    for source in machine.live:
        if not source.acts(block.condition):
            continue
        deviation = source.deviation(machine.machine, block.condition, block)
        shift = deviation.shift
        if hasattr(source, "dead_zones"):
            stream = stream_of(source.name)
            shift = shift * [factors[groups[stream, at]] for at in range(shift.shape[1])]
        shifts.append((deviation.parameters, shift))
    half_width = variables.half_width * by[variables.variable_of]
    return replace(variables, shift=sum_deviations(shifts), half_width=half_width)


def test_bounds_are_the_same(machine: WebMachine) -> None:
    if machine.machine.kernel.overconstrained:
        pytest.skip("its errors are not proven")
    poses = machine.poses(5, 7)
    page, condition = machine.condition(8)
    block = machine.block(poses, condition)
    variables = machine.variables(block)
    scale, factors = scaled(machine)
    variables = widened(machine, block, variables, factors)
    proven = proven_bounds(machine.machine, block, variables)
    kinds = list(quantities(machine.machine.components))
    for at, pose in enumerate(block.indices):
        reply = machine.ask("bounds", pose=poses[pose], condition=page, scale=scale)
        if proven["status"][at] != "proven":
            continue
        assert reply["status"] == "proven"
        for end in ("lower", "upper"):
            np.testing.assert_allclose(numbers(reply[end]), proven[end][at], rtol=0, atol=CLOSE)
        sizes = [reply["magnitude"][kind] for kind in kinds]
        np.testing.assert_allclose(sizes, proven["magnitude"][at], rtol=FINE)
        worst = machine.ask("worst", pose=poses[pose], condition=page, scale=scale)
        assert worst["status"] == "ok"
        for kind, size in zip(kinds, sizes, strict=True):
            assert worst[kind] <= size


@pytest.mark.parametrize("command", ["nominal", "corrected"])
def test_largest_errors_to_first_order_are_the_same(machine: WebMachine, command: str) -> None:
    """Those of `tp.budget` of each source alone, and those that the verdict goes by, of all."""
    poses = machine.poses(4, 13)
    page, condition = machine.condition(14)
    only = replace(machine.machine, sources=tuple(machine.live))
    block = machine.block(poses, condition)
    budget = tp.budget(only, poses, condition)
    state = BEFORE if command == "nominal" else AFTER
    for at, pose in enumerate(block.indices):
        reply = machine.ask(
            "largest", pose=poses[pose], condition=page, command=command, sources=True
        )
        assert reply["status"] == "ok"
        assert reply["by_source"].keys() == {source.name for source in machine.live}
        for answer in tp.accuracy(only, poses[[pose]], condition, states=(state,)):
            np.testing.assert_allclose(
                reply["largest"][answer.quantity], answer.linear.value, rtol=1e-9, atol=CLOSE
            )
        if command == "corrected":
            continue
        for source, of in reply["by_source"].items():
            expected = budget["largest"].sel(pose=at, source=source)
            for kind, size in of.items():
                np.testing.assert_allclose(
                    size, expected.sel(quantity=kind), rtol=1e-9, atol=CLOSE, err_msg=source
                )


def test_samples_of_equal_seed_are_the_same(machine: WebMachine) -> None:
    poses = machine.poses(3, 9)
    page, condition = machine.condition(10)
    only = replace(machine.machine, sources=tuple(machine.live))
    pose = poses[machine.block(poses, condition).indices[0]]
    if not machine.bundle["variables"]:
        pytest.skip("nothing of it is unknown")
    samples = 30_257
    result = tp.monte_carlo(only, [pose], samples=samples, seed=11, condition=condition)
    run = machine.ask("samples", pose=pose, condition=page, seed=11)["run"]
    assert machine.kernel.ask("more", run=run, first=0, count=samples)["count"] == samples
    levels = [0.0, 0.025, 0.5, 0.975, 1.0]
    read = machine.kernel.ask("read", run=run, probabilities=levels)
    machine.kernel.ask("free", run=run)
    m = len(machine.machine.components)
    spread = result["standard_deviation"].to_numpy()[0]
    size = spread.max()
    assert read["count"] == int(result["samples"][0])
    assert read["failed"] == int(result["failed"][0])
    assert_close(read["mean"][:m], result["mean"].to_numpy()[0])
    assert_close(read["mean"][m : m + result.sizes["quantity"]], result["magnitude_mean"][0])
    assert_close(read["covariance"], result["covariance"].to_numpy()[0], size)
    for end in ("minimum", "maximum"):
        assert_close(read[end][:m], result[end].to_numpy()[0])
    found = result["quantile"].sel(level=levels, method="nearest").to_numpy()[0]
    np.testing.assert_allclose(read["quantiles"][:m], found, rtol=0.0, atol=2e-2 * size)
    axes = [POSITIONS.index(name) for name in machine.machine.components if name in POSITIONS]
    if axes:
        shape = numbers(read["ellipse"]["shape"])[np.ix_(axes, axes)]
        np.testing.assert_allclose(shape, result["ellipse"][0], rtol=1e-2, atol=1e-9 * size**2)
        centre = numbers(read["ellipse"]["centre"])[axes]
        assert_close(centre, result["ellipse_centre"].to_numpy()[0])


def assert_close(found: Any, expected: Any, size: float = 1.0) -> None:
    """To the rounding of a pose, m and rad; of a covariance that times the size of the errors."""
    np.testing.assert_allclose(
        numbers(found), np.asarray(expected), rtol=1e-12, atol=ROUNDING * size
    )


def test_batches_of_any_size_are_answered(machine: WebMachine) -> None:
    page, _ = machine.condition(12)
    poses = machine.poses(20_000, 13)
    whole = numbers(machine.ask("errors", poses=poses, condition=page)["errors"])
    for count in (1, 256, 257, 513):
        part = numbers(machine.ask("errors", poses=poses[:count], condition=page)["errors"])
        np.testing.assert_allclose(part, whole[:count], rtol=0.0, atol=CLOSE)
    assert len(whole) == 20_000


def test_what_workers_drew_merges_bit_by_bit(machine: WebMachine) -> None:
    pose = machine.poses(1, 14)[0]
    if machine.ask("place", poses=[pose])["status"] != ["ok"]:
        pytest.skip("the pose is out of reach")
    runs = [machine.ask("samples", pose=pose, seed=15)["run"] for _ in range(4)]
    one, *workers = runs
    parts = [(0, 12_000), (12_000, 5_000), (17_000, 7_001), (24_001, 1)]
    for first, count in parts:
        machine.kernel.ask("more", run=one, first=first, count=count)
    main, left, right = workers
    for worker, mine in ((left, parts[2:]), (right, parts[:2])):
        for first, count in mine:
            machine.kernel.ask("more", run=worker, first=first, count=count)
        tally = machine.kernel.ask("take", run=worker)["tally"]
        machine.kernel.ask("merge", run=main, tally=tally)
    levels = [0.025, 0.5, 0.975]
    reads = [
        machine.kernel.line(f'{{"op":"read","run":{run},"probabilities":{levels}}}')
        for run in (one, main)
    ]
    assert reads[0] == reads[1]
    for run in runs:
        machine.kernel.ask("free", run=run)


def largest(values: Floats) -> float:
    return float(np.abs(values).max(initial=0.0))


def test_a_force_and_warmth_do_something(kernel: WebKernel) -> None:
    """The comparisons above are not of zeros."""
    (path,) = [path for path in machine_files() if path.stem == "hexapod"]
    machine = WebMachine.of(kernel, path)
    page, _ = machine.condition(16)
    home = [machine.bundle["workspace"]["home"]]
    warm = numbers(machine.ask("errors", poses=home, condition=page)["errors"])
    cold = numbers(machine.ask("errors", poses=home)["errors"])
    assert largest(warm) > 1e-6
    assert not math.isclose(largest(warm), largest(cold), rel_tol=0.1)
    kernel.ask("free", machine=machine.number)
