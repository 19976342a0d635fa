"""Listed values that lie further to one side of their mean: the worst case takes those there are.

-0.2, 0.1 and 0.4 mm with the probabilities 0.3, 0.3 and 0.4 have the mean 0.13 and are at most
0.33 from it. Mirrored about it they would end at 0.46 mm; none is above 0.4.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import truepose as tp
from command_line import call
from machine_texts import PLANAR, edited, load_text
from truepose.machine import Machine
from truepose.uncertainty_analysis.functions.inputs import Input
from two_slider import directions, displaced

Floats = NDArray[np.float64]

VALUES = np.array([-0.2e-3, 0.1e-3, 0.4e-3])
CHANCES = [0.3, 0.3, 0.4]
MEAN = 0.13e-3
LISTED = "{ values = [-0.2, 0.1, 0.4], probabilities = [0.3, 0.3, 0.4], distribution = 'discrete' }"


@pytest.fixture
def machine(tmp_path: Path) -> Machine:
    """The planar two-slider whose first strut is of one of three lengths, and nothing else."""
    text = edited(
        PLANAR,
        ("[-0.3, 0.3]", LISTED),
        ("temperature = 35\nforce = { x = 1200, y = -1500 }\n", ""),
    )
    return load_text(tmp_path, text)


def errors(machine: Machine) -> Floats:
    """(n, 3, 2) exact errors of the three machines, by circles."""
    lengths = np.stack([VALUES, np.zeros(3)], axis=1)
    return np.stack([displaced(machine, machine.poses(), lengths=each) for each in lengths], axis=1)


def test_of_a_function_the_worst_is_a_value_that_exists() -> None:
    inputs = {"x": Input.discrete(VALUES, CHANCES)}
    for function, low, high in (
        (lambda x: x, -0.2e-3, 0.4e-3),
        (lambda x: -2.0 * x, -0.8e-3, 0.4e-3),
    ):
        found = tp.worst_case(function, inputs)
        assert float(found.exact_lower.squeeze()) == pytest.approx(low)
        assert float(found.exact_upper.squeeze()) == pytest.approx(high)
        assert float(found.linear.squeeze()) == pytest.approx(max(-low, high))


def test_of_a_machine_the_worst_is_one_of_the_machines(machine: Machine) -> None:
    known, found = errors(machine), tp.worst_case(machine)
    assert np.allclose(found.exact_lower, known.min(axis=1), rtol=0, atol=1e-14)
    assert np.allclose(found.exact_upper, known.max(axis=1), rtol=0, atol=1e-14)
    size = np.linalg.norm(known, axis=2).max(axis=1)
    assert np.allclose(found.magnitude_exact.sel(quantity="position"), size, rtol=1e-9)
    # To first order, about the mean.
    slopes = np.linalg.inv(directions(machine, machine.poses()))[:, :, 0]
    assert np.allclose(found.linear, 0.4e-3 * np.abs(slopes), rtol=2e-3)
    assert np.allclose(tp.budget(machine).worst.sel(source="tolerance"), found.linear, rtol=2e-3)


def test_the_edges_of_the_budget_are_the_ends_that_there_are(machine: Machine) -> None:
    known, budget = errors(machine), tp.budget(machine)
    alone = budget.sel(source="tolerance")
    assert np.allclose(alone.error_lower, known[:, 0], rtol=0, atol=1e-14)
    assert np.allclose(alone.error_upper, known[:, 2], rtol=0, atol=1e-14)
    assert np.allclose(budget.overall_error_upper, known[:, 2], rtol=0, atol=1e-14)


def test_bounds_hold_for_each_machine_and_no_longer_for_its_mirror(machine: Machine) -> None:
    known, found = errors(machine), tp.bounds(machine)
    assert (found.status == "proven").all()
    assert (found.lower <= known.min(axis=1)).all()
    assert (found.upper >= known.max(axis=1)).all()
    wide = np.ptp(known, axis=1)
    assert (known.min(axis=1) - found.lower <= 1e-6 * wide).all()
    assert (found.upper - known.max(axis=1) <= 1e-6 * wide).all()
    assert np.allclose(found.reached_upper, known.max(axis=1), rtol=0, atol=1e-14)


def test_bounds_over_a_region_hold_for_each_machine(machine: Machine) -> None:
    region = {"x": (0.29, 0.31), "y": (0.19, 0.21)}
    found = tp.bounds(machine, region=region, gap=0.01)
    assert str(found.status.values) == "proven"
    random = np.random.default_rng(2)
    poses = random.uniform([0.29, 0.19], [0.31, 0.21], (200, 2))
    lengths = np.stack([VALUES, np.zeros(3)], axis=1)
    reached = np.concatenate([displaced(machine, poses, lengths=each) for each in lengths])
    assert (found.upper.values >= reached.max(axis=0)).all()
    assert (found.lower.values <= reached.min(axis=0)).all()
    # The corners are within a per cent or two of the worst drawn; mirrored it would be 15 %.
    assert (found.upper.values <= 1.06 * reached.max(axis=0)).all()


def test_what_remains_is_at_most_what_the_values_leave(machine: Machine) -> None:
    found = tp.compensate(machine)
    poses, kernel = machine.poses(), machine.kernel
    corrected = kernel.replace({"strut.1.length": 0.5 + MEAN}).inverse(poses)
    remains = []
    for value in VALUES:
        actual = kernel.replace({"strut.1.length": 0.5 + value})
        remains.append(actual.forward(corrected, poses) - poses)
    most = np.abs(remains).max(axis=0)
    assert (most <= found.bound + found.second_order).all()
    assert np.allclose(found.bound, most, rtol=5e-3)


def test_what_is_answered_is_at_least_what_a_machine_of_the_list_reaches(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    # The force moves the tool against the longer side of the list: |error| and reach do not add up
    # to the worst of the source.
    listed = "{ values = [0.2, -0.8], probabilities = [0.9, 0.1], distribution = 'discrete' }"
    text = edited(
        PLANAR, ("[-0.3, 0.3]", listed), ("temperature = 35\n", ""), ('"0.5 mm"', '"0.9 mm"')
    )
    machine = load_text(tmp_path, text)
    budget, worst = tp.budget(machine), tp.worst_case(machine)
    tolerance = budget.sel(source="tolerance")
    slopes = np.abs(np.linalg.inv(directions(machine, machine.poses()))[:, :, 0])
    # From the mean, 0.1 mm, it is 0.9 mm to the one value and 0.1 to the other.
    # The slopes of the machine there are others by as much as that is of a strut, 1/5000.
    assert np.allclose(tolerance.reach, 0.9e-3 * slopes, rtol=1e-3)
    answer = json.loads(call(capsys, "check", tmp_path / "machine.toml", "--format", "json").out)
    position = answer["answers"][0]
    reached = 1e3 * float(worst.magnitude_exact.sel(quantity="position").max())
    assert position["highest"] >= reached
    (shown,) = (each for each in answer["sources"] if each["name"] == "tolerance")
    (ends,) = shown["deviations"]
    assert (ends["shift"], ends["lower"], ends["upper"]) == pytest.approx((0.1, -0.9, 0.1))
    table = call(capsys, "check", tmp_path / "machine.toml").out
    assert "\N{MINUS SIGN}900.000 \N{HORIZONTAL ELLIPSIS} +100.000" in table


def test_a_list_and_a_force_to_its_longer_side_are_answered_together(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    # Both joints on the platform are off alike, so that the tool is off by the list, the other way:
    # from its mean, -0.1 mm, up to 0.8 mm; and the force moves it that way too.
    listed = "{ values = [0.2, -0.8], probabilities = [0.9, 0.1], group = 'p' }"
    text = edited(
        PLANAR,
        ("length_tolerance = [-0.3, 0.3]\n", ""),
        ("temperature = 35\nforce = { x = 1200, y = -1500 }", "force = { x = 8000 }"),
        ("x = [200, 400, 5], y = [100, 300, 3]", "x = [300, 300, 1], y = [200, 200, 1]"),
        ("[accuracy]", f'[tolerance]\n"strut.*.platform.x" = {listed}\n[accuracy]'),
    )
    machine = load_text(tmp_path, text)
    by_force = float(tp.budget(machine).error.sel(source="elastic", component="x").squeeze())
    answer = json.loads(call(capsys, "check", tmp_path / "machine.toml", "--format", "json").out)
    assert by_force > 0.5e-3
    assert answer["answers"][0]["highest"] >= 1e3 * (by_force + 0.8e-3) * (1.0 - 1e-6)
