"""The linear law against the package `uncertainties`: covariance of functions and of machines."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import uncertainties
from numpy.typing import NDArray
from uncertainties import umath

import truepose as tp
from build_machine import MACHINES
from machine_texts import PLANAR, edited, load_text
from truepose.machine import Machine
from truepose.runs.poses import PoseRun, required_sources
from truepose.uncertainty_analysis.functions.inputs import Input

Array = NDArray[np.float64]
SAME = 1e-12


def gauge(ls: Any, d: Any, alpha: Any, theta: Any, d_alpha: Any, d_theta: Any) -> Any:
    return ls + d - ls * (d_alpha * theta + alpha * d_theta)


def rational(x: Any, y: Any, z: Any) -> Any:
    return (x**3 - y) / (z + x * y) + z**-2


def many(**x: Any) -> Any:
    parts = list(x.values())
    return sum((a * b + 0.1 * a for a, b in pairwise(parts)), start=parts[0] ** 2)


FUNCTIONS: dict[str, tuple[Callable[..., Any], dict[str, tuple[float, float]]]] = {
    "gauge": (
        gauge,
        {
            "ls": (50000623.0, 25.0),
            "d": (215.0, 9.7),
            "alpha": (1.15e-5, 1.2e-6),
            "theta": (-0.1, 0.41),
            "d_alpha": (0.0, 5.8e-7),
            "d_theta": (0.0, 0.029),
        },
    ),
    "rational": (rational, {"x": (1.3, 0.1), "y": (-0.4, 0.05), "z": (2.1, 0.3)}),
    "many": (many, {f"x{at}": (0.3 + 0.7 * at, 0.01 * (1 + at)) for at in range(12)}),
}


def correlation(count: int, seed: int) -> Array:
    """A correlation matrix of full rank."""
    factors = np.random.default_rng(seed).normal(size=(count, count + 2))
    matrix = factors @ factors.T
    scale = np.sqrt(np.diagonal(matrix))
    found: Array = matrix / np.outer(scale, scale)
    np.fill_diagonal(found, 1.0)
    return 0.5 * (found + found.T)


@pytest.mark.parametrize("linked", [False, True], ids=["independent", "correlated"])
@pytest.mark.parametrize("name", FUNCTIONS)
def test_plain_functions(name: str, linked: bool) -> None:
    function, stated = FUNCTIONS[name]
    inputs = {each: Input.normal(*at) for each, at in stated.items()}
    matrix = correlation(len(stated), 5) if linked else np.eye(len(stated))
    found = tp.uncertainty(function, inputs, correlation=matrix)
    values = uncertainties.correlated_values_norm(list(stated.values()), matrix)
    expected = function(**dict(zip(stated, values, strict=True)))
    assert float(found.value.squeeze()) == pytest.approx(expected.n, rel=SAME)
    assert float(found.standard_uncertainty.squeeze()) == pytest.approx(expected.s, rel=SAME)


@pytest.mark.parametrize("linked", [False, True], ids=["independent", "correlated"])
def test_covariance_of_several_results(linked: bool) -> None:
    stated = {"r": (0.7, 0.01), "a": (0.4, 0.02), "h": (1.5, 0.03)}
    matrix = correlation(3, 8) if linked else np.eye(3)

    def place(r: Array, a: Array, h: Array) -> dict[str, Array]:
        return {"x": r * np.cos(a), "y": r * np.sin(a), "z": np.exp(-h) * r}

    inputs = {each: Input.normal(*at) for each, at in stated.items()}
    found = tp.uncertainty(place, inputs, correlation=matrix)
    r, a, h = uncertainties.correlated_values_norm(list(stated.values()), matrix)
    results = [r * umath.cos(a), r * umath.sin(a), umath.exp(-h) * r]
    expected = np.array(uncertainties.covariance_matrix(results))
    scale = np.sqrt(np.diagonal(expected))
    assert np.abs((found.covariance.values - expected) / np.outer(scale, scale)).max() < SAME


def two_struts(lengths: list[Any], carriages: Array, span: float) -> tuple[Any, Any]:
    """Where two struts hang from carriages at x = 0 and `span`: the lower crossing of circles."""
    low, high = np.array([0.0, carriages[0]]), np.array([span, carriages[1]])
    apart = float(np.hypot(*(high - low)))
    along, across = (high - low) / apart, np.array([high[1] - low[1], low[0] - high[0]]) / apart
    first, second = lengths
    foot = (first**2 - second**2 + apart**2) / (2.0 * apart)
    height = umath.sqrt(first**2 - foot**2)
    return tuple(low[i] + foot * along[i] + height * across[i] for i in range(2))


def test_a_machine_in_closed_form(tmp_path: Path) -> None:
    """Both lengths go through the crossing of two circles, differentiated by `uncertainties`."""
    text = edited(
        PLANAR,
        ("length = 500\nsection", "length = 500\nlength_tolerance = [-0.3, 0.3]\nsection"),
        ("temperature = 35\nforce", "force"),
        ("x = 1200, y = -1500", "x = 0"),
    )
    machine = load_text(tmp_path, text)
    poses = machine.poses()
    found = tp.uncertainty(machine, poses)
    for at, pose in enumerate(poses):
        joints = machine.inverse(pose)
        lengths = [uncertainties.ufloat(0.5, 0.3e-3 / math.sqrt(3.0)) for _ in range(2)]
        results = two_struts(lengths, joints, 0.6)
        assert [each.n for each in results] == pytest.approx(pose, abs=1e-13)
        expected = np.array(uncertainties.covariance_matrix(results))
        scale = np.sqrt(np.diagonal(expected))
        off = np.abs((found.covariance.values[at] - expected) / np.outer(scale, scale))
        assert off.max() < SAME


@pytest.mark.parametrize("name", ["hexapod", "linear_delta", "3rpr", "hexapod_all_sources"])
def test_the_linear_covariance_of_machines(name: str) -> None:
    """Sensitivity of every parameter to every variable, added up by `uncertainties`."""
    machine = tp.load(MACHINES / f"{name}.toml")
    poses = machine.poses()[[0, -1]]
    found = tp.uncertainty(machine, poses)
    for at, pose in enumerate(poses):
        expected = by_chain_rule(machine, pose)
        scale = np.sqrt(np.diagonal(expected))
        scale = np.where(scale > 0.0, scale, 1.0)
        off = np.abs((found.covariance.values[at] - expected) / np.outer(scale, scale))
        assert off.max() < SAME


def by_chain_rule(machine: Machine, pose: Array) -> Array:
    """Covariance of the error, from deviations of parameters that are uncertain numbers.

    By the slopes where every source is at its shift.
    """
    (block,) = PoseRun(machine, pose[np.newaxis], machine.condition)
    sources = required_sources(machine, machine.condition)
    deviations = [source.deviation(machine, machine.condition, block) for source in sources]
    shift = np.zeros((1, len(machine.parameters)))
    for deviation in deviations:
        np.add.at(shift[0], deviation.parameters, deviation.shift[0])
    every = np.arange(len(machine.parameters))
    moved, _ = machine.kernel.sensitivity_moved(block.joints, block.placements, every, every, shift)
    slopes = moved[0]
    errors: list[Any] = [0.0] * len(machine.components)
    for deviation in deviations:
        variables: dict[int, Any] = {}
        for k in deviation.banded.tolist():
            u = 1.0 / deviation.distribution[k].sigmas
            t = variables.setdefault(int(deviation.variables[k]), uncertainties.ufloat(0.0, u))
            moved = float(deviation.signed_half[0, k]) * t
            errors = [
                error + float(slope) * moved
                for error, slope in zip(errors, slopes[:, deviation.parameters[k]], strict=True)
            ]
    return np.array(uncertainties.covariance_matrix(errors))
