"""The backlash source: the flank by load, else by travel, else a band."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from machine_texts import PLANAR, edited, line_of, load_text
from truepose.errors import MachineFileError
from truepose.machine import Machine
from truepose.runs.poses import PoseRun
from truepose.sources import UNIFORM, Deviation
from two_slider import Floats, directions, displaced, tensions

FORCE = (1200.0, -1500.0)
PLAYS = (20e-6, 30e-6)
NO_FORCE = ("force = { x = 1200, y = -1500 }\n", "")


def with_backlash(*edits: tuple[str, str], threshold: str = "") -> str:
    text = edited(PLANAR, ("length_tolerance = [-0.3, 0.3]\n", ""), *edits)
    for name, play in (("d1", 20), ("d2", 30)):
        given = f'backlash = {{ play = "{play} um"{threshold} }}'
        text = edited(text, (f'name = "{name}"', f'name = "{name}"\n{given}'))
    return text


def deviation_of(machine: Machine, poses: Floats, *, path: bool = False) -> Deviation:
    (source,) = (each for each in machine.sources if each.name == "backlash")
    (block,) = PoseRun(machine, poses, machine.condition, path=path)
    found: Deviation = source.deviation(machine, machine.condition, block)  # type: ignore[attr-defined]
    assert [machine.parameters[c] for c in found.parameters] == [
        "drive.d1.offset",
        "drive.d2.offset",
    ]
    return found


def loads(machine: Machine, force: tuple[float, float] = FORCE) -> Floats:
    """(n, 2) N: what the struts pull their carriages along the rails, up y."""
    poses = machine.poses()
    pulled: Floats = tensions(machine, poses, force) * directions(machine, poses)[:, :, 1]
    return pulled


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_load_puts_each_carriage_on_the_flank_that_it_pushes_to(
    tmp_path: Path, sign: float
) -> None:
    force = (sign * FORCE[0], sign * FORCE[1])
    text = with_backlash(("x = 1200, y = -1500", f"x = {force[0]}, y = {force[1]}"))
    machine = load_text(tmp_path, text)
    flank = np.sign(loads(machine, force))
    assert {(-1.0, 1.0), (1.0, -1.0)} & set(map(tuple, flank.tolist()))
    found = tp.budget(machine)
    expected = displaced(machine, machine.poses(), joints=flank * np.array(PLAYS) / 2)
    assert np.abs(found.error.sel(source="backlash") - expected).max() < 1e-14
    assert not found.uncertainty.sel(source="backlash").values.any()


def test_the_flank_is_taken_where_the_load_exceeds_the_threshold_only(tmp_path: Path) -> None:
    everywhere = load_text(tmp_path, with_backlash())
    pulled = np.abs(loads(everywhere))
    threshold = float(np.sort(pulled.ravel())[pulled.size // 2])  # one carriage just reaches it
    for factor in (1.0 - 1e-6, 1.0 + 1e-6):
        given = f', threshold = "{threshold * factor!r} N"'
        machine = load_text(tmp_path, with_backlash(threshold=given))
        found = deviation_of(machine, machine.poses())
        over = pulled > threshold * factor
        assert 0 < over.sum() < over.size
        assert np.array_equal(found.shift != 0.0, over)
        assert np.array_equal(found.half, np.where(over, 0.0, np.array(PLAYS) / 2))


def test_the_path_decides_where_the_load_does_not(tmp_path: Path) -> None:
    machine = load_text(tmp_path, with_backlash(NO_FORCE))
    # Up, up, standing, down: both rails run along y, and the tool moves along it.
    path = np.array([[0.3, y] for y in (0.10, 0.12, 0.15, 0.15, 0.11)])
    found = deviation_of(machine, path, path=True)
    lag = np.array([0.0, -1.0, -1.0, -1.0, 1.0])[:, np.newaxis]
    assert np.array_equal(found.shift, lag * np.array(PLAYS) / 2)
    # Where it comes from is not known at the first pose.
    assert np.array_equal(found.half, np.where(lag == 0.0, np.array(PLAYS) / 2, 0.0))
    loaded = load_text(tmp_path, with_backlash())
    by_load = deviation_of(loaded, path)
    assert by_load.shift.all()
    assert np.array_equal(deviation_of(loaded, path, path=True).shift, by_load.shift)


def test_a_budget_along_a_path_of_the_file_lags_behind_and_turns_round(tmp_path: Path) -> None:
    up_and_down = "path = { points = [[300, 100], [300, 150], [300, 100]], step = 10 }"
    text = with_backlash(NO_FORCE, ("grid = { x = [200, 400, 5], y = [100, 300, 3] }", up_and_down))
    machine = load_text(tmp_path, text)
    poses = machine.poses()
    way = np.sign(np.diff(poses[:, 1], prepend=poses[0, 1]))
    assert way.tolist() == [0.0, *[1.0] * 5, *[-1.0] * 5]
    expected = displaced(machine, poses, joints=-way[:, np.newaxis] * np.array(PLAYS) / 2)
    found = tp.budget(machine)
    assert np.abs(found.error.sel(source="backlash") - expected).max() < 1e-14
    spread = found.uncertainty.sel(source="backlash").values.any(axis=1)
    assert np.array_equal(spread, way == 0.0)


def test_a_force_of_unknown_direction_resolves_nothing_but_what_it_cannot_reach(
    tmp_path: Path,
) -> None:
    text = with_backlash(NO_FORCE, threshold=', threshold = "300 N"')
    machine = load_text(tmp_path, text)
    poses = np.array([[0.25, y] for y in (0.10, 0.12, 0.15)])
    (source,) = (each for each in machine.sources if each.name == "backlash")
    along = directions(machine, poses)
    # A force F on the tool loads carriage i by F . (inverse of the directions) times its share.
    per_force = np.linalg.inv(np.swapaxes(along, 1, 2)) * along[:, :, 1:]
    most = np.linalg.norm(per_force, axis=2)
    for force in (300.0 / most.max() * 0.999, 300.0 / most.max() * 1.001):
        condition = machine.condition.replace(envelope=force)
        (block,) = PoseRun(machine, poses, condition, path=True)
        found = source.deviation(machine, condition, block)  # type: ignore[attr-defined]
        lags = (force * most <= 300.0) & (np.arange(3) > 0)[:, np.newaxis]
        assert np.array_equal(found.shift, np.where(lags, -np.array(PLAYS) / 2, 0.0))
        assert np.array_equal(found.half, np.where(lags, 0.0, np.array(PLAYS) / 2))


@pytest.mark.parametrize(
    "force",
    [NO_FORCE, ("{ x = 1200, y = -1500 }", "{ z = 1000 }")],
    ids=["no load", "a load that the frame holds"],
)
def test_without_load_and_path_it_is_a_band_about_the_middle(
    tmp_path: Path, force: tuple[str, str]
) -> None:
    machine = load_text(tmp_path, with_backlash(force))
    found = deviation_of(machine, machine.poses())
    assert not found.shift.any()
    assert np.allclose(found.half, np.array(PLAYS) / 2, rtol=1e-15)
    assert set(found.distribution) == {UNIFORM}
    budget = tp.budget(machine)
    assert not budget.error.sel(source="backlash").values.any()
    # The tool follows a carriage by the strut's share along the rail: du . u_i = dq_i axis . u_i.
    along = directions(machine, machine.poses())
    each = np.linalg.inv(along) * (along[:, :, 1] * np.array(PLAYS) / 2)[:, np.newaxis, :]
    worst = np.abs(each).sum(axis=2)
    assert np.abs(budget.worst.sel(source="backlash") - worst).max() < 1e-15
    spread = np.sqrt(np.square(each).sum(axis=2) / 3.0)
    assert np.abs(budget.uncertainty.sel(source="backlash") - spread).max() < 1e-15


def test_a_play_of_zero_does_nothing(tmp_path: Path) -> None:
    text = edited(with_backlash(), ('"20 um"', "0"), ('"30 um"', "0"))
    found = tp.budget(load_text(tmp_path, text))
    assert not found.worst.sel(source="backlash").values.any()


CRANK = """\
schema = 1
[machine]
name = "crank"
dof = ["x"]
[units]
length = "mm"
angle = "deg"
force = "N"
moment = "N m"
[[drive]]
name = "crank"
kind = "crank"
axis = [0, 0, 1]
travel = [10, 80]
working_mode = "+"
backlash = { play = 0.2, threshold = 1.5 }
[[strut]]
name = "rod"
drive = "crank"
base = [100, 0, 0]
platform = [0, 0, 0]
length = 250
[workspace]
grid = { x = [280, 320, 3] }
"""


def test_a_crank_has_a_play_in_angle_and_a_threshold_in_torque(tmp_path: Path) -> None:
    machine = load_text(tmp_path, CRANK)
    slide = machine.poses()[:, 0]
    crank = machine.inverse(machine.poses())[:, 0]
    pin = 0.1 * np.stack([np.cos(crank), np.sin(crank)], axis=1)
    along = np.stack([slide, np.zeros(3)], axis=1) - pin
    along /= 0.25
    # A force of 1 N on the slide pulls the rod by 1 / cos, and the rod the crank by its lever.
    torque = (pin[:, 0] * along[:, 1] - pin[:, 1] * along[:, 0]) / along[:, 0]
    (source,) = (each for each in machine.sources if each.name == "backlash")
    for force in (np.abs(1.5 / torque) * 1.001).tolist():
        condition = machine.condition.replace(force=(force, 0.0, 0.0))
        (block,) = PoseRun(machine, machine.poses(), condition)
        found = source.deviation(machine, condition, block)  # type: ignore[attr-defined]
        over = np.abs(force * torque) > 1.5
        expected = np.where(over, np.sign(force * torque) * math.radians(0.1), 0.0)
        assert np.abs(found.shift[:, 0] - expected).max() < 1e-17
        assert np.array_equal(found.half[:, 0] > 0.0, ~over)


def refused(folder: Path, text: str) -> tuple[str, int | None]:
    with pytest.raises(MachineFileError) as caught:
        load_text(folder, text)
    (problem,) = caught.value.problems
    assert problem.expected
    return problem.code, problem.line


def test_a_drive_measured_on_its_carriage_has_none(tmp_path: Path) -> None:
    text = edited(with_backlash(), ('name = "d2"', 'name = "d2"\nfeedback = "direct"'))
    assert refused(tmp_path, text) == ("unwanted-backlash", line_of(text, '"30 um"'))


@pytest.mark.parametrize(
    ("old", "new", "code"),
    [
        ("play = 0.2", 'play = "20 um"', "wrong-dimension"),
        ("play = 0.2", "play = -0.2", "negative"),
        ("threshold = 1.5", 'threshold = "20 N"', "wrong-dimension"),
        ("threshold = 1.5", "threshold = -1", "negative"),
        ("play = 0.2, ", "", "missing-key"),
        ("play", "plays", "unknown-key"),
    ],
)
def test_what_is_no_backlash_is_refused(tmp_path: Path, old: str, new: str, code: str) -> None:
    text = edited(CRANK, (old, new))
    with pytest.raises(MachineFileError) as caught:
        load_text(tmp_path, text)
    found = {problem.code: problem.line for problem in caught.value.problems}
    assert found[code] == line_of(text, "backlash")
