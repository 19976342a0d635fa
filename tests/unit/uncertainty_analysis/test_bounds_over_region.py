"""Proven bounds over a continuous region: against poses, samples and the search inside it."""

from __future__ import annotations

import itertools
from functools import cache
from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.typing import NDArray

import truepose as tp
from build_machine import MACHINES
from guided_machines import rigidly_guided
from made_source import MadeSource, with_sources
from truepose import _kernel
from truepose.errors import RequestError
from truepose.machine import Machine
from truepose.runs.poses import PoseRun, required_sources
from truepose.runs.variables import variables_at
from truepose.sources import Deviation, PoseBlock
from truepose.uncertainty_analysis.bounds_over_region import SCHEMA

Array = NDArray[np.float64]
Region = dict[str, tuple[float, float]]

GAP = 0.05
MINOR = 0.1
"""Of its magnitude: a component reached less is closed to the gap of so much."""
POSES = 400
SAMPLES = 2000
ROUNDING = 1e-13

WHOLE: Region = {"x": (0.2, 0.4), "y": (0.1, 0.3)}
"""The workspace of the planar machine, m."""


def load(name: str) -> Machine:
    return tp.load(MACHINES / f"{name}.toml")


@cache
def planar() -> xr.Dataset:
    return tp.bounds(load("planar_two_slider"), region=WHOLE, gap=GAP)


def anywhere(region: Region, count: int, seed: int) -> Array:
    """(count, n_commanded) poses of the region, some on its borders."""
    random = np.random.default_rng(seed)
    low, high = np.array(list(region.values())).T
    at = random.uniform(size=(count, low.size))
    at = np.where(random.uniform(size=at.shape) < 0.2, np.round(at), at)
    return low + at * (high - low)


def assert_encloses(found: xr.Dataset, machine: Machine, poses: Array, samples: int) -> None:
    """Every sample and every vertex, with all sources, at every pose."""
    (block,) = PoseRun(machine, poses, machine.condition)
    moves = variables_at(machine, block, required_sources(machine, machine.condition))
    shifted, shift = moves.shift
    study = _kernel.Study(
        machine.kernel,
        block.joints,
        block.placements,
        shifted,
        shift,
        moves.columns,
        moves.variable_of.tolist(),
        moves.half_width,
    )
    m, kinds = len(machine.components), found.sizes["quantity"]
    table = np.zeros((len(poses), m + kinds))
    slack = ROUNDING * machine.characteristic_length
    for kind in ("uniform", "two-point"):
        tallies = _kernel.Tallies(table, table + 1e-6, m + kinds, m)
        described = [
            {"kind": kind, "sigmas": 1.0, "stream": 0, "number": number}
            for number in range(len(moves.names))
        ]
        study.sample(_kernel.Variables(described), 5, 0, samples, tallies)
        assert (tallies.failed == 0).all()
        lowest, highest = np.moveaxis(tallies.extremes, 2, 0)
        assert (highest[:, :m] <= found.upper.values + slack).all()
        assert (lowest[:, :m] >= found.lower.values - slack).all()
        assert (highest[:, m:] <= found.magnitude.values + slack).all()


def assert_closed(found: xr.Dataset, gap: float) -> None:
    """No bound lies above what is reached by more than the gap."""
    size = found.reached_magnitude.values
    places = np.array([0 if name in "xyz" else 1 for name in found.component.values])
    least = MINOR * size[np.minimum(places, size.size - 1)]
    for bound, reached in (
        (found.upper, found.reached_upper),
        (-found.lower, -found.reached_lower),
    ):
        allowed = gap * np.maximum(np.abs(reached), least)
        assert (bound - reached <= 1.0001 * allowed).all()
        assert (bound >= reached).all()
    assert (found.magnitude <= (1.0 + 1.0001 * gap) * size).all()
    assert (found.magnitude >= size).all()


def test_the_planar_workspace_is_closed_to_the_gap() -> None:
    found = planar()
    assert str(found.status.values) == "proven"
    assert_closed(found, GAP)
    assert np.isnan(found.where_unproven).all()
    assert found.attrs["gap"] == GAP


