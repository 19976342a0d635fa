"""Measuring programs, read back with the project's own interpreter, and files to fill in."""

from __future__ import annotations

import dataclasses
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from build_machine import MACHINES
from made_measurements import nominal_values
from truepose import _kernel
from truepose.calibration.instruments import Instrument
from truepose.calibration.measurements import Measurements
from truepose.calibration.measurements.read_csv import read_measurements
from truepose.calibration.planning import program as measuring_program
from truepose.calibration.planning.instruments import (
    distinct,
    instruments_named,
    read_instruments,
)
from truepose.calibration.planning.poses import Placed, home_of, workspace_poses
from truepose.calibration.planning.program import program, reachable, template, way_through
from truepose.calibration.planning.readings import planned
from truepose.controllers.gcode._axes import Axes
from truepose.errors import RequestError

READ = 10_000


@cache
def machine_of(name: str) -> tp.Machine:
    return tp.load(MACHINES / f"{name}.toml")


def poses_of(machine: tp.Machine, count: int = 7) -> np.ndarray:
    poses = Placed(machine, workspace_poses(machine)).poses
    return poses[np.random.default_rng(5).choice(len(poses), count, replace=False)]


def moves_of(machine: tp.Machine, text: str, folder: Path) -> np.ndarray:
    """(n, n_commanded) where the moves of a program end, as LinuxCNC would read it, SI."""
    path = folder / "measure.ngc"
    path.write_text(text, encoding="ascii")
    axes = Axes(machine)
    reader = _kernel.GcodeReader(path, start=axes.home(), axes=axes.names)
    moves = reader.read(READ)
    assert not len(reader.read(READ))
    assert set(moves.kind.tolist()) <= {1}
    return axes.poses(moves.end)


@pytest.mark.parametrize(
    "name", ["hexapod", "linear_delta", "3prs", "planar_two_slider", "pentapod", "five_bar"]
)
def test_the_program_goes_to_every_pose_and_home(name: str, tmp_path: Path) -> None:
    machine = machine_of(name)
    poses = poses_of(machine)
    text = program(machine, poses, dwell=1.5)
    way = way_through(machine, poses)
    ends = moves_of(machine, text, tmp_path)
    np.testing.assert_allclose(ends, way.stops, atol=2e-9)
    np.testing.assert_allclose(way.stops[way.pose >= 0], poses, atol=0)
    np.testing.assert_allclose(ends[[0, -1]], [home_of(machine)] * 2, atol=2e-9)
    lines = text.splitlines()
    assert lines.count("G4 P1.5") == len(poses)
    # At every pose: said, gone to, rested at.
    at = [number for number, line in enumerate(lines) if line.startswith("G4")]
    assert [lines[number - 2] for number in at] == [f"; pose {n} of 7" for n in range(1, 8)]
    assert lines[-1] == "M2"
    assert reachable(machine, way.stops[:-1], way.stops[1:]).all()


def test_units_are_those_of_the_machine_file() -> None:
    inches, millimetres = (
        program(machine_of(name), poses_of(machine_of(name)), feed=0.0254 / 60.0 * 10.0)
        for name in ("hexapod", "linear_delta")
    )
    assert "G20" in inches.splitlines()
    assert "F10" in inches.splitlines()
    assert "G21" in millimetres.splitlines()
    assert "F254" in millimetres.splitlines()


def test_names_cannot_end_a_comment_or_begin_a_command() -> None:
    machine = dataclasses.replace(machine_of("tripod"), name="Mühle (2)\nG0 X9999")
    text = program(machine, poses_of(machine))
    assert text.splitlines()[0].startswith("; M?hle [2]?G0 X9999: 7 poses")
    assert text.isascii()


def test_legs_that_cannot_be_driven_go_by_home(monkeypatch: pytest.MonkeyPatch) -> None:
    machine = machine_of("tripod")
    poses = poses_of(machine, 4)

    def blocked(_: tp.Machine, starts: np.ndarray, ends: np.ndarray) -> np.ndarray:
        second = np.all(starts == poses[1], axis=1) & np.all(ends == poses[2], axis=1)
        return np.asarray(~second)

    monkeypatch.setattr(measuring_program, "reachable", blocked)
    way = way_through(machine, poses)
    assert way.pose.tolist() == [-1, 0, 1, -1, 2, 3, -1]
    np.testing.assert_array_equal(way.stops[3], home_of(machine))
    assert way.by_home == 1
    text = program(machine, poses)
    assert "; begins and ends at home; 1 leg leads by home" in text.splitlines()
    assert text.count("\nG4") == 4


