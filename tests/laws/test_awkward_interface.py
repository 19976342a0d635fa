"""Every public function and method, given what it does not take: a result, or a sentence.

Neither a panic of the kernel nor an exception from the inside. What is called is read off the
package, so that a new function fails here until somebody says how it is called.
"""

from __future__ import annotations

import inspect
import os
import pathlib
import tempfile
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import truepose as tp
from build_machine import MACHINES
from designs import file_with
from truepose.errors import PoseError, TrueposeError

EXAMPLES = int(os.environ.get("TRUEPOSE_EXAMPLES", "60"))
"""Of each function; any number, once."""

MACHINE = tp.load(MACHINES / "planar_two_slider.toml")
POSE = MACHINE.poses()[:1]


def costed() -> tp.Machine:
    """A machine whose file says what may be chosen."""
    with tempfile.TemporaryDirectory() as folder:
        return tp.load(file_with(pathlib.Path(folder), "planar_two_slider"))


COSTED = costed()
JOINTS = MACHINE.inverse(POSE)


def awkward_arrays() -> st.SearchStrategy[Any]:
    """Arrays, and what some take for arrays."""
    numbers = st.sampled_from(
        [0.0, -0.0, 0.3, 1.0, np.nan, np.inf, -np.inf, 1e308, -1e308, 5e-324, 1e-300, 2**53]
    )
    shapes = st.sampled_from(
        [(), (0,), (1,), (2,), (3,), (6,), (0, 2), (1, 2), (2, 2), (3, 6), (2, 1, 2), (1, 2, 1, 2)]
    )

    @st.composite
    def arrays(draw: st.DrawFn) -> np.ndarray:
        shape = draw(shapes)
        size = int(np.prod(shape))
        values = np.array([draw(numbers) for _ in range(size)]).reshape(shape)
        form = draw(st.sampled_from(range(9)))
        if form == 1:
            return np.asfortranarray(values)
        if form == 2:
            return np.repeat(values, 2, axis=-1)[..., ::2] if values.ndim else values
        if form == 3:
            return values.astype(">f8")
        if form == 4:
            values.flags.writeable = False
        if form == 5:
            return values.astype(complex)
        if form == 6:
            return values.astype(object)
        if form == 7:
            return np.ma.masked_invalid(values)
        if form == 8:
            with np.errstate(all="ignore"):
                return values.astype(np.float32)
        return values

    others: list[Any] = [
        None, "text", b"bytes", 5, 0, -1, True, 1j, 10**400, float("nan"), [], {}, (), [[0.3, 0.2]],
        [[0.3], [0.2, 0.1]], [None, 0.2], ["a", "b"], {"x": 0.3}, object(), np.datetime64("2026"),
        np.array(["a", "b"]), np.zeros((2, 0)), range(2), iter([0.3, 0.2]), pathlib.Path("none"),
        MACHINE, MACHINE.condition, lambda *given: 0.0, np.zeros((0, 0, 0, 2)), "\0", "x=",
    ]  # fmt: skip
    return st.one_of(arrays(), st.sampled_from(others))


FEW = {"monte_carlo": {"samples": 20}, "shares": {"samples": 200}}
"""What keeps a call short that has all else right."""


def instrument() -> Any:
    from truepose.calibration.planning.instruments import instruments_named

    return instruments_named(MACHINE, "position=10um")


