"""Error over time: a temperature log through the thermal source, against budgets of each moment."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from build_machine import MACHINES
from machine_texts import PLANAR, edited, load_text
from truepose.error_budget.evaluate import budget
from truepose.error_budget.over_time import over_time
from truepose.errors import RequestError, TrueposeError
from truepose.machine import Machine
from truepose.machine.temperature_log import TemperatureLog

REFERENCE = 293.15
TAU = 900.0


def heated(parts: dict[str, float], seconds: int = 3600) -> TemperatureLog:
    """A first-order heat-up at 1 Hz: each part goes to its final rise in K, with TAU in s."""
    times = np.arange(seconds + 1.0)
    share = 1.0 - np.exp(-times / TAU)
    return TemperatureLog(times, {part: REFERENCE + rise * share for part, rise in parts.items()})


@pytest.fixture(scope="module")
def hexapod() -> Machine:
    machine = tp.load(
        MACHINES / "hexapod.toml", ["platform.material=steel", "frame.material=steel"]
    )
    log = heated({f"strut.{i}": 4.0 + i for i in range(1, 7)} | {"frame": 2.0, "default": 1.0})
    condition = machine.condition.replace(temperature=REFERENCE, temperature_log=log)
    return machine.with_condition(condition)


def test_every_moment_is_the_budget_of_its_temperatures(hexapod: Machine) -> None:
    poses = hexapod.poses()[[0, 40, 101]]
    found = tp.over_time(hexapod, poses)
    assert found.error.dims == ("time", "pose", "component")
    assert found.error.shape == (3601, 3, 6)
    log = hexapod.condition.temperature_log
    assert log is not None
    for moment in (0, 1, 600, 3600):
        fixed = hexapod.condition.replace(
            temperature={name: float(each[moment]) for name, each in log.temperatures.items()}
            | {"platform": float(log.at("default", moment))}
        )
        alone = tp.budget(hexapod, poses, fixed).error.sel(source="thermal")
        at = found.error.sel(time=float(moment))
        assert np.allclose(at.values, alone.values, rtol=0, atol=1e-13)
    assert not np.allclose(found.error.values[600], found.error.values[3600], rtol=1e-3)


def test_a_budget_is_that_of_the_last_moment_or_of_the_time_named(hexapod: Machine) -> None:
    pose = hexapod.poses()[7]
    found = tp.over_time(hexapod, pose)
    last = tp.budget(hexapod, pose).error.sel(source="thermal").values
    assert np.allclose(found.error.values[-1], last, rtol=0, atol=1e-13)
    early = hexapod.condition.replace(time=432.5)
    half_way = tp.budget(hexapod, pose, early).error.sel(source="thermal").values
    between = tp.over_time(hexapod, pose, times=[432.5]).error.values[0]
    assert np.allclose(between, half_way, rtol=0, atol=1e-13)


def test_the_planar_machine_over_time_in_closed_form(tmp_path: Path) -> None:
    """Two struts of one length on vertical guideways: a first-order heat-up of the error."""
    machine = load_text(tmp_path, edited(PLANAR, ("temperature = 35\n", "")))
    log = heated({"strut.1": 15.0})
    condition = machine.condition.replace(temperature_log=log)
    found = tp.over_time(machine, [[0.3, 0.2]], condition)
    rise = 15.0 * (1.0 - np.exp(-found.time.values / TAU))
    length = 0.5 * (1.0 + 1.1e-5 * rise)
    # Carriages stand at x = 0 and 0.6 m, as high as one another; the tool is 0.4 m below them.
    x = (length**2 - 0.5**2 + 0.6**2) / (2 * 0.6)
    y = np.sqrt(length**2 - x**2)
    expected = np.stack([x - 0.3, 0.4 - y], axis=1)
    sign = np.sign(found.error.values[-1, 0, 1] * expected[-1, 1])
    assert np.allclose(found.error.values[:, 0], expected * [1.0, sign], rtol=0, atol=1e-13)


def test_temperatures_are_those_of_every_part(hexapod: Machine) -> None:
    found = tp.over_time(hexapod, times=[0.0, TAU])
    assert tuple(found.part.values) == hexapod.parts
    assert found.sizes["pose"] == 1
    rises = found.temperature.sel(time=TAU) - REFERENCE
    share = 1.0 - np.exp(-1.0)
    assert float(rises.sel(part="strut.3")) == pytest.approx(7 * share)
    assert float(rises.sel(part="platform")) == pytest.approx(share)


def test_home_is_where_it_looks_by_default(hexapod: Machine) -> None:
    found = tp.over_time(hexapod, times=[60.0])
    at = [float(found[f"pose_{name}"][0]) for name in hexapod.commanded]
    assert np.allclose(at, hexapod.home)


def test_many_poses_and_times_are_the_same_in_any_chunks(
    hexapod: Machine, monkeypatch: pytest.MonkeyPatch
) -> None:
    poses, times = hexapod.poses()[:5], np.arange(0.0, 700.0, 7.0)
    whole = tp.over_time(hexapod, poses, times=times).error.values
    monkeypatch.setattr("truepose.error_budget.over_time.BLOCK", 13)
    chunked = tp.over_time(hexapod, poses, times=times).error.values
    assert np.allclose(chunked, whole, rtol=0, atol=1e-14)


def test_poses_that_cannot_be_used_are_left_out_and_counted(hexapod: Machine) -> None:
    poses = np.stack([hexapod.poses()[0], [9.0, 0, 0, 0, 0, 0]])
    found = tp.over_time(hexapod, poses, times=[0.0, 60.0])
    assert found.attrs["poses_left_out"] == 1
    assert found.left_out_index.values.tolist() == [1]
    assert found.error.shape == (2, 1, 6)


def problem_of(call: object, *arguments: object, **named: object) -> str:
    assert callable(call)
    with pytest.raises(TrueposeError) as caught:
        call(*arguments, **named)
    (problem,) = caught.value.problems
    return problem.code


def test_bad_requests(hexapod: Machine) -> None:
    cold = tp.load(MACHINES / "hexapod.toml")
    assert problem_of(tp.over_time, cold) == "no-temperature-log"
    assert problem_of(tp.over_time, hexapod, times=[]) == "bad-times"
    assert problem_of(tp.over_time, hexapod, times=[np.nan]) == "bad-times"
    assert problem_of(tp.over_time, hexapod, times=["soon"]) == "bad-times"
    assert problem_of(tp.over_time, hexapod, times=[0.0, 3601.0]) == "outside-log"
    assert problem_of(tp.over_time, hexapod, [[1.0, 2.0]]) == "bad-poses"
    assert problem_of(tp.over_time, hexapod, [[9.0, 0, 0, 0, 0, 0]]) == "no-pose-left"
    late = hexapod.condition.replace(time=9999.0)
    with pytest.raises(RequestError) as caught:
        tp.budget(hexapod, hexapod.poses()[:1], late)
    assert caught.value.problems[0].code == "outside-log"


def test_a_log_of_a_part_that_does_not_say_how_it_expands() -> None:
    machine = tp.load(MACHINES / "hexapod.toml")
    condition = machine.condition.replace(temperature_log=heated({"tool": 3.0}))
    assert problem_of(tp.over_time, machine, condition=condition) == "no-expansion"


def test_without_poses_it_is_home_and_a_budget_the_workspace(hexapod: Machine) -> None:
    """And the first line of both says so, as it does in docs/results.md."""
    for run, says in ((over_time, "home"), (budget, "workspace")):
        assert says in str(run.__doc__).splitlines()[0]
    page = (Path(__file__).parents[3] / "docs" / "results.md").read_text(encoding="utf-8")
    assert "Without poses all are over the poses of the file's workspace, but `over_time`" in page
    machine = hexapod
    home = dict(zip(machine.dof, machine.home.tolist(), strict=True))
    at_home = [home[freedom] for freedom in machine.commanded]
    times = [0.0, 900.0]
    found, asked = tp.over_time(machine, times=times), tp.over_time(machine, at_home, times=times)
    assert np.array_equal(found.error.values, asked.error.values)
    assert [float(found[f"pose_{name}"].values[0]) for name in machine.commanded] == at_home
    everywhere = tp.budget(machine, condition=machine.condition.replace(temperature_log=None))
    assert everywhere.sizes["pose"] + everywhere.sizes["left_out"] == len(machine.poses())
    assert len(machine.poses()) > 1
    places = [everywhere[f"pose_{name}"].values for name in machine.commanded]
    assert np.array_equal(np.stack(places, axis=-1), machine.poses()[everywhere["pose"].values])
