"""Models: a machine at a pose and a plain function, seen alike."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import truepose as tp
from machine_texts import PLANAR, edited, load_text
from made_source import MadeSource, random_deviation, with_sources
from truepose.errors import RequestError
from truepose.runs.dataset import Variable
from truepose.uncertainty_analysis.functions.dataset import function_dataset
from truepose.uncertainty_analysis.functions.inputs import Input
from truepose.uncertainty_analysis.model import FunctionModel, MachineModel, models

MACHINES = Path(__file__).parents[3] / "machines"
PLANAR_FILE = MACHINES / "planar_two_slider.toml"


# --- machines


@pytest.mark.parametrize("name", ["planar_two_slider", "hexapod"])
def test_the_linear_model_is_the_slope_of_the_exact_one(name: str) -> None:
    machine = tp.load(MACHINES / f"{name}.toml")
    # No shifts: the sensitivities are those of the nominal machine.
    source = MadeSource("made", random_deviation(machine, 3, shift=False))
    machine = with_sources(machine, source)
    _, model = next(iter(models(machine)))
    law = model.linear()
    count = len(model.names)
    assert law.effects.shape == (len(machine.components), count)
    step = 1e-3
    ahead, fine = model.evaluate(step * np.eye(count))
    behind, _ = model.evaluate(-step * np.eye(count))
    assert fine.all()
    slope = (ahead - behind).T / (2.0 * step)
    assert np.allclose(slope, law.effects, rtol=1e-6, atol=1e-6 * np.abs(law.effects).max())
    # Two roads of the kernel to one pose, up to rounding.
    assert np.allclose(law.value, model.evaluate(np.zeros((1, count)))[0][0], rtol=0, atol=1e-15)


def test_corners_of_one_source_are_the_edges_of_the_budget() -> None:
    """The paper's machine: a length tolerance alone, both struts at one end."""
    machine = tp.load(PLANAR_FILE)
    machine = with_sources(machine, *(s for s in machine.sources if s.name == "tolerance"))
    budget = tp.budget(machine)
    for number, model in models(machine):
        (row,) = np.flatnonzero(budget.pose == number)
        values, fine = model.evaluate(np.array([[-1.0, -1.0], [1.0, 1.0], [0.0, 0.0]]))
        assert fine.all()
        for value, name in zip(values, ("error_lower", "error_upper", "error"), strict=True):
            assert np.allclose(value, budget[name][row, 0], rtol=1e-12, atol=1e-15)


def test_a_machine_model_says_what_its_variables_are() -> None:
    machine = tp.load(PLANAR_FILE)
    number, model = next(iter(models(machine)))
    assert isinstance(model, MachineModel)
    assert model.names == ("strut.1.length", "strut.2.length")
    assert model.sources == ("tolerance", "tolerance")
    assert model.outputs == ("x", "y")
    assert model.output_units == ("m", "m")
    assert model.dofs.tolist() == [math.inf, math.inf]
    assert model.at.indices.tolist() == [number]
    assert np.array_equal(model.at.joints[0], model.block.joints[model.pose])
    assert np.array_equal(model.at.placements[0], model.block.placements[model.pose])


def test_more_samples_than_go_at_once() -> None:
    _, model = next(iter(models(tp.load(PLANAR_FILE))))
    t = np.random.default_rng(0).uniform(-1, 1, (8192 + 3, 2))
    whole, fine = model.evaluate(t)
    assert fine.all()
    assert np.array_equal(whole[-3:], model.evaluate(t[-3:])[0])
    assert model.evaluate(t[:0])[0].shape == (0, 2)


def test_a_sample_that_cannot_be_placed_is_not_fine() -> None:
    machine = tp.load(PLANAR_FILE)
    columns = [machine.parameters.index(f"strut.{n}.length") for n in "12"]
    machine = with_sources(machine, MadeSource("made", _half(columns, 0.45)))
    _, model = next(iter(models(machine)))
    _, fine = model.evaluate(np.array([[0.0, 0.0], [-1.0, -1.0]]))
    assert fine.tolist() == [True, False]


def _half(columns: list[int], half: float) -> Any:
    from truepose.sources import Deviation

    return Deviation.of(columns, half=half)


