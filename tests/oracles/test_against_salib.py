"""Sobol indices against SALib, which draws and estimates by itself: of a function, of a machine."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.typing import NDArray

import truepose as tp
from build_machine import MACHINES
from sweeps import sweep
from truepose.uncertainty_analysis.functions.inputs import Input

analyze = pytest.importorskip("SALib.analyze.sobol")
sample = pytest.importorskip("SALib.sample.sobol")

Floats = NDArray[np.float64]

SAMPLES = 1 << 13
CONFIDENCE = 0.99


def of_salib(bounds: dict[str, tuple[float, float]], model: Callable[[Floats], Floats]) -> Any:
    """S1, ST and their half widths, of uniform inputs within `bounds`."""
    problem = {
        "num_vars": len(bounds),
        "names": list(bounds),
        "bounds": [list(each) for each in bounds.values()],
    }
    points = sample.sample(problem, SAMPLES, calc_second_order=False, seed=1)
    values = model(points)
    return analyze.analyze(problem, values, calc_second_order=False, conf_level=CONFIDENCE, seed=1)


def agree(found: xr.Dataset, theirs: Any) -> None:
    """Each index differs by no more than both half widths, taken together."""
    for ours, name in (("first", "S1"), ("total", "ST")):
        width = np.hypot(found[f"{ours}_confidence"].values, theirs[f"{name}_conf"])
        assert (np.abs(found[ours].values - theirs[name]) <= width + 1e-9).all()


def ishigami(x: Floats, y: Floats, z: Floats) -> Floats:
    values: Floats = np.sin(x) + 7.0 * np.sin(y) ** 2 + 0.1 * z**4 * np.sin(x)
    return values


def test_ishigami() -> None:
    bounds = dict.fromkeys("xyz", (-math.pi, math.pi))
    inputs = {name: Input.uniform(*each) for name, each in bounds.items()}
    found = tp.shares(ishigami, inputs, samples=SAMPLES, confidence=CONFIDENCE)
    agree(found.isel(component=0), of_salib(bounds, lambda points: ishigami(*points.T)))
    a, b = 7.0, 0.1
    first = 0.5 * (1.0 + b * math.pi**4 / 5.0) ** 2
    both = b**2 * math.pi**8 * (1.0 / 18.0 - 1.0 / 50.0)
    whole = first + a**2 / 8.0 + both
    exact = {
        "first": np.array([first, a**2 / 8.0, 0.0]) / whole,
        "total": np.array([first + both, a**2 / 8.0, both]) / whole,
    }
    for name, wanted in exact.items():
        width = found[f"{name}_confidence"].values[:, 0]
        assert (np.abs(found[name].values[:, 0] - wanted) <= width).all()
        assert (width < 0.05).all()


@sweep
@pytest.mark.parametrize("half", [0.3e-3, 30e-3], ids=["as toleranced", "a hundred times that"])
def test_the_planar_machine(half: float) -> None:
    """SALib drives the exact model: `forward` of a machine with other strut lengths."""
    tolerance = f"{-1e3 * half}, {1e3 * half}"
    settings = {f"strut.{number}.length_tolerance": f"[{tolerance}]" for number in (1, 2)}
    machine = tp.load(MACHINES / "planar_two_slider.toml", settings)
    pose = machine.poses()[3:4]
    found = tp.shares(machine, pose, samples=SAMPLES, confidence=CONFIDENCE).isel(pose=0)
    names = ["strut.1.length", "strut.2.length"]
    assert found["parameter"].values.tolist() == names
    # What is known of the lengths, heat and load, as the exact budget has it.
    shifts = known_shifts(machine, names)
    bounds = {name: (shift - half, shift + half) for name, shift in zip(names, shifts, strict=True)}
    joints = machine.inverse(pose)[0]
    nominal = machine.nominal[[machine.parameters.index(name) for name in names]]

    def tool(points: Floats) -> Floats:
        return np.array(
            [
                machine.replace(dict(zip(names, nominal + point, strict=True))).forward(
                    joints, start=pose[0]
                )
                for point in points
            ]
        )

    cache: dict[bytes, Floats] = {}

    def component(at: int) -> Callable[[Floats], Floats]:
        def model(points: Floats) -> Floats:
            key = points.tobytes()
            if key not in cache:
                cache[key] = tool(points)
            return cache[key][:, at]

        return model

    for at, name in enumerate(machine.components):
        theirs = of_salib(bounds, component(at))
        agree(found.sel(component=name), theirs)


def known_shifts(machine: Any, names: list[str]) -> Floats:
    """(2,) m: what heat and load do to the lengths, seen through the error that they make."""
    pose = machine.poses()[3:4]
    columns = [machine.parameters.index(name) for name in names]
    error = tp.budget(machine, pose)["overall_error"].values[0]
    shifts: Floats = np.linalg.solve(machine.sensitivity(pose)[0][:, columns], error)
    return shifts
