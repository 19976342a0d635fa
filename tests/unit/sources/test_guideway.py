"""The guideway source: shapes and tables across the rail, and where the rail leans."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

import space_slider
import truepose as tp
from machine_texts import HEXAPOD, PLANAR, edited, line_of, load_text
from truepose.errors import MachineFileError
from truepose.machine import Machine
from truepose.runs.poses import PoseRun
from truepose.sources import UNIFORM, Deviation
from truepose.sources.guideway import ALONG, SHAPES
from two_slider import Floats, carriages, tool

SPACE = space_slider.SPACE


def with_guideway(given: str, drive: str = "d1", text: str = PLANAR) -> str:
    return edited(text, (f'name = "{drive}"', f'name = "{drive}"\nguideway = {given}'))


def straight(shape: str, more: str = "", direction: str = "[1, 0, 0]", drive: str = "d1") -> str:
    entry = f'{{ direction = {direction}, amplitude = "8 um", shape = "{shape}"{more} }}'
    return with_guideway(f"{{ straightness = [{entry}] }}", drive)


def deviation_of(machine: Machine) -> Deviation:
    (source,) = (each for each in machine.sources if each.name == "guideway")
    (block,) = PoseRun(machine, machine.poses(), machine.condition)
    return cast("Deviation", cast("Any", source).deviation(machine, machine.condition, block))


def moved(machine: Machine, off: Floats, drive: int = 0) -> Floats:
    """(n, 2) where the tool goes when one carriage is off by `off` (n, 2), m."""
    centres = carriages(machine.inverse(machine.poses()))
    centres[:, drive] += off
    return tool(centres, np.full((len(off), 2), 0.5), machine.poses()) - machine.poses()


# Travel 0 to 900 mm; fractions of it by hand.
BY_HAND: list[tuple[str, str, Callable[[Floats], Floats]]] = [
    ("bow", "", lambda q: 1 - ((q - 0.45) / 0.45) ** 2),
    ("s", "", lambda q: 6 * 3**0.5 * (q / 0.9) * (1 - q / 0.9) * (1 - 2 * q / 0.9)),
    ("sine", "", lambda q: np.sin(2 * np.pi * q / 0.9)),
    ("sine", ", period = 60", lambda q: np.sin(2 * np.pi * q / 0.06)),
]


@pytest.mark.parametrize(("shape", "more", "by_hand"), BY_HAND)
def test_a_known_shape_moves_the_carriage_across(
    tmp_path: Path, shape: str, more: str, by_hand: Callable[[Floats], Floats]
) -> None:
    machine = load_text(tmp_path, straight(shape, f"{more}, known = true", "[-2, 0, 0]"))
    joint = machine.inverse(machine.poses())[:, 0]
    off = np.stack([-8e-6 * by_hand(joint), np.zeros(len(joint))], axis=1)
    found = tp.budget(machine).sel(source="guideway")
    assert np.abs(found.error - moved(machine, off)).max() < 1e-14
    assert np.abs(found.error).max() > 1e-6
    assert not found.uncertainty.values.any()


@pytest.mark.parametrize(("shape", "more", "by_hand"), BY_HAND)
def test_a_bound_is_a_band_of_the_shape(
    tmp_path: Path, shape: str, more: str, by_hand: Callable[[Floats], Floats]
) -> None:
    machine = load_text(tmp_path, straight(shape, more))
    joint = machine.inverse(machine.poses())[:, 0]
    off = np.stack([8e-6 * by_hand(joint), np.zeros(len(joint))], axis=1)
    found = tp.budget(machine).sel(source="guideway")
    most = np.abs(moved(machine, off))
    assert not found.error_upper.values.any()  # coordinates have no edges
    assert np.abs(found.worst - most).max() < 1e-4 * most.max()
    assert np.abs(found.uncertainty - most / 3**0.5).max() < 1e-4 * most.max()
    assert set(deviation_of(machine).distribution) == {UNIFORM}


@pytest.mark.parametrize("shape", SHAPES)
def test_every_shape_is_zero_at_both_ends_and_reaches_its_amplitude(shape: str) -> None:
    way = np.linspace(0, 1, 100_001)
    values = SHAPES[shape](way)
    assert abs(values[0]) < 1e-15
    assert abs(values[-1]) < 1e-15
    assert np.abs(values).max() == pytest.approx(1.0, abs=1e-9)


def test_an_oblique_direction_is_one_variable_over_its_coordinates(tmp_path: Path) -> None:
    """Rail d3 of the machine in space runs along (0.6, 0, 0.8)."""
    entry = '{ direction = [0.8, 1, -0.6], amplitude = "8 um", shape = "s" }'
    text = with_guideway(f"{{ straightness = [{entry}] }}", "d3", SPACE)
    machine = load_text(tmp_path, text)
    found = deviation_of(machine)
    assert len(set(found.variables.tolist())) == 1
    assert {machine.parameters[c] for c in found.parameters} == {
        f"drive.d3.origin.{axis}" for axis in "xyz"
    }
    way = machine.inverse(machine.poses())[:, 2] / 0.5
    shape = 6 * 3**0.5 * way * (1 - way) * (1 - 2 * way)
    assert (shape < 0).any()
    assert (shape > 0).any()
    unit = np.array([0.8, 1.0, -0.6]) / 2**0.5
    assert np.allclose(found.signed_half, 8e-6 * shape[:, np.newaxis] * unit, rtol=1e-9, atol=1e-18)
    centres = space_slider.carriages(machine.inverse(machine.poses()))
    centres[:, 2] += 8e-6 * shape[:, np.newaxis] * unit
    most = np.abs(space_slider.tool(centres, machine.poses()) - machine.poses())
    assert np.abs(tp.budget(machine).sel(source="guideway").worst - most).max() < 1e-4 * most.max()


def test_a_slanting_direction_counts_by_what_is_across(tmp_path: Path) -> None:
    slightly = load_text(tmp_path, straight("bow", ", known = true", f"[1, {0.9 * ALONG}, 0]"))
    exactly = load_text(tmp_path, straight("bow", ", known = true"))
    both = [tp.budget(each).sel(source="guideway").error.values for each in (slightly, exactly)]
    assert np.abs(both[0] - both[1]).max() < 1e-16
    with pytest.raises(MachineFileError):
        load_text(tmp_path, straight("bow", ", known = true", f"[1, {1.1 * ALONG}, 0]"))


def test_a_measured_rail_moves_the_carriage_by_what_was_measured(tmp_path: Path) -> None:
    csv = "position (mm), level (um), plumb (um)\n900, 0, 2\n0, 1, 0\n400, -7, 3\n"
    (tmp_path / "rail3.csv").write_text(csv, encoding="utf-8")
    given = '{ table = "rail3.csv", directions = { level = [0, 1, 0], plumb = [0.8, 0, -0.6] } }'
    machine = load_text(tmp_path, with_guideway(given, "d3", SPACE))
    joints = machine.inverse(machine.poses())
    level, plumb = (
        1e-6 * np.interp(joints[:, [2]], [0.0, 0.4, 0.9], measured)
        for measured in ([1.0, -7.0, 0.0], [0.0, 3.0, 2.0])
    )
    centres = space_slider.carriages(joints)
    centres[:, 2] += level * [0, 1, 0] + plumb * [0.8, 0, -0.6]
    expected = space_slider.tool(centres, machine.poses()) - machine.poses()
    found = tp.budget(machine).sel(source="guideway")
    assert np.abs(found.error - expected).max() < 1e-13
    assert not found.uncertainty.values.any()
    assert list(machine.data_files) == ["rail3.csv"]


@pytest.mark.parametrize("key", ["squareness", "parallelism"])
@pytest.mark.parametrize(
    "written", ['"20 um/m"', '"+-20 um/m"', '"20 urad"', '["-6 um / 300 mm", "6 um / 300 mm"]']
)
def test_a_lean_all_round_is_of_both_freedoms_of_the_axis(
    tmp_path: Path, key: str, written: str
) -> None:
    machine = load_text(tmp_path, with_guideway(f"{{ {key} = {written} }}", "d3", SPACE))
    found = deviation_of(machine)
    names = [machine.parameters[column] for column in found.parameters]
    assert names == ["drive.d3.axis.u", "drive.d3.axis.v"]
    assert np.allclose(found.half, 20e-6, rtol=1e-12)
    assert not found.shift.any()
    # Carriage 3 anywhere on a square of that half width across its axis, times its way along it.
    joints = machine.inverse(machine.poses())
    across = np.array([[0.0, 1.0, 0.0], [0.8, 0.0, -0.6]])
    effects = []
    for direction in across:
        centres = space_slider.carriages(joints)
        centres[:, 2] += 20e-6 * joints[:, [2]] * direction
        effects.append(space_slider.tool(centres, machine.poses()) - machine.poses())
    # The kernel's two tangents are some pair of right angles: the squares add up alike in any.
    spread = np.sqrt(np.square(effects).sum(axis=0) / 3)
    uncertainty = tp.budget(machine).sel(source="guideway").uncertainty
    assert np.abs(uncertainty - spread).max() < 1e-4 * spread.max()


def test_a_lean_towards_a_direction_is_known_and_not_known_by_its_limits(tmp_path: Path) -> None:
    given = '{ parallelism = { band = ["10 um/m", "50 um/m"], direction = [0, 3, 0] } }'
    machine = load_text(tmp_path, with_guideway(given, "d3", SPACE))
    joints = machine.inverse(machine.poses())
    centres = space_slider.carriages(joints)
    centres[:, 2, 1] += 30e-6 * joints[:, 2]
    expected = space_slider.tool(centres, machine.poses()) - machine.poses()
    found = tp.budget(machine).sel(source="guideway")
    assert np.abs(found.error - expected).max() < 1e-13
    band = np.abs(expected) * 2 / 3
    assert np.abs(found.worst - np.abs(expected) - band).max() < 1e-4 * band.max()


def test_a_lean_is_the_axis_turned_about_the_drive_s_origin(tmp_path: Path) -> None:
    """To the first order the same as a rotated guideway, its offset and scale included."""
    text = edited(SPACE, ("travel = [0, 500]", "travel = [0, 500]\noffset = 20\nscale = 1.5"))
    given = '{ squareness = { band = ["40 um/m", "40 um/m"], direction = [0.6, 0.8, 0] } }'
    machine = load_text(tmp_path, with_guideway(given, "d1", text))
    leaning = edited(text, ("axis = [0.0, 0.0, 1.0]", "axis = [24e-6, 32e-6, 1.0]"))
    poses = machine.poses()
    gone = load_text(tmp_path, leaning).forward(machine.inverse(poses)) - poses
    assert np.abs(gone).max() > 1e-6
    assert np.abs(tp.budget(machine).sel(source="guideway").error - gone).max() < 1e-8 * 0.04


def test_a_guideway_without_error_changes_nothing(tmp_path: Path) -> None:
    entry = '{ direction = [1, 0, 0], amplitude = 0, shape = "bow" }'
    text = with_guideway(f"{{ straightness = [{entry}], squareness = 0 }}")
    found = tp.budget(load_text(tmp_path, text))
    for name in ("error", "error_lower", "error_upper", "worst", "uncertainty"):
        assert not found[name].sel(source="guideway").values.any()


@pytest.mark.parametrize(
    ("given", "code", "words"),
    [
        ("{}", "missing-key", "none of straightness"),
        ("{ squarenes = 1 }", "unknown-key", 'did you mean "squareness"?'),
        ("{ squareness = -1 }", "negative", "a half band"),
        ('{ squareness = "3 N" }', "wrong-dimension", "an angle, found a force"),
        ('{ squareness = "3 um" }', "wrong-dimension", "an angle, found a length"),
        ('{ squareness = ["0 um/m", "9 um/m"] }', "missing-key", "no direction"),
        ('{ squareness = { band = "9 um/m", direction = [0, 1, 0] } }',
         "direction-along-guideway", "0 deg to the axis"),
        ('{ squareness = { bnd = "9 um/m" } }', "unknown-key", 'did you mean "band"?'),
        ('{ straightness = [{ direction = [1, 1, 0], amplitude = 1, shape = "s" }] }',
         "direction-along-guideway", "45 deg to the axis"),
        ('{ straightness = [{ direction = [0, 0, 0], amplitude = 1, shape = "s" }] }',
         "zero-direction", "not zero"),
        ('{ straightness = [{ direction = [1, 0, 0], amplitude = 1, shape = "z" }] }',
         "unknown-choice", "'bow', 's' or 'sine'"),
        ('{ straightness = [{ direction = [1, 0, 0], amplitude = -1, shape = "s" }] }',
         "negative", "known = true"),
        ('{ straightness = [{ direction = [1, 0, 0], amplitude = 1, shape = "s", period = 3 }] }',
         "excluding-keys", "only a sine has a period"),
        ('{ straightness = [{ direction = [1, 0, 0], amplitude = 1, shpe = "s" }] }',
         "unknown-key", 'did you mean "shape"?'),
        ('{ straightness = { direction = [1, 0, 0], amplitude = 1, shape = "s" } }',
         "wrong-type", "expected a list, found a table"),
        ('{ table = "rail.csv" }', "missing-key", "table, but no directions"),
        ("{ directions = { h = [1, 0, 0] } }", "missing-key", "directions, but no table"),
        ('{ table = "rail.csv", directions = { position = [1, 0, 0] } }', "bad-name", "position"),
        ('{ table = "rail.csv", directions = {} }', "bad-name", "no direction"),
        ('{ table = "rail.csv", directions = { h = [1, 0, 0] } }', "file-missing", "rail.csv"),
    ],
)  # fmt: skip
def test_what_a_guideway_may_not_say(tmp_path: Path, given: str, code: str, words: str) -> None:
    text = with_guideway(given)
    with pytest.raises(MachineFileError) as caught:
        load_text(tmp_path, text)
    (problem,) = caught.value.problems
    assert (problem.code, problem.line) == (code, line_of(text, "guideway ="))
    assert words in str(problem)
    assert problem.expected


def test_only_a_carriage_runs_on_a_guideway(tmp_path: Path) -> None:
    text = with_guideway('{ squareness = "20 um/m" }', "d4", HEXAPOD)
    with pytest.raises(MachineFileError) as caught:
        load_text(tmp_path, text)
    (problem,) = caught.value.problems
    assert (problem.code, problem.line) == ("unwanted-guideway", line_of(text, "guideway ="))
    assert problem.found == 'kind = "telescopic"'
    assert "[tolerance]" in str(problem.hint)


@pytest.mark.parametrize(
    ("csv", "code", "line"),
    [
        ("position (mm), h (um)\n0, 1\n800, 2\n", "travel-not-covered", 3),
        ("position (mm), h (um)\n0, 1\n900, 2\n900, 3\n", "doubled-position", 4),
        ("position (mm), h\n0, 1\n900, 2\n", "no-unit", 1),
        ("position (mm), v (um)\n0, 1\n900, 2\n", "missing-column", 1),
        ("position (mm), h (um)\n0\n900, 2\n", "ragged-row", 2),
    ],
)
def test_what_a_rail_s_table_may_not_be(tmp_path: Path, csv: str, code: str, line: int) -> None:
    (tmp_path / "rail.csv").write_text(csv, encoding="utf-8")
    text = with_guideway('{ table = "rail.csv", directions = { h = [1, 0, 0] } }')
    with pytest.raises(MachineFileError) as caught:
        load_text(tmp_path, text)
    problem = next(each for each in caught.value.problems if each.code == code)
    assert problem.line == line
    assert Path(str(problem.file)).name == "rail.csv"
    assert problem.expected
