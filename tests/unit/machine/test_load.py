"""A good file becomes the machine that it describes."""

from __future__ import annotations

import hashlib
import math
import pickle
from pathlib import Path

import numpy as np
import pytest

import truepose
from build_machine import description_of, machine_files
from machine_texts import HEXAPOD, PLANAR, edited, load_text
from truepose import _kernel
from truepose.errors import RequestError
from truepose.machine.elements import drive_kinds
from truepose.machine.materials import MATERIALS


@pytest.mark.parametrize("path", machine_files(), ids=lambda path: path.stem)
def test_the_parameters_are_those_of_a_plain_reading(path: Path) -> None:
    machine = truepose.load(path)
    plain = _kernel.Machine(description_of(path))
    assert machine.parameters == plain.parameters
    assert machine.nominal == pytest.approx(plain.nominal, rel=1e-14, abs=1e-17)
    assert machine.joints == plain.joints
    assert machine.closures == plain.closures
    assert machine.closures[: len(machine.struts)] == tuple(s.name for s in machine.struts)
    assert machine.origin
    assert "\n" not in machine.name


def test_what_the_file_says(tmp_path: Path) -> None:
    machine = load_text(tmp_path, PLANAR)
    assert machine.name == "planar"
    assert machine.file == "machine.toml"
    assert machine.file_hash == hashlib.sha256(PLANAR.encode()).hexdigest()
    assert (machine.dof, machine.commanded) == (("x", "y"), ("x", "y"))
    assert machine.joints == ("d1", "d2")
    assert machine.components == ("x", "y")
    assert machine.accuracy.target == 0.0005
    assert machine.accuracy.angle_target is None
    assert machine.unit_labels["length"] == "mm"
    assert machine.unit_labels["stress"] == "Pa"
    first, second = machine.struts
    assert (first.drive, first.area, first.modulus) == ("d1", 28e-6, 210e9)
    assert (first.expansion, first.material) == (1.1e-5, None)
    assert second.expansion == MATERIALS["steel"].expansion
    assert second.modulus == MATERIALS["steel"].modulus
    assert second.axial_stiffness(0.5) == pytest.approx(210e9 * 28e-6 / 0.5, rel=1e-15)
    drive = machine.drives[1]
    assert (drive.kind, drive.coordinate, drive.drawing) == ("slider", "length", "line")
    assert drive.travel == (0.0, 0.9)
    assert drive.fields["origin"] == (0.6, 0.0, 0.0)
    sources = [source.name for source in machine.sources]
    assert sources == ["tolerance", "thermal", "elastic", "loads"]


@pytest.mark.parametrize(
    ("written", "coverage", "text"),
    [
        (None, None, "worst"),
        ('"worst"', None, "worst"),
        ('"95 %"', 0.95, "95 %"),
        ('"99.7%"', 0.997, "99.7 %"),
        ('"90 percent"', 0.9, "90 %"),
        ('"0.5"', 0.5, "50 %"),
        ("0.95", 0.95, "95 %"),
    ],
)
def test_at_which_coverage_an_accuracy_is_asked(
    tmp_path: Path, written: str | None, coverage: float | None, text: str
) -> None:
    key = "" if written is None else f"at = {written}\n"
    accuracy = load_text(tmp_path, edited(PLANAR, ("[accuracy]\n", f"[accuracy]\n{key}"))).accuracy
    assert accuracy.at == coverage
    assert (accuracy.at_text, accuracy.target) == (text, 0.0005)
    if written is not None:
        told = load_text(tmp_path, PLANAR, f"accuracy.at={written}").accuracy
        assert told == accuracy


def test_a_coverage_alone_asks_nothing(tmp_path: Path) -> None:
    text = edited(PLANAR, ('target = "0.5 mm"', 'at = "95 %"'))
    accuracy = load_text(tmp_path, text).accuracy
    assert accuracy.at == pytest.approx(0.95)
    assert not accuracy.asks
    assert load_text(tmp_path, PLANAR).accuracy.asks


def test_the_poses_run_first_axis_fastest(tmp_path: Path) -> None:
    machine = load_text(tmp_path, PLANAR)
    poses = machine.poses()
    assert poses.shape == (15, 2)
    assert machine.workspace.shape == (5, 3)
    assert poses[:6, 0] == pytest.approx([0.2, 0.25, 0.3, 0.35, 0.4, 0.2], abs=1e-15)
    assert poses[:6, 1] == pytest.approx([0.1] * 5 + [0.2], abs=1e-15)
    assert poses[-1] == pytest.approx([0.4, 0.3], abs=1e-15)
    assert machine.home == pytest.approx([0.3, 0.2], abs=1e-15)


