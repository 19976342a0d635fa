"""The elastic source: load on the strut's length times its compliance."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from machine_texts import HEXAPOD, PLANAR, edited, line_of, load_text
from truepose.errors import MachineFileError, TrueposeError
from truepose.sources import acting

SECTION = 'section_area = "100 mm^2"\nmodulus = "200 GPa"'
STIFF = HEXAPOD.replace("platform = [", f"{SECTION}\nplatform = [")
PUSH = (1.0, -2.0, -10.0)  # so little that only the linear part remains


def test_a_strut_stretches_by_its_tension_over_its_stiffness(tmp_path: Path) -> None:
    machine = load_text(tmp_path, PLANAR)
    found = tp.budget(machine)
    # By hand: force balance in the plane, then the linear displacement, from which the exact one
    # differs by 0.15 mm over 500 mm of itself.
    poses = machine.poses()
    rails = np.array([0.0, 0.6])
    carriages = np.stack([np.broadcast_to(rails, (len(poses), 2)), machine.inverse(poses)], axis=2)
    along = (poses[:, np.newaxis, :] - carriages) / 0.5
    tension = np.linalg.solve(np.swapaxes(along, 1, 2), np.array([[[1200.0], [-1500.0]]]))[..., 0]
    assert np.abs(found.force.values - tension).max() < 1e-8
    stiffness = 28e-6 * np.array([210e9, machine.struts[1].modulus]) / 0.5
    moved = np.linalg.solve(along, (tension / stiffness)[..., np.newaxis])[..., 0]
    assert np.abs(found.error.sel(source="elastic") - moved).max() < 1e-3 * np.abs(moved).max()


@pytest.mark.parametrize("given", ["section and modulus", "outright"])
def test_the_compliance_is_that_of_the_present_length_or_outright(
    tmp_path: Path, given: str
) -> None:
    text = STIFF if given != "outright" else STIFF.replace(SECTION, 'stiffness = "20 kN/mm"')
    machine = load_text(tmp_path, text)
    found = tp.budget(machine, condition=machine.condition.replace(force=PUSH))
    lengths = machine.inverse(machine.poses()) + 0.6
    stiffness = 100e-6 * 200e9 / lengths if given != "outright" else 20e6
    sensitivity = machine.sensitivity(machine.poses())[:, :, machine.kernel.length_parameters]
    linear = np.einsum("ncl,nl->nc", sensitivity, found.force.values / stiffness)
    assert np.ptp(lengths) > 0.1
    assert np.abs(found.error.sel(source="elastic") - linear).max() < 1e-5 * np.abs(linear).max()


def test_cutting_data_give_the_force_of_the_paper(tmp_path: Path) -> None:
    cutting = """
