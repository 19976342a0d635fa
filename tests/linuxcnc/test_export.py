"""What the export writes: limits, home, names, defaults and refusals. Needs no LinuxCNC."""

from __future__ import annotations

import configparser
import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from module_under_test import exported

import truepose as tp
from command_line import MACHINES
from machine_texts import PLANAR, edited, load_text
from sweeps import thinned
from truepose.compensation.commands import corrected_poses
from truepose.controllers._export import options_of
from truepose.controllers.linuxcnc import LinuxCNC
from truepose.errors import RequestError
from truepose.machine import Machine

EVERY = sorted(path.stem for path in MACHINES.glob("*.toml"))
QUICK = {"planar_two_slider", "rotary_delta", "3prs", "hexapod", "overconstrained"}
IN_MODULES = ("thermal", "elastic", "tolerance")
ANGLES = ("a", "b", "c")


def files_of(machine: Machine, **options: str) -> Mapping[str, str]:
    """The export's files, without sources that a controller cannot compute."""
    others = [source.name for source in machine.sources if source.name not in IN_MODULES]
    return exported(machine, without=",".join(others), **options)


def sections(ini: str) -> configparser.ConfigParser:
    parsed = configparser.ConfigParser(strict=True, comment_prefixes=("#",))
    parsed.read_string(ini)
    return parsed


def limits(machine: Machine, ini: configparser.ConfigParser) -> np.ndarray:
    """(2, n_commanded) ends of the box, SI."""
    ends = [
        [float(ini[f"AXIS_{name.upper()}"][key]) for name in machine.commanded]
        for key in ("MIN_LIMIT", "MAX_LIMIT")
    ]
    units = [np.pi / 180 if name in ANGLES else 1e-3 for name in machine.commanded]
    return np.array(ends) * units


def number(c: str, name: str) -> float:
    found = re.search(rf"h->{name} = (\S+);", c)
    assert found
    return float(found[1])


def problem(machine: Machine, **options: str) -> str:
    with pytest.raises(RequestError) as caught:
        LinuxCNC.export(machine, options_of(LinuxCNC, machine, options))
    return caught.value.problems[0].code


def changed(tmp_path: Path, *changes: tuple[str, str]) -> Machine:
    """The planar machine with its text changed."""
    return load_text(tmp_path, edited(PLANAR, *changes))


@pytest.mark.parametrize("stem", thinned(EVERY, QUICK))
def test_home_and_limits(stem: str) -> None:
    machine = tp.load(MACHINES / f"{stem}.toml")
    ini = sections(files_of(machine)["ini"])
    assert ini["KINS"]["KINEMATICS"].partition(" ")[0] == f"truepose_{stem}"
    assert int(ini["KINS"]["JOINTS"]) == len(machine.joints)
    assert ini["TRAJ"]["COORDINATES"].lower().split() == list(machine.commanded)
    units = [np.pi / 180 if drive.coordinate == "angle" else 1e-3 for drive in machine.drives]
    rows = [ini[f"JOINT_{number}"] for number in range(len(machine.joints))]
    home = np.array([float(row["HOME"]) for row in rows]) * units
    assert [row["TYPE"] for row in rows] == [
        "ANGULAR" if drive.coordinate == "angle" else "LINEAR" for drive in machine.drives
    ]
    assert all(row["HOME"] == row["HOME_OFFSET"] for row in rows)
    for row, drive, unit in zip(rows, machine.drives, units, strict=True):
        ends = np.array([float(row["MIN_LIMIT"]), float(row["MAX_LIMIT"])]) * unit
        assert ends == pytest.approx(drive.travel, abs=1e-12)
    # The pose and the joints of home are one, to the last digits.
    pose = np.array([float(word) for word in ini["TRAJ"]["HOME"].split()])
    pose *= [1e-3] * 3 + [np.pi / 180] * 3
    commanded = pose[["xyzabc".index(name) for name in machine.commanded]]
    assert np.abs(machine.inverse(commanded) - home).max() < 1e-15 * 1e3
    low, high = limits(machine, ini)
    assert (low <= commanded).all()
    assert (commanded <= high).all()


@pytest.mark.parametrize(
    "stem", thinned(["planar_two_slider", "rotary_delta", "hexapod", "3rrr"], QUICK)
)
def test_the_box_keeps_its_word(stem: str) -> None:
    """At poses that the export did not look at, and with every joint at the clamp."""
    machine = tp.load(MACHINES / f"{stem}.toml")
    files = files_of(machine, clamp="2 mm")
    low, high = limits(machine, sections(files["ini"]))
    poses = np.random.default_rng(2).uniform(low, high, (5000, len(low)))
    joints, status = machine.inverse(poses, status=True)
    assert not status.any()
    for drive, column in zip(machine.drives, joints.T, strict=True):
        room = 2e-3 if drive.coordinate == "length" else 2e-3 / _radius(machine)
        assert column.min() >= drive.travel[0] + room - 1e-9
        assert column.max() <= drive.travel[1] - room + 1e-9


