"""Parameters of a family as tolerances and as what a calibration finds, in memory and as a file."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from machine_texts import edited
from truepose.calibration.calibrate import Calibration
from truepose.calibration.result.bands import tolerance_covariance
from truepose.errors import MachineFileError
from truepose.machine import Machine
from truepose.sources.tolerance import bands_of
from truepose.verdict.witness_file import write_witness

DELTA = """\
schema = 1
[machine]
name = "printer"
[units]
length = "mm"
angle = "deg"
[family]
kind = "linear_delta"
radius = 138 # as drawn
effector_radius = 33
rod = 217
spacing = 45
[each.drive]
travel = [0, 400]
[tolerance]
"family.radius" = "0.5 mm"
"family.rod" = 0.2
"strut.*.length" = 0.02
[workspace]
grid = { x = [-60, 60, 3], y = [-60, 60, 3], z = [0, 100, 3] }
[accuracy]
target = "0.5 mm"
[controller]
holds = "drawing"
"""

RADIUS, ROD = 0.31e-3, -0.12e-3


def written(folder: Path, text: str, *settings: str) -> Machine:
    path = folder / "machine.toml"
    path.write_text(text, encoding="utf-8")
    return tp.load(path, settings)


def readings(folder: Path, machine: Machine, truth: Machine, noise: float = 5e-6) -> Path:
    """A CSV of positions that `truth` shows when commanded as `machine` is."""
    poses = machine.poses()
    actual = truth.forward(machine.inverse(poses), start=truth.home)[:, :3]
    actual = actual + np.random.default_rng(4).normal(0.0, noise, actual.shape)
    lines = ["#: [instrument.camera]", '#: kind = "position"', '#: frame = "base"']
    lines += [f'#: uncertainty = "{noise * 1e6:g} um"']
    lines += ["command.x (mm), command.y (mm), command.z (mm), x (mm), y (mm), z (mm)"]
    lines += [
        ", ".join(f"{1e3 * value:.6f}" for value in row)
        for row in np.hstack([poses, actual])
    ]  # fmt: skip
    path = folder / "positions.csv"
    path.write_text("\n".join([*lines, ""]), encoding="utf-8")
    return path


@pytest.fixture
def truth(tmp_path: Path) -> Machine:
    folder = tmp_path / "truth"
    folder.mkdir()
    return written(
        folder, DELTA, f"family.radius={138 + 1e3 * RADIUS}", f"family.rod={217 + 1e3 * ROD}"
    )


def calibrated(folder: Path, truth: Machine, text: str = DELTA, **options: object) -> Calibration:
    machine = written(folder, text)
    return tp.calibrate(machine, readings(folder, machine, truth), **options)  # type: ignore[arg-type]


def found(calibration: Calibration) -> dict[str, float]:
    unknowns = calibration.fit.unknowns
    return dict(zip(unknowns.names, calibration.fit.values.tolist(), strict=True))


def test_the_variables_are_called_as_their_owner_does(tmp_path: Path) -> None:
    machine = written(tmp_path, DELTA)
    shares = tp.shares(machine, machine.poses()[:1], samples=16)
    names = shares["parameter"].values.tolist()
    assert {"family.radius", "family.rod", "strut.a1.length"} <= set(names)
    # Before the two, the others are nothing.
    assert shares["linear"].values[0, names.index("family.radius"), :2].max() > 0.9
    bands = bands_of(machine)
    assert bands is not None
    # A parameter in two columns: what it deviates by is their sum.
    length = machine.parameters.index("strut.a1.length")
    assert (bands.parameters == length).sum() == 2
    covariance = tolerance_covariance(machine).covariance
    wanted = (0.2e-3**2 + 0.02e-3**2) / 3.0
    assert covariance[length, length] == pytest.approx(wanted, rel=1e-12)
    other = machine.parameters.index("strut.c2.length")
    assert covariance[length, other] == pytest.approx(0.2e-3**2 / 3.0, rel=1e-12)


def test_a_budget_of_a_known_deviation_is_that_of_another_file(tmp_path: Path) -> None:
    """[v, v] as the tolerance of a radius, against a machine of that radius."""
    text = edited(DELTA, ('"family.radius" = "0.5 mm"', '"family.radius" = [0.31, 0.31]'),
                  ('"family.rod" = 0.2\n', ""), ('"strut.*.length" = 0.02\n', ""))  # fmt: skip
    machine = written(tmp_path, text)
    other = written(tmp_path, text, "family.radius=138.31")
    poses = machine.poses()
    error = other.forward(machine.inverse(poses), start=machine.home)[:, :3] - poses
    budget = tp.budget(machine, poses)
    told = budget["error"].sel(source="tolerance", component=["x", "y", "z"]).values
    np.testing.assert_allclose(told, error, rtol=0, atol=1e-11)


def test_a_witness_speaks_of_the_family_and_is_a_file_of_joint_centres(tmp_path: Path) -> None:
    text = edited(DELTA, ('target = "0.5 mm"', 'target = "0.1 mm"'))
    machine = written(tmp_path, text, "family.spacing=46", "strut.c1.length=217.01")
    witness = tp.accuracy(machine)[0].example
    assert witness is not None
    causes = {cause.parameter: cause for cause in witness.causes()}
    radius = causes["family.radius"]
    assert abs(radius.deviation) == pytest.approx(0.5e-3, rel=1e-12)
    assert (radius.more, radius.unit, radius.end) == (
        0, "m", "upper" if radius.deviation > 0.0 else "lower"
    )  # fmt: skip
    other = write_witness(
        machine, witness, tmp_path / "witness.toml", original=tmp_path / "machine.toml"
    )
    assert other.family is None
    error = tp.budget(other)["error"].sel(source="tolerance").values
    assert np.linalg.norm(error[0][:3]) == pytest.approx(witness.size, rel=1e-6)


@pytest.mark.parametrize(
    ("identify", "names"),
    [
        ((), {"family.radius", "family.rod"}),
        (("family.radius", "family.rod"), {"family.radius", "family.rod"}),
        (("family.r*=1 mm",), {"family.radius", "family.rod"}),
    ],
)
def test_what_is_found_is_the_change_of_the_parameter(
    tmp_path: Path, truth: Machine, identify: tuple[str, ...], names: set[str]
) -> None:
    calibration = calibrated(tmp_path, truth, identify=identify)
    values = found(calibration)
    assert names <= values.keys()
    assert values["family.radius"] == pytest.approx(RADIUS, abs=2e-5)
    assert values["family.rod"] == pytest.approx(ROD, abs=2e-5)
    number = calibration.fit.unknowns.names.index("family.radius")
    assert calibration.fit.unknowns.units[number] == "m"
    assert calibration.fit.unknowns.labels[number] == "radius"


def test_a_family_without_tolerance_is_found_from_the_readings_alone(
    tmp_path: Path, truth: Machine
) -> None:
    text = edited(DELTA, ('"family.radius" = "0.5 mm"\n', ""))
    calibration = calibrated(tmp_path, truth, text, identify=["family.radius", "family.rod"])
    assert found(calibration)["family.radius"] == pytest.approx(RADIUS, abs=2e-5)
    angle = calibrated(tmp_path, truth, identify=["family.angle.b", "family.r*", "family.rod.a"])
    unknowns = angle.fit.unknowns
    assert unknowns.units[unknowns.names.index("family.angle.b")] == "rad"
    assert found(angle)["family.angle.b"] == pytest.approx(0.0, abs=3e-4)


@pytest.mark.parametrize("holds", ["drawing", "calibrated"])
@pytest.mark.parametrize(
    "identify",
    [(), ("family.radius", "family.rod"), ("family.radius",), ("strut.*.length",),
     ("family.r*", "family.angle.a", "family.angle.b", "family.effector_radius")],
    ids=lambda names: "+".join(names) or "all",
)  # fmt: skip
def test_the_saved_file_is_the_calibrated_machine(
    tmp_path: Path, truth: Machine, identify: tuple[str, ...], holds: str
) -> None:
    calibration = calibrated(tmp_path, truth, identify=identify)
    saved = calibration.save(
        tmp_path / "saved.toml",
        original=tmp_path / "machine.toml",
        date="2026-01-31",
        controller_holds=holds,  # type: ignore[arg-type]
        force=True,
    )
    unknowns, values = calibration.fit.unknowns, calibration.fit.values
    change = np.zeros(len(saved.parameters))
    np.add.at(change, unknowns.columns, unknowns.parameter_change(values))
    filed = calibration.machine
    assert saved.family is not None
    assert filed.family is not None
    if holds == "drawing":
        np.testing.assert_allclose(saved.nominal, filed.nominal, rtol=0, atol=1e-16)
        np.testing.assert_allclose(tolerance_covariance(saved).shift, change, rtol=0, atol=1e-16)
        assert saved.family == filed.family
        return
    np.testing.assert_allclose(saved.nominal, filed.nominal + change, rtol=1e-14, atol=1e-16)
    told = tomllib.loads((tmp_path / "saved.toml").read_text(encoding="utf-8"))["family"]
    if "family.radius" in unknowns.names:
        assert told["radius"] == pytest.approx(
            138 + 1e3 * found(calibration)["family.radius"], abs=1e-9
        )
    ours = calibration.calibrated()
    one, other = (tolerance_covariance(machine).covariance for machine in (ours, saved))
    np.testing.assert_allclose(one, other, rtol=0, atol=1e-9 * np.abs(other).max())
    wanted = tp.uncertainty(saved)["standard_uncertainty"].values
    got = tp.uncertainty(ours)["standard_uncertainty"].values
    np.testing.assert_allclose(got, wanted, rtol=1e-6)


def test_tolerances_that_were_not_identified_stay(tmp_path: Path, truth: Machine) -> None:
    calibration = calibrated(tmp_path, truth, identify=["family.radius"])
    saved = calibration.save(
        tmp_path / "saved.toml", original=tmp_path / "machine.toml", date="2026-01-31", force=True
    )
    told = tomllib.loads((tmp_path / "saved.toml").read_text(encoding="utf-8"))["tolerance"]
    assert told["family.rod"] == 0.2
    assert told["strut.*.length"] == 0.02
    assert told["family.radius"]["distribution"] == "normal"
    before, after = bands_of(calibration.machine), bands_of(saved)
    assert before is not None
    assert after is not None
    assert set(after.group_names.values()) == {"family.radius", "family.rod"}
    assert after.parameters.tolist() == before.parameters.tolist()
    # What only the file asks: a family's parameter is one number of one distribution.
    calibration = tp.calibrate(saved, readings(tmp_path, saved, truth))
    assert found(calibration)["family.radius"] == pytest.approx(RADIUS, abs=2e-5)


BAD = [
    ('"family.radius" = "0.5 mm"', '"family.radios" = 0.5', "tolerance-matches-nothing",
     'did you mean "family.radius"?'),
    ('"family.radius" = "0.5 mm"', '"family.radius" = "0.5 deg"', "wrong-dimension", "angle"),
    ('"family.radius" = "0.5 mm"', '"family.radius" = { band = 0.5, group = "g" }',
     "excluding-keys", "a variable by itself"),
    ('"family.radius" = "0.5 mm"', '"family.*" = 0.5', "tolerance-matches-nothing", "family.*"),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "code", "words"), BAD)
def test_bad_tolerances_are_told(tmp_path: Path, old: str, new: str, code: str, words: str) -> None:
    with pytest.raises(MachineFileError) as raised:
        written(tmp_path, edited(DELTA, (old, new)))
    (problem,) = raised.value.problems
    assert problem.code == code
    assert problem.line == DELTA[: DELTA.index('"family.radius"')].count("\n") + 1
    assert words in str(problem)


def test_correlations_name_the_family(tmp_path: Path) -> None:
    rows = '[[correlation]]\nbetween = ["family.radius", "family.rod"]\ncoefficient = 0.5\n'
    bands = bands_of(written(tmp_path, DELTA + rows))
    assert bands is not None
    assert bands.correlation is not None
    assert (bands.correlation == 0.5).sum() == 2
