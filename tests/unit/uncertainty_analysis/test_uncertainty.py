"""The linear answer of all sources together, and its comparison with plain sampling."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.typing import NDArray
from scipy import stats

import truepose as tp
from build_machine import MACHINES
from machine_texts import HEXAPOD, PLANAR, edited, load_text
from truepose.errors import RequestError
from truepose.machine import Machine
from truepose.runs.poses import PoseRun, required_sources
from truepose.runs.variables import variables_at
from truepose.uncertainty_analysis.functions.inputs import Input
from truepose.uncertainty_analysis.uncertainty import NOT_SAMPLED, SCHEMA, SECOND_ORDER, VALIDATION

Array = NDArray[np.float64]
K = 1.959963984540054


def load(name: str) -> Machine:
    return tp.load(MACHINES / f"{name}.toml")


def test_the_schema_is_what_there_is() -> None:
    machine = load("hexapod")
    found = tp.uncertainty(machine, machine.poses()[:3])
    assert list(found.data_vars) == list(SCHEMA)
    for name, variable in SCHEMA.items():
        assert found[name].dims == variable.dims
    assert found.standard_uncertainty.attrs["units"] == "m, rad"
    assert found.covariance.attrs["units"] == "m^2, m rad, rad^2"
    assert found.other_component.values.tolist() == list(machine.components)
    assert found.attrs["probability"] == 0.95
    planar = tp.uncertainty(load("planar_two_slider"))
    assert planar.covariance.attrs["units"] == "m^2"


@pytest.mark.parametrize("name", ["hexapod", "hexapod_all_sources", "3rpr", "overconstrained"])
def test_sources_add_as_squares(name: str) -> None:
    machine = load(name)
    poses = machine.poses()[:5]
    found, budget = tp.uncertainty(machine, poses), tp.budget(machine, poses)
    together = np.sqrt((budget.uncertainty**2).sum("source"))
    # The budget has each source alone, about the nominal machine; here all are at their shifts.
    shifted = bool((budget.error != 0.0).any())
    assert np.allclose(found.standard_uncertainty, together, rtol=0.02 if shifted else 1e-12)
    assert np.allclose(found.value, budget.overall_error, rtol=0, atol=1e-15)
    diagonal = np.einsum("ncc->nc", found.covariance.values)
    assert np.allclose(np.sqrt(diagonal), found.standard_uncertainty, rtol=1e-12)
    assert np.isinf(found.effective_dof).all()
    assert np.allclose(found.coverage_factor, K)
    half = K * found.standard_uncertainty
    assert np.allclose(found.upper - found.value, half, rtol=1e-12)
    assert np.allclose(found.value - found.lower, half, rtol=1e-12)


def slopes_of_lengths(machine: Machine, poses: Array) -> Array:
    """(n, n_component, 2) derivatives to both lengths where all sources are at their shift."""
    (block,) = PoseRun(machine, poses, machine.condition)
    moves = variables_at(machine, block, required_sources(machine, machine.condition))
    columns = [machine.parameters.index(f"strut.{i}.length") for i in (1, 2)]
    found, _ = machine.kernel.sensitivity_moved(
        block.joints, block.placements, columns, *moves.shift
    )
    return found


def test_correlated_tolerances_keep_their_signs(tmp_path: Path) -> None:
    """Against the two lengths' sensitivities; sideways they work against one another."""
    text = edited(
        PLANAR,
        ("length = 500\nsection", "length = 500\nlength_tolerance = 0.2\nsection"),
        (
            "[workspace]",
            '[[correlation]]\nbetween = ["strut.1.length", "strut.2.length"]\n'
            "coefficient = 0.8\n[workspace]",
        ),
    )
    machine = load_text(tmp_path, text)
    poses = machine.poses()
    bands = np.array([0.3e-3, 0.2e-3]) / np.sqrt(3.0)
    first, second = np.moveaxis(slopes_of_lengths(machine, poses) * bands, 2, 0)
    assert (first * second < 0.0).any()
    assert (first * second > 0.0).any()
    expected = np.sqrt(first**2 + second**2 + 2.0 * 0.8 * first * second)
    found, budget = tp.uncertainty(machine), tp.budget(machine)
    assert np.allclose(found.standard_uncertainty, expected, rtol=1e-12)
    # The budget has the tolerance alone, about the nominal machine.
    assert np.allclose(budget.uncertainty.sel(source="tolerance"), expected, rtol=0.02)
    # A correlation does not narrow the worst case.
    plain = tp.budget(load_text(tmp_path, text.replace("coefficient = 0.8", "coefficient = 0")))
    assert np.allclose(budget.worst, plain.worst, rtol=1e-13)


