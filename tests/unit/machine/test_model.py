"""The machine as an object: immutable, picklable, its calls and its replacements."""

from __future__ import annotations

import dataclasses
import pickle
from pathlib import Path

import numpy as np
import pytest

from guided_machines import guided
from machine_texts import HEXAPOD, PLANAR, edited, load_text
from truepose.errors import PoseError, RequestError
from truepose.machine import Condition, Envelope, Machine, load
from truepose.machine.temperature_log import TemperatureLog
from truepose.sources import REGISTRY

STIFF = ("platform = [90, 80, 0]", 'platform = [90, 80, 0]\nstiffness = "100 N/um"')


@pytest.fixture(name="planar")
def planar_machine(tmp_path: Path) -> Machine:
    return load_text(tmp_path, PLANAR)


@pytest.fixture(name="hexapod")
def hexapod_machine(tmp_path: Path) -> Machine:
    return load_text(tmp_path, HEXAPOD, 'strut.*.stiffness="100 N/um"')


def test_forward_is_the_kernels_own_method(planar: Machine) -> None:
    assert planar.forward == planar.kernel.forward
    assert type(planar.forward).__name__ == "builtin_function_or_method"


def test_it_cannot_be_changed(planar: Machine) -> None:
    with pytest.raises(dataclasses.FrozenInstanceError):
        planar.name = "other"
    with pytest.raises(dataclasses.FrozenInstanceError):
        planar.condition.force = (0, 0, 1)
    with pytest.raises(TypeError):
        planar.settings["a"] = "b"
    with pytest.raises(TypeError):
        planar.drives[0].fields["offset"] = 1.0
    with pytest.raises(TypeError):
        planar.condition.part_temperatures["strut.1"] = 300.0
    poses = planar.poses()
    poses[:] = 0
    assert planar.poses().any()


def test_it_comes_back_from_a_pickle(planar: Machine) -> None:
    changed = planar.replace({"strut.1.length": 0.5003})
    again = pickle.loads(pickle.dumps(changed))  # noqa: S301
    assert again.nominal == pytest.approx(changed.nominal, abs=0)
    assert again.file_hash == planar.file_hash
    assert again.condition == changed.condition
    assert again.replaced == {"strut.1.length": 0.5003}
    assert (again.inverse(again.poses()) == changed.inverse(changed.poses())).all()
    assert [source.name for source in again.sources] == [source.name for source in planar.sources]


def test_replace(planar: Machine) -> None:
    changed = planar.replace({"strut.1.length": 0.5003}).replace({"tool.x": 0.001})
    index = planar.parameters.index("strut.1.length")
    assert changed.nominal[index] == 0.5003
    assert planar.nominal[index] == 0.5
    assert changed.replaced == {"strut.1.length": 0.5003, "tool.x": 0.001}
    assert changed.inverse([0.3, 0.2]) != pytest.approx(planar.inverse([0.3, 0.2]), abs=1e-6)
    back = changed.replace({"strut.1.length": 0.5, "tool.x": 0.0})
    assert back.inverse([0.3, 0.2]) == pytest.approx(planar.inverse([0.3, 0.2]), abs=1e-15)


def test_replace_names_every_parameter_that_is_none(planar: Machine) -> None:
    with pytest.raises(RequestError) as caught:
        planar.replace(
            {
                "strut.1.lenght": 0.5,
                "nothing": 1.0,
                "strut.2.length": np.nan,
                "strut.1.length": -0.5,
                "drive.d1.scale": 0.0,
                "drive.d1.offset": -0.5,
            }
        )
    problems = caught.value.problems
    assert [problem.code for problem in problems] == [
        "unknown-parameter",
        "unknown-parameter",
        "not-finite",
        "not-positive",
        "not-positive",
    ]
    assert problems[0].hint == 'did you mean "strut.1.length"?'


def test_conditions(planar: Machine) -> None:
    warm = planar.condition.replace(temperature={"strut.1": 320.0}, force=[1, 2, 3])
    assert warm.temperature("strut.1") == 320.0
    assert warm.temperature("strut.2") == planar.condition.temperature("strut.2")
    assert warm.wrench == pytest.approx([1, 2, 3, 0, 0, 0])
    assert warm.moment == planar.condition.moment
    even = warm.replace(temperature=300.0, reference_temperature=290.0)
    assert even.temperature_rise("strut.1") == 10.0
    assert planar.with_condition(even).condition is even
    assert pickle.loads(pickle.dumps(warm)) == warm  # noqa: S301


@pytest.mark.parametrize(
    "wrong",
    [
        {"temperature": -1.0},
        {"temperature": {"strut.1": float("nan")}},
        {"reference_temperature": 0.0},
        {"force": (0.0, float("inf"), 0.0)},
        {"force": (0.0, 1.0)},
        {"moment": (0.0, 1.0, 2.0, 3.0)},
        {"acceleration": (0.0, 1.0)},
        {"gravity": -9.81},
        {"gradient": {"strut.1": (1.0, 2.0)}},
        {"gradient": {"strut.1": float("inf")}},
        {"gradient": {"strut.1": (1.0, 2.0, 0.0)}},
        {"gradient": {"frame": 3.0}},
        {"envelope": -1.0},
        {"envelope": float("nan")},
        {"time": float("nan")},
    ],
)
def test_a_condition_that_cannot_be(wrong: dict) -> None:
    with pytest.raises(RequestError) as caught:
        Condition().replace(**wrong)
    assert caught.value.problems[0].code == "bad-condition"


