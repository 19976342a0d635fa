"""Measured parameters: what was measured of a part alone, with and without tolerances."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from made_measurement_files import problems, read
from made_measurements import made_measurements, poses_within
from truepose.calibration import Instrument, joined, measurements_of, write_measurements
from truepose.calibration.identification.fit import Fit, fit
from truepose.calibration.identification.problem import IdentificationProblem
from truepose.calibration.identification.unknowns import unknowns_of
from truepose.calibration.identification.validate import validate
from truepose.calibration.instruments import Frame
from truepose.calibration.measurements import Measurements
from truepose.calibration.planning.readings import observed
from truepose.errors import RequestError
from truepose.machine import Condition, Machine

MACHINES = Path(__file__).parents[3] / "machines"
EXAMPLES = Path(__file__).parents[3] / "examples"
RODS = [f"strut.{name}.length" for name in ("a1", "a2", "b1", "b2", "c1", "c2")]

HEAD = """\
#: [instrument.probe]
#: kind = "coordinate"
#: frame = "base"
#: uncertainty = "5 um"
#: [instrument.calliper]
#: kind = "parameter"
#: uncertainty = "0.02 mm"
"""
COLUMNS = "instrument,command.x (mm),command.y (mm),command.z (mm),z (mm)"
PROBED = "probe,0,0,40,40.01"


@pytest.fixture(scope="module")
def delta() -> Machine:
    return tp.load(MACHINES / "linear_delta.toml")


def measured(
    machine: Machine, away: dict[str, float], uncertainty: float, rows: int = 1
) -> Measurements:
    """Parameters measured so far from nominal, SI, each in all rows."""
    nominal = dict(zip(machine.parameters, machine.nominal.tolist(), strict=True))
    values = {f"parameter.{name}": [nominal[name] + by] * rows for name, by in away.items()}
    instrument = Instrument("calliper", "parameter", Frame())
    return measurements_of(machine, instrument, values=values, uncertainty=uncertainty)


def heights(machine: Machine, rows: int = 30) -> Measurements:
    poses = poses_within(machine, rows, seed=4)
    return made_measurements(
        machine, "coordinate", poses, name="probe", observables=("z",), values="nominal"
    )


def fitted(machine: Machine, data: Measurements, *identify: str, use_prior: bool = True) -> Fit:
    unknowns = unknowns_of(machine, data, identify)
    return fit(machine, data, unknowns, use_prior=use_prior, robust=False)


def test_a_file_with_a_row_without_a_pose(tmp_path: Path, delta: Machine) -> None:
    head = COLUMNS + ",parameter.strut.a1.length (mm),parameter.drive.b.axis.u (mrad)\n"
    found = read(tmp_path, HEAD + head + PROBED + ",,\ncalliper,,,,,333.03,\n", delta)
    assert found.posed.tolist() == [True, False]
    assert found.strut[1] == delta.parameters.index("strut.a1.length")
    assert (found.value[1], found.uncertainty[1]) == (pytest.approx(0.33303, abs=1e-15), 2e-5)
    write_measurements(tmp_path / "again.csv", delta, found)
    text = (tmp_path / "again.csv").read_text()
    assert text.splitlines()[-1] == "calliper, , , , , , 333.03, 0.02, fit"
    again = read(tmp_path, text, delta)
    assert np.array_equal(again.value, found.value)


def test_a_file_of_nothing_else_needs_no_columns_of_commands(
    tmp_path: Path, delta: Machine
) -> None:
    head = '#: [instrument.gauge]\n#: kind = "parameter"\n#: uncertainty = ["2 um", "5 arcsec"]\n'
    text = head + "parameter.tool.z (mm),parameter.drive.a.axis.u (mrad)\n0.01,0.2\n,0.1\n"
    found = read(tmp_path, text, delta)
    assert found.value.tolist() == pytest.approx([2e-4, 1e-5, 1e-4])  # by parameter
    assert found.uncertainty.tolist() == pytest.approx(
        [5 * np.pi / 648000, 2e-6, 5 * np.pi / 648000]
    )


@pytest.mark.parametrize("use_prior", [True, False])
def test_tolerance_and_reading_are_weighed(delta: Machine, use_prior: bool) -> None:
    """Alone, with a tolerance: the mean of both, weighed by 1 / variance; without, the reading."""
    half, uncertainty, away = 20e-6, 8e-6, 15e-6  # of the rods: 0.02 mm, uniform
    asked = RODS if use_prior else RODS[:1]
    data = measured(delta, {RODS[0]: away}, uncertainty)
    found = fitted(delta, data, *asked, use_prior=use_prior)
    at = found.unknowns.names.index(RODS[0])
    tolerance = 3.0 / half**2 if use_prior else 0.0
    weight = 1.0 / uncertainty**2
    assert found.values[at] == pytest.approx(away * weight / (weight + tolerance), rel=1e-9)
    assert found.deviations[at] == pytest.approx((weight + tolerance) ** -0.5, rel=1e-9)
    others = np.delete(found.deviations, at)
    assert others == pytest.approx(np.full(len(asked) - 1, half / 3.0**0.5))


def test_rods_that_were_measured_are_as_rods_that_are_known(delta: Machine) -> None:
    """Beside other readings they do what tolerances of that width would do."""
    uncertainty = 8e-6
    probed = heights(delta)
    both = joined(probed, measured(delta, dict.fromkeys(RODS, 0.0), uncertainty))
    found = fitted(delta, both, *RODS, use_prior=False)
    band = f"{uncertainty * 3**0.5 * 1e3!r} mm"
    known = fitted(delta, probed, *(f"{rod}={band}" for rod in RODS))
    assert np.abs(found.covariance / known.covariance - 1.0).max() < 1e-8
    alone = fitted(delta, probed, *RODS, use_prior=False)
    assert (found.deviations < 0.99 * alone.deviations).all()


def test_what_was_measured_is_identified_whatever_is_asked(delta: Machine) -> None:
    """Nothing of the file is dropped: with no tolerance, and where others are named."""
    untoleranced = "drive.a.scale"
    data = joined(heights(delta), measured(delta, {untoleranced: 1e-4, RODS[1]: 1e-5}, 1e-6))
    tolerated = unknowns_of(delta, heights(delta)).names
    assert untoleranced not in tolerated
    assert set(unknowns_of(delta, data).names) == {*tolerated, untoleranced}
    assert unknowns_of(delta, data, [RODS[0]]).names == (*RODS[:2], untoleranced)
    found = fitted(delta, data, RODS[0])
    at = found.unknowns.names.index(untoleranced)
    assert found.values[at] == pytest.approx(1e-4, abs=3e-6)
    # A row that only checks adds no unknown that nothing would determine.
    kept = data.select(np.ones(data.n_row, bool))
    kept.held_out[-1] = True
    assert unknowns_of(delta, kept, [RODS[0]]).names == (RODS[0],)


def test_a_group_is_measured_by_one_of_its_members(tmp_path: Path) -> None:
    text = (MACHINES / "linear_delta.toml").read_text()
    text = text.replace("length_tolerance = 0.02\n", "")
    bands = '[tolerance]\n"strut.a*.length" = { band = 0.05, group = "rods of a" }\n'
    bands += '"strut.b1.platform.x" = { band = 0.01, group = "joints" }\n'
    bands += '"strut.b2.platform.x" = { band = 0.01, group = "joints" }\n'
    assert "[tolerance]" in text
    path = tmp_path / "machine.toml"
    path.write_text(text.replace("[tolerance]\n", bands))
    machine = tp.load(path)
    columns = COLUMNS + ",parameter.rods of a (mm)\n"
    data = read(tmp_path, HEAD + columns + PROBED + ",\ncalliper,,,,,333.03\n", machine)
    unknowns = unknowns_of(machine, data, ["rods of a"])
    assert unknowns.names == ("rods of a",)
    slope = IdentificationProblem(machine, data, unknowns).jacobian([0.0])
    assert slope[-1, 0] == 1.0
    assert data.value[-1] == pytest.approx(0.33303)
    for extra, code in (
        (",parameter.joints (mm)", "unknown-parameter"),
        (",parameter.rods of a (mm),parameter.strut.a1.length (mm)", "excluding-columns"),
    ):
        cells = ",333.03" * extra.count(",")
        row = f"calliper,,,,{cells}\n"
        found = problems(tmp_path, HEAD + COLUMNS + extra + "\n" + row, machine)
        assert code in [problem.code for problem in found], found


def test_a_part_is_cold_and_unloaded_whatever_the_machine_is(delta: Machine) -> None:
    warm = Condition(default_temperature=delta.condition.reference_temperature + 20.0)
    poses = poses_within(delta, 3)
    probed = made_measurements(delta, "coordinate", poses, observables=("z",), condition=warm)
    data = joined(probed, measured(delta, dict.fromkeys(RODS, 0.0), 1e-5))
    problem = IdentificationProblem(delta, data, unknowns_of(delta, data))
    predicted = problem.predict(np.zeros(problem.unknowns.count))
    nominal = delta.nominal[[delta.parameters.index(rod) for rod in RODS]]
    assert np.abs(predicted[3:] - nominal).max() < 1e-15
    slopes = problem.jacobian(np.zeros(problem.unknowns.count))[3:]
    assert sorted(np.abs(slopes).sum(axis=1).tolist()) == [1.0] * len(RODS)


def test_what_nothing_else_sees_is_not_predicted(delta: Machine) -> None:
    """Left out, the reading of a part says nothing against the fit of the others."""
    rods = measured(delta, dict.fromkeys(RODS, 1e-5), 1e-6, rows=8)
    data = joined(rods, measured(delta, {"tool.x": 3e-3}, 1e-6, rows=2))
    found = fitted(delta, data, *RODS[:2])
    kept = data.select(np.ones(data.n_row, bool))
    kept.held_out[-1] = True
    checked = validate(delta, kept, found)
    assert checked is not None
    assert np.isfinite(checked.after[-1])  # the other row says what it is
    one = joined(rods, measured(delta, {"tool.x": 3e-3}, 1e-6))
    checked = validate(delta, one, fitted(delta, one, *RODS[:2]))
    assert checked is not None
    assert np.isnan(checked.after[-1])
    assert np.isfinite(checked.after[:-1]).all()


def test_a_calibration_with_measured_rods(delta: Machine) -> None:
    """By a machine whose rods differ: the answer has them among its unknowns and readings."""
    random = np.random.default_rng(8)
    away = dict(zip(RODS, (15e-6 * random.standard_normal(6)).tolist(), strict=True))
    nominal = dict(zip(delta.parameters, delta.nominal.tolist(), strict=True))
    truth = delta.replace({rod: nominal[rod] + by for rod, by in away.items()})
    poses = poses_within(delta, 40, seed=1)
    joints = delta.inverse(poses)
    shown = truth.forward(joints)[:, :3] + 1e-5 * random.standard_normal((40, 3))
    tracker = Instrument("tracker", "position", Frame())
    seen = dict(zip("xyz", shown.T, strict=True))
    tracked = measurements_of(delta, tracker, joints=joints, values=seen, uncertainty=1e-5)
    data = joined(tracked, measured(delta, away, 1e-6))
    found = tp.calibrate(delta, data)
    for rod, by in away.items():
        at = found.fit.unknowns.names.index(rod)
        assert abs(found.fit.values[at] - by) < 4e-6
        assert found.fit.deviations[at] < 1.5e-6
    assert f"parameter.{RODS[0]}" in found.dataset["observation_what"].values
    assert np.isnan(found.dataset["row_x"].values[-1])
    assert any(
        "measured dimensions" in words for words in tp.calibration.calibrate.phrases(delta, data)
    )


def test_a_wrong_unit_of_a_part_is_named(delta: Machine) -> None:
    away = dict.fromkeys(RODS, 24.4 * 0.333)
    found = tp.calibration.data_checks.suspicions(delta, measured(delta, away, 1e-5))
    assert [(each.code, each.refuses) for each in found] == [("wrong-unit", True)]
    assert (
        tp.calibration.data_checks.suspicions(
            delta, measured(delta, dict.fromkeys(RODS, 1e-5), 1e-5)
        )
        == ()
    )


def test_the_advice_to_measure_the_rods_can_be_followed(tmp_path: Path) -> None:
    """The sentences of the refusal, read and done: rows in the same file, and it is a yes.

    The rods, and the height of one more point, are those of the machine that the positions of the
    same printer give.
    """
    data = EXAMPLES / "data"
    machine = tp.load(data / "delta_printer.toml")
    heights_file = data / "delta_heights.csv"
    refused = tp.calibrate(machine, heights_file, use_prior=False).gate
    assert not refused.accepted
    assert refused.remedy is not None
    advice = re.search(r"Measure the length of every strut \(to (\S+ mm)\)", refused.words)
    assert advice is not None, refused.words
    higher = re.search(r"one row at another commanded z, such as (\d+) mm", refused.words)
    assert higher is not None, refused.words
    truth = tp.calibrate(machine, data / "delta_positions.csv").calibrated()
    joints, placements, _ = machine.kernel.place([[0.0, 0.0, 1e-3 * float(higher[1])]])
    reached = truth.kernel.forward(joints, machine.kernel.pose_of(placements))
    height = 1e3 * float(reached[0, machine.dof.index("z")])
    sizes = dict(zip(truth.parameters, (1e3 * truth.nominal).tolist(), strict=True))
    rods = [f"strut.{strut.name}.length" for strut in machine.struts]
    head, _, table = heights_file.read_text().partition("\ncommand.")
    head += f'\n#: [instrument.gauge]\n#: kind = "parameter"\n#: uncertainty = "{advice[1]}"\n'
    (name,) = re.findall(r"\[instrument\.(.*)\]", heights_file.read_text())
    first, *rows = ("command." + table).strip().splitlines()
    columns = [f"parameter.{rod} (mm)" for rod in rods]
    noise = 0.02 * np.random.default_rng(3).standard_normal(len(rods))
    lengths = [f"{sizes[rod] + by:.2f}" for rod, by in zip(rods, noise, strict=True)]
    lines = [",".join(["instrument", first, *columns])]
    lines += [",".join([name, row, *[""] * len(rods)]) for row in rows]
    lines.append(",".join([name, "0", "0", higher[1], f"{height:.3f}", *[""] * len(rods)]))
    lines.append(",".join(["gauge", *[""] * (first.count(",") + 1), *lengths]))
    followed = tmp_path / "with_rods.csv"
    followed.write_text(head + "\n".join(lines) + "\n")
    for use_prior in (False, True):
        gate = tp.calibrate(machine, followed, use_prior=use_prior).gate
        assert gate.accepted, gate.words
        assert gate.after is not None
        if not use_prior:
            # As well known as the advice promised, or better by the further row.
            assert gate.after.position_max > 0.3 * refused.remedy.position
        assert gate.after.position_max < 1.05 * refused.remedy.position


WRONG = [
    (",parameter.strut.a9.length (mm)", "calliper,,,,,333", "unknown-parameter", 8),
    (",parameter.strut.a1.length (deg)", "calliper,,,,,333", "wrong-dimension", 8),
    (",parameter.strut.a1.length (mm)", "calliper,0,0,40,,333", "unwanted-value", 10),
    (",parameter.strut.a1.length (mm)", "probe,0,0,40,40,333", "unwanted-value", 10),
    (",parameter.strut.a1.length (mm)", "probe,0,,40,40,", "empty-cell", 10),
    (",parameter.strut.a1.length (mm)", "calliper,,,,,", "empty-cell", 10),
    (",parameter.tool.x (mm),temperature.default (degC)", "calliper,,,,,1,9", "unwanted-value", 10),
    (",parameter.strut.a1.length (mm),force.z (N)", "calliper,,,,,333,1", "unwanted-value", 10),
]  # fmt: skip


@pytest.mark.parametrize(("columns", "row", "code", "line"), WRONG)
def test_what_is_refused(
    tmp_path: Path, delta: Machine, columns: str, row: str, code: str, line: int
) -> None:
    commas = "," * (columns.count(",") - 1)
    good = f"{PROBED},{commas}\n" if "a9" in columns else f"calliper,,,,,333{commas}\n"
    found = problems(tmp_path, HEAD + COLUMNS + columns + "\n" + good + row + "\n", delta)
    assert (code, line) in [(problem.code, problem.line) for problem in found], found
    for problem in found:
        assert problem.expected


@pytest.mark.parametrize(
    "key", ['bias = "unknown"', 'frame = "base"', 'target = ["0 mm", "0 mm", "1 mm"]']
)
def test_a_part_has_no_such_key(tmp_path: Path, delta: Machine, key: str) -> None:
    text = (
        HEAD + f"#: {key}\n" + COLUMNS + ",parameter.tool.x (mm)\n" + PROBED + ",\ncalliper,,,,,1\n"
    )
    assert [problem.code for problem in problems(tmp_path, text, delta)] == ["unknown-key"]


def test_poses_and_conditions_of_a_part_are_refused(delta: Machine) -> None:
    gauge = Instrument("gauge", "parameter", Frame())
    values = {"parameter.tool.x": 0.0}
    warm = Condition(default_temperature=300.0)
    for others in ({"poses": [[0.0, 0.0, 0.04]]}, {"condition": warm}):
        with pytest.raises(RequestError) as refused:
            measurements_of(delta, gauge, values=values, uncertainty=1e-6, **others)  # type: ignore[arg-type]
        assert [p.code for p in refused.value.problems] == ["bad-measurements"]
    biased = Instrument("gauge", "parameter", Frame(), bias_unknown=True)
    with pytest.raises(RequestError) as refused:
        measurements_of(delta, biased, values=values, uncertainty=1e-6)
    assert [p.path for p in refused.value.problems] == ["instrument.bias_unknown"]


def test_it_is_nothing_to_plan(delta: Machine) -> None:
    with pytest.raises(RequestError) as refused:
        observed(delta, Instrument("gauge", "parameter", Frame(), uncertainty={"m": 1e-5}))
    (problem,) = refused.value.problems
    assert problem.code == "plan-instrument"
    assert "without a pose" in problem.message


def test_a_part_does_not_ask_where_the_machine_can_stand(delta: Machine) -> None:
    """Joints at which it has no pose, in rows that need none, change no reading and no slope."""
    data = joined(heights(delta, 8), measured(delta, dict.fromkeys(RODS, 1e-5), 1e-5))
    unknowns = unknowns_of(delta, data)
    at_home = IdentificationProblem(delta, data, unknowns)
    joints = data.joints.copy()
    joints[~data.posed] = [0.0, 9.0, 0.0]
    nowhere = IdentificationProblem(delta, dataclasses.replace(data, joints=joints), unknowns)
    values = np.full(unknowns.count, 1e-5)
    assert not nowhere.status(values).any()
    assert np.array_equal(nowhere.predict(values), at_home.predict(values))
    assert np.array_equal(nowhere.jacobian(values), at_home.jacobian(values))
    one = [problem.solve().values for problem in (nowhere, at_home)]
    assert np.array_equal(one[0], one[1])
    # Of a height it does ask.
    joints[0] = [0.0, 9.0, 0.0]
    failing = IdentificationProblem(delta, dataclasses.replace(data, joints=joints), unknowns)
    assert np.isnan(failing.predict(values)[0])
    assert failing.solve().ending == ("unreachable",)