def test_poses_that_cannot_be_used_are_set_aside_and_counted() -> None:
    machine = tp.load(PLANAR_FILE)
    poses = np.array([[0.3, 0.2], [9.0, 9.0], [0.25, 0.2]])
    done: list[tuple[int, int]] = []
    each = models(machine, poses, progress=lambda at, total: done.append((at, total)))
    schema = {"value": Variable(("pose", "component"), "component", "error")}
    each.begin(schema)
    values = np.empty((2, 2))
    for _, model in each:
        values[model.pose] = model.linear().value
    each.fill(model.block, np.arange(2), {"value": values})
    assert done == [(1, 3), (2, 3), (3, 3)]
    found = each.dataset({})
    assert found.pose.values.tolist() == [0, 2]
    assert found.left_out_index.values.tolist() == [1]
    # two roads: the model's own linearisation, and the budget's pass in the kernel
    budget = tp.budget(machine, poses)
    assert np.allclose(found["value"], budget.overall_error, rtol=0, atol=1e-15)


def test_a_pose_that_is_left_out_later(tmp_path: Path) -> None:
    machine = tp.load(PLANAR_FILE)
    each = models(machine, [[0.3, 0.2]])
    schema = {"value": Variable(("pose", "component"), "component", "error")}
    each.begin(schema)
    for _, model in each:
        each.leave_out(model, 3)
    with pytest.raises(RequestError, match="no-pose-left"):
        each.dataset({})


def test_a_machine_without_sources(tmp_path: Path) -> None:
    text = edited(PLANAR, ("length_tolerance = [-0.3, 0.3]\n", ""), ("temperature = 35\n", ""),
                  ("force = { x = 1200, y = -1500 }\n", ""))  # fmt: skip
    with pytest.raises(RequestError, match="no-source"):
        models(load_text(tmp_path, text))


# --- functions


def end_gauge(ls: Any, d: Any, alpha_s: Any, d_alpha: Any, theta: Any, d_theta: Any) -> Any:
    """GUM H.1: length of an end gauge, nm."""
    return ls + d - ls * (d_alpha * theta + alpha_s * d_theta)


END_GAUGE = {
    "ls": Input.normal(50000623.0, 25.0, 18),
    "d": Input.normal(215.0, 9.7, 25.6),
    "alpha_s": Input.uniform(9.5e-6, 13.5e-6),
    "d_alpha": Input.uniform(-1e-6, 1e-6, 50),
    "theta": Input.normal(-0.1, 0.41),
    "d_theta": Input.uniform(-0.05, 0.05, 2),
}


def test_the_end_gauge_of_the_gum() -> None:
    model = FunctionModel(end_gauge, END_GAUGE)
    law = model.linear()
    assert law.value.tolist() == [50000838.0]
    half = [one.half for one in END_GAUGE.values()]
    # H.1.3: coefficients of first order at the estimates.
    slope = [1.0, 1.0, 0.0, 50000623.0 * 0.1, 0.0, -50000623.0 * 11.5e-6]
    assert np.allclose(law.effects[0], np.multiply(slope, half), rtol=1e-12, atol=1e-12)
    assert model.names == tuple(END_GAUGE)
    assert model.sources == model.names
    assert model.dofs.tolist() == [18.0, 25.6, math.inf, 50.0, math.inf, 2.0]
    assert model.outputs == ("value",)
    assert model.output_units == ("1",)
    assert model.numbers.tolist() == list(range(6))


def test_a_dict_of_outputs_and_correlated_inputs() -> None:
    """GUM H.2: resistance and reactance from voltage, current and phase."""

    def impedance(V: Any, I: Any, phi: Any) -> dict[str, Any]:  # noqa: E741
        return {"R": V / I * np.cos(phi), "X": V / I * np.sin(phi)}

    inputs = {
        "V": Input.normal(4.9990, 0.0032),
        "I": Input.normal(19.6610e-3, 0.0095e-3),
        "phi": Input.normal(1.04446, 0.00075),
    }
    pairs = {("V", "I"): -0.36, ("V", "phi"): 0.86, ("I", "phi"): -0.65}
    model = FunctionModel(impedance, inputs, pairs)
    assert model.outputs == ("R", "X")
    assert model.correlation is not None
    values, fine = model.evaluate(np.zeros((2, 3)))
    assert fine.all()
    assert np.allclose(values[0], [127.732, 219.847], atol=5e-4)
    assert np.allclose(model.linear().value, values[0], rtol=0, atol=0)


def test_a_sample_without_a_finite_value_is_not_fine() -> None:
    model = FunctionModel(lambda x: np.log(x), {"x": Input.uniform(-0.5, 1.5)})
    values, fine = model.evaluate(np.array([[0.0], [-1.0], [-0.5]]))
    assert fine.tolist() == [True, False, False]
    assert values[0, 0] == math.log(0.5)