def test_another_probability() -> None:
    machine = load("planar_two_slider")
    found = tp.uncertainty(machine, probability=0.6827)
    assert np.allclose(found.coverage_factor, 1.0, atol=1e-4)


def test_covariance_is_that_of_drawn_errors(tmp_path: Path) -> None:
    machine = load_text(tmp_path, f'{HEXAPOD}\n[tolerance]\n"strut.*" = 0.01\n')
    pose = machine.poses()[:1]
    found = tp.uncertainty(machine, pose).covariance.values[0]
    random = np.random.default_rng(3)
    joints, placement, _ = machine.kernel.place(pose)
    count = 100_000
    columns = [at for at, each in enumerate(machine.parameters) if each.startswith("strut.")]
    moved = random.uniform(-1e-5, 1e-5, (count, len(columns)))
    errors, _ = machine.kernel.displacement(
        np.repeat(joints, count, axis=0), np.repeat(placement, count, axis=0), columns, moved
    )
    scale = np.sqrt(np.diagonal(found))
    assert np.abs((np.cov(errors.T) - found) / np.outer(scale, scale)).max() < 0.02


def test_poses_in_parts_are_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    machine = load("hexapod")
    poses = machine.poses()[:7]
    whole = tp.uncertainty(machine, poses)
    monkeypatch.setattr("truepose.runs.poses.BLOCK", 4)
    monkeypatch.setattr("truepose.uncertainty_analysis.uncertainty.FEW", 3)
    xr.testing.assert_allclose(tp.uncertainty(machine, poses), whole, rtol=1e-13)


def test_poses_left_out_and_progress() -> None:
    machine = load("planar_two_slider")
    seen: list[tuple[int, int]] = []
    poses = np.concatenate([[[9.0, 9.0]], machine.poses()[:2]])
    found = tp.uncertainty(machine, poses, progress=lambda *each: seen.append(each))
    assert seen == [(3, 3)]
    assert found.pose.values.tolist() == [1, 2]
    assert found.left_out_index.values.tolist() == [0]


def code_of(call: Callable[..., Any], *arguments: Any, **named: Any) -> str:
    with pytest.raises(RequestError) as caught:
        call(*arguments, **named)
    return caught.value.problems[0].code


def test_bad_requests(tmp_path: Path) -> None:
    machine = load("planar_two_slider")
    for probability in (0.0, 1.0, -0.1, 95.0, float("nan"), "0.95"):
        assert code_of(tp.uncertainty, machine, probability=probability) == "bad-probability"
    with pytest.raises(RequestError, match=r"95 % is 0\.95"):
        tp.uncertainty(machine, probability=95)
    for digits in (0, 7, 1.5, True):
        assert code_of(tp.uncertainty, machine, digits=digits) == "bad-digits"
    assert code_of(tp.uncertainty, machine, [[1.0]]) == "bad-poses"
    assert code_of(tp.uncertainty, machine, [[9.0, 9.0]]) == "no-pose-left"
    assert code_of(tp.uncertainty, load_text(tmp_path, HEXAPOD)) == "no-source"


def sampled(model: Any, poses: Any = None, condition: Any = None, **named: Any) -> xr.Dataset:
    """Plain sampling of lengths that are uniform (planar machines), or of normal inputs."""
    random = np.random.default_rng(named["seed"])
    count = named["samples"] or 200_000
    if isinstance(model, Machine):
        columns = np.array([model.parameters.index(f"strut.{i}.length") for i in (1, 2)])
        given = model.poses() if poses is None else np.asarray(poses)
        joints, placements, status = model.kernel.place(given)
        usable = np.flatnonzero(status == 0)
        outputs = [
            model.kernel.displacement(
                np.repeat(joints[[at]], count, axis=0),
                np.repeat(placements[[at]], count, axis=0),
                columns,
                random.uniform(-0.3e-3, 0.3e-3, (count, 2)),
            )[0]
            for at in usable
        ]
        drawn, dims, coords = np.stack(outputs, axis=1), ("pose", "component"), {"pose": usable}
    else:
        names = list(poses)
        variables_at = {name: random.normal(poses[name].centre, 1.0, count) for name in names}
        drawn, dims, coords = model(**variables_at)[:, np.newaxis], ("component",), {}
    tail = 0.5 * (1.0 - named["probability"])
    data = {
        "mean": drawn.mean(axis=0),
        "standard_deviation": drawn.std(axis=0),
        "lower": np.quantile(drawn, tail, axis=0),
        "upper": np.quantile(drawn, 1.0 - tail, axis=0),
    }
    samples = np.full(drawn.shape[1:-1], count)
    return xr.Dataset(
        {name: (dims, values) for name, values in data.items()}
        | {"samples": (dims[:-1], samples), "failed": (dims[:-1], np.zeros_like(samples))},
        coords,
        {"seed": named["seed"]},
    )


