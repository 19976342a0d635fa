"""Distances between two commanded poses: files, arrays, what they determine, what is refused."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from made_measurement_files import problems, read
from made_measurements import made_measurements, poses_within
from truepose.calibration import Instrument, joined, measurements_of, write_measurements
from truepose.calibration.data_checks import suspicions
from truepose.calibration.identification.fit import fit
from truepose.calibration.identification.problem import IdentificationProblem
from truepose.calibration.identification.unknowns import unknowns_of
from truepose.calibration.instruments import Frame
from truepose.calibration.measurements import Measurements
from truepose.calibration.planning.readings import observed
from truepose.errors import RequestError
from truepose.machine import Condition, Machine

MACHINES = Path(__file__).parents[3] / "machines"

HEAD = """\
#: [instrument.calliper]
#: kind = "separation"
#: uncertainty = "0.02 mm"
"""
FIRST = "command.x (mm),command.y (mm),command.z (mm)"
SECOND = "to.command.x (mm),to.command.y (mm),to.command.z (mm)"
COLUMNS = f"{FIRST},{SECOND},distance (mm)\n"
CALLIPER = Instrument("calliper", "separation", Frame())


@pytest.fixture(scope="module")
def delta() -> Machine:
    return tp.load(MACHINES / "linear_delta.toml")


@pytest.fixture(scope="module")
def hexapod() -> Machine:
    return tp.load(MACHINES / "hexapod.toml")


def separations(
    machine: Machine, distances: np.ndarray, poses: np.ndarray, to: np.ndarray
) -> Measurements:
    return measurements_of(
        machine, CALLIPER, poses=poses, to=to, values={"distance": distances}, uncertainty=2e-6
    )


def test_a_file(tmp_path: Path, delta: Machine) -> None:
    text = HEAD + COLUMNS + "-50,0,0,50,0,0,100.04\n0,-50,10,0,50,10,99.97\n"
    found = read(tmp_path, text, delta)
    assert found.between.all()
    assert found.value.tolist() == pytest.approx([0.10004, 0.09997])
    assert found.placements[:, :3] == pytest.approx(np.array([[-0.05, 0, 0], [0, -0.05, 0.01]]))
    assert found.other_placements is not None
    assert found.other_placements[:, :3] == pytest.approx(np.array([[0.05, 0, 0], [0, 0.05, 0.01]]))
    write_measurements(tmp_path / "again.csv", delta, found)
    again = read(tmp_path, (tmp_path / "again.csv").read_bytes(), delta)
    assert again.other_joints is not None
    assert found.other_joints is not None
    assert np.allclose(again.other_joints, found.other_joints, rtol=1e-15, atol=0.0)
    assert np.array_equal(again.value, found.value)


def test_beside_rows_of_one_pose(tmp_path: Path, delta: Machine) -> None:
    head = HEAD + '#: [instrument.probe]\n#: kind = "coordinate"\n#: frame = "base"\n'
    head += '#: uncertainty = "5 um"\n'
    text = head + f"instrument,{FIRST},{SECOND},distance (mm),z (mm)\n"
    text += "probe,0,0,40,,,,,40.01\ncalliper,0,0,0,50,0,0,50.02,\nprobe,9,0,40,,,,,40\n"
    found = read(tmp_path, text, delta)
    assert found.between.tolist() == [False, True, False]
    some = found.select([False, True, True])
    assert some.between.tolist() == [True, False]
    problem = IdentificationProblem(delta, found, unknowns_of(delta, found))
    assert problem.status(np.zeros(problem.unknowns.count)).tolist() == [0, 0, 0]
    assert problem.predict(np.zeros(problem.unknowns.count))[1] == pytest.approx(0.05, abs=1e-4)


def test_what_is_read_is_what_the_machine_does(hexapod: Machine) -> None:
    """Another machine at the same joints, posed by its own forward kinematics."""
    random = np.random.default_rng(5)
    poses, to = poses_within(hexapod, 8, seed=1), poses_within(hexapod, 8, seed=2)
    names = [name for name in hexapod.parameters if name.endswith((".base.x", ".platform.y"))]
    away = dict(zip(names, (1e-4 * random.standard_normal(len(names))).tolist(), strict=True))
    nominal = dict(zip(hexapod.parameters, hexapod.nominal.tolist(), strict=True))
    truth = hexapod.replace({name: nominal[name] + by for name, by in away.items()})
    places = [truth.forward(hexapod.inverse(each)) for each in (poses, to)]
    expected = np.linalg.norm(places[1][:, :3] - places[0][:, :3], axis=1)
    data = separations(hexapod, expected, poses, to)
    unknowns = unknowns_of(hexapod, data, names)
    values = np.array([away[name] for name in unknowns.names])
    plain = dataclasses.replace(hexapod, sources=())
    problem = IdentificationProblem(plain, data, unknowns)
    assert np.abs(problem.predict(values) - expected).max() < 1e-11
    assert np.abs(problem.predict(np.zeros(len(names))) - expected).max() > 2e-5


def test_distances_alone_tell_how_large_a_delta_is(delta: Machine) -> None:
    """With rods 50 um too long all of them, distances say so; heights of a flat bed do too little.

    Second road: the machine with those rods, by its own forward kinematics.
    """
    rods = [name for name in delta.parameters if name.endswith(".length")]
    nominal = dict(zip(delta.parameters, delta.nominal.tolist(), strict=True))
    truth = delta.replace({rod: nominal[rod] + 50e-6 for rod in rods})
    poses, to = poses_within(delta, 40, seed=6), poses_within(delta, 40, seed=7)
    places = [truth.forward(delta.inverse(each)) for each in (poses, to)]
    distances = np.linalg.norm(places[1][:, :3] - places[0][:, :3], axis=1)
    data = separations(delta, distances, poses, to)
    found = fit(delta, data, unknowns_of(delta, data, rods), use_prior=False)
    assert not len(found.null_space)
    assert found.values == pytest.approx(np.full(len(rods), 50e-6), abs=3e-6)


def test_a_warm_row_is_warm_at_both_poses(hexapod: Machine) -> None:
    warm = Condition(default_temperature=hexapod.condition.reference_temperature + 10.0)
    poses, to = poses_within(hexapod, 4, seed=1), poses_within(hexapod, 4, seed=2)
    readings = {"distance": np.ones(4)}
    data = measurements_of(
        hexapod, CALLIPER, poses=poses, to=to, values=readings, uncertainty=1e-6, condition=warm
    )
    unknowns = unknowns_of(hexapod, data)
    predicted = IdentificationProblem(hexapod, data, unknowns).predict(np.zeros(unknowns.count))
    # The same by two rows of a position each.
    both = [
        measurements_of(
            hexapod, Instrument("tracker", "position", Frame()), poses=each,
            values=dict.fromkeys("xyz", np.zeros(4)), uncertainty=1e-6, condition=warm,
        )
        for each in (poses, to)
    ]  # fmt: skip
    none = np.zeros(unknowns.count)  # neither has unknowns of the instrument
    points = [IdentificationProblem(hexapod, one, unknowns).predict(none) for one in both]
    apart = np.linalg.norm((points[1] - points[0]).reshape(4, 3), axis=1)
    assert np.abs(predicted - apart).max() < 1e-12


def test_an_unknown_constant_of_a_calliper(delta: Machine) -> None:
    bar = made_measurements(
        delta, "separation", poses_within(delta, 30, seed=3), values="nominal", bias_unknown=True
    )
    shown = bar.with_values(bar.value + 3e-5, 1e-6)
    rods = [name for name in delta.parameters if name.endswith(".length")]
    found = fit(delta, shown, unknowns_of(delta, shown, rods))
    at = found.unknowns.names.index("made.bias.separation")
    assert found.values[at] == pytest.approx(3e-5, abs=2e-6)


def test_a_calibration_by_distances_and_measured_rods(delta: Machine) -> None:
    """Neither needs a frame, and together they are accepted or refused with reasons."""
    rods = [name for name in delta.parameters if name.endswith(".length")]
    nominal = dict(zip(delta.parameters, delta.nominal.tolist(), strict=True))
    gauge = Instrument("gauge", "parameter", Frame())
    measured = measurements_of(
        delta, gauge, values={f"parameter.{rod}": nominal[rod] for rod in rods}, uncertainty=2e-6
    )
    random = np.random.default_rng(0)
    poses, to = poses_within(delta, 60, seed=6), poses_within(delta, 60, seed=7)
    distances = np.linalg.norm(to - poses, axis=1) + 2e-6 * random.standard_normal(60)
    found = tp.calibrate(delta, joined(separations(delta, distances, poses, to), measured))
    assert found.validation is not None
    assert not found.suspicions
    assert found.gate.words
    assert found.dataset.sizes["observation"] == 66


def test_inches_of_a_calliper_are_named(delta: Machine) -> None:
    poses, to = poses_within(delta, 20, seed=6), poses_within(delta, 20, seed=7)
    noise = 2e-6 * np.random.default_rng(0).standard_normal(20)
    distances = np.linalg.norm(to - poses, axis=1) + noise
    assert suspicions(delta, separations(delta, distances, poses, to)) == ()
    first = suspicions(delta, separations(delta, distances / 25.4, poses, to))[0]
    assert first.code == "wrong-unit"
    assert "25.4, the inch" in first.sentence


GOOD = "0,0,0,50,0,0,50\n"
WRONG = [
    (COLUMNS, "0,0,0,0,0,0,50\n", "not-positive", 6),
    (COLUMNS, "0,0,0,50,0,0,-50\n", "not-positive", 6),
    (COLUMNS, "0,0,0,50,,0,50\n", "empty-cell", 6),
    (COLUMNS, "0,0,0,50,0,9000,50\n", "commanded-out-of-reach", 6),
    (f"{FIRST},distance (mm)\n", "0,0,0,50\n", "missing-column", 4),
    (f"{FIRST},to.command.x (mm),distance (mm)\n", "0,0,0,50,50\n", "missing-column", 4),
    (f"{FIRST},to.joint.a (mm),distance (mm)\n", "0,0,0,50,50\n", "excluding-columns", 4),
    (f"{FIRST},{SECOND},to.command.q,distance (mm)\n", "0,0,0,9,0,0,1,9\n", "other-machine", 4),
]  # fmt: skip


@pytest.mark.parametrize(("columns", "row", "code", "line"), WRONG)
def test_what_is_refused(
    tmp_path: Path, delta: Machine, columns: str, row: str, code: str, line: int
) -> None:
    first = GOOD if columns == COLUMNS else row
    found = problems(tmp_path, HEAD + columns + first + row, delta)
    assert [(problem.code, problem.line) for problem in found] == [(code, line)], found
    assert found[0].expected


def test_a_second_pose_of_a_row_that_has_one_is_refused(tmp_path: Path, delta: Machine) -> None:
    head = '#: [instrument.probe]\n#: kind = "coordinate"\n#: frame = "base"\n'
    head += '#: uncertainty = "5 um"\n'
    found = problems(tmp_path, head + f"{FIRST},{SECOND},z (mm)\n" + GOOD, delta)
    assert {problem.code for problem in found} == {"unwanted-value"}


def test_arrays_that_are_refused(delta: Machine) -> None:
    poses = [[0.0, 0.0, 0.0]]
    for kind, others in (
        ("separation", {}),
        ("separation", {"to": [[0.05, 0.0]]}),
        ("separation", {"to": [[0.05, 0.0, np.nan]]}),
        ("distance", {"to": [[0.05, 0.0, 0.0]]}),
    ):
        with pytest.raises(RequestError) as refused:
            measurements_of(
                delta, Instrument("i", kind, Frame()), poses=poses,
                values={"distance": 0.05}, uncertainty=1e-6, **others,
            )  # fmt: skip
        assert [(p.code, p.path) for p in refused.value.problems] == [("bad-measurements", "to")]


def test_it_is_nothing_to_plan(delta: Machine) -> None:
    with pytest.raises(RequestError) as refused:
        observed(delta, Instrument("bar", "separation", Frame(), uncertainty={"m": 1e-5}))
    (problem,) = refused.value.problems
    assert (problem.code, "between two" in problem.message) == ("plan-instrument", True)


def test_a_second_pose_that_cannot_be_counts_as_the_first_does(delta: Machine) -> None:
    """With weight the fit has no place for it; without, it is as if the row were not there."""
    rods = [name for name in delta.parameters if name.endswith(".length")]
    whole = made_measurements(
        delta, "separation", poses_within(delta, 30, seed=3), values="nominal"
    )
    assert whole.other_joints is not None
    whole = whole.with_values(whole.value + 1e-5 * np.sin(np.arange(30)))
    others = whole.other_joints.copy()
    others[4] = [0.0, 9.0, 0.0]
    spoilt = dataclasses.replace(whole, other_joints=others)
    unknowns = unknowns_of(delta, whole, rods)
    problem = IdentificationProblem(delta, spoilt, unknowns)
    none = np.zeros(unknowns.count)
    assert np.flatnonzero(problem.status(none)).tolist() == [4]
    assert np.flatnonzero(np.isnan(problem.predict(none))).tolist() == [4]
    assert np.isnan(problem.jacobian(none)[4]).all()
    assert problem.solve().ending == ("unreachable",)
    weights = np.ones(30)
    weights[4] = 0.0
    without = problem.solve(weights=weights)
    kept = whole.select(np.arange(30) != 4)
    expected = IdentificationProblem(delta, kept, unknowns).solve()
    assert without.ending == expected.ending
    assert np.abs(without.values - expected.values).max() < 1e-12
