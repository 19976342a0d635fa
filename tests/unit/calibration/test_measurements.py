"""The form of measurements: kinds of instruments, rows and observations, arrays, several in one."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import truepose as tp
from build_machine import machine_files
from made_measurements import made_measurements, nominal_values, poses_within
from truepose.calibration import Frame, Instrument, Measurements, joined, measurements_of
from truepose.calibration.instruments import REGISTRY
from truepose.calibration.instruments._base import of_readings
from truepose.calibration.measurements.rows import within_a_turn
from truepose.calibration.observables import OBSERVABLES, column_name
from truepose.errors import RequestError
from truepose.machine import Condition, Machine

MACHINES = Path(__file__).parents[3] / "machines"
SPACE = ("x", "y", "z", "rx", "ry", "rz")
NO, YES = False, True


@pytest.fixture(scope="module")
def machine() -> Machine:
    return tp.load(MACHINES / "hexapod_telescope.toml")


@pytest.fixture(scope="module")
def slider() -> Machine:
    return tp.load(MACHINES / "planar_two_slider.toml")


# Kinds of instruments.


@pytest.mark.parametrize("name", REGISTRY)
def test_a_kind_says_what_it_is(name: str) -> None:
    kind = REGISTRY[name]
    assert kind.name == name
    assert kind.doc.endswith(".")
    assert kind.by.startswith("by ")
    assert set(kind.reads.values()) | set(kind.fixed) <= set(OBSERVABLES)
    observed = kind.observed(SPACE)
    assert observed
    assert kind.phrase(observed).startswith("by ")
    if kind.frame is not None:
        assert any(kind.frame(observed, SPACE))


@pytest.mark.parametrize(
    ("observables", "components", "unknown"),
    [
        ("xyz", SPACE, (YES,) * 6),
        ("xyzabc", SPACE, (YES,) * 6),
        ("z", SPACE, (NO, NO, YES, YES, YES, NO)),  # a height: turned about z it is the same
        ("x", SPACE, (YES, NO, NO, NO, YES, YES)),
        ("xy", ("x", "y", "rz"), (YES, YES, NO, NO, NO, YES)),  # no height in a planar machine
        ("xyz", ("x", "y"), (YES,) * 6),  # unless it is read, which shows tilts of the frame
        ("ab", SPACE, (NO, NO, NO, YES, YES, NO)),
        ("a", ("z", "rx", "ry"), (NO, NO, NO, YES, NO, NO)),
        ("c", ("x", "y", "rz"), (NO, NO, NO, NO, NO, YES)),
    ],
)
def test_what_of_a_frame_readings_see(
    observables: str, components: tuple[str, ...], unknown: tuple[bool, ...]
) -> None:
    assert of_readings(observables, components) == unknown


@pytest.mark.parametrize(
    ("name", "observables", "phrase"),
    [
        ("coordinate", "z", "by heights alone"),
        ("coordinate", "xy", "by x and y alone"),
        ("position", "xyz", "by positions in x, y and z"),
        ("pose", "xyc", "by whole poses (x y c)"),
        ("orientation", "ab", "by the angles a and b alone"),
        ("distance", ("distance",), "by distances alone"),
    ],
)
def test_words_for_how_an_instrument_sees(name: str, observables: Any, phrase: str) -> None:
    assert REGISTRY[name].phrase(tuple(observables)) == phrase


def test_an_uncertainty_by_observable_goes_before_that_by_unit() -> None:
    instrument = Instrument("i", "pose", Frame(), uncertainty={"m": 1e-5, "z": 3e-5})
    found = [instrument.uncertainty_of(each) for each in ("x", "z", "a")]
    assert found == [1e-5, 3e-5, None]


# Rows and observations.


def test_some_rows_of_measurements(machine: Machine) -> None:
    whole = made_measurements(machine, "position", poses_within(machine, 5), values="nominal")
    some = whole.select([True, False, True, True, False])
    assert some.n_row == 3
    assert some.row.tolist() == [0, 0, 0, 1, 1, 1, 2, 2, 2]
    assert np.array_equal(some.value, whole.value[np.isin(whole.row, [0, 2, 3])])
    assert np.array_equal(some.joints, whole.joints[[0, 2, 3]])
    assert np.array_equal(some.value, nominal_values(machine, some))
    none = whole.select(np.zeros(5, bool))
    assert (none.n_row, none.n_observation) == (0, 0)
    with pytest.raises(ValueError, match="flags"):
        whole.select([True])


def test_other_values(machine: Machine) -> None:
    made = made_measurements(machine, "distance", poses_within(machine, 4))
    other = made.with_values([1.0, 2.0, 3.0, 4.0], 2e-5)
    assert other.value.tolist() == [1.0, 2.0, 3.0, 4.0]
    assert other.uncertainty.tolist() == [2e-5] * 4
    assert made.value.tolist() == [0.0] * 4
    assert other.observables(0) == ("distance",)
    for value, uncertainty in (([1.0], None), ([math.nan] * 4, None), ([1.0] * 4, 0.0)):
        with pytest.raises(ValueError, match="expected"):
            made.with_values(value, uncertainty)


# From arrays.


def same(one: Measurements, other: Measurements, exact: bool = True) -> None:
    """Whether two are the same, but for the file they come from."""
    assert one.instruments == other.instruments
    assert one.conditions == other.conditions
    for name in ("instrument", "held_out", "row", "observable", "strut", "uncertainty"):
        assert np.array_equal(getattr(one, name), getattr(other, name)), name
    for name in ("joints", "placements", "value", "other_joints", "other_placements"):
        if getattr(other, name) is None:
            assert getattr(one, name) is None
            continue
        assert np.allclose(getattr(one, name), getattr(other, name), rtol=0, atol=1e-12), name
    if exact:
        assert np.array_equal(one.value, other.value)
        assert np.array_equal(one.joints, other.joints)


def columns_of(machine: Machine, made: Measurements) -> dict[str, np.ndarray]:
    """The readings of measurements of one instrument by the columns of a file."""
    words = {o: w for w, o in REGISTRY[made.instruments[0].kind].reads.items()}
    columns: dict[str, np.ndarray] = {}
    for row, code, strut, value in zip(
        made.row, made.observable, made.strut, made.value, strict=True
    ):
        word = words.get(OBSERVABLES[code])
        if word is None:
            continue
        name = word if strut < 0 else column_name(machine, int(code), int(strut))
        columns.setdefault(name, np.full(made.n_row, math.nan))[row] = value
    return columns


def commands(kind: str, **first: np.ndarray) -> dict[str, np.ndarray]:
    """What a kind needs of the commands: nothing, the poses, or to which others it measured too."""
    ((name, table),) = first.items()
    return [{}, {name: table}, {name: table, "to": np.roll(table, 1, axis=0)}][REGISTRY[kind].poses]


@pytest.mark.parametrize("kind", REGISTRY)
def test_arrays_of_every_kind(machine: Machine, kind: str) -> None:
    poses = poses_within(machine, 6, seed=2)
    made = made_measurements(
        machine, kind, poses, frame=Frame(origin=(0.1, 0.2, -0.3)), values="nominal"
    )
    if kind == "contact":
        made = made.with_values(np.zeros(made.n_observation))
    values = columns_of(machine, made)
    commanded = commands(kind, poses=poses)
    found = measurements_of(machine, made.instruments[0], values=values, **commanded)
    same(found, made)
    commanded = commands(kind, joints=made.joints)
    again = measurements_of(machine, made.instruments[0], values=values, **commanded)
    same(again, made)


def test_a_frame_to_be_found_is_what_is_seen_of_it(slider: Machine) -> None:
    poses = poses_within(slider, 3)
    camera = Instrument("camera", "position", Frame(origin=(0.1, 0.0, 0.0)))
    found = measurements_of(
        slider,
        camera,
        poses=poses,
        values={"x": poses[:, 0], "y": poses[:, 1]},
        uncertainty=1e-5,
        frame_unknown=True,
    )
    assert found.instruments[0].frame.unknown == (YES, YES, NO, NO, NO, YES)
    assert found.instruments[0].frame.origin == (0.1, 0.0, 0.0)
    assert found.uncertainty.tolist() == [1e-5] * 6


def test_readings_that_are_not_there_and_uncertainties_by_column(machine: Machine) -> None:
    poses = poses_within(machine, 3)
    scales = Instrument("scales", "strut-length", Frame(), uncertainty={"length": 2e-6})
    found = measurements_of(
        machine,
        scales,
        poses=poses,
        values={"strut.1.length": [0.5, math.nan, 0.52], "strut.3.length": 0.6},
        uncertainty={"strut.3.length": [1e-6, math.nan, 3e-6]},
        held_out=[False, False, True],
    )
    assert found.strut.tolist() == [0, 2, 2, 0, 2]
    assert found.row.tolist() == [0, 0, 1, 2, 2]
    assert found.uncertainty.tolist() == [2e-6, 1e-6, 2e-6, 2e-6, 3e-6]
    assert found.held_out.tolist() == [False, False, True]


def test_the_condition_of_rows(machine: Machine) -> None:
    poses = poses_within(machine, 3)
    warm = Condition(default_temperature=300.0)
    one = Instrument("bar", "distance", Frame(), uncertainty={"distance": 1e-6})
    values = {"distance": 0.5}
    cold = measurements_of(machine, one, poses=poses, values=values)
    assert len({id(each) for each in cold.conditions}) == 1
    assert cold.conditions[0].default_temperature == machine.condition.reference_temperature
    found = measurements_of(machine, one, poses=poses, values=values, condition=[warm, warm, warm])
    assert found.conditions == (warm,) * 3
    with pytest.raises(RequestError) as error:
        measurements_of(machine, one, poses=poses, values=values, condition=[warm])
    assert [p.path for p in error.value.problems] == ["condition"]
    strange = Condition(part_temperatures={"strut.99": 300.0})
    with pytest.raises(RequestError) as error:
        measurements_of(machine, one, poses=poses, values=values, condition=strange)
    assert [p.code for p in error.value.problems] == ["unknown-part"]


REFUSED: list[tuple[str, str, dict[str, Any]]] = [
    ("bad-measurements", "instrument.kind", {"instrument": Instrument("i", "posision", Frame())}),
    ("bad-measurements", "instrument.name", {"instrument": Instrument("strut", "pose", Frame())}),
    (
        "bad-measurements",
        "instrument.frame.rotation",
        {"instrument": Instrument("i", "position", Frame(rotation=(1.0, 1.0, 0.0, 0.0)))},
    ),
    (
        "not-positive",
        "instrument.uncertainty.x",
        {"instrument": Instrument("i", "position", Frame(), uncertainty={"x": 0.0})},
    ),
    ("bad-measurements", "poses", {"poses": [[0.1, 0.2, 0.3]]}),
    ("bad-measurements", "poses", {"poses": [[math.nan, 0.2]] * 3}),
    ("bad-measurements", "poses", {"poses": None}),
    ("bad-measurements", "poses", {"joints": [[0.6, 0.6]] * 3}),
    ("bad-measurements", "poses", {"poses": "here"}),
    ("bad-measurements", "values.u", {"values": {"u": 0.0, "x": 0.0, "y": 0.0}}),
    ("bad-measurements", "values.x", {"values": {"x": [1.0, 2.0], "y": 0.0}}),
    ("bad-measurements", "values.x", {"values": {"x": math.inf, "y": 0.0}}),
    ("missing-column", None, {"values": {"x": 0.0}}),
    ("empty-cell", "y", {"values": {"x": 0.0, "y": [1.0, math.nan, 2.0]}}),
    ("unwanted-value", "distance", {"values": {"x": 0.0, "y": 0.0, "distance": 1.0}}),
    ("not-positive", "x.uncertainty", {"uncertainty": {"x": -1.0, "y": 1.0}}),
    ("no-uncertainty", "y", {"uncertainty": {"x": 1.0}}),
    ("bad-measurements", "uncertainty.u", {"uncertainty": {"u": 1.0}}),
    ("bad-measurements", "held_out", {"held_out": [True]}),
    ("commanded-out-of-reach", None, {"poses": [[0.3, 0.2], [0.3, 0.2], [9.0, 0.2]]}),
    ("commanded-out-of-reach", "joint.d1", {"poses": None, "joints": [[9.0, 0.6]] * 3}),
]


@pytest.mark.parametrize(("code", "path", "changes"), REFUSED)
def test_arrays_that_are_refused(
    slider: Machine, code: str, path: str | None, changes: dict[str, Any]
) -> None:
    given: dict[str, Any] = {
        "instrument": Instrument("camera", "position", Frame()),
        "poses": [[0.3, 0.2], [0.25, 0.2], [0.3, 0.25]],
        "values": {"x": [0.3, 0.25, 0.3], "y": [0.2, 0.2, 0.25]},
        "uncertainty": 1e-5,
    }
    assert measurements_of(slider, **given).n_row == 3
    with pytest.raises(RequestError) as error:
        measurements_of(slider, **(given | changes))
    assert (code, path) in [(p.code, p.path) for p in error.value.problems]
    assert {p.code for p in error.value.problems} == {code}


def test_several_become_one(machine: Machine) -> None:
    poses = poses_within(machine, 4)
    tracker = made_measurements(machine, "position", poses, name="tracker", values="nominal")
    bar = made_measurements(machine, "distance", poses[:2], name="bar", values="nominal")
    both = joined(tracker.select([True, True, False, False]), bar, tracker.select([0, 0, 1, 1]))
    assert [each.name for each in both.instruments] == ["tracker", "bar"]
    assert both.instrument.tolist() == [0, 0, 1, 1, 0, 0]
    assert both.n_observation == 14
    assert np.array_equal(both.value, nominal_values(machine, both))
    assert len({id(each) for each in both.conditions}) == 1
    same(
        both.select(both.instrument == 0).select([1, 1, 1, 1]),
        joined(tracker, bar).select([1, 1, 1, 1, 0, 0]),
    )


def test_what_cannot_be_joined(machine: Machine, slider: Machine) -> None:
    one = made_measurements(machine, "position", poses_within(machine, 2))
    two = made_measurements(machine, "distance", poses_within(machine, 2))
    other = made_measurements(slider, "position", poses_within(slider, 2), name="other")
    for several in ((), (one, two), (one, other)):
        with pytest.raises(RequestError) as error:
            joined(*several)
        assert [p.code for p in error.value.problems] == ["bad-measurements"]


def test_angles_are_taken_into_one_turn() -> None:
    angles = np.deg2rad([0.0, 359.0, -181.0, 180.0, -180.0, 725.0])
    found = np.rad2deg(within_a_turn(angles))
    assert np.allclose(found, [0.0, -1.0, 179.0, 180.0, -180.0, 5.0])
    assert within_a_turn(angles)[0] == 0.0


@pytest.mark.parametrize("path", machine_files(), ids=lambda path: path.stem)
def test_every_kind_of_every_machine(path: Path) -> None:
    machine = tp.load(path)
    poses = poses_within(machine, 5)
    for name, kind in REGISTRY.items():
        if not kind.observed(machine.components):
            continue
        made = made_measurements(machine, name, poses, values="nominal")
        if name == "contact":
            made = made.with_values(np.zeros(made.n_observation))
        values = columns_of(machine, made)
        commanded = commands(name, poses=poses)
        found = measurements_of(machine, made.instruments[0], values=values, **commanded)
        same(found, made)
