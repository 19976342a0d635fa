"""The actuator source: lead, what repeats, and measured positioning after ISO 230-2."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

import space_slider
import truepose as tp
from machine_texts import HEXAPOD, PLANAR, edited, line_of, load_text
from truepose.errors import MachineFileError
from truepose.machine import Machine
from truepose.runs.poses import PoseRun
from truepose.sources import ARCSINE, TWO_POINT, Deviation, normal
from two_slider import Floats, displaced

TABLE = 'actuator = { table = "d1.csv" }'

# mm and um: at every target five runs in each direction. By hand, at 300 mm: mean 4 and 12 um;
# squares of the differences from it sum to 10 and 40 um^2, so s = sqrt(2.5) and sqrt(10) um.
MEASURED = """\
# laser interferometer, 20.1 degC
target (mm), direction, deviation (um)
""" + "".join(
    f"{target}, {way}, {value}\n"
    for target, up, down in (
        (0, (0, 1, 0, -1, 0), (3, 4, 5, 4, 4)),
        (300, (2, 3, 4, 5, 6), (8, 10, 12, 14, 16)),
        (900, (20, 20, 20, 20, 20), (14, 14, 16, 16, 15)),
    )
    for way, values in (("+", up), ("-", down))
    for value in values
)
MICRO = 1e-6


def with_actuator(given: str, drive: str = "d1", text: str = PLANAR) -> str:
    return edited(text, (f'name = "{drive}"', f'name = "{drive}"\nactuator = {given}'))


def with_table(folder: Path, csv: str = MEASURED, text: str = PLANAR) -> str:
    (folder / "d1.csv").write_text(csv, encoding="utf-8")
    return edited(text, ('name = "d1"', f'name = "d1"\n{TABLE}'))


def deviation_of(machine: Machine, poses: Floats, *, path: bool = False) -> Deviation:
    (source,) = (each for each in machine.sources if each.name == "actuator")
    (block,) = PoseRun(machine, poses, machine.condition, path=path)
    return cast("Deviation", cast("Any", source).deviation(machine, machine.condition, block))


def at_joint(machine: Machine, *joints: float, second: float = 0.4) -> Floats:
    """(n, 2) poses at which the first joint is at each of `joints`, m."""
    return np.array([machine.forward([joint, second]) for joint in joints])


def first_only(values: Floats) -> Floats:
    return np.stack([values, np.zeros(len(values))], axis=1)


@pytest.mark.parametrize(
    ("extra", "given", "zero"),
    [
        ("", '{ lead_error = "20 um / 300 mm" }', 0.0),
        # Where a screw's bearing stands says nothing of where the axis was homed.
        ("fixed_at = 250\n", '{ lead_error = "20 um / 300 mm" }', 0.0),
        ("fixed_at = 250\n", '{ lead_error = "20 um / 300 mm", zero_at = 100 }', 0.1),
    ],
)
def test_a_known_lead_error_grows_from_where_it_counts(
    tmp_path: Path, extra: str, given: str, zero: float
) -> None:
    text = edited(with_actuator(given), ("travel = [0, 900]\n", f"travel = [0, 900]\n{extra}"))
    machine = load_text(tmp_path, text)
    off = 20e-6 / 0.3 * (machine.inverse(machine.poses())[:, 0] - zero)
    expected = displaced(machine, machine.poses(), joints=first_only(off))
    found = tp.budget(machine).sel(source="actuator")
    assert np.abs(found.error - expected).max() < 1e-14
    assert not found.uncertainty.values.any()


def test_a_lead_error_within_limits_is_a_band(tmp_path: Path) -> None:
    machine = load_text(tmp_path, with_actuator('{ lead_error = ["0 um/m", "40 um/m"] }'))
    found = deviation_of(machine, machine.poses())
    assert [machine.parameters[column] for column in found.parameters] == ["drive.d1.scale"]
    assert found.shift.tolist() == found.half.tolist() == [[pytest.approx(20e-6, rel=1e-12)]]


def test_a_periodic_error_of_known_phase_is_a_sine_along_the_travel(tmp_path: Path) -> None:
    given = '{ periodic = { amplitude = "3 um", period = 10, phase = "30 deg" } }'
    machine = load_text(tmp_path, with_actuator(given))
    joint = machine.inverse(machine.poses())[:, 0]
    off = 3e-6 * np.sin(2 * np.pi * joint / 0.01 + np.pi / 6)
    assert np.ptp(off) > 4e-6
    found = tp.budget(machine).sel(source="actuator")
    expected = displaced(machine, machine.poses(), joints=first_only(off))
    assert np.abs(found.error - expected).max() < 1e-14


def test_a_periodic_error_of_unknown_phase_is_an_arcsine_band(tmp_path: Path) -> None:
    given = '{ periodic = { amplitude = "3 um", period = 10 } }'
    machine = load_text(tmp_path, with_actuator(given))
    deviation = deviation_of(machine, machine.poses())
    assert deviation.distribution == (ARCSINE,)
    most = np.abs(displaced(machine, machine.poses(), joints=np.array([3e-6, 0.0])))
    found = tp.budget(machine).sel(source="actuator")
    assert not found.error.values.any()
    assert np.abs(found.worst - most).max() < 1e-4 * most.max()
    assert np.abs(found.uncertainty - most / 2**0.5).max() < 1e-4 * most.max()
    # The sine itself, over all phases, has that spread.
    sine = np.sin(np.linspace(0, 2 * np.pi, 1000, endpoint=False))
    assert np.std(sine) == pytest.approx(1 / ARCSINE.sigmas, rel=1e-12)


def test_carriages_in_space_each_with_its_own_sine(tmp_path: Path) -> None:
    text = space_slider.SPACE
    for drive in ("d1", "d2", "d3"):
        given = '{ periodic = { amplitude = "5 um", period = 37, phase = 0 } }'
        text = with_actuator(given, drive, text)
    machine = load_text(tmp_path, text)
    joints = machine.inverse(machine.poses())
    off = 5e-6 * np.sin(2 * np.pi * joints / 0.037)
    expected = space_slider.tool(space_slider.carriages(joints + off), machine.poses())
    found = tp.budget(machine).sel(source="actuator").error
    assert np.abs(found - (expected - machine.poses())).max() < 1e-13


def test_a_measured_table_by_hand_at_a_target(tmp_path: Path) -> None:
    machine = load_text(tmp_path, with_table(tmp_path))
    found = deviation_of(machine, at_joint(machine, 0.3))
    assert [machine.parameters[column] for column in found.parameters] == ["drive.d1.offset"] * 2
    assert found.distribution == (normal(2.0), TWO_POINT)
    assert np.allclose(found.shift, [[8 * MICRO, 0]], rtol=1e-9, atol=1e-18)
    # Both directions: the wider spread, and half the reversal of 8 um.
    assert np.allclose(found.half, [[2 * 10**0.5 * MICRO, 4 * MICRO]], rtol=1e-9)


def test_the_direction_of_travel_decides_where_it_is_known(tmp_path: Path) -> None:
    machine = load_text(tmp_path, with_table(tmp_path))
    found = deviation_of(machine, at_joint(machine, 0.25, 0.3, 0.35, 0.3, 0.3), path=True)
    ways = np.array([0, 1, 1, -1, -1])  # the last has not moved since it came in -
    assert found.shift[1, 0] == pytest.approx(4 * MICRO, rel=1e-9)
    assert found.shift[3:, 0] == pytest.approx(12 * MICRO, rel=1e-9)
    assert found.half[1, 0] == pytest.approx(2 * 2.5**0.5 * MICRO, rel=1e-9)
    assert found.half[3:, 0] == pytest.approx(2 * 10**0.5 * MICRO, rel=1e-9)
    assert (found.half[:, 1] > 0).tolist() == (ways == 0).tolist()


def statistics(csv: str) -> tuple[Floats, Floats, Floats]:
    """Targets (m,), means and spreads (m, 2) of + and -, mm and um, by numpy."""
    rows = [line.split(", ") for line in csv.splitlines()[2:]]
    targets = sorted({float(row[0]) for row in rows})
    groups = [
        [[float(r[2]) for r in rows if float(r[0]) == t and r[1] == way] for way in "+-"]
        for t in targets
    ]
    return (
        np.array(targets),
        np.array([[np.mean(each) for each in pair] for pair in groups]),
        np.array([[np.std(each, ddof=1) for each in pair] for pair in groups]),
    )


def test_between_targets_it_goes_straight(tmp_path: Path) -> None:
    machine = load_text(tmp_path, with_table(tmp_path))
    joints = np.linspace(0.1, 0.7, 9)
    targets, means, spreads = statistics(MEASURED)
    up, down = (np.interp(1e3 * joints, targets, means[:, way]) for way in (0, 1))
    widest = np.max([np.interp(1e3 * joints, targets, spreads[:, way]) for way in (0, 1)], axis=0)
    found = deviation_of(machine, at_joint(machine, *joints))
    assert np.allclose(found.shift[:, 0], (up + down) / 2 * MICRO, rtol=1e-8)
    assert np.allclose(found.half[:, 0], 2 * widest * MICRO, rtol=1e-8)
    assert np.allclose(found.half[:, 1], np.abs(up - down) / 2 * MICRO, rtol=1e-8)


@pytest.mark.parametrize("alike", [True, False])
def test_the_band_is_the_standard_s_repeatability_or_more(tmp_path: Path, alike: bool) -> None:
    """R = max(2 s+ + 2 s- + |B|, 4 s+, 4 s-), ISO 230-2:2014: the whole width."""
    random = np.random.default_rng(2)
    rows = ["target (mm), direction, deviation (um)"]
    spread = random.normal(size=5)
    for target in range(0, 1000, 100):
        for way, lag in (("+", 3.0), ("-", -1.0)):
            runs = lag + (spread if alike else random.normal(size=5) * (2.0 if way == "+" else 1))
            rows += [f"{target}, {way}, {run!r}" for run in runs.tolist()]
    csv = "\n".join(["# made", *rows])
    machine = load_text(tmp_path, with_table(tmp_path, csv))
    targets, means, s = statistics(csv)
    inside = targets[(targets > 0) & (targets < 900)]
    found = deviation_of(machine, at_joint(machine, *(1e-3 * inside)))
    at = np.isin(targets, inside)
    width = np.max(
        [2 * s[at].sum(axis=1) + np.abs(np.diff(means[at])[:, 0]), 4 * s[at, 0], 4 * s[at, 1]],
        axis=0,
    )
    half = found.half.sum(axis=1) / MICRO
    if alike:
        assert np.allclose(half, width / 2, rtol=1e-8)
    else:
        assert (half >= width / 2 - 1e-9).all()
        # The band holds both directions' means and their own repeatability.
        centre = found.shift[:, 0] / MICRO
        for way in (0, 1):
            off = np.abs(means[at, way] - centre) + 2 * s[at, way]
            assert (off <= half + 1e-9).all()


def test_a_table_s_errors_in_the_budget(tmp_path: Path) -> None:
    machine = load_text(tmp_path, with_table(tmp_path))
    poses = machine.poses()
    targets, means, spreads = statistics(MEASURED)
    joint = 1e3 * machine.inverse(poses)[:, 0]
    both = [np.interp(joint, targets, means[:, way]) * MICRO for way in (0, 1)]
    found = tp.budget(machine).sel(source="actuator")
    middle = displaced(machine, poses, joints=first_only((both[0] + both[1]) / 2))
    assert np.abs(found.error - middle).max() < 1e-13
    s = np.max([np.interp(joint, targets, spreads[:, way]) for way in (0, 1)], axis=0) * MICRO
    spread = np.sqrt(s**2 + ((both[0] - both[1]) / 2) ** 2)
    one = np.abs(displaced(machine, poses, joints=first_only(np.full(len(poses), 1e-7)))) / 1e-7
    assert np.allclose(found.uncertainty, one * spread[:, np.newaxis], rtol=1e-4)
    assert list(machine.data_files) == ["d1.csv"]


def test_rows_in_any_order_and_a_machine_that_travels(tmp_path: Path) -> None:
    head, *rows = MEASURED.splitlines()[1:]
    shuffled = "\n".join([head, *np.random.default_rng(5).permutation(rows).tolist()])
    machine = load_text(tmp_path, with_table(tmp_path, shuffled))
    again = pickle.loads(pickle.dumps(machine))  # noqa: S301
    sorted_one = load_text(tmp_path, with_table(tmp_path))
    poses = at_joint(machine, 0.2, 0.5)
    for each in (machine, again):
        assert np.allclose(
            deviation_of(each, poses).half, deviation_of(sorted_one, poses).half, rtol=1e-12
        )


def test_an_actuator_without_error_changes_nothing(tmp_path: Path) -> None:
    given = "{ lead_error = 0, periodic = { amplitude = 0, period = 5 } }"
    found = tp.budget(load_text(tmp_path, with_actuator(given)))
    for name in ("error", "error_lower", "error_upper", "worst", "uncertainty"):
        assert not found[name].sel(source="actuator").values.any()


def test_a_telescope_s_screw_moves_its_offset(tmp_path: Path) -> None:
    given = '{ lead_error = "50 um/m", zero_at = 100 }'
    machine = load_text(tmp_path, with_actuator(given, "d2", HEXAPOD))
    moved = machine.replace({"drive.d2.scale": 1 + 50e-6, "drive.d2.offset": 0.6 - 50e-6 * 0.1})
    poses = machine.poses()
    gone = moved.forward(machine.inverse(poses)) - poses
    found = tp.budget(machine).sel(source="actuator").error
    assert np.abs(found[:, :3] - gone[:, :3]).max() < 1e-12


@pytest.mark.parametrize(
    ("given", "code", "words"),
    [
        ("{}", "missing-key", "none of lead_error, periodic and table"),
        ('{ lead_error = "1 ppm", table = "d1.csv" }', "excluding-keys", "lead_error and table"),
        ('{ lead_error = "1 um" }', "wrong-dimension", "found a length"),
        ('{ leed_error = "1 ppm" }', "unknown-key", 'did you mean "lead_error"?'),
        ("{ periodic = { amplitude = 1 } }", "missing-key", "periodic.period"),
        ("{ periodic = { amplitude = 1, perod = 5 } }", "unknown-key", 'mean "period"?'),
        ("{ periodic = { amplitude = 1, period = 0 } }", "not-positive", "above zero"),
        ("{ periodic = { amplitude = -1, period = 5 } }", "negative", "zero or more"),
        ('{ table = "d2.csv" }', "file-missing", "d2.csv"),
        ("{ table = 3 }", "wrong-type", "expected text"),
    ],
)
def test_what_an_actuator_may_not_say(tmp_path: Path, given: str, code: str, words: str) -> None:
    text = with_actuator(given)
    with pytest.raises(MachineFileError) as caught:
        load_text(tmp_path, text)
    (problem,) = caught.value.problems
    assert (problem.code, problem.line) == (code, line_of(text, "actuator ="))
    assert words in str(problem)
    assert problem.expected


def test_a_direct_scale_sees_lead_and_period(tmp_path: Path) -> None:
    given = (
        '{ lead_error = "1 ppm", periodic = { amplitude = 1, period = 5 } }\nfeedback = "direct"'
    )
    text = with_actuator(given)
    with pytest.raises(MachineFileError) as caught:
        load_text(tmp_path, text)
    assert [problem.code for problem in caught.value.problems] == ["unwanted-lead-error"] * 2
    assert {problem.line for problem in caught.value.problems} == {line_of(text, "actuator =")}
    assert "sensor" in str(caught.value.problems[0].hint)
    # Measured with its scale, the table is of the axis as it is.
    measured = edited(with_table(tmp_path), (TABLE, f'{TABLE}\nfeedback = "direct"'))
    assert load_text(tmp_path, measured).sources


@pytest.mark.parametrize("key", ["backlash", "sensor.scale_error"])
def test_a_table_has_the_reversal_and_the_scale_in_it(tmp_path: Path, key: str) -> None:
    both = 'backlash = { play = "5 um" }\nsensor = { resolution = 1, scale_error = "3 ppm" }'
    text = edited(with_table(tmp_path), (TABLE, f"{TABLE}\n{both}"))
    with pytest.raises(MachineFileError) as caught:
        load_text(tmp_path, text)
    assert [problem.code for problem in caught.value.problems] == ["excluding-keys"] * 2
    assert {problem.line for problem in caught.value.problems} == {line_of(text, TABLE)}
    assert key in str(caught.value)


def without(*starts: str) -> str:
    return "\n".join(line for line in MEASURED.splitlines() if not line.startswith(starts))


@pytest.mark.parametrize(
    ("csv", "code", "at", "words"),
    [
        (MEASURED.replace("300, +, 2\n", "301, +, 2\n"), "too-few-runs", "301", "1 in direction +"),
        (without("300, -"), "too-few-runs", "300", "0 in direction -"),
        (without("0, -", "300, -", "900, -"), "too-few-runs", "0, +", "and at 2 more"),
        (without("900"), "travel-not-covered", "300", "0 mm to 300 mm"),
        (without("0, "), "travel-not-covered", "300", "0 to 900 mm"),
        (MEASURED.replace("(mm)", ""), "no-unit", "target", "target"),
        (MEASURED.replace("(mm)", "(deg)"), "wrong-dimension", "target", "an angle"),
        (MEASURED.replace("300, -, 8\n", "300, up, 8\n"), "unknown-choice", "300, up", "of -, +"),
        (MEASURED.replace("300, -, 8\n", "300, -, 8, 1\n"), "ragged-row", "300, -, 8", "3 cells"),
        (MEASURED.replace("300, -, 8\n", "300, -, x\n"), "not-a-number", "300, -, x", '"x"'),
        (MEASURED.replace("deviation", "deviaton"), "unknown-column", "target", '"deviation"'),
    ],
)  # fmt: skip
def test_what_a_table_may_not_be(tmp_path: Path, csv: str, code: str, at: str, words: str) -> None:
    text = with_table(tmp_path, csv)
    with pytest.raises(MachineFileError) as caught:
        load_text(tmp_path, text)
    problem = next(
        each for each in caught.value.problems if each.code == code and words in str(each)
    )
    assert problem.file is not None
    assert Path(problem.file).name == "d1.csv"
    assert problem.line == next(
        number for number, line in enumerate(csv.splitlines(), 1) if line.startswith(at)
    )
    assert problem.expected


def test_targets_in_another_unit_reach_the_ends_of_the_travel(tmp_path: Path) -> None:
    inches = MEASURED.replace("(mm)", "(in)").replace("\n300,", "\n10,")
    inches = inches.replace("\n900,", f"\n{900 / 25.4!r},")
    assert load_text(tmp_path, with_table(tmp_path, inches)).sources