def test_a_pose_that_no_leg_leads_to_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    machine = machine_of("tripod")
    poses = poses_of(machine, 4)

    def blocked(_: tp.Machine, starts: np.ndarray, ends: np.ndarray) -> np.ndarray:
        here = np.all(ends == poses[2], axis=1) | np.all(starts == poses[2], axis=1)
        return np.asarray(~here)

    monkeypatch.setattr(measuring_program, "reachable", blocked)
    with pytest.raises(RequestError, match="pose 3 of the plan") as caught:
        program(machine, poses)
    assert {each.code for each in caught.value.problems} == {"plan-way"}


def test_a_leg_that_leaves_the_reach_is_found() -> None:
    machine = machine_of("tripod")
    inside = poses_of(machine, 1)
    assert reachable(machine, inside, inside).all()
    assert not reachable(machine, inside, inside + 10.0).any()
    # Both ends can be used, what lies between cannot.
    ends = np.array([[-0.313, 0.081, 0.568], [-0.083, -0.287, 0.615]])
    assert not machine.kernel.place(ends)[2].any()
    assert not reachable(machine, ends[:1], ends[1:]).any()
    way = way_through(machine, ends)
    assert way.pose.tolist() == [-1, 0, -1, 1, -1]
    assert reachable(machine, way.stops[:-1], way.stops[1:]).all()


@pytest.mark.parametrize("bad", [{"dwell": 0.0}, {"feed": -1.0}, {"dwell": float("inf")}])
def test_a_dwell_and_a_feed_are_above_zero(bad: dict[str, float]) -> None:
    machine = machine_of("tripod")
    with pytest.raises(RequestError) as caught:
        program(machine, poses_of(machine), **bad)  # type: ignore[arg-type]
    assert [each.code for each in caught.value.problems] == ["plan-option"]


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("hexapod", ("position=10um",)),
        ("linear_delta", ("coordinate:z=10um", "distance=2um")),
        ("hexaglide", ("pose=10um,20urad",)),
        ("tripod", ("strut-length=1um",)),
        ("tricept", ("strut-direction=50e-6",)),
    ],
)
def test_the_file_to_fill_in_reads_back_once_it_is_filled_in(
    name: str, words: tuple[str, ...], tmp_path: Path
) -> None:
    machine = machine_of(name)
    given: tuple[Instrument, ...] = ()
    for word in words:
        given += instruments_named(machine, word)
    given = distinct(machine, given)
    poses = poses_of(machine, 5)
    text = template(machine, poses, given)
    path = tmp_path / "measurements.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(RequestError):
        read_measurements(path, machine)  # nothing is read yet
    assert read_instruments(path, machine) == given
    wanted = planned(machine, given, Placed(machine, poses))
    wanted = wanted.with_values(nominal_values(machine, wanted))
    path.write_text(filled(machine, text, wanted), encoding="utf-8")
    found = read_measurements(path, machine)
    assert found.instruments == given
    np.testing.assert_allclose(found.joints, wanted.joints, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(found.value, wanted.value, rtol=1e-9, atol=1e-9)
    np.testing.assert_array_equal(found.observable, wanted.observable)
    np.testing.assert_allclose(found.uncertainty, wanted.uncertainty, rtol=1e-12)


def filled(machine: tp.Machine, text: str, wanted: Measurements) -> str:
    """The blank cells of each line filled with the readings of its row, in their order."""
    lines = text.splitlines()
    first = next(at for at, line in enumerate(lines) if not line.startswith("#:"))
    names = lines[first].split(", ")
    done = lines[: first + 1]
    for row, line in enumerate(lines[first + 1 :]):
        cells = [cell.strip() for cell in line.split(",")]
        instrument = wanted.instruments[wanted.instrument[row]]
        own = iter(wanted.value[wanted.row == row])
        for at, name in enumerate(names):
            if cells[at] == "" and mine(instrument, name):
                unit = machine.file_units["angle" if "deg" in name else "length"]
                value = next(own)
                cells[at] = repr(float(unit.to_file(value)) if "(" in name else float(value))
        assert next(own, None) is None
        done.append(",".join(cells))
    return "\n".join(done)


def mine(instrument: Instrument, column: str) -> bool:
    """Whether an instrument of these tests reads a column."""
    word = column.split(" ")[0]
    if instrument.kind == "distance":
        return word == "distance"
    if instrument.kind == "coordinate":
        return word == "z"
    return True
