"""Bounds with the box of deviations divided: near singular poses, against circles by hand."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import truepose as tp
from build_machine import MACHINES
from machine_texts import load_text
from truepose.machine import Machine
from truepose.runs.poses import PoseRun, required_sources
from truepose.runs.variables import variables_at
from truepose.uncertainty_analysis.truncation import Ends

Array = NDArray[np.float64]

LENGTH, BAND = 0.5, 3e-4

SLIDERS = """\
schema = 1
[machine]
name = "one rail"
dof = ["x", "y"]
[units]
length = "mm"
angle = "deg"
force = "N"
temperature = "degC"
[[drive]]
name = "d1"
kind = "slider"
axis = [0, 1, 0]
travel = [-900, 900]
working_mode = "+"
[[drive]]
name = "d2"
kind = "slider"
axis = [0, 1, 0]
travel = [-900, 900]
working_mode = "-"
[[strut]]
name = "1"
drive = "d1"
base = [0, 0, 0]
platform = [0, 0, 0]
length = 500
length_tolerance = [-0.3, 0.3]
[[strut]]
name = "2"
drive = "d2"
base = [0, 0, 0]
platform = [0, 0, 0]
length = 500
length_tolerance = [-0.3, 0.3]
[workspace]
grid = { x = [20, 400, 5], y = [-100, 100, 3] }
home = { x = 100, y = 0 }
"""
"""Carriages above and below the tool: the struts lie nearly in one line where x is small."""


def bounds_at(machine: Machine, poses: Array, **asked: Any) -> tuple[Array, Array, Array]:
    """Magnitudes (n, n_quantity), status (n,) and boxes (n,)."""
    (block,) = PoseRun(machine, poses, machine.condition)
    moves = variables_at(machine, block, required_sources(machine, machine.condition))
    moves = Ends(None).truncated(moves)
    found = machine.kernel.bounds_at(
        block.joints,
        block.placements,
        moves.shift[0],
        np.ascontiguousarray(moves.shift[1]),
        moves.columns,
        moves.variable_of.tolist(),
        np.ascontiguousarray(moves.half_width),
        [members.tolist() for members in moves.directions],
        **asked,
    )
    return np.asarray(found[2]), np.asarray(found[3]), np.asarray(found[4])


def by_hand(machine: Machine, poses: Array) -> Array:
    """(n,) the longest error over a fine grid of both lengths, m; inf where one cannot close."""
    lengths = LENGTH + np.linspace(-BAND, BAND, 61)
    first, second = np.meshgrid(lengths, lengths, indexing="ij")
    longest = []
    for pose, (one, other) in zip(poses, machine.inverse(poses), strict=True):
        apart = other - one
        along = (first**2 - second**2 + apart**2) / (2 * apart)
        across = first**2 - along**2
        x = np.sqrt(np.where(across > 0.0, across, np.nan))
        sizes = np.hypot(x - pose[0], one + along - pose[1])
        longest.append(np.inf if np.isnan(sizes).any() else sizes.max())
    return np.array(longest)


@cache
def near_singular(folder: Path) -> tuple[Machine, Array, Array]:
    """The machine at poses of conditioning below 0.1, and the longest error at each."""
    machine = load_text(folder, SLIDERS)
    random = np.random.default_rng(3)
    poses = np.stack([random.uniform(0.012, 0.0499, 60), random.uniform(-0.1, 0.1, 60)], axis=1)
    assert (np.asarray(machine.kernel.conditioning(poses)) < 0.1).all()
    return machine, poses, by_hand(machine, poses)


def test_near_a_singularity_a_divided_box_has_a_bound(tmp_path: Path) -> None:
    machine, poses, exact = near_singular(tmp_path)
    closing = np.isfinite(exact)
    assert 20 < closing.sum() < 55
    _, whole, _ = bounds_at(machine, poses)
    asked = np.where(closing, 1.001 * exact, np.nan)[:, np.newaxis]
    size, status, boxes = bounds_at(machine, poses, most_boxes=4000, targets=asked)
    proven = status == "proven"
    assert not proven[~closing].any()
    assert (whole == "proven").sum() < 0.8 * closing.sum()
    assert proven.sum() >= 0.9 * closing.sum()
    assert (size[proven, 0] >= exact[proven]).all()
    assert (size[proven, 0] <= 1.001 * exact[proven]).all()
    assert np.isnan(size[~proven]).all()
    assert (boxes <= 4000).all()


def test_a_target_is_met_where_it_can_be(tmp_path: Path) -> None:
    machine, poses, exact = near_singular(tmp_path)
    sizes, _, _ = bounds_at(machine, poses, most_boxes=4000)
    at = int(np.nanargmax(sizes[:, 0] / exact))
    first, pose = sizes[at], poses[at : at + 1]
    assert first[0] > 1.005 * exact[at]
    below = 1.001 * exact[at]
    (size,), status, boxes = bounds_at(machine, pose, most_boxes=4000, targets=[below])
    assert status == ["proven"]
    assert exact[at] <= size[0] <= below < first[0]
    assert boxes[0] <= 4000
    # What is reached cannot be bounded below: the rest is not spent.
    (least,), _, spent = bounds_at(machine, pose, most_boxes=4000, targets=[0.9 * exact[at]])
    assert exact[at] <= least[0] <= first[0]
    assert spent[0] < 4000


@pytest.mark.parametrize("targets", [None, [np.nan], [np.inf], [1.0]])
def test_without_a_target_to_reach_one_box_is_enough(
    tmp_path: Path, targets: list[float] | None
) -> None:
    machine = load_text(tmp_path, SLIDERS)
    poses = np.array([[0.2, 0.0], [0.3, 0.1]])
    once = bounds_at(machine, poses)
    size, status, boxes = bounds_at(machine, poses, most_boxes=100, targets=targets)
    assert (size == once[0]).all()
    assert status.tolist() == ["proven", "proven"]
    assert boxes.tolist() == [1, 1]


def test_targets_are_of_the_quantities(tmp_path: Path) -> None:
    machine = load_text(tmp_path, SLIDERS)
    with pytest.raises(ValueError, match="targets"):
        bounds_at(machine, np.array([[0.2, 0.0]]), targets=[1e-3, 1e-3])


def test_bands_too_wide_for_one_box_have_a_bound_in_many(tmp_path: Path) -> None:
    """Wide bands far from singularities: both sliders 25 mm off, by hand at all four corners."""
    wide = SLIDERS.replace("[-0.3, 0.3]", "[-25, 25]")
    machine = load_text(tmp_path, wide)
    pose = np.array([[0.25, 0.0]])
    _, once, _ = bounds_at(machine, pose)
    assert once.tolist() == ["box_too_wide"]
    (size,), status, boxes = bounds_at(machine, pose, most_boxes=500)
    assert status.tolist() == ["proven"]
    ((one, other),) = machine.inverse(pose)
    apart = other - one
    corners = []
    for first in (0.475, 0.525):
        for second in (0.475, 0.525):
            along = (first**2 - second**2 + apart**2) / (2 * apart)
            corners.append(np.hypot(np.sqrt(first**2 - along**2) - 0.25, one + along))
    assert max(corners) <= size[0] <= 1.6 * max(corners)
    assert 1 < boxes[0] <= 500


def test_a_platform_that_turns_with_a_force_of_unknown_direction() -> None:
    """Every source of a hexapod: its direction is not divided, and what is sampled stays inside."""
    machine = tp.load(MACHINES / "hexapod_all_sources.toml")
    pose = machine.poses()[:1]
    once, status, _ = bounds_at(machine, pose)
    assert status.tolist() == ["proven"]
    found = tp.bounds(machine, pose)
    assert np.array_equal(found.magnitude, once)
    halved, again, boxes = bounds_at(
        machine, pose, most_boxes=40, targets=[0.9999 * once[0, 0], np.nan]
    )
    assert again.tolist() == ["proven"]
    assert (halved <= once).all()
    assert (halved >= found.reached_magnitude.values).all()
    assert boxes[0] <= 40