FUNCTIONS: dict[str, tuple[Callable[..., Any], Mapping[str, Any]]] = {
    name: (getattr(tp, name), {"machine": MACHINE, "poses": POSE})
    for name in ("accuracy", "bounds", "budget", "compensate", "over_time", "strain")
} | {
    name: (getattr(tp, name), {"model": MACHINE, "poses": POSE, **FEW.get(name, {})})
    for name in ("monte_carlo", "shares", "uncertainty", "worst_case")
} | {
    "allocate": (tp.allocate, {"machine": COSTED}),
    "circular_test": (
        tp.circular_test,
        {
            "machine": MACHINE, "radius": 0.05, "centre": {"x": 0.3, "y": 0.2}, "step": 0.1,
            "samples": 100,
        },
    ),
    "check": (tp.check, {"machine": MACHINE}),
    "compare": (tp.compare, {"old": MACHINE, "new": MACHINE, "poses": POSE}),
    "calibrate": (tp.calibrate, {"machine": MACHINE, "data": "none.csv", "folds": 2}),
    "correct_program": (
        tp.correct_program, {"machine": MACHINE, "source": "none.ngc", "target": None},
    ),
    "export": (tp.export, {"machine": MACHINE, "name": "c"}),
    "report": (tp.report, {"machine": MACHINE, "output": "none.txt"}),
    "Machine.plot": (MACHINE.plot, {"figure": "nothing"}),
    "part": (tp.part, {"machine": MACHINE, "program": "none.ngc"}),
    "plan": (
        tp.plan, {"machine": MACHINE, "instrument": instrument(), "budget": 3, "starts": 1},
    ),
    "study": (
        tp.study,
        {
            "machine": MACHINES / "planar_two_slider.toml",
            "vary": ["condition.temperature=20,30 degC"], "quantities": ["error"],
        },
    ),
    "forward_solutions": (
        tp.forward_solutions, {"machine": MACHINE, "joints": JOINTS[0], "starts": 10},
    ),
    "inverse_solutions": (tp.inverse_solutions, {"machine": MACHINE, "pose": POSE[0]}),
    "import_machine": (tp.import_machine, {"path": "none.cfg"}),
    "oddities": (tp.oddities, {"machine": MACHINE}),
    "tightening": (tp.tightening, {"machine": MACHINE}),
    "load": (tp.load, {"path": MACHINES / "planar_two_slider.toml"}),
    "threads": (tp.threads, {}),
    "Condition": (tp.Condition, {}),
    "Condition.replace": (MACHINE.condition.replace, {}),
    "Condition.temperature": (MACHINE.condition.temperature, {"part": "strut.1"}),
    "Input": (tp.Input, {"centre": 0.0, "half": 1.0}),
    "Machine.replace": (MACHINE.replace, {}),
    "Machine.with_condition": (MACHINE.with_condition, {}),
    "Machine.check_condition": (MACHINE.check_condition, {}),
    "Machine.stiffness": (MACHINE.stiffness, {"poses": POSE}),
    "Machine.compliance": (MACHINE.compliance, {"poses": POSE}),
    "Machine.compliances": (MACHINE.compliances, {}),
    "Machine.inverse": (MACHINE.inverse, {}),
    "Machine.forward": (MACHINE.forward, {"joints": JOINTS}),
}  # fmt: skip

NO_ARGUMENT = {"poses", "pose_table", "joint_units"}
"""Methods of a machine without any."""


def test_every_public_function_and_method_is_here() -> None:
    public = {
        name
        for name in tp.__all__
        if callable(getattr(tp, name)) and not inspect.isclass(getattr(tp, name))
    }
    assert public <= set(FUNCTIONS)
    methods = {
        name
        for name in dir(MACHINE)
        if not name.startswith("_") and callable(getattr(MACHINE, name)) and name not in NO_ARGUMENT
    }
    kernel = {name for name in methods if name in type(MACHINE.kernel).__dict__}
    tested = {name.partition(".")[2] for name in FUNCTIONS if name.startswith("Machine.")}
    assert methods - kernel <= tested


def parameters_of(name: str) -> list[str]:
    function, _ = FUNCTIONS[name]
    if name == "Machine.forward":
        return ["joints", "start"]
    if name in ("Machine.inverse", "Machine.stiffness", "Machine.compliance"):
        return ["poses"]
    if name == "threads":
        return ["n"]
    return list(inspect.signature(function).parameters)


@pytest.mark.parametrize("name", sorted(FUNCTIONS))
def test_awkward_arguments_get_a_result_or_a_sentence(name: str) -> None:
    function, right = FUNCTIONS[name]
    names = parameters_of(name)
    before = tp.threads()
    told: list[str] = []

    @settings(
        max_examples=EXAMPLES, deadline=None, derandomize=True, database=None,
        suppress_health_check=list(HealthCheck),
    )  # fmt: skip
    @given(st.sampled_from(names), awkward_arrays())
    def call(parameter: str, value: Any) -> None:
        given = dict(right)
        given[parameter] = value
        try:
            with np.errstate(all="ignore"):
                function(**given)
        except (TrueposeError, PoseError) as refusal:
            told.append(str(refusal))

    try:
        call()
    finally:
        tp.threads(before)
    assert told
    assert all(told)
