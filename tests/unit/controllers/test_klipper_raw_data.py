"""What Klipper's delta_calibrate kept, as measurements: by a simulation in its own format."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from klipper_printer import LINEAR, ROTARY, Printer, saved
from truepose.controllers import Import
from truepose.errors import MachineFileError, Problem, RequestError

MM = 1e-3
PRINTERS = {"linear": LINEAR, "rotary": ROTARY}


def imported(folder: Path, text: str, **settings: str) -> Import:
    path = folder / "printer.cfg"
    path.write_text(text, "utf-8")
    return tp.import_machine(
        path, settings={key.replace("_", ".", 1): value for key, value in settings.items()}
    )


def refused(folder: Path, text: str, **settings: str) -> list[Problem]:
    with pytest.raises((MachineFileError, RequestError)) as told:
        imported(folder, text, **settings)
    return list(told.value.problems)


@pytest.mark.parametrize("kind", PRINTERS)
def test_readings_are_where_the_nozzle_was(kind: str, tmp_path: Path) -> None:
    """Of a machine that is as the file has it, without noise: every reading is its own."""
    printer: Printer = PRINTERS[kind]
    found = imported(tmp_path, printer.config() + saved(printer, printer, z_offset=0.5))
    data = found.measurements
    assert data is not None
    assert [instrument.name for instrument in data.instruments] == ["probe", "calliper"]
    calibration = tp.calibrate(found.machine, data)
    # Half a step is what counting in steps leaves.
    assert np.abs(calibration.dataset["residual_before"].values).max() < 0.02 * MM


def test_heights_that_differ_are_heights_over_the_bed(tmp_path: Path) -> None:
    text = LINEAR.config() + saved(LINEAR, LINEAR, z_offset=0.5)
    row = LINEAR.steps(np.array([10.0, 20.0, 3.0]))
    entered = f"manual_height0: 3.0\nmanual_height0_pos: {LINEAR.counted(row)}\n"
    text = text.replace("[delta_calibrate]\n", f"[delta_calibrate]\n{entered}", 1)
    found = imported(tmp_path, text)
    assert found.measurements_text is not None
    assert "[instrument.paper]" in found.measurements_text
    assert ", 3.0, manual_height0" in found.measurements_text


def test_without_a_probe_paper_touches_the_bed(tmp_path: Path) -> None:
    text = LINEAR.config(probe=False) + saved(LINEAR, LINEAR, z_offset=0.0)
    found = imported(tmp_path, text)
    assert found.measurements_text is not None
    assert "[instrument.probe]" not in found.measurements_text
    assert any("paper" in each.sentence for each in found.assumptions)


@pytest.mark.parametrize("group", ["heights", "distances"])
@pytest.mark.parametrize("factor", [0.25, 0.5, 2.0, 4.0])
@pytest.mark.parametrize("kind", PRINTERS)
def test_microsteps_of_another_day_are_named(
    kind: str, factor: float, group: str, tmp_path: Path
) -> None:
    """Only those: the other group says nothing. With the microsteps of that day all is well."""
    printer: Printer = PRINTERS[kind]
    text = printer.config() + saved(printer, printer, z_offset=0.5)
    right = imported(tmp_path, text)
    lines = text.splitlines()
    for number, line in enumerate(lines):
        if "_pos" in line and ("height" in line) == (group == "heights"):
            key, _, counted = line.partition(": ")
            steps = [float(count) * factor for count in counted.split(",")]
            lines[number] = f"{key}: {','.join(f'{count:.3f}' for count in steps)}"
    changed = "\n".join(lines) + "\n"
    (problem,) = refused(tmp_path, changed)
    assert problem.code == "import-steps"
    assert problem.line is not None
    assert lines[problem.line - 1].startswith("height0" if group == "heights" else "distance0")
    before = f"{16 * factor:g}"
    assert f"--set {group}.microsteps={before}" in (problem.hint or "")
    assert "rms" in (problem.found or "")
    mended = imported(tmp_path, changed, **{f"{group}_microsteps": before})
    assert mended.measurements is not None
    assert right.measurements is not None
    assert np.abs(mended.measurements.joints - right.measurements.joints).max() < 1e-5 * MM


@pytest.mark.parametrize(
    ("old", "new", "code"),
    [
        ("microsteps: 16\n", "", "missing-key"),
        ("rotation_distance: 40\n", "", "missing-key"),
        ("microsteps: 16\n", "microsteps: 0\n", "not-positive"),
        ("rotation_distance: 40\n", "rotation_distance: 40\ngear_ratio: 80\n", "not-a-number"),
        ("rotation_distance: 40\n", "rotation_distance: 40\nstep_distance: 0.01\n",
         "excluding-keys"),
        ("height1_pos: ", "height1_pos: 1,", "not-a-number"),
        ("height1_pos: ", "height1_place: ", "missing-key"),
        ("distance0_pos2: ", "distance0_pos2: x", "not-a-number"),
        ("height1: 0.5", "height1: half", "not-a-number"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_told(old: str, new: str, code: str, tmp_path: Path) -> None:
    text = LINEAR.config() + saved(LINEAR, LINEAR, z_offset=0.5)
    told = refused(tmp_path, text.replace(old, new, 1))
    assert [problem.code for problem in told] == [code]
    assert told[0].line is not None


def test_a_step_may_be_said_as_it_was_before_2021(tmp_path: Path) -> None:
    text = LINEAR.config() + saved(LINEAR, LINEAR, z_offset=0.5)
    old = text.replace("microsteps: 16\nrotation_distance: 40\n", "step_distance: 0.0125\n")
    assert old != text
    one, other = imported(tmp_path, text), imported(tmp_path, old)
    assert one.measurements is not None
    assert other.measurements is not None
    assert np.abs(one.measurements.joints - other.measurements.joints).max() < 1e-15


def test_half_of_how_the_rods_stand_is_refused(tmp_path: Path) -> None:
    for key, other in (("spacing", "effector_radius"), ("effector_radius", "spacing")):
        (problem,) = refused(tmp_path, LINEAR.config(), **{f"family_{key}": "45"})
        assert problem.code == "import-incomplete"
        assert f"--set family.{other}=" in (problem.expected or "")
    (problem,) = refused(tmp_path, LINEAR.config(), family_spacing="0", family_effector_radius="1")
    assert problem.code == "not-positive"


def test_with_its_rods_the_machine_tilts(tmp_path: Path) -> None:
    one = imported(tmp_path, LINEAR.config())
    two = imported(tmp_path, LINEAR.config(), family_spacing="45", family_effector_radius="30")
    assert one.machine.dof == ("x", "y", "z")
    assert two.machine.dof == ("x", "y", "z", "a", "b", "c")
    assert any("tilt" in each.sentence for each in one.assumptions)
    assert not any("tilt" in each.sentence for each in two.assumptions)


@pytest.mark.parametrize("kind", PRINTERS)
def test_a_machine_with_its_rods_is_calibrated_in_its_owners_words(
    kind: str, tmp_path: Path
) -> None:
    printer: Printer = PRINTERS[kind]
    text = printer.config() + saved(printer, printer, z_offset=0.5)
    found = imported(tmp_path, text, family_spacing="45", family_effector_radius="30")
    assert found.measurements is not None
    calibration = tp.calibrate(found.machine, found.measurements)
    radius = "family.shoulder_radius" if printer.turns else "family.radius"
    assert radius in calibration.dataset["unknown"].values
    assert np.abs(calibration.dataset["residual_before"].values).max() < 0.02 * MM


@pytest.mark.parametrize("rods", [{}, {"family_spacing": "45", "family_effector_radius": "30"}])
@pytest.mark.parametrize("kind", PRINTERS)
def test_nothing_looks_odd_about_it(kind: str, rods: dict[str, str], tmp_path: Path) -> None:
    assert tp.oddities(imported(tmp_path, PRINTERS[kind].config(), **rods).machine) == ()


def test_what_the_machine_file_cannot_say_is_told(tmp_path: Path) -> None:
    text = LINEAR.config() + "[bed_mesh]\nmesh_radius: 80\n"
    assert any("[bed_mesh]" in sentence for sentence in imported(tmp_path, text).lost)