def _radius(machine: Machine) -> float:
    """m of the arms, all equal: from the axis to where the strut stands at home."""
    joints, placements, _ = machine.kernel.place(
        machine.home[[machine.dof.index(name) for name in machine.commanded]][np.newaxis]
    )
    drive, base = machine.drives[0], machine.kernel.joint_centres(joints, placements)[0, 0, 0]
    axis = np.array(drive.fields["axis"], float)
    axis /= np.linalg.norm(axis)
    away = base - np.array(drive.fields["origin"], float)
    return float(np.linalg.norm(away - axis * (axis @ away)))


def test_a_workspace_beyond_the_travel_is_cut_to_it(tmp_path: Path) -> None:
    wide = changed(tmp_path, ("y = [100, 300, 3]", "y = [100, 700, 3]"))
    # At x = 200 the second carriage stands 300 mm above the tool, the first sqrt(500^2 - 200^2).
    most = 900.0 - np.sqrt(500.0**2 - 200.0**2)
    files = files_of(wide, clamp="5 mm")
    low, high = limits(wide, sections(files["ini"])) * 1e3
    assert low == pytest.approx([200.0, 100.0])
    assert high[0] == pytest.approx(400.0)
    # Within one pose of the dense grid, which is shrunk in a few rounds.
    assert most - 5.0 - 5.0 < high[1] <= most - 5.0
    assert "larger" in files["ini"]
    assert "larger" not in files_of(tp.load(MACHINES / "planar_two_slider.toml"))["ini"]


def test_home_outside_the_grid_is_in_the_box(tmp_path: Path) -> None:
    outside = changed(tmp_path, ("[accuracy]", "home = { x = 300, y = 50 }\n[accuracy]"))
    low, _ = limits(outside, sections(files_of(outside)["ini"]))
    assert low == pytest.approx([0.2, 0.05])


def test_home_has_all_its_digits(tmp_path: Path) -> None:
    home = "home = { x = 290.12345678901234, y = 100.98765432109876 }\n[accuracy]"
    machine = changed(tmp_path, ("[accuracy]", home))
    ini = sections(files_of(machine)["ini"])
    pose = np.array([float(word) for word in ini["TRAJ"]["HOME"].split()[:2]])
    assert np.abs(pose / 1e3 / machine.home - 1.0).max() < 1e-15
    joints = np.array([float(ini[f"JOINT_{number}"]["HOME"]) for number in range(2)])
    assert np.abs(joints / 1e3 / machine.inverse(machine.home) - 1.0).max() < 1e-15


def test_an_axis_that_the_workspace_holds_has_a_little_room() -> None:
    """The limits meet poses that are off by rounding, and what corrected programs ask for."""
    machine = tp.load(MACHINES / "hexapod.toml")
    c = sections(files_of(machine)["ini"])["AXIS_C"]
    assert float(c["MIN_LIMIT"]) == -float(c["MAX_LIMIT"])
    poses = machine.poses()
    asked = np.degrees(np.abs(corrected_poses(machine, poses)[0] - poses)[:, 5].max())
    assert 2.0 * asked < float(c["MAX_LIMIT"]) < 0.5


@pytest.mark.parametrize(
    ("stem", "locked", "held", "following"),
    [
        ("planar_two_slider", "Z, A, B, C", None, None),
        ("hexapod", None, "Axis C is locked at 0 degrees", None),
        ("overconstrained", "Z, A, B", None, "C"),
        ("linear_delta", None, None, "A, B, C"),
        ("hexapod_all_sources", None, None, None),
    ],
)
def test_an_axis_that_does_not_move_says_why(
    stem: str, locked: str | None, held: str | None, following: str | None
) -> None:
    machine = tp.load(MACHINES / f"{stem}.toml")
    others = ",".join(source.name for source in machine.sources if source.name not in IN_MODULES)
    export = LinuxCNC.export(machine, options_of(LinuxCNC, machine, {"without": others}))
    ini = next(text for name, text in export.files.items() if name.endswith(".ini"))
    c = next(text for name, text in export.files.items() if name.endswith(".c"))
    told = {
        "No axis {}: the machine has no such freedom": locked,
        "No axis {}: not commanded": following,
        "{}: the machine file's": held,
    }
    for text, names in told.items():
        assert (text.partition("{}")[2] in ini) == (names is not None), text
        assert names is None or text.format(names) in ini
    # In the section of its axis, whose limits are the room that it has.
    assert held is None or re.search(r"\[AXIS_C\]\n# Axis C is locked", ini)
    # And in what the export says, and in the module's head.
    said = [line for line in export.statement if line.startswith(("locked: ", "not commanded: "))]
    assert [line.partition(", for")[0] for line in said if line.startswith("locked")] == [
        f"locked: {names}" for names in ((locked or "").lower(), "c" if held else "") if names
    ]
    assert any(line.startswith("not commanded") for line in said) == (following is not None)
    head = c.partition("*/")[0]
    assert ("(locked, the machine has no such freedom: " in head) == (locked is not None)
    # Every one of the six axes is commanded, or said to be missing.
    absent = [name for text in (locked, following) if text for name in text.lower().split(", ")]
    assert sorted([*machine.commanded, *absent]) == sorted("xyzabc")


