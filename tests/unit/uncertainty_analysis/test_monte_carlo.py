"""Monte Carlo of machines and functions: against NumPy on the same samples, and its stopping."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.typing import NDArray

import truepose as tp
from build_machine import MACHINES
from machine_texts import HEXAPOD, PLANAR, edited, load_text
from truepose.cli.montecarlo import command
from truepose.errors import RequestError
from truepose.machine import Machine
from truepose.runs.first_order import ExactError
from truepose.runs.poses import PoseRun, required_sources
from truepose.runs.variables import variables_at
from truepose.uncertainty_analysis import machine_sampler, monte_carlo, stopping_rule
from truepose.uncertainty_analysis.functions.inputs import Input
from truepose.uncertainty_analysis.model import FunctionModel
from truepose.uncertainty_analysis.sampler import Random

Array = NDArray[np.float64]
SAMPLES = 20_000
SEED = 5
# Beyond it lies one of 100 000 estimates: one of the seed's.
FAR = 4.4


def load(name: str) -> Machine:
    return tp.load(MACHINES / f"{name}.toml")


@cache
def sampled(name: str) -> tuple[xr.Dataset, Array]:
    """The result at three poses, and the errors (pose, sample, component) of the same samples."""
    machine = load(name)
    poses = machine.poses()[[0, 1, -1]]
    found = tp.monte_carlo(machine, poses, SAMPLES, SEED)
    (block,) = PoseRun(machine, poses, machine.condition)
    moves = variables_at(machine, block, required_sources(machine, machine.condition))
    t = Random(moves, SEED).rows(0, SAMPLES)
    move = ExactError(machine, block, moves)
    each = [move(np.full(SAMPLES, pose), t) for pose in range(3)]
    assert all((status == 0).all() for _, status in each)
    return found, np.stack([errors for errors, _ in each])


NAMES = ["planar_two_slider", "hexapod", "hexapod_all_sources", "3rpr", "overconstrained"]


@pytest.mark.parametrize("name", NAMES)
def test_the_result_is_that_of_numpy_on_the_same_samples(name: str) -> None:
    found, errors = sampled(name)
    deviation = errors.std(axis=1, ddof=1)
    scale = deviation.max()
    assert found.samples.values.tolist() == [SAMPLES] * 3
    assert found.failed.values.tolist() == [0] * 3
    assert np.abs(found["mean"] - errors.mean(axis=1)).max() < 1e-9 * scale
    assert np.abs(found.standard_deviation - deviation).max() < 1e-9 * scale
    for pose, values in enumerate(errors):
        assert np.abs(found.covariance[pose] - np.cov(values.T)).max() < 1e-9 * scale**2
    assert np.abs(found.minimum - errors.min(axis=1)).max() < 1e-9 * scale
    assert np.abs(found.maximum - errors.max(axis=1)).max() < 1e-9 * scale
    # A quantile is known to a bin, of which there are 50 to 100 in a deviation, ...
    near = deviation / 45.0
    for variable, share in (("lower", 0.025), ("upper", 0.975)):
        expected = np.quantile(errors, share, axis=1)
        assert (np.abs(found[variable] - expected) < near).all()
    # ... but where there is nothing but a bin without samples.
    expected = np.moveaxis(np.quantile(errors, found.level[1:-1], axis=1), 0, 2)
    assert (np.abs(found["quantile"][..., 1:-1] - expected) < 3.0 * near[..., None]).all()
    assert np.array_equal(found["quantile"][..., 0], found.minimum)
    assert np.array_equal(found["quantile"][..., -1], found.maximum)


@pytest.mark.parametrize("name", NAMES)
def test_sizes(name: str) -> None:
    found, errors = sampled(name)
    places = np.array([each in "xyz" for each in found.component.values])
    parts = [errors[..., places], errors[..., ~places]]
    for at, part in enumerate(part for part in parts if part.shape[-1]):
        size = np.linalg.norm(part, axis=-1)
        here = found.isel(quantity=at)
        assert np.allclose(here.magnitude_mean, size.mean(axis=1), rtol=1e-9)
        assert np.allclose(here.magnitude_maximum, size.max(axis=1), rtol=1e-9)
        near = size.std(axis=1) / 20.0
        assert (np.abs(here.magnitude_upper - np.quantile(size, 0.95, axis=1)) < near).all()
        median = here.magnitude_quantile.sel(level=0.5)
        assert (np.abs(median - np.median(size, axis=1)) < near).all()


@pytest.mark.parametrize("name", NAMES)
def test_the_shortest_interval(name: str) -> None:
    found, errors = sampled(name)
    held = round(0.95 * SAMPLES)
    ordered = np.sort(errors, axis=1)
    shortest = (ordered[:, held - 1 :] - ordered[:, : SAMPLES - held + 1]).min(axis=1)
    width = found.shortest_upper - found.shortest_lower
    assert (np.abs(width - shortest) < 0.04 * errors.std(axis=1)).all()
    assert (width <= found.upper - found.lower + 1e-15).all()
    lower, upper = found.shortest_lower.values, found.shortest_upper.values
    inside = (errors >= lower[:, np.newaxis]) & (errors <= upper[:, np.newaxis])
    varying = errors.std(axis=1) > 1e-12
    assert np.abs(inside.mean(axis=1) - 0.95)[varying].max() < 0.005


@pytest.mark.parametrize("name", NAMES)
def test_the_ellipse_holds_its_share_of_the_samples(name: str) -> None:
    found, errors = sampled(name)
    axes = [str(axis) for axis in found.axis.values]
    assert axes == [each for each in found.component.values if each in "xyz"]
    position = errors[..., : len(axes)]
    for pose, values in enumerate(position):
        away = values - found.ellipse_centre.values[pose]
        shape = found.ellipse.values[pose]
        assert (np.linalg.eigvalsh(shape) > 0.0).all()
        square = np.einsum("si,ij,sj->s", away, np.linalg.inv(shape), away)
        assert (square <= 1.0).mean() == pytest.approx(0.95, abs=0.005)
        # Its shape is that of the covariance, of the first samples; its size some deviations.
        covariance = found.covariance.values[pose][: len(axes), : len(axes)]
        sizes = np.linalg.eigvals(np.linalg.solve(covariance, shape))
        assert np.ptp(sizes) < 0.1 * sizes.mean()
        assert 2.0 < np.sqrt(sizes.mean()) < 3.5


def test_a_direction_in_which_nothing_spreads(tmp_path: Path) -> None:
    """One length alone: the position error lies on a curve, all but a line."""
    machine = load_text(tmp_path, PLANAR)
    found = tp.monte_carlo(machine, [[0.3, 0.2]], 5000).isel(pose=0)
    values = np.linalg.eigvalsh(found.ellipse.values)
    assert values[0] < 1e-4 * values[1]
    assert np.isfinite(found.ellipse).all()


@pytest.mark.parametrize(
    "named", [{}, {"samples": 64}, {"samples": 64, "sampling": "sobol"}], ids=str
)
def test_without_bands_it_is_the_error(tmp_path: Path, named: dict[str, Any]) -> None:
    machine = load_text(tmp_path, edited(PLANAR, ("length_tolerance = [-0.3, 0.3]\n", "")))
    found = tp.monte_carlo(machine, **named)
    error = tp.budget(machine).overall_error
    assert (found.standard_deviation == 0.0).all()
    assert (found.ellipse == 0.0).all()
    for name in ("mean", "lower", "upper", "shortest_lower", "maximum"):
        assert np.abs(found[name] - error).max() < 1e-13


def test_attributes_and_units() -> None:
    found, _ = sampled("hexapod")
    assert list(found.data_vars) == [
        *monte_carlo.SCHEMA,
        *monte_carlo.MACHINE,
        *monte_carlo.ELLIPSE,
    ]
    for schema in (monte_carlo.SCHEMA, monte_carlo.MACHINE, monte_carlo.ELLIPSE):
        for name, variable in schema.items():
            assert found[name].dims == variable.dims
    assert found.attrs["seed"] == SEED
    assert found.attrs["probability"] == 0.95
    assert found.attrs["sampling"] == "random"
    assert found.attrs["digits"] == 0
    assert found.attrs["interrupted"] == 0
    assert found["mean"].attrs["units"] == "m, rad"
    assert found.ellipse.attrs["units"] == "m^2"


def test_a_seed_gives_one_result_and_another_another() -> None:
    machine = load("planar_two_slider")
    pose = machine.poses()[:1]
    one, same, other = (tp.monte_carlo(machine, pose, 3000, seed) for seed in (1, 1, 2))
    xr.testing.assert_identical(one, same)
    assert not np.allclose(one["mean"], other["mean"], rtol=1e-9)
    largest = tp.monte_carlo(machine, pose, 3000, 2**64 - 1)
    assert np.isfinite(largest["mean"]).all()


def test_a_pose_is_the_same_whatever_else_is_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    machine = load("hexapod")
    poses = machine.poses()[:5]
    whole = tp.monte_carlo(machine, poses, 25_000)
    alone = tp.monte_carlo(machine, poses[3:4], 25_000)
    xr.testing.assert_allclose(alone.isel(pose=0, drop=True), whole.isel(pose=3, drop=True))
    monkeypatch.setattr(monte_carlo, "POSES", 2)
    monkeypatch.setattr("truepose.runs.poses.BLOCK", 3)
    xr.testing.assert_allclose(tp.monte_carlo(machine, poses, 25_000), whole, rtol=1e-9)


def test_the_error_is_about_the_known_part_and_inside_its_bound() -> None:
    machine = load("planar_two_slider")
    found, bound = tp.monte_carlo(machine, samples=5000), tp.bounds(machine)
    assert (found.minimum >= bound.lower).all()
    assert (found.maximum <= bound.upper).all()
    linear = tp.uncertainty(machine)
    near = FAR * linear.standard_uncertainty / np.sqrt(5000)
    assert (np.abs(found["mean"] - linear.value) < near + 1e-6).all()
    assert np.allclose(found.standard_deviation, linear.standard_uncertainty, rtol=0.04)


# Struts of 500 -+ 160 mm between carriages 600 mm apart do not always meet.
LOOSE = edited(
    PLANAR,
    ("length = 500\nsection", "length = 500\nlength_tolerance = 160\nsection"),
    ("[-0.3, 0.3]", "[-160, 160]"),
)


def test_samples_that_fail_are_counted(tmp_path: Path) -> None:
    machine = load_text(tmp_path, LOOSE)
    found = tp.monte_carlo(machine, [[0.3, 0.2], [0.12, 0.2]], 20_000)
    assert (found.failed + found.samples == 20_000).all()
    assert int(found.failed[1]) > 0
    for name in ("mean", "standard_deviation", "lower", "upper", "ellipse", "magnitude_upper"):
        assert np.isfinite(found[name]).all()


def test_progress_is_told() -> None:
    machine = load("planar_two_slider")
    seen: list[tuple[int, int]] = []
    poses = machine.poses()[:3]
    tp.monte_carlo(machine, poses, 15_000, progress=lambda *each: seen.append(each))
    assert seen[-1] == (45_000, 45_000)
    seen.clear()
    tp.monte_carlo(machine, poses, progress=lambda *each: seen.append(each))
    assert seen[0] == (30_000, 0)
    assert [done for done, _ in seen] == [30_000 * (at + 1) for at in range(len(seen))]
    # How many it takes is estimated from the second batch on, and known at the end.
    assert all(total >= done for done, total in seen[1:])
    assert seen[-1][0] == seen[-1][1]


def test_what_is_expected_is_about_what_it_takes() -> None:
    machine = load("hexapod")
    seen: list[tuple[int, int]] = []
    poses = machine.poses()[:3]
    found = tp.monte_carlo(machine, poses, digits=2, progress=lambda *each: seen.append(each))
    taken = int(found.samples.sum())
    assert len(seen) > 8
    assert seen[-1] == (taken, taken)
    half = next(total for done, total in seen if done >= 0.5 * taken)
    assert 0.5 * taken < half < 2.0 * taken


def test_as_many_as_are_needed() -> None:
    """Stable to two digits of the deviation, against a run of many more samples."""
    machine = load("hexapod")
    pose = machine.poses()[:2]
    found = tp.monte_carlo(machine, pose, seed=3, digits=2)
    assert found.attrs["digits"] == 2
    count = int(found.samples[0])
    assert (found.samples == count).all()
    assert count % 10_000 == 0
    assert 20_000 <= count < 3_000_000
    longer = tp.monte_carlo(machine, pose, 5_000_000, seed=99)
    # Half a unit of the second digit, which the rule holds at 95 % for each figure.
    unit = 10.0 ** (np.floor(np.log10(longer.standard_deviation)) - 1.0)
    for name in ("mean", "standard_deviation", "lower", "upper"):
        assert (np.abs(found[name] - longer[name]) < 1.5 * 0.5 * unit).all()


def test_more_digits_take_more_samples() -> None:
    inputs = {"x": Input.normal(0.0, 1.0), "y": Input.uniform(-1.0, 1.0)}

    def total(x: Array, y: Array) -> Array:
        return x + y

    counts = [int(tp.monte_carlo(total, inputs, digits=digits).samples) for digits in (1, 2)]
    assert counts[0] < counts[1]
    # Of a probability of 0.9999 a batch has more than 10 000 (JCGM 101:2008, 7.9.4).
    tail = tp.monte_carlo(total, inputs, digits=1, probability=0.9999)
    assert int(tail.samples) % 1_000_000 == 0


def test_what_does_not_vary_does_not_keep_it_going() -> None:
    inputs = {"x": Input.normal(2.0, 1.0), "y": Input.exact(3.0)}
    found = tp.monte_carlo(lambda x, y: {"varies": x, "is": y * 1.0}, inputs, digits=1)
    assert float(found.standard_deviation.sel(component="is")) < 1e-12
    assert float(found["mean"].sel(component="is")) == pytest.approx(3.0)
    assert int(found.samples) < 1_000_000


def test_it_ends_where_nothing_becomes_stable(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stopping_rule, "MOST", 50_000)
    heavy = {"x": Input.student_t(0.0, 1.0, 2.05)}
    assert int(tp.monte_carlo(lambda x: x**3, heavy, digits=4).samples) == 50_000


def test_sobol_points_agree_and_are_better() -> None:
    """The mean of a smooth function: its error falls nearly as 1 / n."""
    inputs = {f"x{at}": Input.uniform(0.0, 1.0) for at in range(4)}
    inputs["n"] = Input.normal(0.0, 1.0)

    def smooth(n: Array, **x: Array) -> Array:
        return np.exp(0.3 * n) * np.prod([1.0 + 0.5 * (each - 0.5) for each in x.values()], axis=0)

    exact = np.exp(0.045)
    errors: dict[str, list[float]] = {"random": [], "sobol": []}
    for sampling, found in errors.items():
        for seed in range(8):
            result = tp.monte_carlo(smooth, inputs, 2**12, seed, sampling=sampling)
            found.append(abs(float(result["mean"].squeeze()) - exact))
    assert max(errors["sobol"]) < 0.25 * max(errors["random"])
    assert max(errors["sobol"]) < 2e-3


def test_sobol_points_of_a_machine() -> None:
    machine = load("hexapod")
    pose = machine.poses()[:2]
    found = tp.monte_carlo(machine, pose, 2**16, sampling="sobol")
    many = tp.monte_carlo(machine, pose, 2_000_000)
    deviation = many.standard_deviation
    assert found.attrs["sampling"] == "sobol"
    assert (np.abs(found["mean"] - many["mean"]) < FAR * deviation / np.sqrt(2_000_000)).all()
    assert np.allclose(found.standard_deviation, deviation, rtol=0.01)
    assert (np.abs(found.upper - many.upper) < 0.05 * deviation).all()


def test_sobol_points_of_correlated_inputs() -> None:
    inputs = {"x": Input.normal(0.0, 1.0), "y": Input.uniform(-1.0, 1.0), "z": Input.normal(0.0, 2)}
    found = tp.monte_carlo(
        lambda x, y, z: {"x": x, "y": y, "z": z},
        inputs,
        2**14,
        correlation={("x", "y"): 0.5, ("x", "z"): -0.3},
        sampling="sobol",
    )
    deviation = found.standard_deviation.values
    r = found.covariance.values / np.outer(deviation, deviation)
    assert r == pytest.approx(np.array([[1, 0.5, -0.3], [0.5, 1, 0], [-0.3, 0, 1]]), abs=0.005)
    assert deviation == pytest.approx([1.0, 1.0 / np.sqrt(3.0), 2.0], rel=0.002)


class Stop:
    """A look at progress that presses Ctrl-C after so many times."""

    def __init__(self, times: int) -> None:
        self.times, self.done = times, 0

    def __call__(self, done: int, total: int) -> None:
        self.times -= 1
        self.done = done
        if self.times <= 0:
            raise KeyboardInterrupt


@pytest.fixture
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    """Batches of 10 000 samples, whatever the poses."""
    monkeypatch.setattr(stopping_rule, "SLICE", 1)


@pytest.mark.usefixtures("short")
def test_ctrl_c_gives_the_result_so_far() -> None:
    machine = load("planar_two_slider")
    pose = machine.poses()[:2]
    found = tp.monte_carlo(machine, pose, 1_000_000, progress=Stop(3))
    assert found.attrs["interrupted"] == 1
    assert found.samples.values.tolist() == [30_000, 30_000]
    fewer = tp.monte_carlo(machine, pose, 30_000)
    assert fewer.attrs["interrupted"] == 0
    xr.testing.assert_equal(found, fewer)


def test_ctrl_c_of_a_run_of_as_many_as_needed() -> None:
    machine = load("planar_two_slider")
    found = tp.monte_carlo(machine, machine.poses()[:1], digits=4, progress=Stop(4))
    assert found.attrs["interrupted"] == 1
    assert found.samples.values.tolist() == [40_000]


@pytest.mark.usefixtures("short")
def test_ctrl_c_of_a_function() -> None:
    found = tp.monte_carlo(lambda x: x, {"x": Input.uniform(0, 1)}, 10**6, progress=Stop(2))
    assert found.attrs["interrupted"] == 1
    assert int(found.samples) == 20_000


def test_ctrl_c_among_poses_gives_those_that_are_done(monkeypatch: pytest.MonkeyPatch) -> None:
    machine = load("planar_two_slider")
    monkeypatch.setattr(monte_carlo, "POSES", 2)
    found = tp.monte_carlo(machine, machine.poses()[:6], 5000, progress=Stop(2))
    assert found.attrs["interrupted"] == 1
    whole = tp.monte_carlo(machine, machine.poses()[:6], 5000)
    size = np.square(whole.standard_deviation).sum("component").values
    parts = np.argsort(-size.reshape(3, 2).max(axis=1))[:2]
    assert found.pose.values.tolist() == sorted(2 * int(k) + j for k in parts for j in (0, 1))
    assert found.samples.values.tolist() == [5000] * 4
    xr.testing.assert_allclose(
        found.standard_deviation, whole.standard_deviation.isel(pose=found.pose.values)
    )


def test_ctrl_c_before_any_sample_passes(monkeypatch: pytest.MonkeyPatch) -> None:
    def pressed(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(f"{machine_sampler.__name__}.MachineSampler.begin", pressed)
    monkeypatch.setattr(f"{monte_carlo.__name__}._FunctionSampler.sample", pressed)
    machine = load("planar_two_slider")
    with pytest.raises(KeyboardInterrupt):
        tp.monte_carlo(machine, machine.poses()[:1], 1000)
    with pytest.raises(KeyboardInterrupt):
        tp.monte_carlo(lambda x: x, {"x": Input.uniform(0, 1)}, 1000)


def test_a_function_is_sampled_as_numpy_does() -> None:
    inputs = {"x": Input.normal(1.0, 0.2), "y": Input.uniform(2.0, 4.0)}

    def both(x: Array, y: Array) -> dict[str, Array]:
        return {"product": x * y, "sine": np.sin(x)}

    found = tp.monte_carlo(both, inputs, 30_000, 11)
    t = Random(FunctionModel(both, inputs), 11).rows(0, 30_000)
    # A normal input's band is taken as some of its standard deviations.
    x, y = (one.centre + one.half * t[:, at] for at, one in enumerate(inputs.values()))
    assert x.std() == pytest.approx(0.2, rel=0.02)
    values = np.stack([x * y, np.sin(x)], axis=1)
    assert found["mean"].values == pytest.approx(values.mean(axis=0), rel=1e-12)
    assert found.covariance.values == pytest.approx(np.cov(values.T), rel=1e-9)
    assert found.minimum.values == pytest.approx(values.min(axis=0), rel=1e-14)
    near = values.std(axis=0) / 45.0
    assert (np.abs(found.lower - np.quantile(values, 0.025, axis=0)) < near).all()
    assert (np.abs(found.upper - np.quantile(values, 0.975, axis=0)) < near).all()
    assert found["component"].values.tolist() == ["product", "sine"]
    assert "pose" not in found.dims
    assert "ellipse" not in found
    assert xr.Dataset.identical(found, tp.monte_carlo(both, inputs=inputs, samples=30_000, seed=11))


def test_a_function_that_is_not_finite_everywhere() -> None:
    inputs = {"x": Input.uniform(-1.0, 3.0)}
    found = tp.monte_carlo(lambda x: np.sqrt(x), inputs, 20_000)
    assert int(found.samples) + int(found.failed) == 20_000
    assert int(found.failed) == pytest.approx(5000, abs=FAR * np.sqrt(20_000 * 0.25 * 0.75))
    assert float(found["mean"].squeeze()) == pytest.approx(2.0 / np.sqrt(3.0), abs=0.02)


def test_large_and_tiny_values_of_a_function() -> None:
    found = tp.monte_carlo(
        lambda x: {"large": 1e12 + x, "tiny": 1e-30 * x, "wide": np.exp(20.0 * x)},
        {"x": Input.normal(0.0, 1.0)},
        100_000,
    )
    deviation = found.standard_deviation.values
    assert deviation[:2] == pytest.approx([1.0, 1e-30], rel=0.02)
    assert found.upper.values[:2] - [1e12, 0.0] == pytest.approx([1.96, 1.96e-30], rel=0.03)
    assert (found["quantile"].diff("level") >= 0.0).all()


def test_a_function_of_correlated_inputs() -> None:
    inputs = {"x": Input.normal(0.0, 1.0), "y": Input.normal(0.0, 1.0), "z": Input.normal(0.0, 3.0)}
    found = tp.monte_carlo(
        lambda x, y, z: {"sum": x + y, "z": z}, inputs, 200_000, correlation={("x", "y"): 0.5}
    )
    assert found.standard_deviation.values == pytest.approx([np.sqrt(3.0), 3.0], rel=0.01)


def code_of(call: Callable[..., Any], *arguments: Any, **named: Any) -> str:
    with pytest.raises(RequestError) as caught:
        call(*arguments, **named)
    return caught.value.problems[0].code


@pytest.mark.parametrize(
    ("named", "code"),
    [
        ({"samples": 0}, "bad-samples"),
        ({"samples": 1}, "bad-samples"),
        ({"samples": -5}, "bad-samples"),
        ({"samples": 1.5}, "bad-samples"),
        ({"samples": "many"}, "bad-samples"),
        ({"probability": 0.0}, "bad-probability"),
        ({"probability": 1.0}, "bad-probability"),
        ({"probability": 95}, "bad-probability"),
        ({"probability": float("nan")}, "bad-probability"),
        ({"probability": "0.95"}, "bad-probability"),
        ({"seed": -1}, "bad-seed"),
        ({"seed": 2**64}, "bad-seed"),
        ({"seed": 1.0}, "bad-seed"),
        ({"seed": None}, "bad-seed"),
        ({"digits": 0}, "bad-digits"),
        ({"digits": 1.5}, "bad-digits"),
        ({"sampling": "halton"}, "bad-sampling"),
        ({"sampling": "sobol"}, "bad-samples"),
        ({"sampling": "sobol", "samples": 1000}, "bad-samples"),
        ({"sampling": "sobol", "samples": 0}, "bad-samples"),
    ],
    ids=str,
)
def test_bad_numbers(named: dict[str, Any], code: str) -> None:
    machine = load("planar_two_slider")
    assert code_of(tp.monte_carlo, machine, machine.poses()[:1], **named) == code
    assert code_of(tp.monte_carlo, lambda x: x, {"x": Input.uniform(0, 1)}, **named) == code


def test_bad_requests(tmp_path: Path) -> None:
    machine = load("planar_two_slider")
    assert code_of(tp.monte_carlo, machine, [[1.0]]) == "bad-poses"
    assert code_of(tp.monte_carlo, machine, [[9.0, 9.0]]) == "no-pose-left"
    assert code_of(tp.monte_carlo, load_text(tmp_path, HEXAPOD)) == "no-source"
    assert code_of(tp.monte_carlo, lambda x: x, {}) == "no-input"
    assert code_of(tp.monte_carlo, lambda x: x, None) == "no-input"
    assert code_of(tp.monte_carlo, 3.0, {"x": Input.uniform(0, 1)}) == "bad-function"
    never = {"x": Input.uniform(-1.0, 1.0)}
    with np.errstate(invalid="ignore"):
        assert (
            code_of(tp.monte_carlo, lambda x: np.where(x == 0.0, 1.0, np.nan), never, 100)
            == "bad-samples"
        )


def test_sobol_points_without_their_package(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "scipy.stats", None)
    machine = load("planar_two_slider")
    code = code_of(tp.monte_carlo, machine, machine.poses()[:1], 1024, sampling="sobol")
    assert code == "extra-missing"


def test_digits_have_one_default() -> None:
    """The command and the function stop at the same number of samples."""
    option = next(each for each in command.params if each.name == "digits")
    assert option.default == inspect.signature(tp.monte_carlo).parameters["digits"].default == 1
    machine = load("planar_two_slider")
    assert tp.monte_carlo(machine, machine.poses()[:1]).attrs["digits"] == 1