def test_home_names_some_and_the_rest_is_zero(tmp_path: Path) -> None:
    machine = load_text(tmp_path, HEXAPOD)
    assert machine.home == pytest.approx([0, 0, 0.65, 0, 0, 0], abs=1e-15)
    assert machine.workspace.shape == (3, 1, 2, 1, 1, 2)
    assert np.unique(machine.poses()[:, 5]) == pytest.approx(np.radians([-5, 5]))


def test_axes_that_the_grid_does_not_name_stay_at_home(tmp_path: Path) -> None:
    machine = load_text(tmp_path, edited(HEXAPOD, ("z = 650", "z = 650, y = 7, a = 3")))
    assert np.unique(machine.poses()[:, 1]) == pytest.approx([0.007])
    assert np.unique(machine.poses()[:, 3]) == pytest.approx([math.radians(3)])


def test_listed_poses(tmp_path: Path) -> None:
    text = edited(
        PLANAR,
        ("grid = { x = [200, 400, 5], y = [100, 300, 3] }", 'poses = [[200, "1 cm"], [400.5, 30]]'),
    )
    machine = load_text(tmp_path, text)
    assert machine.poses() == pytest.approx(np.array([[0.2, 0.01], [0.4005, 0.03]]), abs=1e-15)
    assert machine.home == pytest.approx([0.30025, 0.02], abs=1e-15)
    assert machine.workspace.shape == (2,)


def test_a_file_without_poses_is_good_until_they_are_wanted(tmp_path: Path) -> None:
    text = PLANAR[: PLANAR.index("[workspace]")]
    machine = load_text(tmp_path, text)
    assert machine.workspace is None
    with pytest.raises(RequestError) as caught:
        machine.poses()
    assert caught.value.problems[0].code == "no-workspace"


def test_the_condition(tmp_path: Path) -> None:
    condition = load_text(tmp_path, PLANAR).condition
    assert condition.reference_temperature == pytest.approx(293.15)
    assert condition.temperature("strut.1") == pytest.approx(308.15)
    assert condition.temperature_rise("strut.1") == pytest.approx(15.0)
    assert condition.wrench == pytest.approx([1200, -1500, 0, 0, 0, 0])


@pytest.mark.parametrize(
    "table",
    [
        'temperature = { default = 30, "strut.1" = 40, "drive.d1" = 25 }',
        "temperature = { default = 30, strut.1 = 40, drive = { d1 = 25 } }",
        "temperature.default = 30\ntemperature.strut.1 = 40\ntemperature.drive.d1 = 25",
    ],
)
def test_temperatures_by_part(table: str, tmp_path: Path) -> None:
    text = edited(PLANAR, ('kind = "slider"', 'kind = "slider"\nmaterial = "steel"'))
    condition = load_text(tmp_path, edited(text, ("temperature = 35", table))).condition
    parts = ("strut.1", "strut.2", "drive.d1")
    temperatures = [condition.temperature(part) - 273.15 for part in parts]
    assert temperatures == pytest.approx([40, 30, 25])


def test_parts_without_a_default_are_at_the_reference_temperature(tmp_path: Path) -> None:
    text = edited(PLANAR, ("temperature = 35", 'temperature = { "strut.1" = 40 }'))
    condition = load_text(tmp_path, text).condition
    assert condition.temperature_rise("strut.2") == 0.0


def test_no_condition_is_20_degrees_and_no_force(tmp_path: Path) -> None:
    text = PLANAR[: PLANAR.index("[condition]")] + PLANAR[PLANAR.index("[workspace]") :]
    condition = load_text(tmp_path, text).condition
    assert condition.temperature("strut.1") == condition.reference_temperature == 293.15
    assert not condition.wrench.any()


def test_force_from_cutting_data(tmp_path: Path) -> None:
    """The founding paper's: 3000 N/mm2 x 0.2 mm chip, depth 2 mm and width 2.5 mm."""
    cutting = (
        'cutting = { specific_force = "3000 N/mm^2", chip_thickness = 0.2, depth = 2, '
        "width = 2.5, depth_direction = [2, 0, 0], width_direction = [0, -1, 0] }"
    )
    text = edited(PLANAR, ("force = { x = 1200, y = -1500 }", cutting))
    assert load_text(tmp_path, text).condition.force == pytest.approx((1200, -1500, 0))


