"""Blunders are found by name, and good data arouse no suspicion."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
import pytest

import truepose as tp
from build_machine import MACHINES
from made_blunders import (
    column,
    elsewhere,
    exchanged,
    good,
    recommanded,
    scaled,
    shown,
    with_noise,
)
from made_measurements import made_measurements, poses_within
from sweeps import thinned
from truepose.calibration.data_checks import CODES, Suspicion, suspicions
from truepose.calibration.data_checks.too_few import last_digit
from truepose.calibration.identification.problem import IdentificationProblem
from truepose.calibration.identification.unknowns import unknowns_of
from truepose.calibration.instruments import REGISTRY
from truepose.calibration.measurements import Measurements
from truepose.machine import Machine
from truepose.spatial import vector_to_matrix

ALL = sorted(path.stem for path in MACHINES.glob("*.toml"))
SOME = {"planar_two_slider", "tricept", "hexapod"}
SPATIAL = ("hexapod", "walking_6psu", "hexaglide", "linapod", "hexapod_telescope")
INCH = 25.4
COUNT = 24


@functools.cache
def machine(name: str) -> Machine:
    return tp.load(MACHINES / f"{name}.toml")


def first(name: str, measurements: Measurements) -> Suspicion:
    found = suspicions(machine(name), measurements)
    assert found, "nothing is suspected"
    assert found[0].code in CODES
    return found[0]


def readable(name: str) -> list[tuple[str, str]]:
    """Kinds of instrument that read something of a machine, each with the frames it may have."""
    kinds = []
    for kind, entry in REGISTRY.items():
        if kind == "contact" or not entry.observed(machine(name).components):
            continue  # a contact needs joints that touch one point: below
        kinds += [(kind, "base")] + ([(kind, "unknown")] if entry.frame else [])
    return kinds


@pytest.mark.parametrize("name", thinned(ALL, SOME))
def test_good_data_arouse_no_suspicion(name: str) -> None:
    for kind, frame in readable(name):
        for seed in range(2):
            data = good(machine(name), kind, seed=seed, frame=frame)
            assert suspicions(machine(name), data) == (), (kind, frame, seed)


def test_contact_at_one_point_arouses_none() -> None:
    m = machine("hexapod")
    poses = poses_within(m, COUNT)
    poses[:, :3] = poses[0, :3]
    made = made_measurements(m, "contact", poses, frame="unknown", uncertainty=1e-3)
    assert suspicions(m, made) == ()


def test_a_few_outliers_arouse_none_of_a_blunder() -> None:
    data = good(machine("hexapod"), "position")
    value = data.value.copy()
    value[[5, 40]] += [3e-3, -5e-3]
    found = suspicions(machine("hexapod"), data.with_values(value))
    assert all(not each.refuses for each in found), found


@pytest.mark.parametrize("name", thinned(SPATIAL))
@pytest.mark.parametrize("kind", ["pose", "position"])
@pytest.mark.parametrize("pair", ["xy", "yz", "xz"])
def test_swapped_coordinates(name: str, kind: str, pair: str) -> None:
    data = good(machine(name), kind)
    found = first(name, exchanged(data, column(data, pair[0]), column(data, pair[1])))
    assert (found.code, set(found.where)) == ("swapped-columns", set(pair))
    assert found.factor > 5.0
    assert f"{pair[0]} and {pair[1]} stand in each other's place" in found.sentence


@pytest.mark.parametrize("name", thinned(SPATIAL))
def test_swapped_angles(name: str) -> None:
    data = good(machine(name), "pose")
    found = first(name, exchanged(data, column(data, "a"), column(data, "c")))
    assert (found.code, set(found.where)) == ("swapped-columns", {"a", "c"})
    assert found.unit == "rad"


@pytest.mark.parametrize("name", ["hexapod", "tripod", "linear_delta"])
def test_swapped_coordinates_of_an_unknown_frame(name: str) -> None:
    # An exchange of two axes, seen from a frame that may be turned, is a left-handed frame.
    data = good(machine(name), "position", frame="unknown")
    found = first(name, exchanged(data, column(data, "x"), column(data, "y")))
    assert found.code == "swapped-columns"


@pytest.mark.parametrize("name", ["hexapod", "hexapod_telescope"])
def test_two_struts_exchanged(name: str) -> None:
    data = good(machine(name), "strut-length")
    found = first(name, exchanged(data, column(data, "length", 1), column(data, "length", 4)))
    struts = [machine(name).struts[k].name for k in (1, 4)]
    assert found.code == "swapped-columns"
    assert set(found.where) == {f"strut.{each}.length" for each in struts}


@pytest.mark.parametrize("name", thinned([*SPATIAL, "tripod"], {"hexapod", "tripod"}))
def test_two_joints_exchanged(name: str) -> None:
    # The readings belong to the joints as they were; the file has two columns in turn.
    m = machine(name)
    data = good(m, "pose")
    joints = data.joints.copy()
    joints[:, [0, 1]] = joints[:, [1, 0]]
    found = first(name, recommanded(m, data, joints))
    assert found.code == "swapped-columns"
    assert {f"joint.{each}" for each in m.joints[:2]} <= set(found.where)


@pytest.mark.parametrize("name", thinned(ALL, SOME))
@pytest.mark.parametrize("factor", thinned([10.0, 1.0 / INCH, INCH, 0.1]))
def test_wrong_unit(name: str, factor: float) -> None:
    data = good(machine(name), "position")
    found = first(name, scaled(data, slice(None), factor))
    assert found.code == "wrong-unit"
    assert ("large" if factor > 1 else "small") in found.sentence
    assert (" 10" if factor in (10.0, 0.1) else " 25.4") in found.sentence


@pytest.mark.parametrize("name", ["hexapod", "tripod"])
def test_wrong_unit_of_one_column(name: str) -> None:
    data = good(machine(name), "position")
    found = first(name, scaled(data, column(data, "y"), INCH))
    assert (found.code, found.where) == ("wrong-unit", ("y",))


def test_wrong_unit_in_an_unknown_frame() -> None:
    data = good(machine("hexapod"), "position", frame="unknown")
    assert first("hexapod", scaled(data, slice(None), 1.0 / INCH)).code == "wrong-unit"


@pytest.mark.parametrize("kind", ["strut-length", "distance"])
def test_wrong_unit_of_other_lengths(kind: str) -> None:
    data = good(machine("hexapod"), kind)
    assert first("hexapod", scaled(data, slice(None), 10.0)).code == "wrong-unit"


def test_wrong_unit_of_the_command() -> None:
    # Commanded in tenths: a tenth of each pose about the workspace's middle would be measured.
    m = machine("linear_delta")
    poses = poses_within(m, COUNT)
    made = made_measurements(m, "position", poses, values="nominal")
    measured = with_noise(made, made.value, 0)
    _, placements, status = m.kernel.place(poses / 10.0)
    joints, *_ = m.kernel.place(poses / 10.0)
    assert (status == 0).all()
    found = first(
        "linear_delta", dataclasses.replace(measured, joints=joints, placements=placements)
    )
    assert found.code == "wrong-unit"
    assert "or the commands x, y and z are too small by a factor 10" in found.sentence


# The others turn too little beside their tolerances for their angles to tell.
TURNING = [name for name in SPATIAL if name != "walking_6psu"]


@pytest.mark.parametrize("name", thinned(TURNING))
@pytest.mark.parametrize("factor", [np.pi / 180.0, 180.0 / np.pi])
def test_degrees_for_radians(name: str, factor: float) -> None:
    data = good(machine(name), "pose")
    angles = np.concatenate([column(data, each) for each in "abc"])
    found = scaled(data, angles, factor)
    value = found.value.copy()
    value[angles] = (value[angles] + np.pi) % (2.0 * np.pi) - np.pi  # as the reader has them
    assert first(name, found.with_values(value)).code == "degrees-radians"


@pytest.mark.parametrize("name", thinned(SPATIAL))
def test_rotation_sign(name: str) -> None:
    data = good(machine(name), "pose")
    angles = np.concatenate([column(data, each) for each in "abc"])
    assert first(name, scaled(data, angles, -1.0)).code == "rotation-sign"
    found = first(name, scaled(data, column(data, "b"), -1.0))
    assert (found.code, found.where) == ("rotation-sign", ("b",))


@pytest.mark.parametrize("name", ["hexapod", "hexaglide", "linapod"])
def test_axis_order(name: str) -> None:
    data = good(machine(name), "pose")
    at = np.stack([column(data, each) for each in "abc"], axis=1)
    a, b, c = data.value[at].T
    rotation = np.stack(
        [
            vector_to_matrix(z) @ vector_to_matrix(y) @ vector_to_matrix(x)
            for x, y, z in _vectors(a, b, c)
        ]
    )
    # The same rotation in angles of R = Rx(a) Ry(b) Rz(c).
    other = np.column_stack(
        [
            np.arctan2(-rotation[:, 1, 2], rotation[:, 2, 2]),
            np.arcsin(rotation[:, 0, 2]),
            np.arctan2(-rotation[:, 0, 1], rotation[:, 0, 0]),
        ]
    )
    value = data.value.copy()
    value[at] = other
    found = first(name, data.with_values(value))
    assert found.code == "axis-order"
    assert "Rx(a) Ry(b) Rz(c)" in found.sentence


@pytest.mark.parametrize("name", ["hexapod", "linear_delta", "tricept", "rotary_delta", "3rpr"])
def test_warm_and_loaded_machines_arouse_no_suspicion(name: str) -> None:
    # Made by the kernel's own problem, the file's warmth and loads in every row.
    m = machine(name)
    for kind in ("position", "strut-length"):
        made = made_measurements(m, kind, poses_within(m, COUNT), condition=m.condition)
        unknowns = unknowns_of(m, made)
        spread = np.sqrt(np.diagonal(unknowns.prior_covariance))
        values = unknowns.prior_mean + spread * np.random.default_rng(2).uniform(-1, 1, spread.size)
        shows = IdentificationProblem(m, made, unknowns).predict(values)
        assert suspicions(m, with_noise(made, shows, 2)) == (), kind


def _vectors(*angles: np.ndarray) -> list[np.ndarray]:
    return [np.diag(each) for each in np.column_stack(angles)]


@pytest.mark.parametrize("name", thinned(SPATIAL))
@pytest.mark.parametrize("axis", "xyz")
def test_flipped_axis(name: str, axis: str) -> None:
    data = good(machine(name), "position")
    found = first(name, scaled(data, column(data, axis), -1.0))
    assert (found.code, found.where) == ("flipped-axis", (axis,))


@pytest.mark.parametrize("name", thinned([*SPATIAL, "tripod", "3rrr"], {"hexapod", "3rrr"}))
def test_another_frame_than_stated(name: str) -> None:
    m = machine(name)
    made = made_measurements(m, "position", poses_within(m, COUNT), values="nominal")
    turn = np.array([0.0, 0.0, 0.3]) if len(m.dof) < 6 and "z" not in m.dof else [0.2, -0.1, 0.3]
    there = elsewhere(made.instruments[0], [0.3, -0.2, 0.0], turn)
    found = first(name, with_noise(made, shown(m, m, made, there), 3))
    assert found.code == "other-frame"
    assert "another frame" in found.sentence


@pytest.mark.parametrize("name", thinned(SPATIAL))
def test_forgotten_target(name: str) -> None:
    m = machine(name)
    made = made_measurements(m, "position", poses_within(m, 40), values="nominal")
    there = elsewhere(made.instruments[0], np.zeros(3), np.zeros(3), [0.01, -0.02, 0.08])
    found = first(name, with_noise(made, shown(m, m, made, there), 3))
    assert found.code == "target-offset"


@pytest.mark.parametrize("name", thinned(ALL, SOME))
@pytest.mark.parametrize("step", [1, -1])
def test_shifted_rows(name: str, step: int) -> None:
    data = good(machine(name), "position")
    table = data.value.reshape(data.n_row, -1)
    found = first(name, data.with_values(np.roll(table, step, axis=0).ravel()))
    assert found.code in ("shifted-rows", "exchanged-rows")
    assert found.factor > 5.0


@pytest.mark.parametrize("name", thinned(ALL, SOME))
def test_two_rows_exchanged(name: str) -> None:
    data = good(machine(name), "position")
    table = data.value.reshape(data.n_row, -1).copy()
    far = int(np.argmax(np.linalg.norm(table - table[3], axis=1)))
    table[[3, far]] = table[[far, 3]]
    found = first(name, data.with_values(table.ravel()))
    assert (found.code, set(found.rows)) == ("exchanged-rows", {3, far})
    assert f"rows {min(3, far) + 1} and {max(3, far) + 1}" in found.sentence


def test_repeated_rows_and_their_lines() -> None:
    data = good(machine("hexapod"), "position")
    data = dataclasses.replace(data, lines=np.arange(data.n_row) + 7)
    rows = np.r_[np.arange(data.n_row), 4]
    copied = _rows(data, rows)
    (found,) = suspicions(machine("hexapod"), copied)
    assert (found.code, found.rows, found.lines) == ("repeated-rows", (4, 24), (11, 11))


def test_honest_repeats_arouse_none_and_others_do() -> None:
    data = good(machine("hexapod"), "position")
    twice = _rows(data, np.r_[np.arange(data.n_row), 4])
    noise = 1e-5 * np.random.default_rng(1).standard_normal(3)
    value = twice.value.copy()
    value[-3:] += noise
    assert suspicions(machine("hexapod"), twice.with_values(value)) == ()
    value[-3:] += 2e-4
    (found,) = suspicions(machine("hexapod"), twice.with_values(value))
    assert (found.code, found.rows, found.refuses) == ("repeats-disagree", (4, 24), False)


def _rows(data: Measurements, rows: np.ndarray) -> Measurements:
    width = data.n_observation // data.n_row
    at = (rows[:, np.newaxis] * width + np.arange(width)).ravel()
    return dataclasses.replace(
        data,
        joints=data.joints[rows],
        placements=data.placements[rows],
        instrument=data.instrument[rows],
        conditions=tuple(data.conditions[row] for row in rows),
        held_out=data.held_out[rows],
        lines=data.lines[rows],
        row=np.repeat(np.arange(rows.size), width),
        observable=data.observable[at],
        strut=data.strut[at],
        value=data.value[at],
        uncertainty=data.uncertainty[at],
    )


@pytest.mark.parametrize("name", thinned(ALL, SOME))
def test_constant_column(name: str) -> None:
    data = good(machine(name), "position")
    value = data.value.copy()
    value[column(data, "y")] = value[column(data, "y")[0]]
    found = first(name, data.with_values(value))
    assert (found.code, found.where) == ("constant-column", ("y",))


@pytest.mark.parametrize("name", thinned(ALL, SOME))
def test_copied_command(name: str) -> None:
    m = machine(name)
    data = made_measurements(m, "position", poses_within(m, COUNT), values="nominal")
    assert first(name, data).code == "copied-command"


def test_too_few_data() -> None:
    """What counts is rank: two points leave the turn about their line open, and their distance."""
    one = first("hexapod", good(machine("hexapod"), "position", frame="unknown", count=1))
    assert one.code == "too-few-data"
    assert "3 readings, and 6 unknowns of the instrument itself, of which they determine 3" in (
        one.sentence
    )
    two = good(machine("hexapod"), "position", frame="unknown", count=2)
    assert "too-few-data" not in [each.code for each in suspicions(machine("hexapod"), two)]


def test_absurd_uncertainty() -> None:
    data = good(machine("hexapod"), "position")
    large = data.with_values(data.value, 10.0)
    found = first("hexapod", large)
    assert (found.code, found.refuses) == ("absurd-uncertainty", False)
    rounded = data.with_values(np.round(data.value, 4), 1e-6)
    codes = [each.code for each in suspicions(machine("hexapod"), rounded)]
    assert codes == ["absurd-uncertainty"] * 3


def test_last_digit() -> None:
    values = np.random.default_rng(0).uniform(0.0, 1.0, 30)
    assert last_digit(np.round(values, 4), "m") == pytest.approx(1e-4)
    inches = np.round(values / 0.0254, 3) * 0.0254
    assert last_digit(inches, "m") == pytest.approx(0.0254e-3)
    assert last_digit(values, "m") is None
    assert last_digit(values[:3], "m") is None


def test_other_data_altogether() -> None:
    data = good(machine("hexapod"), "position")
    value = np.random.default_rng(0).permutation(data.value)
    found = first("hexapod", data.with_values(value))
    assert (found.code, found.refuses) == ("far-off", True)


def test_a_machine_beyond_its_tolerances_is_told_but_not_refused() -> None:
    m = machine("hexapod")
    made = made_measurements(m, "position", poses_within(m, COUNT), values="nominal")
    random = np.random.default_rng(0)
    actual = m.replace(
        {
            name: float(value + 2e-3 * random.uniform(-1.0, 1.0))
            for name, value, unit in zip(m.parameters, m.nominal, m.units, strict=True)
            if unit == "m" and name.startswith("strut.")
        }
    )
    found = suspicions(m, with_noise(made, shown(m, actual, made), 0))
    assert [(each.code, each.refuses) for each in found] == [("far-off", False)]
    assert "no known blunder" in found[0].sentence


def test_data_stay_as_they_are() -> None:
    data = good(machine("hexapod"), "pose")
    swapped = exchanged(data, column(data, "x"), column(data, "y"))
    before = swapped.value.copy()
    suspicions(machine("hexapod"), swapped)
    assert (swapped.value == before).all()


def test_every_code_is_documented() -> None:
    page = (MACHINES.parent / "docs" / "calibration_suspicions.md").read_text(encoding="utf-8")
    assert all(f"`{code}`" in page for code in CODES)