def test_an_envelope_is_a_plane_or_all_directions() -> None:
    with pytest.raises(RequestError):
        Envelope(10.0, (0.0, 0.0, 0.0))
    assert np.array_equal(Envelope(10.0).directions, np.eye(3))
    given = Condition().replace(envelope=Envelope(10.0, (0, 0, 2)))
    assert given.envelope == Envelope(10.0, (0.0, 0.0, 1.0))
    assert given.replace(force=(1, 0, 0)).envelope == given.envelope


def test_gradients_and_logs(planar: Machine) -> None:
    log = TemperatureLog(
        np.array([0.0, 10.0]),
        {"strut.1": np.array([300.0, 310.0]), "default": np.array([295.0, 297.0])},
    )
    given = planar.condition.replace(
        temperature_log=log, gradient={"strut.1": 4, "frame": (0, 0, 2)}
    )
    assert given.gradient("strut.1") == (4.0, 0.0, 0.0)
    assert (given.gradient("frame"), given.gradient("tool")) == ((0, 0, 2), (0, 0, 0))
    assert given.temperature("strut.1") == 310.0, "the last of the log"
    assert given.replace(time=5.0).temperature("strut.1") == 305.0
    assert given.temperature("strut.1", [0.0, 2.5]) == pytest.approx([300.0, 302.5])
    assert given.temperature_rise("frame", [5.0]) == pytest.approx([296.0 - 293.15])
    own = given.replace(temperature={"strut.2": 280.0})
    assert own.temperature("strut.2") == 280.0, "what the condition names goes before the log"
    assert own.temperature("strut.2", [0.0]) == 280.0
    assert given.replace(temperature=280.0).temperature("strut.1") == 280.0
    others = given.replace(temperature={"default": 280.0})
    assert others.temperature("strut.2") == others.temperature("strut.2", [0.0]) == 280.0
    assert others.temperature("strut.1") == 310.0, "still that of the log"
    assert log.without("strut.1") is not None
    bare = TemperatureLog(log.times, {"default": log.temperatures["default"]})
    alone = given.replace(temperature_log=bare).replace(temperature={"default": 280.0})
    assert (alone.temperature_log, alone.temperature("strut.1")) == (None, 280.0)
    assert planar.with_condition(given).condition is given
    again = pickle.loads(pickle.dumps(given))  # noqa: S301
    assert again.temperature("strut.1") == 310.0


def test_compliances(planar: Machine) -> None:
    columns, found = planar.compliances(np.array([[0.5, 0.25], [1.0, 2.0]]))
    assert columns.tolist() == planar.kernel.length_parameters.tolist()
    assert found == pytest.approx(np.array([[0.5, 0.25], [1.0, 2.0]]) / (28e-6 * 210e9))
    assert planar.stiffness_known.tolist() == [True, True]


def test_stiffness_of_a_single_strut_direction(planar: Machine) -> None:
    """Two struts: K = sum of EA/L times the outer product of each strut's direction."""
    pose = np.array([0.3, 0.2])
    joints = planar.inverse(pose)
    carriages = np.array([[0.0, joints[0]], [0.6, joints[1]]])
    directions = (pose - carriages) / 0.5
    axial = 28e-6 * 210e9 / 0.5
    expected = axial * directions.T @ directions
    assert planar.stiffness(pose) == pytest.approx(expected, rel=1e-9, abs=1e-9 * axial)
    assert planar.compliance(pose) == pytest.approx(
        np.linalg.inv(expected), rel=1e-9, abs=1e-9 / axial
    )


def test_stiffness_keeps_the_leading_shape(hexapod: Machine) -> None:
    poses = hexapod.poses().reshape(2, -1, 6)
    stiffness, status = hexapod.stiffness(poses, status=True)
    assert stiffness.shape == (*poses.shape[:-1], 6, 6)
    assert status.shape == poses.shape[:-1]
    assert not status.any()
    assert stiffness == pytest.approx(np.swapaxes(stiffness, -1, -2), rel=1e-9, abs=1e-3)
    identity = stiffness @ hexapod.compliance(poses)
    assert identity == pytest.approx(np.broadcast_to(np.eye(6), identity.shape), abs=1e-8)
    assert hexapod.stiffness(poses[0, 0]).shape == (6, 6)


def test_poses_that_cannot_be_used(hexapod: Machine) -> None:
    poses = np.zeros((3, 6))
    poses[:, 2] = [0.65, 5.0, 0.65]
    with pytest.raises(PoseError) as caught:
        hexapod.stiffness(poses)
    assert (caught.value.count, caught.value.index) == (1, 1)
    _, status = hexapod.compliance(poses, status=True)
    assert status.astype(bool).tolist() == [False, True, False]


def test_no_stiffness_without_a_strut_that_gives_it(tmp_path: Path) -> None:
    machine = load_text(tmp_path, edited(HEXAPOD, STIFF))
    assert machine.stiffness_known.tolist() == [True] + [False] * 5
    _, compliance = machine.compliances(np.ones(6))
    assert compliance[0] == pytest.approx([1e-8, 0, 0, 0, 0, 0])
    with pytest.raises(RequestError) as caught:
        machine.stiffness(machine.poses())
    assert caught.value.problems[0].code == "no-stiffness"
    assert "2, 3, 4, 5, 6" in caught.value.problems[0].message


def test_a_platform_that_a_guide_holds_has_a_compliance_but_no_stiffness() -> None:
    machine = load(guided("tricept"), registry=REGISTRY)
    poses = machine.poses()[:2]
    assert np.isfinite(machine.compliance(poses)).all()
    with pytest.raises(PoseError) as caught:
        machine.stiffness(poses)
    assert "the stiffness is infinite" in caught.value.reason