[condition.cutting]
specific_force = "3000 N/mm^2"
chip_thickness = 0.2
depth = 2
width = 2.5
depth_direction = [1, 0, 0]
width_direction = [0, -1, 0]
"""
    text = edited(
        PLANAR, ("force = { x = 1200, y = -1500 }\n", ""), ("[workspace]", cutting + "[workspace]")
    )
    by_data, outright = load_text(tmp_path, text), load_text(tmp_path, PLANAR)
    assert "elastic" in {source.name for source in acting(by_data)}
    gap = tp.budget(by_data).error - tp.budget(outright).error
    assert np.abs(gap).max() < 1e-15


def test_it_acts_where_the_file_or_the_condition_gives_a_wrench(tmp_path: Path) -> None:
    unloaded = load_text(tmp_path, edited(PLANAR, ("force = { x = 1200, y = -1500 }\n", "")))
    assert "elastic" not in {source.name for source in acting(unloaded)}
    loaded = unloaded.condition.replace(force=(1200.0, -1500.0, 0.0))
    found = tp.budget(unloaded, condition=loaded)
    assert np.array_equal(found.error, tp.budget(load_text(tmp_path, PLANAR)).error)
    zero = load_text(tmp_path, edited(PLANAR, ("{ x = 1200, y = -1500 }", "{ x = 0 }")))
    assert not tp.budget(zero).error.sel(source="elastic").values.any()


def test_a_strut_that_does_not_say_how_stiff_it_is_is_refused(tmp_path: Path) -> None:
    text = edited(PLANAR, ('section_area = "28 mm^2"\nmodulus', "modulus"))
    with pytest.raises(MachineFileError) as caught:
        load_text(tmp_path, text)
    assert "no-stiffness" in {problem.code for problem in caught.value.problems}
    problem = next(p for p in caught.value.problems if p.code == "no-stiffness")
    assert problem.line == line_of(text, "[[strut]]")
    assert problem.found == "no section_area"


def test_a_condition_that_asks_for_what_no_strut_says_is_refused(tmp_path: Path) -> None:
    machine = load_text(tmp_path, HEXAPOD)
    with pytest.raises(TrueposeError) as caught:
        tp.budget(machine, condition=machine.condition.replace(force=PUSH))
    assert [problem.code for problem in caught.value.problems] == ["no-stiffness"] * 6
    assert caught.value.problems[0].found == "no section_area and no modulus"


def limb(text: str, drive: str = "", strut: str = "") -> str:
    """The planar machine with more keys in every drive and strut."""
    every_drive = text.replace('kind = "slider"', f'kind = "slider"\n{drive}')
    return every_drive.replace("base = [0, 0, 0]", f"base = [0, 0, 0]\n{strut}")


def compliance_of(machine: tp.Machine, name: str) -> np.ndarray:
    """(n,) compliance of one parameter; 0 where none is listed."""
    joints, placements, _ = machine.kernel.place(machine.poses())
    columns, values = machine.compliances(machine.kernel.lengths_at(joints, placements))
    column = machine.parameters.index(name)
    return values[:, columns == column].sum(axis=1)


def test_strut_and_joints_are_in_series_on_the_length(tmp_path: Path) -> None:
    joints = 'base_joint = { stiffness = "120 N/um" }\nplatform_joint = { stiffness = "80 N/um" }'
    stiff = load_text(tmp_path, PLANAR)
    soft = load_text(tmp_path, limb(PLANAR, strut=joints))
    gap = compliance_of(soft, "strut.1.length") - compliance_of(stiff, "strut.1.length")
    assert gap == pytest.approx(1 / 120e6 + 1 / 80e6)
    assert compliance_of(stiff, "strut.1.length") == pytest.approx(0.5 / (28e-6 * 210e9))


def test_a_telescopic_drive_is_in_series_with_its_strut(tmp_path: Path) -> None:
    drive = 'stiffness = { screw = "100 N/um", nut = "100 N/um" }'
    text = STIFF.replace('kind = "telescopic"', f'kind = "telescopic"\n{drive}')
    gap = compliance_of(load_text(tmp_path, text), "drive.d3.offset") - compliance_of(
        load_text(tmp_path, STIFF), "drive.d3.offset"
    )
    assert gap == pytest.approx(2e-8)
    direct = text.replace(drive, f'{drive}\nfeedback = "direct"')
    assert compliance_of(load_text(tmp_path, direct), "drive.d3.offset") == pytest.approx(
        compliance_of(load_text(tmp_path, STIFF), "drive.d3.offset")
    )


RIGID = PLANAR.replace('section_area = "28 mm^2"\n', "").replace('modulus = "210 GPa"\n', "")


def test_a_drive_gives_way_along_its_rail(tmp_path: Path) -> None:
    # By hand: the platform rests on two struts; the carriage takes the strut's part along the rail.
    machine = load_text(tmp_path, limb(RIGID, drive='stiffness = "40 N/um"'))
    found = tp.budget(machine)
    poses, carriages = machine.poses(), machine.inverse(machine.poses())
    along = (poses[:, np.newaxis] - np.stack([[[0.0, 0.6]] * 15, carriages], axis=2)) / 0.5
    tension = np.linalg.solve(np.swapaxes(along, 1, 2), np.array([[[1200.0], [-1500.0]]]))[..., 0]
    # A strut in tension pulls the carriage towards the tool.
    sagged = tension * along[..., 1] / 40e6
    moved = np.linalg.solve(along, (along[..., 1] * sagged)[..., np.newaxis])[..., 0]
    assert np.abs(found.error.sel(source="elastic") - moved).max() < 1e-3 * np.abs(moved).max()
    direct = load_text(
        tmp_path,
        limb(
            RIGID,
            drive='stiffness = "40 N/um"\nfeedback = "direct"',
            strut='stiffness = "1e9 N/um"',
        ),
    )
    assert np.abs(tp.budget(direct).error.sel(source="elastic")).max() < 1e-9


def test_a_crank_twists_by_its_moment_over_its_torsional_stiffness(tmp_path: Path) -> None:
    text = edited(
        RIGID.replace('kind = "slider"', 'kind = "crank"\nstiffness = "9 kN m/rad"')
        .replace("axis = [0, 1, 0]", "axis = [0, 0, 1]")
        .replace("base = [0, 0, 0]", "base = [300, 0, 0]")
        .replace("travel = [0, 900]", "travel = [-170, 170]")
        .replace('working_mode = "+"\n', ""),
        ("y = [100, 300, 3]", "y = [400, 500, 3]"),
    )
    machine = load_text(tmp_path, text)
    found = tp.budget(machine)
    joints = machine.inverse(machine.poses()[found.pose.values])
    elbow = 0.3 * np.stack([np.cos(joints), np.sin(joints)], axis=2)
    elbow[:, 1, 0] += 0.6
    along = (machine.poses()[found.pose.values][:, np.newaxis] - elbow) / 0.5
    tension = np.linalg.solve(np.swapaxes(along, 1, 2), np.array([[[1200.0], [-1500.0]]]))[..., 0]
    across = 0.3 * np.stack([-np.sin(joints), np.cos(joints)], axis=2)
    lever = (across * along).sum(axis=2)
    moved = np.linalg.solve(along, (lever * tension * lever / 9e3)[..., np.newaxis])[..., 0]
    gap = np.abs(found.error.sel(source="elastic") - moved).max()
    assert gap < 5e-2 * np.abs(moved).max()  # some mrad of twist: of second order
    load = machine.condition.replace(force=(1.2, -1.5, 0.0))
    small = tp.budget(machine, condition=load).error.sel(source="elastic")
    assert np.abs(1e3 * small - moved).max() < 1e-4 * np.abs(moved).max()


def test_what_the_base_joint_stands_on_gives_way_along_its_axes(tmp_path: Path) -> None:
    standing = 'base_stiffness = ["20 N/um", "30 N/um", inf]'
    machine = load_text(tmp_path, limb(RIGID, strut=standing))
    force = (12.0, -15.0, 0.0)
    found = tp.budget(machine, condition=machine.condition.replace(force=force))
    poses, carriages = machine.poses(), machine.inverse(machine.poses())
    along = (poses[:, np.newaxis] - np.stack([[[0.0, 0.6]] * 15, carriages], axis=2)) / 0.5
    tension = np.linalg.solve(np.swapaxes(along, 1, 2), np.array([[[12.0], [-15.0]]]))[..., 0]
    given = tension[..., np.newaxis] * along / [20e6, 30e6]
    moved = np.linalg.solve(along, (along * given).sum(axis=2)[..., np.newaxis])[..., 0]
    gap = np.abs(found.error.sel(source="elastic") - moved).max()
    assert gap < 1e-4 * np.abs(moved).max()
    uniform = load_text(tmp_path, limb(RIGID, strut='base_stiffness = "25 N/um"'))
    assert uniform.struts[0].base_stiffness == (25e6, 25e6, 25e6)


def test_stiffness_counts_what_elastic_does(tmp_path: Path) -> None:
    soft = limb(
        PLANAR,
        drive='stiffness = "40 N/um"',
        strut='base_stiffness = "90 N/um"\nbase_joint = { stiffness = "120 N/um" }',
    )
    machine = load_text(tmp_path, soft)
    load = machine.condition.replace(force=(1.0, -2.0, 0.0))
    moved = tp.budget(machine, condition=load).error.sel(source="elastic").values
    linear = machine.compliance(machine.poses()) @ [1.0, -2.0]
    assert np.abs(moved - linear).max() < 1e-5 * np.abs(linear).max()
    both = machine.stiffness(machine.poses()) @ machine.compliance(machine.poses())
    assert both == pytest.approx(np.broadcast_to(np.eye(2), both.shape), abs=1e-9)


def test_kienzle_gives_the_force_on_the_tool(tmp_path: Path) -> None:
    # k_c1.1 = 1500 N/mm2 and m_c = 0.25 at h = 0.16 mm: 1500 x 2.5 x 0.16^0.75 = 948.683 N.
    kienzle = (
        'kienzle = { specific_force = "1500 N/mm^2", exponent = 0.25, chip_thickness = 0.16, '
        "width = 2.5, direction = [3, -4, 0] }"
    )
    machine = load_text(tmp_path, edited(PLANAR, ("force = { x = 1200, y = -1500 }", kienzle)))
    assert machine.condition.force == pytest.approx(
        (0.6 * 948.6832981, -0.8 * 948.6832981, 0.0), rel=1e-9
    )
    assert "elastic" in {source.name for source in acting(machine)}
