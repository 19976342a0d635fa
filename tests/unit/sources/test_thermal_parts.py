"""Thermal growth of drives, frame, platform and tool, against laws worked out here by themselves.

Each test builds the warm machine's numbers on a second road, by integrating the strain or by
turning and stretching points, and compares them with the deviation or with the tool's error.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray

import truepose as tp
from build_machine import MACHINES
from machine_texts import HEXAPOD, PLANAR, edited, line_of, load_text
from truepose.errors import MachineFileError, TrueposeError
from truepose.machine import Condition, Machine
from truepose.sources._growth import Growth, along_line
from truepose.sources.thermal import Thermal

ALPHA = 1.7e-5
REFERENCE = 293.15
Floats = NDArray[np.float64]


def deviations(machine: Machine, condition: Condition, poses: ArrayLike) -> dict[str, Floats]:
    """Parameter -> its shift (n,) at poses (n, n_commanded)."""
    from truepose.runs.poses import PoseRun

    table = np.atleast_2d(np.asarray(poses, float))
    (block,) = PoseRun(machine, table, condition)
    found = Thermal(requested=True).deviation(machine, condition, block)
    assert not found.half.any()
    assert len(set(found.parameters.tolist())) == found.parameters.size
    shift = np.broadcast_to(found.shift, (len(table), found.parameters.size))
    return {machine.parameters[k]: shift[:, i] for i, k in enumerate(found.parameters)}


def of_point(shifts: dict[str, Floats], point: str) -> Floats:
    """(n or 1, 3) shift of a point; a coordinate without a column stays."""
    found = [shifts.get(f"{point}.{axis}", np.zeros(1)) for axis in "xyz"]
    return np.stack(np.broadcast_arrays(*found), axis=1)


def without_lengths(shifts: dict[str, Floats]) -> dict[str, Floats]:
    return {name: each for name, each in shifts.items() if each.any()}


def planar(folder: Path, *edits: tuple[str, str], more: str = "") -> Machine:
    """The planar machine, cold, whose struts do not expand."""
    text = edited(
        PLANAR,
        ('expansion = "1.1e-5 1/K"', 'expansion = "0 1/K"'),
        ('material = "steel"', 'modulus = "210 GPa"\nexpansion = "0 1/K"'),
        ("temperature = 35\n", ""),
        *edits,
    )
    return load_text(folder, text + more)


def hexapod(folder: Path, more: str = "", strut: str = 'expansion = "0 1/K"') -> Machine:
    return load_text(folder, HEXAPOD.replace("platform = [", f"{strut}\nplatform = [") + more)


# ---- the laws themselves


def test_a_rod_integrates_its_strain() -> None:
    way, rise, gradient = np.array([[0.7], [-0.3]]), 5.0, 11.0
    found = along_line(ALPHA, rise, gradient, way)[:, 0]
    for end, growth in zip(way[:, 0], found, strict=True):
        s = np.linspace(0.0, end, 20001)
        assert growth == pytest.approx(np.trapezoid(ALPHA * (rise + gradient * s), s), rel=1e-8)


def test_the_field_of_a_body_has_the_strain_of_its_temperature_and_no_other() -> None:
    random = np.random.default_rng(1)
    gradient, anchor, point = (random.normal(size=3) for _ in range(3))
    growth = Growth(ALPHA, 7.0, gradient, anchor)
    step = 1e-4  # the field is of second order: central differences are exact but for rounding
    moves = step * np.eye(3)
    slope = np.stack(
        [
            (growth.displacement(point + d)[0] - growth.displacement(point - d)[0]) / (2 * step)
            for d in moves
        ],
        axis=1,
    )
    temperature = 7.0 + gradient @ (point - anchor)
    assert np.allclose(0.5 * (slope + slope.T), ALPHA * temperature * np.eye(3), atol=1e-13)
    curl = np.array(
        [slope[2, 1] - slope[1, 2], slope[0, 2] - slope[2, 0], slope[1, 0] - slope[0, 1]]
    )
    assert np.allclose(growth.turn(point), 0.5 * curl, atol=1e-13)
    assert np.allclose(growth.strain(point), ALPHA * temperature)
    assert not growth.displacement(anchor).any()
    assert not growth.turn(anchor).any()


def test_a_rise_over_time_is_a_row_for_each_time() -> None:
    rises = np.array([[0.0], [4.0], [9.0]])
    growth = Growth(ALPHA, rises, np.array([0.0, 0.0, 2.0]), np.zeros(3))
    found = growth.displacement([0.1, 0.2, 0.3])
    for rise, row in zip(rises[:, 0], found, strict=True):
        alone = Growth(ALPHA, float(rise), growth.gradient, growth.anchor)
        assert np.allclose(row, alone.displacement([0.1, 0.2, 0.3])[0], rtol=1e-14)


# ---- struts


def test_a_gradient_along_a_strut(tmp_path: Path) -> None:
    machine = hexapod(tmp_path, strut=f'expansion = "{ALPHA} 1/K"')
    condition = machine.condition.replace(
        temperature={"strut.2": REFERENCE + 6}, gradient={"strut.2": 9.0}
    )
    shifts = without_lengths(deviations(machine, condition, [[0, 0, 0.65, 0, 0, 0]]))
    base, platform = np.array([-0.1, 0.3, 0.0]), np.array([0.02, 0.12, 0.65])
    length = np.linalg.norm(platform - base)
    s = np.linspace(0.0, length, 2001)
    expected = np.trapezoid(ALPHA * (6 + 9 * s), s)
    assert shifts.keys() == {"drive.d2.offset"}
    assert shifts["drive.d2.offset"] == pytest.approx(expected, rel=1e-6)


# ---- drives


SCREW = (
    'kind = "slider"',
    f'kind = "slider"\nexpansion = "{ALPHA} 1/K"\nfixed_at = 300\noffset = 40',
)


def test_a_screw_that_grows_carries_its_carriage_from_where_it_is_fixed(tmp_path: Path) -> None:
    machine = planar(tmp_path, SCREW, ("travel = [0, 900]", "travel = [0, 900]\nscale = 0.98"))
    condition = machine.condition.replace(
        temperature={"drive.d1": REFERENCE + 12}, gradient={"drive.d1": 20.0}
    )
    poses = machine.poses()
    joints = machine.inverse(poses)[:, 0]
    shifts = deviations(machine, condition, poses)
    assert without_lengths(shifts).keys() == {"drive.d1.scale", "drive.d1.offset"}
    for row, q in enumerate(joints):
        # Integrate the warm screw from where it is fixed to where the command sets the nut.
        s = np.linspace(0.0, q - 0.3, 4001)
        growth = np.trapezoid(ALPHA * (12 + 20 * s), s)
        wanted = 0.98 * (q + growth) + 0.04
        scale = 0.98 + shifts["drive.d1.scale"][row]
        offset = 0.04 + np.broadcast_to(shifts["drive.d1.offset"], joints.shape)[row]
        assert scale * q + offset == pytest.approx(wanted, rel=0, abs=1e-12)


def test_the_fixed_point_stays(tmp_path: Path) -> None:
    machine = planar(tmp_path, SCREW)
    condition = machine.condition.replace(temperature={"drive.d1": REFERENCE + 40})
    assert deviations(machine, condition, [[0.3, 0.2]])["drive.d1.offset"] == pytest.approx(
        -ALPHA * 40 * 0.3
    )


def test_a_scale_along_a_telescopic_strut(tmp_path: Path) -> None:
    text = HEXAPOD.replace("platform = [", 'expansion = "0 1/K"\nplatform = [')
    text = edited(
        text, ("offset = 600", f'offset = 600\nexpansion = "{ALPHA} 1/K"\nfixed_at = -50')
    )
    machine = load_text(tmp_path, text)
    condition = machine.condition.replace(temperature={"drive.d1": REFERENCE + 10})
    shifts = without_lengths(deviations(machine, condition, [[0, 0, 0.65, 0, 0, 0]]))
    assert shifts.keys() == {"drive.d1.scale", "drive.d1.offset"}
    assert shifts["drive.d1.scale"] == pytest.approx(ALPHA * 10)
    assert shifts["drive.d1.offset"] == pytest.approx(ALPHA * 10 * 0.05)


def test_a_scale_along_a_telescopic_strut_has_all_of_its_length(tmp_path: Path) -> None:
    """Three struts from a ring to one point, which rises as their lengths grow: by Pythagoras."""
    rows = "".join(
        f'[[drive]]\nname = "d{n}"\nkind = "telescopic"\noffset = 400\nscale = 1.1\n'
        f'travel = [0, 800]\nexpansion = "{ALPHA} 1/K"\n'
        f'[[strut]]\nname = "{n}"\ndrive = "d{n}"\nbase = [{x}, {y}, 0]\n'
        f'platform = [0, 0, 0]\nexpansion = "0 1/K"\n'
        for n, (x, y) in enumerate(((400, 0), (-240, 320), (-240, -320)), start=1)
    )
    head = (
        'schema = 1\n[machine]\nname = "tripod"\ndof = ["x", "y", "z"]\n'
        '[units]\nlength = "mm"\nangle = "deg"\n[workspace]\nposes = [[0, 0, 650]]\n'
    )
    machine = load_text(tmp_path, head + rows)
    warm = machine.condition.replace(temperature=REFERENCE + 10)
    found = tp.budget(machine, [[0, 0, 0.65]], warm).error.sel(source="thermal").values[0]
    length = np.hypot(0.4, 0.65) * (1 + ALPHA * 10)
    assert np.allclose(found, [0, 0, np.sqrt(length**2 - 0.4**2) - 0.65], rtol=0, atol=1e-14)
    # Fixed where the file says so: at 100 mm of the coordinate, 510 mm up the strut.
    at = load_text(tmp_path, head + rows.replace("scale = 1.1", "scale = 1.1\nfixed_at = 100"))
    found = tp.budget(at, [[0, 0, 0.65]], warm).error.sel(source="thermal").values[0]
    length = 0.51 + (np.hypot(0.4, 0.65) - 0.51) * (1 + ALPHA * 10)
    assert np.allclose(found, [0, 0, np.sqrt(length**2 - 0.4**2) - 0.65], rtol=0, atol=1e-14)


def test_a_telescopic_strut_does_not_grow_twice(tmp_path: Path) -> None:
    text = HEXAPOD.replace("platform = [", 'material = "steel"\nplatform = [')
    text = edited(text, ("offset = 600", "offset = 600\nexpansion = 1e-5"))
    text = edited(text, ('length = "mm"', 'length = "mm"\nexpansion = "1/K"'))
    with pytest.raises(MachineFileError) as caught:
        load_text(tmp_path, text)
    (problem,) = caught.value.problems
    assert problem.code == "excluding-keys"
    assert problem.line == line_of(text, "expansion = 1e-5")
    assert "for the strut" in str(problem)


def test_the_arm_of_a_crank_grows_about_its_axis() -> None:
    settings = ["drive.a.material=aluminium"]
    machine = tp.load(MACHINES / "rotary_delta.toml", settings)
    drive = machine.drives[0]
    assert drive.expansion is not None
    condition = machine.condition.replace(
        temperature={"default": REFERENCE, drive.part: REFERENCE + 9}
    )
    shifts = without_lengths(deviations(machine, condition, machine.poses()[:2]))
    carried = [strut for strut in machine.struts if strut.drive == drive.name]
    assert {name.rsplit(".", 1)[0] for name in shifts} == {f"{s.part}.base" for s in carried}
    for strut in carried:
        base = machine.nominal[[machine.parameters.index(f"{strut.part}.base.{a}") for a in "xyz"]]
        found = of_point(shifts, f"{strut.part}.base")
        assert np.allclose(found, drive.expansion * 9 * base, rtol=1e-12)


# ---- frame


FRAME = f'[frame]\nexpansion = "{ALPHA} 1/K"\nanchor = [100, -50, 20]\n'


def test_a_frame_grows_about_its_anchor(tmp_path: Path) -> None:
    machine = hexapod(tmp_path, FRAME)
    condition = machine.condition.replace(temperature={"frame": REFERENCE + 8})
    shifts = without_lengths(deviations(machine, condition, [[0, 0, 0.65, 0, 0, 0]]))
    assert {name.split(".")[2] for name in shifts} == {"base"}
    found = of_point(shifts, "strut.1.base")[0]
    assert np.allclose(found, ALPHA * 8 * (np.array([0.3, 0.1, 0]) - [0.1, -0.05, 0.02]))


def test_a_uniform_frame_scales_the_machine_that_stands_on_it(tmp_path: Path) -> None:
    """A frame that carries guideways: their origins go, and nothing else."""
    machine = planar(tmp_path, more=FRAME)
    condition = machine.condition.replace(temperature={"frame": REFERENCE + 8})
    shifts = without_lengths(deviations(machine, condition, [[0.3, 0.2]]))
    assert {name.rsplit(".", 1)[0] for name in shifts} == {"drive.d1.origin", "drive.d2.origin"}
    found = of_point(shifts, "drive.d2.origin")[0]
    assert np.allclose(found, ALPHA * 8 * (np.array([0.6, 0, 0]) - [0.1, -0.05, 0.02]))


def warm_point(point: Floats, gradient: Floats) -> Floats:
    """Where a point of the bent frame goes, by integrating along the way from its anchor.

    u' = H(s) d along the line r = s d, and H' = alpha [(g . d) 1 + d g^T - g d^T]: the strain's own
    slope and, of the rotation, alpha g x d.
    """
    arm = point - np.array([0.1, -0.05, 0.02])
    slope = ALPHA * (
        (gradient @ arm) * np.eye(3) + np.outer(arm, gradient) - np.outer(gradient, arm)
    )
    return np.asarray(0.5 * slope @ arm)


@pytest.mark.parametrize(("fixed_at", "offset"), [(0, 0), (300, 40), (-200, 0)])
def test_carriages_follow_a_bent_frame_across_their_guideways(
    fixed_at: int, offset: int, tmp_path: Path
) -> None:
    """Along them they go where the bearing of the screw goes."""
    base = ("base = [0, 0, 0]", "base = [20, 30, -10]")
    told = ("travel = [0, 900]", f"travel = [-100, 900]\nfixed_at = {fixed_at}\noffset = {offset}")
    machine = planar(tmp_path, base, told, more=FRAME)
    gradient = np.array([3.0, 50.0, -20.0])
    condition = machine.condition.replace(gradient={"frame": gradient})
    poses = machine.poses()
    joints = machine.inverse(poses)
    shifts = deviations(machine, condition, poses)
    axis = np.array([0.0, 1.0, 0.0])
    bearing = warm_point((fixed_at + offset) / 1e3 * axis, gradient)
    for row, q in enumerate(joints[:, 0]):
        carriage = (q + offset / 1e3) * axis
        # The carriage is a small rigid triad on the frame; its joint turns with it.
        step = 1e-6
        turned = [
            (warm_point(carriage + step * e, gradient) - warm_point(carriage - step * e, gradient))
            / (2 * step)
            for e in np.eye(3)
        ]
        slope = np.stack(turned, axis=1)
        rotation = 0.5 * (slope - slope.T)
        moved = warm_point(carriage, gradient)
        moved += ((bearing - moved) @ axis) * axis
        expected = moved + rotation @ np.array([0.02, 0.03, -0.01])
        found = of_point(shifts, "drive.d1.origin")[0] + of_point(shifts, "strut.1.base")[row]
        assert np.allclose(found, expected, rtol=0, atol=1e-12)


def test_an_arm_turns_with_its_bearing_on_a_bent_frame() -> None:
    machine = tp.load(MACHINES / "rotary_delta.toml", ["frame.material=steel"])
    alpha = machine.frame.expansion
    assert alpha is not None
    gradient = np.array([12.0, -7.0, 30.0])
    condition = machine.condition.replace(temperature=REFERENCE, gradient={"frame": gradient})
    pose = machine.poses()[:1]
    shifts = deviations(machine, condition, pose)
    joints, placements, _ = machine.kernel.place(pose)
    cold = machine.kernel.joint_centres(joints, placements)[0, :, 0]
    changed = {
        name: machine.nominal[machine.parameters.index(name)] + each[0]
        for name, each in shifts.items()
    }
    warm = machine.replace(changed).kernel.joint_centres(joints, placements)[0, :, 0]
    for index, strut in enumerate(machine.struts):
        origin = np.array(
            [
                machine.nominal[machine.parameters.index(f"drive.{strut.drive}.origin.{a}")]
                for a in "xyz"
            ]
        )
        arm = origin - np.array(machine.frame.anchor)
        moved = alpha * ((gradient @ arm) * arm - 0.5 * (arm @ arm) * gradient)
        turned = np.cross(alpha * np.cross(gradient, arm), cold[index] - origin)
        assert np.allclose(warm[index] - cold[index], moved + turned, rtol=0, atol=1e-9 * 0.1)


# ---- platform and tool


PLATFORM = f'[platform]\nexpansion = "{ALPHA} 1/K"\nanchor = [10, 0, -5]\n'
TOOL = '[tool]\nexpansion = "1.1e-5 1/K"\nanchor = [0, 0, 30]\n'


def with_tool(folder: Path, more: str) -> Machine:
    text = HEXAPOD.replace("platform = [", 'expansion = "0 1/K"\nplatform = [')
    return load_text(folder, edited(text, ("[units]", "tool = [5, 10, 80]\n[units]")) + more)


def test_platform_joints_and_tool_point_grow_about_the_anchor(tmp_path: Path) -> None:
    machine = with_tool(tmp_path, PLATFORM)
    condition = machine.condition.replace(temperature={"platform": REFERENCE + 5})
    shifts = without_lengths(deviations(machine, condition, [[0, 0, 0.65, 0, 0, 0.05]]))
    anchor = np.array([0.01, 0, -0.005])
    assert np.allclose(of_point(shifts, "tool")[0], ALPHA * 5 * ([0.005, 0.01, 0.08] - anchor))
    joint = np.array([0.09, 0.08, 0.0])
    assert np.allclose(of_point(shifts, "strut.1.platform")[0], ALPHA * 5 * (joint - anchor))
    assert len(shifts) == 6 * 3 + 3


def test_a_tool_of_its_own_is_carried_turned_and_grows(tmp_path: Path) -> None:
    machine = with_tool(tmp_path, PLATFORM + TOOL)
    gradient = np.array([10.0, -4.0, 30.0])
    condition = machine.condition.replace(
        temperature={"platform": REFERENCE + 5, "tool": REFERENCE + 25},
        gradient={"platform": gradient},
    )
    shifts = deviations(machine, condition, [[0, 0, 0.65, 0, 0, 0]])
    held, point = np.array([0, 0, 0.03]), np.array([0.005, 0.01, 0.08])
    arm = held - np.array([0.01, 0, -0.005])
    carried = ALPHA * (5 * arm + (gradient @ arm) * arm - 0.5 * (arm @ arm) * gradient)
    turned = np.cross(ALPHA * np.cross(gradient, arm), point - held)
    expected = carried + turned + 1.1e-5 * 25 * (point - held)
    assert np.allclose(of_point(shifts, "tool")[0], expected, rtol=1e-12)


def test_a_tool_alone_moves_the_tool_point_alone(tmp_path: Path) -> None:
    machine = with_tool(tmp_path, TOOL)
    condition = machine.condition.replace(temperature={"tool": REFERENCE + 25})
    pose = [[0, 0, 0.65, 0, 0, 0]]
    shifts = without_lengths(deviations(machine, condition, pose))
    assert shifts.keys() == {"tool.x", "tool.y", "tool.z"}
    error = tp.budget(machine, pose, condition).error.sel(source="thermal").values[0]
    assert np.allclose(error, [*(1.1e-5 * 25 * np.array([0.005, 0.01, 0.05])), 0, 0, 0], atol=1e-15)


def test_a_whole_machine_of_one_material_scales(tmp_path: Path) -> None:
    """Everything at one temperature: the warm machine is the cold one, larger about its anchor."""
    alpha = f'expansion = "{ALPHA} 1/K"'
    machine = hexapod(tmp_path, f"[frame]\n{alpha}\n[platform]\n{alpha}\n", alpha)
    pose = np.array([0.02, -0.03, 0.63, 0.05, -0.04, 0.1])
    condition = machine.condition.replace(temperature=REFERENCE + 20)
    error = tp.budget(machine, pose, condition).error.sel(source="thermal").values[0]
    grown = ALPHA * 20
    assert np.allclose(error, [*(grown * pose[:3]), 0, 0, 0], rtol=0, atol=1e-12)


# ---- who must say what


@pytest.mark.parametrize("part", ["frame", "platform", "tool", "drive.d1"])
def test_a_part_that_is_named_says_how_it_expands(part: str, tmp_path: Path) -> None:
    machine = planar(tmp_path)
    pose = [[0.3, 0.2]]
    warm = machine.condition.replace(temperature={part: REFERENCE + 1})
    slope = (3.0,) if part.startswith("drive") else (3.0, 0.0, 0.0)
    bent = machine.condition.replace(gradient={part: slope[0] if len(slope) == 1 else slope})
    for condition in (warm, bent):
        with pytest.raises(TrueposeError) as caught:
            tp.budget(machine, pose, condition)
        (problem,) = caught.value.problems
        assert problem.code == "no-expansion"
        assert problem.path == part
    named_but_cold = machine.condition.replace(temperature={part: REFERENCE})
    tp.budget(machine, pose, named_but_cold)
    tp.budget(machine, pose, machine.condition.replace(temperature=REFERENCE + 9))


def test_a_file_that_names_such_a_part_is_refused(tmp_path: Path) -> None:
    with pytest.raises(MachineFileError) as caught:
        planar(tmp_path, ("reference_temperature = 20", "temperature = { frame = 25 }"))
    (problem,) = caught.value.problems
    assert problem.code == "no-expansion"
    assert problem.path == "condition.temperature.frame"
    assert problem.line is not None
    assert "under [frame]" in str(problem)


@pytest.mark.parametrize("part", ["frane", "strut.9", "drive.x"])
def test_a_temperature_for_a_part_that_does_not_exist(part: str, tmp_path: Path) -> None:
    edit = ("reference_temperature = 20", f'temperature = {{ "{part}" = 25 }}')
    with pytest.raises(MachineFileError) as caught:
        planar(tmp_path, edit)
    (problem,) = caught.value.problems
    assert problem.code == "unknown-part"
    assert problem.line is not None
    assert part in str(problem)


def test_a_gradient_alone_asks_for_the_source(tmp_path: Path) -> None:
    machine = hexapod(tmp_path, '[condition.gradient]\n"strut.1" = "5 K/m"\n')
    found = tp.budget(machine, [[0, 0, 0.65, 0, 0, 0]])
    assert "thermal" in found.source.values