def test_moment(tmp_path: Path) -> None:
    text = edited(PLANAR, ("[workspace]", 'moment = { z = "4 N m" }\n[workspace]'))
    assert load_text(tmp_path, text).condition.moment == (0, 0, 4)


def test_outright_keys_win_over_the_material(tmp_path: Path) -> None:
    text = edited(PLANAR, ('"steel"', '"steel"\nexpansion = "9e-6 1/K"\nstiffness = "9 N/um"'))
    strut = load_text(tmp_path, text).struts[1]
    assert strut.expansion == 9e-6
    assert strut.modulus == MATERIALS["steel"].modulus
    assert strut.axial_stiffness(0.5) == pytest.approx(9e6)


def test_a_unit_change_changes_nothing(tmp_path: Path) -> None:
    inches = edited(
        PLANAR,
        ('length = "mm"', 'length = "in"'),
        ("travel = [0, 900]", 'travel = [0, "0.9 m"]'),
        ("travel = [0, 900]", 'travel = [0, "90 cm"]'),
        ("origin = [600,", 'origin = ["600 mm",'),
        ("length = 500", 'length = "0.5 m"'),
        ("length = 500", 'length = "500000 um"'),
        ("[-0.3, 0.3]", '["-0.3 mm", "0.3 mm"]'),
        ("x = [200, 400,", 'x = ["200 mm", "400 mm",'),
        ("y = [100, 300,", 'y = ["100 mm", "300 mm",'),
        ("temperature = 35", 'temperature = "95 degF"'),
    )
    one, other = load_text(tmp_path, PLANAR), load_text(tmp_path, inches)
    assert other.nominal == pytest.approx(one.nominal, rel=1e-15)
    assert other.poses() == pytest.approx(one.poses(), rel=1e-15)
    assert other.condition.temperature("strut.1") == pytest.approx(308.15, rel=1e-15)


def test_a_strut_on_the_frame(tmp_path: Path) -> None:
    """Commanded x alone, by one drive; the other strut hangs on the frame and has a length."""
    text = edited(
        PLANAR,
        ('dof = ["x", "y"]', 'dof = ["x", "y"]\ncommanded = ["x"]'),
        ('drive = "d2"\nbase = [0, 0, 0]', "base = [600, 500, 0]"),
        (", y = [100, 300, 3]", ""),
        ("grid =", "home = { x = 300, y = 100 }\ngrid ="),
    )
    text = text[: text.index('[[drive]]\nname = "d2"')] + text[text.index("[[strut]]") :]
    machine = load_text(tmp_path, text)
    assert machine.commanded == ("x",)
    assert machine.struts[1].drive is None
    assert machine.poses().shape == (5, 1)


def test_every_kind_of_drive_has_its_coordinate() -> None:
    kinds = {kind.kind: (kind.coordinate, kind.sets_length) for kind in drive_kinds().values()}
    known = {
        "slider": ("length", False),
        "crank": ("angle", False),
        "telescopic": ("length", True),
    }
    assert known.items() <= kinds.items()
    assert {coordinate for coordinate, _ in kinds.values()} <= {"length", "angle"}


def test_every_material_states_where_it_is_from() -> None:
    assert set(MATERIALS) == {"steel", "aluminium", "cast iron", "invar", "carbon fibre"}
    for material in MATERIALS.values():
        assert 5e10 < material.modulus < 5e11
        assert -1e-6 < material.expansion < 3e-5
        assert material.expansion
        assert len(material.source) > 20


@pytest.mark.parametrize("holds", ["drawing", "calibrated"])
def test_what_the_controller_holds(tmp_path: Path, holds: str) -> None:
    said = load_text(tmp_path, f'{PLANAR}\n[controller]\nholds = "{holds}"\n')
    told = load_text(tmp_path, PLANAR, f"controller.holds={holds}")
    silent = load_text(tmp_path, PLANAR)
    assert (said.controller_holds, told.controller_holds) == (holds, holds)
    assert silent.controller_holds is None
    assert np.array_equal(said.nominal, silent.nominal)
    again = pickle.loads(pickle.dumps(said))  # noqa: S301
    assert again.controller_holds == holds