def test_bounds_at_the_poses_of_the_file_are_inside() -> None:
    found, at = planar(), tp.bounds(load("planar_two_slider"))
    assert (at.reached_upper <= found.upper).all()
    assert (at.reached_lower >= found.lower).all()
    assert (at.reached_magnitude <= found.magnitude).all()
    # Two bounds of one thing: either may be the sharper one, by the gap at most.
    assert (at.upper.max("pose") <= (1.0 + GAP) * found.upper).all()
    # What is reached somewhere is no less than at these poses, but for the gap.
    assert (found.upper >= at.reached_upper.max("pose")).all()


def test_no_sample_anywhere_leaves_the_bounds() -> None:
    machine = load("planar_two_slider")
    assert_encloses(planar(), machine, anywhere(WHOLE, POSES, 2), SAMPLES)


@pytest.mark.parametrize(
    ("name", "region"),
    [
        ("planar_two_slider", {"x": (0.2, 0.22), "y": (0.1, 0.12)}),
        ("five_bar", None),
        ("hexapod", None),
        ("linear_delta", None),
    ],
)
def test_a_box_that_is_not_divided_bounds_what_changes_in_it(
    name: str, region: Region | None
) -> None:
    """In one box the bound at its middle does not serve: it must grow with the box.

    Dividing would hide that, for then every middle is near.
    """
    machine = load(name)
    middle = machine.poses().mean(axis=0)
    if region is None:
        half = [1e-3 if each in "xyz" else 1e-2 for each in machine.commanded]
        ends = zip(middle - half, middle + half, strict=True)
        region = dict(zip(machine.commanded, ends, strict=True))
    found = tp.bounds(machine, region=region, gap=0.99)
    assert int(found.boxes) == 1
    assert str(found.status.values) == "proven"
    low, high = np.array(list(region.values())).T
    corners = np.array(list(itertools.product(*zip(low, high, strict=True))))
    worst = tp.worst_case(machine, corners)
    slack = ROUNDING * machine.characteristic_length
    assert (worst.exact_upper <= found.upper + slack).all()
    assert (worst.exact_lower >= found.lower - slack).all()
    assert (worst.magnitude_exact <= found.magnitude + slack).all()
    # And the middle's own worst case is exceeded somewhere, so that it would not have served.
    at = tp.worst_case(machine, 0.5 * (low + high))
    assert (worst.exact.max("pose") > at.exact.isel(pose=0) + slack).any()


def test_what_is_reached_is_reached_there() -> None:
    """At the pose that is told, the worst vertex is no less."""
    machine, found = load("planar_two_slider"), planar()
    poses = np.concatenate([found["where"], found["where_lower"], found["where_magnitude"]])
    low, high = np.array(list(WHOLE.values())).T
    assert ((poses >= low) & (poses <= high)).all()
    worst = tp.worst_case(machine, poses)
    for at in range(2):
        there = float(worst.exact_upper[at, at])
        assert float(found.reached_upper[at]) <= there + 1e-15
        assert float(found.reached_upper[at]) == pytest.approx(there, rel=1e-3)
        there = float(worst.exact_lower[2 + at, at])
        assert float(found.reached_lower[at]) == pytest.approx(there, rel=1e-3)
    there = float(worst.magnitude_exact[4, 0])
    assert float(found.reached_magnitude[0]) == pytest.approx(there, rel=1e-3)


@pytest.mark.parametrize("gap", [0.2, 0.5])
def test_a_wider_gap_takes_fewer_parts(gap: float) -> None:
    found = tp.bounds(load("planar_two_slider"), region=WHOLE, gap=gap)
    assert_closed(found, gap)
    assert int(found.boxes) < int(planar().boxes)


@pytest.mark.parametrize("name", ["3prs", "3rpr", "hexapod"])
def test_machines_that_turn_in_a_small_region(name: str) -> None:
    """One with parasitic freedoms, a planar body, and all six freedoms."""
    machine = tp.load(rigidly_guided(MACHINES / f"{name}.toml"))
    centre = dict(zip(machine.commanded, machine.poses().mean(axis=0).tolist(), strict=True))
    region = {each: (value - 2e-3, value + 2e-3) for each, value in centre.items()}
    found = tp.bounds(machine, region=region, gap=0.3)
    assert str(found.status.values) == "proven"
    assert_closed(found, 0.3)
    assert_encloses(found, machine, anywhere(region, 30, 4), SAMPLES)


