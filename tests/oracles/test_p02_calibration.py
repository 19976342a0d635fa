"""P02 from a file of measurements to the verdict: heights alone, and x, y and z.

The delta of the case as a machine file: its radius, endstops, tower angles and rods are groups of
tolerances. Heights on a flat bed leave its rods uncertain by 3.7 mm, so the answer is no, though
they fit to the last digit; x, y and z of the same poses leave 0.065 mm.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from command_line import call
from oracle_cases import Published, case
from truepose.calibration import write_measurements
from truepose.calibration.calibrate import Calibration, calibrate
from truepose.calibration.instruments import Frame, Instrument
from truepose.calibration.measurements import Measurements
from truepose.calibration.measurements.arrays import measurements_of
from truepose.machine import Machine

P02 = case("p02_delta_height_only")
INPUTS, OUTPUTS = P02["inputs"], P02["outputs"]
RADIUS, ROD = INPUTS["delta_radius_mm"], INPUTS["rod_mm"]
TOWERS = dict(zip("abc", INPUTS["tower_angles_deg"], strict=True))
BAND = 0.5
"""mm, of radius, endstops and rods; ours, for the case has none. Of a tower's angle 0.5 mm, too."""


def machine_text() -> str:
    """The case's delta: a point platform on three rods, towers upright."""
    drives, struts, tolerances = [], [], []
    for name, angle in TOWERS.items():
        x, y = (RADIUS * math.cos(math.radians(angle)), RADIUS * math.sin(math.radians(angle)))
        drives.append(
            f'[[drive]]\nname = "{name}"\nkind = "slider"\norigin = [{x!r}, {y!r}, 0]\n'
            'axis = [0, 0, 1]\ntravel = [0, 600]\nworking_mode = "+"\n'
        )
        struts.append(
            f'[[strut]]\nname = "{name}"\ndrive = "{name}"\nbase = [0, 0, 0]\n'
            f"platform = [0, 0, 0]\nlength = {ROD}\n"
        )
        entries = {
            f"strut.{name}.length": (f"rod length {name}", 1.0),
            f"drive.{name}.offset": (f"endstop {name}", 1.0),
        }
        for axis, share in zip("xy", (x / RADIUS, y / RADIUS), strict=True):
            entries[f"drive.{name}.origin.{axis}"] = ("delta radius", share)
        # A tower that turns about the middle moves across its radius: so do its joints.
        if name != "c":
            for axis, share in zip("xy", (-y / RADIUS, x / RADIUS), strict=True):
                entries[f"strut.{name}.base.{axis}"] = (f"tower angle {name}", share)
        for parameter, (group, share) in entries.items():
            if abs(share) > 1e-9:
                tolerances.append(
                    f'"{parameter}" = {{ band = {BAND * abs(share)!r}, group = "{group}", '
                    f"sign = {1 if share > 0 else -1} }}\n"
                )
    return (
        'schema = 1\n[machine]\nname = "P02"\ndof = ["x", "y", "z"]\n'
        '[units]\nlength = "mm"\nangle = "deg"\n'
        + "".join(drives + struts)
        + "[tolerance]\n"
        + "".join(tolerances)
        + "[workspace]\ngrid = { x = [-70, 70, 5], y = [-70, 70, 5], z = [0, 100, 3] }\n"
    )


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The machine's file."""
    found = tmp_path_factory.mktemp("p02") / "p02.toml"
    found.write_text(machine_text(), encoding="utf-8")
    return found


@pytest.fixture(scope="module")
def machine(path: Path) -> Machine:
    return tp.load(path)


def measured(machine: Machine, axes: str) -> Measurements:
    """What the nominal machine shows at the case's points: the bed is flat, and nothing is off."""
    points = np.array(INPUTS["probe_points_mm"]) * 1e-3
    poses = np.column_stack([points, np.full(len(points), INPUTS["probe_z_mm"] * 1e-3)])
    kind = "position" if axes == "xyz" else "coordinate"
    values = {axis: poses[:, "xyz".index(axis)] for axis in axes}
    return measurements_of(
        machine,
        Instrument("probe", kind, Frame()),
        poses=poses,
        values=values,
        uncertainty=INPUTS["noise_mm"] * 1e-3,
    )


def stated(found: Calibration) -> dict[str, float]:
    """Standard uncertainties by the case's names, mm and deg."""
    fit = found.fit
    result = {}
    for name, sigma in zip(fit.unknowns.names, fit.deviations, strict=True):
        if name.startswith("tower angle"):
            # The unknown is the larger of the two coordinates that the angle moves.
            angle = math.radians(TOWERS[name[-1]])
            across = max(abs(math.sin(angle)), abs(math.cos(angle)))
            result[f"angle_{name[-1]}_deg"] = math.degrees(sigma / across / (RADIUS * 1e-3))
        else:
            short = name.replace("rod length", "rod").replace("delta ", "").replace(" ", "_")
            result[f"{short}_mm"] = 1e3 * sigma
    return result


@pytest.mark.parametrize(("axes", "key"), [("z", "height_only"), ("xyz", "x_y_z")])
def test_the_uncertainties_are_those_of_the_case(
    machine: Machine, axes: str, key: str, published: Published
) -> None:
    found = stated(calibrate(machine, measured(machine, axes), use_prior=False))
    expected = OUTPUTS[key]["standard_uncertainty"]
    assert found.keys() == expected.keys()
    theirs = np.array(list(expected.values()))
    what = f"standard uncertainties of a delta by {axes}, mm and deg"
    within = np.maximum(2e-4 * theirs, 6e-6)
    published(what, theirs, [found[name] for name in expected], within=within, by="reference")


def test_heights_alone_are_refused_with_words(
    path: Path, machine: Machine, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "heights.csv"
    write_measurements(file, machine, measured(machine, "z"))
    outcome = call(capsys, "calibrate", path, file, "--no-prior")
    assert outcome.code == 1
    words = " ".join(outcome.out.split())
    assert "rod length, endstop and delta radius cannot be told apart by a flat bed" in words
    assert "only to 3.7 mm" in words
    assert "measure" in words.lower()
    assert "probe in x and y too" in words


def test_x_y_and_z_are_accepted_and_written(
    path: Path, machine: Machine, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, result = tmp_path / "xyz.csv", tmp_path / "calibrated.toml"
    data = measured(machine, "xyz")
    noise = data.uncertainty * np.random.default_rng(2).standard_normal(data.n_observation)
    # Without noise it would be suspected that the commands were copied, and rightly so.
    write_measurements(file, machine, data.with_values(data.value + noise))
    outcome = call(
        capsys, "calibrate", path, file, "--no-prior",
        "--machine-output", result, "--date", "2026-11-21",
    )  # fmt: skip
    assert outcome.code == 0, outcome.err
    budget = tp.budget(tp.load(result))
    assert float(budget["uncertainty"].max()) < 20e-6
