"""P01: the planar two-slider machine, every number of the closed form, from the Python interface.

Source: cases/p01_planar_two_slider.json, closed-form intersection of two circles, 9 decimals in mm
and 6 in N; the four steps of Gojtan & Hess-Coelho (2005) end to end.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.typing import ArrayLike

import truepose as tp
from build_machine import MACHINES
from oracle_cases import Published, case
from truepose.machine import Machine

LENGTH = 1e-9 * 1e-3
"""1e-9 mm in m."""
FORCE = 1e-6

OUTPUTS: dict[str, Any] = case("p01_planar_two_slider")["outputs"]
EDGES = {"tolerance_max": ("tolerance", "upper"), "tolerance_min": ("tolerance", "lower")}


@cache
def machine() -> Machine:
    return tp.load(MACHINES / "planar_two_slider.toml")


@cache
def budget() -> xr.Dataset:
    return tp.budget(machine())


@cache
def compensation() -> xr.Dataset:
    return tp.compensate(machine())


def metres(millimetres: ArrayLike) -> np.ndarray:
    return np.asarray(millimetres, float) * 1e-3


def test_the_poses_are_the_case_s_in_its_order() -> None:
    expected = metres(OUTPUTS["poses_mm"])
    assert np.abs(machine().poses() - expected).max() < 1e-15
    found = np.stack([budget().pose_x, budget().pose_y], axis=1)
    assert np.array_equal(found, machine().poses())


def test_joints(published: Published) -> None:
    expected = metres(OUTPUTS["joints_nominal_mm"])
    joints, mm = machine().inverse(machine().poses()), {"unit": "mm", "by": "reference"}
    published("joints", expected * 1e3, joints * 1e3, within=LENGTH * 1e3, **mm)
    assert np.abs(budget().joint_nominal - expected).max() < LENGTH
    assert np.abs(compensation().joint_nominal - expected).max() < LENGTH


def test_strut_forces(published: Published) -> None:
    expected = np.asarray(OUTPUTS["strut_force_N"])
    found = budget().force.values
    published("strut forces", expected, found, within=FORCE, unit="N", by="reference")
    wrench = np.array([1200.0, -1500.0, 0, 0, 0, 0])
    assert np.abs(machine().forces(machine().poses(), wrench) - expected).max() < FORCE


@pytest.mark.parametrize(
    ("key", "source", "variable"),
    [
        ("tolerance_max", "tolerance", "error_upper"),
        ("tolerance_min", "tolerance", "error_lower"),
        ("thermal", "thermal", "error"),
        ("thermal", "thermal", "error_lower"),
        ("thermal", "thermal", "error_upper"),
        ("elastic", "elastic", "error"),
        ("elastic", "elastic", "error_lower"),
        ("elastic", "elastic", "error_upper"),
    ],
)
def test_error_of_a_source_alone(key: str, source: str, variable: str) -> None:
    expected = metres(OUTPUTS["errors_mm"][key])
    found = budget()[variable].sel(source=source).values
    assert np.abs(found - expected).max() < LENGTH


@pytest.mark.parametrize("edge", ["upper", "lower"])
def test_overall_error(edge: str, published: Published) -> None:
    key = {"upper": "overall_max", "lower": "overall_min"}[edge]
    expected = metres(OUTPUTS["errors_mm"][key])
    found, mm = budget()[f"overall_error_{edge}"].values, {"unit": "mm", "by": "reference"}
    published(f"overall error, {edge}", expected * 1e3, found * 1e3, within=LENGTH * 1e3, **mm)


@pytest.mark.parametrize("row", sorted(OUTPUTS["tables"]))
def test_tables_of_the_highest(row: str) -> None:
    table = OUTPUTS["tables"][row]
    if row.startswith("overall"):
        edge = "upper" if row.endswith("max") else "lower"
        absolute = budget()[f"overall_highest_{edge}"]
        percent = budget()[f"overall_highest_percent_{edge}"]
    else:
        source, edge = EDGES.get(row, (row, "upper"))
        absolute = budget()[f"highest_{edge}"].sel(source=source)
        percent = budget()[f"highest_percent_{edge}"].sel(source=source)
    assert np.abs(absolute.values - metres(table["highest_abs_mm"])).max() < LENGTH
    # 9 decimals of a percentage.
    assert np.abs(percent.values - table["highest_percent"]).max() < 1e-9


def test_compensated_joints() -> None:
    expected = metres(OUTPUTS["joints_compensated_mm"])
    assert np.abs(compensation()["joint_corrected"].values - expected).max() < LENGTH


@pytest.mark.parametrize("edge", ["upper", "lower"])
def test_residual_after_compensation(edge: str, published: Published) -> None:
    key = {"upper": "at_max", "lower": "at_min"}[edge]
    expected = metres(OUTPUTS["residual_after_compensation_mm"][key])
    found, mm = compensation()[f"residual_{edge}"].values, {"unit": "mm", "by": "reference"}
    what = f"residual after compensation, {edge}"
    published(what, expected * 1e3, found * 1e3, within=LENGTH * 1e3, **mm)


def test_nothing_remains_in_the_middle() -> None:
    assert np.abs(compensation().residual_middle.values).max() < LENGTH


def test_ranking_and_verdict() -> None:
    # Highest norms of worst: tolerance 0.625 mm, elastic 0.186, thermal 0.105; 0.5 mm is asked.
    assert budget()["rank"].to_series().to_dict() == {"tolerance": 1, "elastic": 2, "thermal": 3}
    assert budget().verdict.to_series().to_dict() == {
        "tolerance": "dominant",
        "elastic": "dominant",
        "thermal": "relevant",
    }
    assert budget()["share"].sum().item() == pytest.approx(1.0, abs=1e-15)


def test_half_the_tolerance_range_remains() -> None:
    # The paper's claim: what remains is at most half the tolerance range times the sensitivity.
    sensitivity = machine().sensitivity(machine().poses())
    lengths = [machine().parameters.index(f"strut.{n}.length") for n in (1, 2)]
    half_range = 0.3e-3 * np.abs(sensitivity[:, :, lengths]).sum(axis=-1)
    assert np.allclose(compensation().bound.values, half_range, rtol=1e-3)
    # Exactly, of the struts as long as they are, from the corrected carriages to the tool.
    carriages = np.zeros((*compensation()["joint_corrected"].shape, 2))
    carriages[:, 1, 0] = 0.6
    carriages[:, :, 1] = compensation()["joint_corrected"].values
    struts = machine().poses()[:, np.newaxis] - carriages
    struts /= np.linalg.norm(struts, axis=2, keepdims=True)
    half_range = 0.3e-3 * np.abs(np.linalg.inv(struts)).sum(axis=-1)
    assert np.abs(compensation().bound.values - half_range).max() < LENGTH
    for edge in ("lower", "upper"):
        residual = np.abs(compensation()[f"residual_{edge}"].values)
        assert (residual <= half_range + compensation().second_order.values + LENGTH).all()
    # The second-order term is small change: half a micrometre of the 380.
    assert compensation().second_order.values.max() < 1e-6