def test_how_limbs_bend_is_not_enclosed_over_a_region() -> None:
    machine = load("3prs")
    with pytest.raises(RequestError, match="how its limbs bend is not enclosed over a region"):
        tp.bounds(machine, region={"z": (0.0, 1e-3)})


def test_a_freedom_not_named_stays_at_home() -> None:
    machine = load("planar_two_slider")
    home = machine.kernel.home.tolist()
    low, high = home[1] - 1e-3, home[1] + 1e-3
    found = tp.bounds(machine, region={"y": (low, high)}, gap=0.1)
    same = tp.bounds(machine, region={"x": (home[0], home[0]), "y": (low, high)}, gap=0.1)
    assert np.array_equal(found.upper, same.upper)
    assert (found["where"][:, 0] == home[0]).all()
    assert found.attrs["region"] == str({"x": [home[0]] * 2, "y": [low, high]})


def test_a_region_of_one_pose_is_that_pose() -> None:
    machine = load("planar_two_slider")
    found = tp.bounds(machine, region={"x": (0.3, 0.3), "y": (0.2, 0.2)}, gap=GAP)
    at = tp.bounds(machine, [[0.3, 0.2]]).isel(pose=0)
    assert_closed(found, GAP)
    assert int(found.boxes) == 1
    assert np.allclose(found.upper, at.upper, rtol=GAP, atol=0)
    assert np.allclose(found.reached_upper, at.reached_upper, rtol=1e-9, atol=0)


def test_a_region_of_one_pose_is_bounded_as_the_pose_is() -> None:
    """Nothing is lost by a region: the first box is bounded as well as can be, and not divided.

    But that magnitudes are refined to 1 %, not as closely as at a pose.
    """
    machine = load("linear_delta")
    region = tp.bounds(machine, region={"x": (0.0, 0.0), "y": (0.0, 0.0), "z": (0.1, 0.1)})
    pose = tp.bounds(machine, [0.0, 0.0, 0.1])
    assert int(region["boxes"]) == 1
    for name, share in (("lower", 1e-6), ("upper", 1e-6), ("magnitude", 0.01)):
        assert np.allclose(region[name], pose[name][0], rtol=share)
    assert (region.magnitude >= pose.reached_magnitude[0]).all()


def test_the_schema_is_what_there_is() -> None:
    found = planar()
    assert list(found.data_vars) == list(SCHEMA)
    for name, variable in SCHEMA.items():
        assert found[name].dims == variable.dims
    assert found.upper.attrs["units"] == "m"


def test_progress_is_told() -> None:
    seen: list[tuple[int, int]] = []
    tp.bounds(
        load("planar_two_slider"), region=WHOLE, gap=0.3, progress=lambda *each: seen.append(each)
    )
    done = [boxes for boxes, _ in seen]
    assert done == sorted(done)
    assert len(done) > 3


def test_a_region_that_cannot_be_proven_has_a_status_and_no_number() -> None:
    """Bands of 20 mm: no part of the region, however small, is proven."""
    machine = load("planar_two_slider")
    columns = list(machine.kernel.length_parameters)
    wide = with_sources(machine, MadeSource("wide", Deviation.of(columns, half=0.06)))
    found = tp.bounds(wide, region={"x": (0.2, 0.25), "y": (0.1, 0.15)}, gap=0.5)
    assert str(found.status.values) != "proven"
    for name in ("lower", "upper", "magnitude"):
        assert np.isnan(found[name]).all()
    low, high = np.array([0.2, 0.1]), np.array([0.25, 0.15])
    where = found.where_unproven.values
    assert ((where >= low) & (where <= high)).all()


def refusal(machine: Machine, **named: Any) -> RequestError:
    with pytest.raises(RequestError) as caught:
        tp.bounds(machine, **named)
    return caught.value