def test_a_home_that_leaves_no_room_for_the_clamp_is_refused(tmp_path: Path) -> None:
    high = changed(tmp_path, ("[accuracy]", "home = { x = 300, y = 499 }\n[accuracy]"))
    assert problem(high, clamp="5 mm") == "controller-cannot"
    files_of(high, clamp="0.5 mm")


def test_the_clamp_is_three_times_the_most_over_the_workspace() -> None:
    machine = tp.load(MACHINES / "hexapod.toml")
    largest = 0.0
    for sign in (1.0, -1.0):
        given = machine.condition
        rise = given.default_temperature - given.reference_temperature
        result = tp.compensate(
            machine,
            None,
            given.replace(
                temperature=given.reference_temperature + sign * rise,
                force=[sign * component for component in given.force],
            ),
        )
        added = result["joint_corrected"].values - result["joint_nominal"].values
        largest = max(largest, float(np.abs(added).max()))
    c = files_of(machine)["c"]
    assert 3e3 * largest <= number(c, "clamp") < 3.1e3 * largest
    assert number(files_of(machine, clamp="0.25 mm")["c"], "clamp") == 0.25


def test_rates_and_plausible_loads() -> None:
    machine = tp.load(MACHINES / "planar_two_slider.toml")
    c = files_of(machine, rate_limit="0.5")["c"]
    assert number(c, "rate_limit") == 0.5
    assert number(c, "force_max") == pytest.approx(10 * np.hypot(1200, 1500), rel=1e-5)
    assert number(c, "moment_max") == 0.0  # the file says none: any is believed


@pytest.mark.parametrize(
    ("option", "value"),
    [("rate_limit", "0"), ("rate_limit", "-1"), ("clamp", "-1 mm"), ("clamp", "3 N"), ("rte", "1")],
)
def test_options_that_cannot_be(option: str, value: str) -> None:
    machine = tp.load(MACHINES / "planar_two_slider.toml")
    assert problem(machine, **{option: value}) == "bad-option"


def test_no_workspace(tmp_path: Path) -> None:
    text = ("[workspace]\ngrid = { x = [200, 400, 5], y = [100, 300, 3] }\n", "")
    assert problem(changed(tmp_path, text)) == "no-workspace"


def test_names_do_not_get_out_of_comments_and_strings(tmp_path: Path) -> None:
    name = 'a */ "b" \\\\ @title@ # \\n ünd'
    machine = changed(tmp_path, ('name = "planar"', f"name = '{name}'"))
    files = files_of(machine)
    head, _, rest = files["c"].partition(" */\n")
    assert "*/" not in head
    assert "b" in head.splitlines()[0]
    assert 'MODULE_DESCRIPTION("' in rest
    assert all("\n" not in line for line in files["ini"].splitlines())
    assert files["ini"].splitlines()[1].startswith("# Written by truepose")
    # Whatever the file is called, LinuxCNC can load a module of that name.
    odd = tmp_path / "3 Achsen (neu) é.toml"
    odd.write_text(PLANAR)
    exports = LinuxCNC.export(tp.load(odd), options_of(LinuxCNC, machine)).files
    assert {name.partition(".")[0] for name in exports} == {"truepose_3_achsen_neu"}


def test_the_licence() -> None:
    c = files_of(tp.load(MACHINES / "planar_two_slider.toml"))["c"]
    assert "SPDX-License-Identifier: GPL-2.0-or-later" in c
    assert 'MODULE_LICENSE("GPL");' in c


@pytest.mark.parametrize(
    ("name", "families"),
    [
        ("hexapod_all_sources", ["strut-[0-5]", "drive-[135]", "frame", "platform"]),
        ("linear_delta", ["strut-[0-5]", "drive-[0-2]", "carriage-[0-2]", "frame", "platform"]),
    ],
)
def test_pins_by_part(name: str, families: list[str]) -> None:
    """Drives and bodies have a temperature where it counts; parts go by number, not by name."""
    files = files_of(tp.load(MACHINES / f"{name}.toml"))
    pins = re.findall(r"=> (truepose\.\S+-temperature)", files["hal"])
    assert len(pins) == len(set(pins))
    for family in families:
        found = [p for p in pins if re.fullmatch(rf"truepose\.{family}-temperature", p)]
        several = re.search(r"\[(.*)\]", family)
        listed = {"0-5": 6, "0-2": 3, "135": 3}
        assert len(found) == (listed[several[1]] if several else 1), family
        pins = [p for p in pins if p not in found]
    assert not pins
    pins = re.findall(r"=> (truepose\.\S+-temperature)", files["hal"])
    listed = re.search(r"TEMPERATURE_NAME\[.*?\] = \{(.*?)\}", files["c"])
    assert listed
    assert [f"truepose.{name}-temperature" for name in re.findall(r'"(.*?)"', listed[1])] == pins


def test_update_comes_first() -> None:
    hal = files_of(tp.load(MACHINES / "planar_two_slider.toml"))["hal"]
    order = re.findall(r"^addf (\S+) servo-thread", hal, re.MULTILINE)
    assert order == ["truepose.update", "motion-command-handler", "motion-controller"]