def test_a_function_may_take_more_than_its_inputs() -> None:
    def scaled(x: Any, factor: float = 2.0) -> Any:
        return factor * x

    assert FunctionModel(scaled, {"x": Input.normal(1.0, 0.1)}).linear().value.tolist() == [2.0]
    takes_all = FunctionModel(lambda **named: named["x"] + 1, {"x": Input.normal(1.0, 0.1)})
    assert takes_all.linear().effects == pytest.approx(np.array([[0.3]]))


def test_a_function_that_writes_into_its_arguments_spoils_nothing() -> None:
    def greedy(x: Any) -> Any:
        x *= 2.0
        return x

    model = FunctionModel(greedy, {"x": Input.normal(1.0, 0.1)})
    t = np.ones((3, 1))
    assert model.evaluate(t)[0].tolist() == model.evaluate(t)[0].tolist()
    assert t.tolist() == [[1.0]] * 3


ONE = {"x": Input.normal(1.0, 0.1)}


@pytest.mark.parametrize(
    ("function", "inputs", "code", "words"),
    [
        ("text", ONE, "bad-function", "neither a machine nor a function"),
        (lambda x: math.sqrt(x), ONE, "bad-function", "np.sqrt for math.sqrt"),
        (lambda x: x if x > 0 else -x, ONE, "bad-function", "np.where for if"),
        (lambda x: 1.0, ONE, "bad-function", "shape ()"),
        (lambda x: x[:2], ONE, "bad-function", "shape (2,) where arrays of 3"),
        (lambda x: x.mean(), ONE, "bad-function", "one number for each sample"),
        (lambda x: np.stack([x, x]), ONE, "bad-function", "shape (2, 3)"),
        (lambda x: "text", ONE, "bad-function", "real numbers"),
        (lambda x: x + 1j, ONE, "bad-function", "real numbers"),
        (lambda x: [x, x[:1]], ONE, "bad-function", "real numbers"),
        (lambda x: None, ONE, "bad-function", "real numbers"),
        (lambda x: {}, ONE, "bad-function", "without an entry"),
        (lambda x: {1: x}, ONE, "bad-function", "named by text"),
        (lambda x: {"a": x, "b": 2.0}, ONE, "bad-function", "b: "),
        (lambda x: x / 0.0, ONE, "not-finite", "x = 1"),
        (lambda x: {"a": x, "b": np.log(-x)}, ONE, "not-finite", "found:    b"),
        (lambda x: x, {}, "no-input", "nothing"),
        (lambda x: x, [Input.exact(1.0)], "no-input", "type list"),
        (lambda x: x, None, "no-input", "nothing"),
        (lambda x: x, {"x": 1.0}, "wrong-type", "Input.exact(1.0)"),
        (lambda x: x, {"y": Input.exact(1.0)}, "unknown-input", "expected: x"),
        (lambda x, y: x, ONE, "unknown-input", "missing a required argument"),
    ],
)
def test_what_a_function_cannot_be(
    function: Callable[..., Any], inputs: Any, code: str, words: str
) -> None:
    with pytest.raises(RequestError) as caught:
        FunctionModel(function, inputs)
    (problem,) = caught.value.problems
    assert problem.code == code
    assert words in str(problem)


def test_correlations_that_cannot_be_are_refused() -> None:
    inputs = {name: Input.normal(0.0, 1.0) for name in "xyz"}
    pairs = {("x", "y"): 0.9, ("y", "z"): 0.9, ("x", "z"): -0.9}
    with pytest.raises(RequestError, match="correlation-not-semidefinite"):
        FunctionModel(lambda x, y, z: x + y + z, inputs, pairs)


def test_the_dataset_of_a_function() -> None:
    model = FunctionModel(end_gauge, END_GAUGE)
    schema = {
        "value": Variable(("pose", "component"), "component", "value"),
        "covariance": Variable(
            ("pose", "component", "other_component"), "covariance", "covariance"
        ),
        "samples": Variable(("pose",), "1", "samples", np.intp),
    }
    values = {"value": [1.0], "covariance": [[4.0]], "samples": 7}
    found = function_dataset(schema, values, model)
    assert found["value"].dims == ("component",)
    assert found["covariance"].dims == ("component", "other_component")
    assert found["samples"].dims == ()
    assert found.component.values.tolist() == ["value"]
    assert found["value"].attrs["units"] == "1"
    assert found.attrs["function"] == "end_gauge"
    assert "uniform" in found.attrs["inputs"]