@pytest.mark.parametrize(
    "region",
    [
        {"z": (0.1, 0.2)},
        {"x": (0.4, 0.2)},
        {"x": (0.2, float("nan"))},
        {"x": (0.2, float("inf"))},
        {"x": (0.2,)},
        {"x": (0.2, 0.3, 0.4)},
        {"x": 0.3},
        {"x": ("a", "b")},
        {"x": None},
        {},
        [(0.2, 0.4)],
    ],
    ids=str,
)
def test_a_region_that_is_none(region: Any) -> None:
    problem = refusal(load("planar_two_slider"), region=region).problems[0]
    assert problem.code == "bad-region"
    assert problem.expected is not None


def test_all_that_is_wrong_with_a_region_is_told() -> None:
    error = refusal(load("planar_two_slider"), region={"X": (0.1, 0.2), "y": (0.3, 0.1)})
    assert [each.code for each in error.problems] == ["bad-region", "bad-region"]
    assert "reversed" in error.problems[1].message


@pytest.mark.parametrize("gap", [0.0, -0.1, 1.0, 5, float("nan"), "0.05", None, 1e-4, True])
def test_a_gap_that_is_none(gap: Any) -> None:
    machine = load("planar_two_slider")
    assert refusal(machine, region=WHOLE, gap=gap).problems[0].code == "bad-gap"


@pytest.mark.parametrize("x", [(0.2, 0.7), (-2.0, -1.0), (0.2, 3.0)])
def test_a_region_out_of_reach(x: tuple[float, float]) -> None:
    error = refusal(load("planar_two_slider"), region={"x": x, "y": (0.1, 0.3)})
    assert error.problems[0].code == "region-out-of-reach"
    assert " at " in str(error.problems[0].found)


def test_a_region_out_of_reach_between_its_corners() -> None:
    """A crank machine reaches around a hole: the corners and the middle say nothing of it."""
    machine = load("five_bar")
    poses = machine.poses()
    low, high = poses.min(axis=0) - 0.25, poses.max(axis=0) + 0.25
    region = dict(
        zip(machine.commanded, zip(low.tolist(), high.tolist(), strict=True), strict=True)
    )
    assert refusal(machine, region=region).problems[0].code == "region-out-of-reach"


def test_a_source_that_is_not_known_between_poses() -> None:
    """Backlash goes with the sign of a force: it may change anywhere."""
    machine = load("hexapod_all_sources")
    centre = machine.poses().mean(axis=0)
    region = {
        name: (value, value + 1e-3)
        for name, value in zip(machine.commanded, centre.tolist(), strict=True)
    }
    (problem,) = refusal(machine, region=region).problems
    assert problem.code == "no-proof"


def test_a_made_source_that_differs_from_pose_to_pose_is_refused() -> None:
    machine = load("planar_two_slider")

    def by_pose(block: PoseBlock) -> Deviation:
        return Deviation.of([0], shift=1e-4 * block.placements[:, :1])

    made = with_sources(machine, MadeSource("of the pose", of_block=by_pose))
    (problem,) = refusal(made, region=WHOLE).problems
    assert problem.code == "no-proof"
    assert "of the pose: it differs from pose to pose" in str(problem.found)

    def wider(block: PoseBlock) -> Deviation:
        return Deviation.of([0], half=1e-4 * block.placements[:, :1])

    made = with_sources(machine, MadeSource("of the pose", of_block=wider))
    (problem,) = refusal(made, region=WHOLE).problems
    assert problem.code == "no-proof"
    assert "its band differs" in str(problem.found)


def test_an_overconstrained_machine_has_no_proof() -> None:
    machine = load("overconstrained")
    assert refusal(machine, region={"x": (0.0, 0.01)}).problems[0].code == "no-proof"


def test_a_distribution_without_ends() -> None:
    machine = load("planar_two_slider")
    from truepose.sources import normal

    deviation = Deviation.of([0], half=1e-4, distribution=normal(3.0))
    made = with_sources(machine, MadeSource("endless", deviation))
    stated = tp.bounds(made, region=WHOLE, gap=0.3)
    assert stated.attrs["truncate"] == "as stated"
    assert stated.attrs["unbounded"].startswith("normal, 3 sigma: ")
    found = tp.bounds(made, region=WHOLE, gap=0.3, truncate=3)
    assert found.attrs["truncate"] == 3.0
    assert (found.upper == stated.upper).all()
    assert str(found.status.values) == "proven"