@pytest.fixture
def plain_sampling(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("truepose.uncertainty_analysis.uncertainty.monte_carlo", sampled)


@pytest.fixture
def planar(tmp_path: Path) -> Machine:
    text = edited(
        PLANAR,
        ("length = 500\nsection", "length = 500\nlength_tolerance = 0.3\nsection"),
        ("temperature = 35\nforce", "force"),
        ("x = 1200, y = -1500", "x = 0"),
    )
    return load_text(tmp_path, text)


@pytest.mark.usefixtures("plain_sampling")
def test_what_is_compared(planar: Machine) -> None:
    found = tp.uncertainty(planar, validate=True)
    assert list(found.data_vars) == [*SCHEMA, *VALIDATION]
    assert found.valid.dtype == bool
    assert found.reason.dtype.kind == "U"
    assert found.attrs["digits"] == 2
    assert found.attrs["seed"] == 0
    assert np.allclose(found.difference_upper, np.abs(found.upper - found.sampled_upper))
    assert np.allclose(found.difference_lower, np.abs(found.lower - found.sampled_lower))
    beyond = np.maximum(found.difference_lower, found.difference_upper) > found.tolerance
    assert np.array_equal(found.valid, ~beyond)
    # Two uniform lengths make a triangular sum: narrower than a normal one.
    here = found.isel(pose=int(np.argmin(found.valid.all("component").values)))
    assert "the sampled upper end lies" in str(here.reason.values)
    assert [bool(each) for each in found.reason == ""] == found.valid.all(
        "component"
    ).values.tolist()


@pytest.mark.usefixtures("plain_sampling")
def test_one_dominant_length_is_named(planar: Machine) -> None:
    found = tp.uncertainty(planar, [[0.48, 0.2]], validate=True)
    assert not found.valid.values.all()
    assert "strut.1.length, which is uniform, makes" in str(found.reason.values[0])


@pytest.mark.usefixtures("plain_sampling")
def test_poses_are_matched_by_their_number(planar: Machine) -> None:
    found = tp.uncertainty(planar, [[9.0, 9.0], [0.3, 0.2], [0.25, 0.2]], validate=True)
    alone = tp.uncertainty(planar, [[0.25, 0.2]], validate=True)
    assert found.pose.values.tolist() == [1, 2]
    assert np.allclose(found.sampled_upper[1], alone.sampled_upper[0], rtol=0.01)


def test_a_pose_that_was_not_sampled(planar: Machine, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        "truepose.uncertainty_analysis.uncertainty.monte_carlo",
        lambda *a, **k: sampled(*a, **k).isel(pose=[1]),
    )
    found = tp.uncertainty(planar, [[0.3, 0.2], [0.25, 0.2]], validate=True)
    assert str(found.reason.values[0]) == NOT_SAMPLED
    assert not found.valid[0].any()
    assert np.isnan(found.sampled_lower[0]).all()
    assert np.isfinite(found.sampled_lower[1]).all()


@pytest.mark.usefixtures("plain_sampling")
def test_a_function_and_its_validation() -> None:
    def area(x: Array, y: Array) -> Array:
        return x * y

    far = {"x": Input.normal(300.0, 1.0), "y": Input.normal(200.0, 1.0)}
    good = tp.uncertainty(area, far, validate=True)
    assert [*good.data_vars] == [*SCHEMA, *SECOND_ORDER, *VALIDATION]
    assert good.valid.values.all()
    assert str(good.reason.values) == ""
    near = tp.uncertainty(area, {name: Input.normal(0.0, 1.0) for name in far}, validate=True)
    assert not near.valid.values.any()
    assert "its sensitivity is nearly zero here" in str(near.reason.values)
    assert float(near.second_order_uncertainty.squeeze()) == pytest.approx(1.0)
    assert near.attrs["seed"] == 0


def test_a_function_of_correlated_inputs_and_two_results() -> None:
    inputs = {"x": Input.normal(3.0, 0.1), "y": Input.normal(4.0, 0.2)}
    found = tp.uncertainty(
        lambda x, y: {"sum": x + y, "difference": x - y},
        inputs=inputs,
        correlation={("x", "y"): 0.5},
    )
    assert np.allclose(found.value, [7.0, -1.0])
    assert np.allclose(found.standard_uncertainty, np.sqrt([0.07, 0.03]))
    assert found.covariance.values == pytest.approx(np.array([[0.07, -0.03], [-0.03, 0.03]]))
    assert found["component"].values.tolist() == ["sum", "difference"]
    assert np.allclose(found.second_order_uncertainty, found.standard_uncertainty, rtol=1e-12)


def second_order(function: Callable[..., Any], *, r: float = 0.0, **inputs: Input) -> float:
    given = {("x", "y"): r} if r else None
    found = tp.uncertainty(function, inputs, correlation=given)
    return float(found.second_order_uncertainty.squeeze())


def test_terms_of_next_order_are_exact_for_quadratics_of_normal_inputs() -> None:
    x, y = Input.normal(0.5, 0.3), Input.normal(-1.0, 0.7)
    # var(x^2) = 4 m^2 u^2 + 2 u^4
    assert second_order(lambda x: x**2, x=x) == pytest.approx(
        np.sqrt(4 * 0.25 * 0.09 + 2 * 0.0081), rel=1e-9
    )
    # var(x y) = mx^2 uy^2 + my^2 ux^2 + 2 mx my c + ux^2 uy^2 + c^2
    for r in (0.0, 0.6, 1.0):
        c = r * 0.3 * 0.7
        expected = 0.25 * 0.49 + 0.09 + 2 * 0.5 * -1.0 * c + 0.09 * 0.49 + c**2
        found = second_order(lambda x, y: x * y, x=x, y=y, r=r)
        assert found == pytest.approx(np.sqrt(expected), rel=1e-7)


def test_third_derivatives_enter_with_the_slope() -> None:
    # y = x + x^3 / 6 at 0: 1 + 2 (1/2 0 + 1 1 u^2 / 2) = u^2 + u^4
    assert second_order(lambda x: x + x**3 / 6, x=Input.normal(0.0, 0.2)) == pytest.approx(
        np.sqrt(0.04 + 0.0016), rel=1e-9
    )
    # y = x + x y^2 / 2: f_xyy = 1, so that u_x^2 u_y^2 is added for it and for f_xy = 0.
    found = second_order(
        lambda x, y: x + x * y**2 / 2, x=Input.normal(0.0, 0.2), y=Input.normal(0.0, 0.3)
    )
    assert found == pytest.approx(np.sqrt(0.04 + 0.04 * 0.09), rel=1e-9)


def test_rounding_of_a_large_value_adds_nothing() -> None:
    found = second_order(lambda x, y: 1e9 + x + y, x=Input.normal(0, 1e-3), y=Input.uniform(-1, 1))
    assert found == pytest.approx(np.sqrt(1e-6 + 1 / 3), rel=1e-6)


def test_a_function_that_ends_next_to_its_estimate_has_no_second_order() -> None:
    found = second_order(lambda x: np.where(x > -0.01, x, np.nan), x=Input.uniform(-1.0, 1.0))
    assert np.isnan(found)


def test_degrees_of_freedom_of_inputs() -> None:
    inputs = {"x": Input.normal(0.0, 3.0, 4), "y": Input.uniform(-1.0, 1.0)}
    found = tp.uncertainty(lambda x, y: x + y, inputs)
    total = 9.0 + 1.0 / 3.0
    assert float(found.effective_dof.squeeze()) == pytest.approx(total**2 / (81.0 / 4.0))
    assert float(found.coverage_factor.squeeze()) == pytest.approx(2.7346, abs=0.05)


def test_a_student_input_has_its_own_coverage() -> None:
    # Of 5 degrees of freedom: Student's 97.5 % quantile is 2.5706 scales, and the standard
    # deviation, which is what is stated, sqrt(5 / 3) of them.
    quantile = stats.t.ppf(0.975, 5)
    found = tp.uncertainty(lambda x: x, {"x": Input.student_t(0.0, 2.0, 5.0)})
    assert float(found.effective_dof.squeeze()) == pytest.approx(5.0)
    assert float(found.standard_uncertainty.squeeze()) == pytest.approx(2.0, rel=1e-9)
    factor = quantile / math.sqrt(5.0 / 3.0)
    assert round(factor, 3) == 1.991
    assert float(found.coverage_factor.squeeze()) == pytest.approx(factor, rel=1e-9)
    assert float(found.upper.squeeze()) == pytest.approx(2.0 * factor, rel=1e-9)
    # The second road: of 10^6 drawn, an end of the interval is known to some 0.2 %.
    drawn = tp.monte_carlo(lambda x: x, {"x": Input.student_t(0.0, 2.0, 5.0)}, samples=1_000_000)
    assert float(drawn.upper.squeeze()) == pytest.approx(2.0 * factor, rel=0.01)


@pytest.mark.parametrize("dof", [2.5, 4.0, 9.0])
def test_the_scale_of_jcgm_101_is_the_standard_deviation_of_the_mean(dof: float) -> None:
    """Its interval is the classical one of a mean, s / sqrt(n) times Student's quantile."""
    scale = 0.3
    by_scale = Input.student_t(1.0, scale=scale, dof=dof)
    by_deviation = Input.student_t(1.0, scale * math.sqrt(dof / (dof - 2.0)), dof)
    assert by_scale.standard_uncertainty == pytest.approx(
        by_deviation.standard_uncertainty, rel=1e-14
    )
    assert by_scale.distribution == by_deviation.distribution
    found = tp.uncertainty(lambda x: x, {"x": by_scale})
    wanted = stats.t(dof, 1.0, scale)
    assert float(found.standard_uncertainty.squeeze()) == pytest.approx(wanted.std(), rel=1e-9)
    assert float(found.upper.squeeze()) == pytest.approx(wanted.ppf(0.975), rel=1e-9)


def test_a_tolerance_by_its_scale_is_the_one_by_its_standard_deviation(tmp_path: Path) -> None:
    found = []
    for key, size in (("scale", 0.1), ("standard_deviation", 0.1 * math.sqrt(5.0 / 3.0))):
        band = f'{{ {key} = {size!r}, distribution = "student-t", dof = 5 }}'
        text = PLANAR.replace("length_tolerance = [-0.3, 0.3]", f"length_tolerance = {band}")
        found.append(tp.uncertainty(load_text(tmp_path, text)))
    for name in ("standard_uncertainty", "upper"):
        assert np.allclose(found[0][name], found[1][name], rtol=1e-12, atol=0.0)


def test_a_tolerance_of_students_distribution_widens_the_machines_interval(tmp_path: Path) -> None:
    band = '{ standard_deviation = 0.1, distribution = "student-t", dof = 5 }'
    text = PLANAR.replace("length_tolerance = [-0.3, 0.3]", f"length_tolerance = {band}")
    machine = load_text(tmp_path, text)
    found = tp.uncertainty(machine)
    assert np.allclose(found.effective_dof, 5.0, rtol=1e-9)
    factor = stats.t.ppf(0.975, 5) / math.sqrt(5.0 / 3.0)
    assert np.allclose(found.coverage_factor, factor, rtol=1e-9)


def test_correlated_inputs_of_finite_degrees_have_no_effective_ones() -> None:
    inputs = {"x": Input.normal(0.0, 3.0, 4), "y": Input.normal(0.0, 4.0, 9)}
    found = tp.uncertainty(lambda x, y: x + y, inputs, correlation={("x", "y"): 1.0})
    assert np.isnan(found.effective_dof).all()
    # Wholly correlated, they are one of 7, of which the fewest degrees are known: 4.
    assert float(found.upper.squeeze()) == pytest.approx(7.0 * stats.t.ppf(0.975, 4), rel=1e-9)


@pytest.mark.parametrize("count", [1, 2, 6, 30])
@pytest.mark.parametrize("dof", [3.0, 6.0])
def test_an_interval_of_several_student_inputs_holds_95_percent(count: int, dof: float) -> None:
    # Their scales alone would make it sqrt((dof - 2) / dof) of a normal one where they are many.
    inputs = {f"x{at}": Input.student_t(0.0, 1.0, dof) for at in range(count)}
    found = tp.uncertainty(lambda **x: sum(x.values()), inputs)
    random = np.random.default_rng(8)
    unit = math.sqrt((dof - 2.0) / dof)
    drawn = sum(unit * random.standard_t(dof, 200_000) for _ in range(count))
    inside = np.abs(drawn) <= float(found.upper.squeeze())
    # 2e5 samples know the share to 5e-4; that a Student distribution is only like the sum, to 1 %.
    assert 0.94 < inside.mean() < 0.96
