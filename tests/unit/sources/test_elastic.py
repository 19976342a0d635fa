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
    tension = np.linalg.solve(np.swapaxes(along, 1, 2), np.array([[1200.0], [-1500.0]]))[..., 0]
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
