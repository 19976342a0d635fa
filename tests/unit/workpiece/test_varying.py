"""The variables at the points of a path: today's distributions at each, and what two points share.

Distributions are compared by Kolmogorov and Smirnov's test: of 1e6 samples the largest distance of
the distribution functions exceeds 1.95e-3 once in a thousand tests where they are one (the limit
sqrt(-ln(0.001 / 2) / 2) / sqrt(n)); the seed is fixed.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import truepose as tp
from machine_texts import PLANAR, edited, load_text
from truepose._kernel import Points, Tallies
from truepose.machine import Machine
from truepose.runs.first_order import first_order
from truepose.runs.poses import PoseRun
from truepose.runs.run import Run
from truepose.runs.variables import Variables, variables_at
from truepose.sources import UNIFORM, PoseBlock, acting
from truepose.sources.deviation import Distribution
from truepose.uncertainty_analysis.model import SharedModel
from truepose.uncertainty_analysis.sampler import Random
from truepose.workpiece.varying import Varying

Floats = NDArray[np.float64]

SAMPLES = 1_000_000
CRITICAL = math.sqrt(-0.5 * math.log(0.001 / 2.0)) / math.sqrt(SAMPLES)

PATH = [[260 + 9 * step, 100 + 7.3 * step] for step in range(9)] + [[300, 120], [310, 140]]

TABLE = "target (mm), direction, deviation (um)\n" + "".join(
    f"{target}, {way}, {value}\n"
    for target in (0, 900)
    for way, values in (("+", (1, 2, 4)), ("-", (6, 8, 9)))
    for value in values
)

OF_DRIVE_1 = """\
sensor = { resolution = "5 um", scale_error = "+-12 ppm" }
actuator = { lead_error = "+-66 ppm", periodic = { amplitude = "2 um", period = 5 } }
backlash = { play = "10 um", threshold = "9 kN" }
"""
OF_DRIVE_2 = """\
sensor = { resolution = "4 um" }
actuator = { periodic = { amplitude = "3 um", period = 7 } }
"""
JOINT = 'base_joint = { kind = "revolute", axis = [0, 0, 1], clearance = "8 um" }'
ENVELOPE = 'envelope = { force = "300 N" }'


def with_path(text: str, *edits: tuple[str, str]) -> str:
    return edited(
        text,
        (
            "grid = { x = [200, 400, 5], y = [100, 300, 3] }",
            f"path = {{ points = {PATH} }}",
        ),
        *edits,
    )


EVERYTHING = with_path(
    PLANAR,
    ('name = "d1"\n', 'name = "d1"\n' + OF_DRIVE_1),
    ('name = "d2"\n', 'name = "d2"\n' + OF_DRIVE_2),
    ('name = "1"\n', 'name = "1"\n' + JOINT + "\n"),
    ("force = { x = 1200, y = -1500 }", ENVELOPE),
    (
        "[condition]",
        '[clearance]\nthreshold = "9 kN"\n[tolerance]\n'
        '"strut.1.base.x" = { band = 0.01, varies = "run" }\n'
        '"strut.2.base.x" = { standard_deviation = 0.01, varies = "visit" }\n'
        "[condition]",
    ),
)
"""Every way of varying, on a path."""

CONSTANT = with_path(
    PLANAR,
    ('name = "d1"\n', 'name = "d1"\nbacklash = { play = "10 um", threshold = "9 kN" }\n'),
    ("force = { x = 1200, y = -1500 }", ENVELOPE),
    (
        "[condition]",
        '[tolerance]\n"drive.*.offset" = { standard_deviation = 0.02 }\n'
        '"strut.*.base.x" = { band = 0.03, distribution = "triangular" }\n'
        '[[correlation]]\nbetween = ["drive.*.offset"]\ncoefficient = 0.5\n[condition]',
    ),
)
"""Nothing that changes on the way."""

OVERRIDDEN = edited(
    EVERYTHING,
    ('resolution = "5 um"', 'resolution = "5 um", varies = "machine"'),
    ('resolution = "4 um"', 'resolution = "4 um", varies = "run"'),
    ("period = 5", 'period = 5, varies = "machine"'),
    ("period = 7", 'period = 7, varies = "run"'),
    ('threshold = "9 kN"\n[', 'threshold = "9 kN"\nvaries = "machine"\n['),
    ('standard_deviation = 0.01, varies = "visit"', "standard_deviation = 0.01"),
)
"""The same sources, each with a word by which nothing changes on the way."""

OTHERS = with_path(
    PLANAR,
    (
        'name = "d1"\n',
        'name = "d1"\nactuator = { table = "d.csv" }\n'
        'sensor = { resolution = "5 um", varies = "visit" }\n',
    ),
    (
        'name = "d2"\n',
        'name = "d2"\nactuator = { periodic = { amplitude = "3 um", period = 7, '
        'varies = "visit" } }\n',
    ),
    (
        "force = { x = 1200, y = -1500 }",
        'envelope = { force = "300 N", normal = [0, 0, 1], varies = "visit" }',
    ),
    (
        "[condition]",
        '[tolerance]\n"drive.*.offset" = { band = 0.02, varies = "visit" }\n'
        '"strut.1.base.x" = { band = 0.03, distribution = "triangular", varies = "visit" }\n'
        '"strut.2.base.x" = { standard_deviation = 0.03, distribution = "student-t", dof = 4, '
        'varies = "run" }\n'
        '[[correlation]]\nbetween = ["drive.*.offset"]\ncoefficient = 0.5\n[condition]',
    ),
)
"""Other words than the defaults, a correlation and a direction of every visit among them."""


def on_path(folder: Path, text: str) -> tuple[Machine, PoseBlock, Variables]:
    (folder / "d.csv").write_text(TABLE, encoding="utf-8")
    machine = load_text(folder, text)
    ((block, variables),) = Run(machine).with_variables()
    return machine, block, variables


def varying(folder: Path, text: str, seed: int = 3, run: int = 0) -> Varying:
    _, block, variables = on_path(folder, text)
    return Varying(variables, block.joints, seed, run)


def numbers_of(varied: Varying, word: str) -> list[int]:
    return [k for k, one in enumerate(varied.variables.variations) if one.word == word]


def distance(values: Floats, distribution: Distribution) -> float:
    """Largest distance of the distribution functions; of listed values, of their shares."""
    ordered = np.sort(values)
    if distribution.stepped:
        listed, up_to = distribution.steps
        share = np.searchsorted(ordered, listed, side="right") / ordered.size
        assert np.isin(ordered[[0, -1]], listed).all()
        return float(np.abs(share - up_to).max())
    # By the quantile function, at 1e4 probabilities; between two of them 1e-4 may hide.
    asked = np.linspace(0.0, 1.0, 10_001)[1:-1]
    below = np.searchsorted(ordered, distribution.quantile(asked)) / ordered.size
    return float(np.abs(below - asked).max()) + 1e-4


@pytest.mark.parametrize(("text", "run"), [(EVERYTHING, 0), (EVERYTHING, 2), (OTHERS, 1)])
def test_each_point_has_the_distribution_of_today(tmp_path: Path, text: str, run: int) -> None:
    varied = varying(tmp_path, text, run=run)
    rows = varied.rows(0, SAMPLES)
    assert {one.word for one in varied.variables.variations} >= {"run", "visit"}
    for point in (0, 4, 10):
        values = varied.at_point(rows, 0, point)
        for column, distribution in enumerate(varied.variables.distributions):
            felt = varied.variables.half_width[point, varied.variables.variable_of == column]
            if felt.any():
                apart = distance(values[:, column], distribution)
                assert apart < CRITICAL, (varied.variables.names[column], point, apart)


@pytest.mark.parametrize("text", [CONSTANT, OVERRIDDEN], ids=["by default", "by the key"])
def test_without_anything_that_varies_the_samples_are_those_of_monte_carlo(
    tmp_path: Path, text: str
) -> None:
    machine, block, variables = on_path(tmp_path, text)
    varied = Varying(variables, block.joints, seed=5)
    assert varied.constant
    count = 1000
    rows = varied.rows(0, count)
    random = Random(variables, 5)
    assert np.array_equal(rows, random.rows(0, count))
    exact = SharedModel(machine, block, variables).study
    tallies = Tallies(np.zeros((len(block.joints), 3)), np.full((len(block.joints), 3), 1e-9), 3, 2)
    kept = np.asarray(exact.sample_keeping(random.variables, 5, 0, count, tallies))
    drawn = tp.monte_carlo(machine, samples=count, seed=5)
    for point in range(len(block.joints)):
        t = varied.at_point(rows, 0, point)
        errors, failed = exact.errors(point, Points(t, len(variables.names)))
        assert failed == 0
        assert np.array_equal(errors, kept[point, :, :2])
        assert np.array_equal(errors.min(axis=0), drawn["minimum"].values[point])
        assert np.array_equal(errors.max(axis=0), drawn["maximum"].values[point])


def test_what_is_constant_is_drawn_as_ever_beside_what_varies(tmp_path: Path) -> None:
    varied = varying(tmp_path, EVERYTHING, seed=9)
    assert not varied.constant
    rows = varied.rows(40, 100)
    as_ever = Random(varied.variables, 9).rows(40, 100)
    steady = [
        k
        for k, one in enumerate(varied.variables.variations)
        if one.word in ("machine", "run", "direction")
    ]
    assert len(steady) > 4
    assert np.array_equal(rows[:, steady], as_ever[:, steady])
    for point in (0, 7):
        assert np.array_equal(varied.at_point(rows, 40, point)[:, steady], as_ever[:, steady])


def test_a_run_keeps_the_machine_and_draws_its_own(tmp_path: Path) -> None:
    first, third = (varying(tmp_path, EVERYTHING, run=run) for run in (0, 2))
    one, other = first.at(first.rows(0, 500), 0), third.at(third.rows(0, 500), 0)
    for word, same in (
        ("machine", True),
        ("direction", True),
        ("position", True),
        ("run", False),
        ("visit", False),
    ):
        for number in numbers_of(first, word):
            felt = first.variables.half_width[:, first.variables.variable_of == number].any(axis=1)
            if not felt.any():
                continue
            values = one[:, felt, number], other[:, felt, number]
            assert np.array_equal(*values) == same, first.variables.names[number]
            if word == "run":
                assert (np.ptp(values[1], axis=1) == 0.0).all()
            if not same:
                assert abs(np.corrcoef(values[0].ravel(), values[1].ravel())[0, 1]) < 0.25


def test_a_ripple_is_a_sine_of_the_joint_coordinate(tmp_path: Path) -> None:
    varied = varying(tmp_path, EVERYTHING)
    rows = varied.rows(0, 50)
    values = varied.at(rows, 0)
    for drive, period in ((0, 5e-3), (1, 7e-3)):
        (number,) = (
            k
            for k, one in enumerate(varied.variables.variations)
            if getattr(one.law, "period", None) == period
        )
        turns = math.tau * varied.joints[:, drive] / period
        waves = np.stack([np.sin(turns), np.cos(turns)], axis=1)
        fitted = np.linalg.lstsq(waves, values[:, :, number].T, rcond=None)[0]
        assert waves @ fitted == pytest.approx(values[:, :, number].T, abs=1e-10)
        assert np.hypot(*fitted) == pytest.approx(np.ones(50), abs=1e-10)
        assert np.ptp(np.arctan2(*fitted)) > 5.0


def test_a_resolution_is_the_coordinate_on_a_grid(tmp_path: Path) -> None:
    varied = varying(tmp_path, EVERYTHING)
    rows = varied.rows(0, 200)
    values = varied.at(rows, 0)
    for drive, step in ((0, 5e-6), (1, 4e-6)):
        (number,) = (
            k
            for k, one in enumerate(varied.variables.variations)
            if getattr(one.law, "step", None) == step
        )
        origin = 0.5 * (rows[:, number] + 1.0) * step
        for point, q in enumerate(varied.joints[:, drive].tolist()):
            least = math.floor(q / step) - 2
            grid = origin[:, np.newaxis] + step * (least + np.arange(5))
            nearest = grid[np.arange(200), np.abs(grid - q).argmin(axis=1)]
            # An ulp of q is 1e-16 m, of 2.5e-6 m it is 4e-11.
            assert values[:, point, number] * step / 2 == pytest.approx(nearest - q, abs=1e-15)


def test_phases_of_two_drives_are_independent(tmp_path: Path) -> None:
    varied = varying(tmp_path, EVERYTHING)
    phases = varied.rows(0, 100_000)[:, numbers_of(varied, "position")]
    assert phases.shape[1] == 4
    apart = np.corrcoef(phases.T) - np.eye(4)
    assert np.abs(apart).max() < 4.0 / math.sqrt(100_000)


@pytest.mark.parametrize("text", [EVERYTHING, OTHERS])
def test_visits_are_independent_of_each_other(tmp_path: Path, text: str) -> None:
    varied = varying(tmp_path, text)
    count = 20_000
    values = varied.at(varied.rows(0, count), 0)
    for number in numbers_of(varied, "visit"):
        felt = varied.variables.half_width[:, varied.variables.variable_of == number].any(axis=1)
        points = values[:, felt, number]
        assert points.shape[1] > 5
        apart = np.corrcoef(points.T) - np.eye(points.shape[1])
        assert np.abs(apart).max() < 4.5 / math.sqrt(count), varied.variables.names[number]


def test_what_is_correlated_and_what_is_a_direction_stays_so_in_every_visit(
    tmp_path: Path,
) -> None:
    varied = varying(tmp_path, OTHERS)
    count = 40_000
    values = varied.at(varied.rows(0, count), 0, slice(2, 5))
    names = list(varied.variables.names)
    pair = [k for k, name in enumerate(names) if "offset" in name and name.startswith("tolerance")]
    assert len(pair) == 2
    (members,) = varied.variables.directions
    for point in range(3):
        coefficient = np.corrcoef(values[:, point, pair].T)[0, 1]
        assert coefficient == pytest.approx(0.5, abs=4.0 / math.sqrt(count))
        size = np.linalg.norm(values[:, point, members], axis=1)
        assert size == pytest.approx(np.ones(count), abs=1e-12)


@pytest.mark.parametrize("text", [EVERYTHING, OTHERS, CONSTANT])
def test_the_numbers_do_not_depend_on_how_they_are_asked_for(tmp_path: Path, text: str) -> None:
    varied = varying(tmp_path, text)
    whole = varied.at(varied.rows(0, 300), 0)
    pieces = [varied.at(varied.rows(first, count), first) for first, count in ((0, 37), (37, 263))]
    assert np.array_equal(np.concatenate(pieces), whole)
    some = np.array([7, 2])
    assert np.array_equal(varied.at(varied.rows(0, 300), 0, some), whole[:, some])
    assert np.array_equal(varied.at_point(varied.rows(0, 300), 0, 4), whole[:, 4])
    again = Varying(
        varied.variables.select(slice(3, 6)), varied.joints[3:6], 3, places=np.arange(3, 6)
    )
    assert np.array_equal(again.at(again.rows(0, 300), 0), whole[:, 3:6])
    other = varying(tmp_path, text, seed=4)
    assert not np.array_equal(other.at(other.rows(0, 300), 0), whole)


@pytest.mark.parametrize("text", [EVERYTHING, OTHERS, CONSTANT])
def test_linear_errors_are_those_of_the_values(tmp_path: Path, text: str) -> None:
    machine, block, variables = on_path(tmp_path, text)
    varied = Varying(variables, block.joints, seed=2)
    value, effects, _ = first_order(machine, block, variables)
    rows = varied.rows(10, 200)
    expected = value + np.einsum("sip,imp->sim", varied.at(rows, 10), effects)
    found = varied.linear(rows, 10, value, effects)
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-15)
    some = np.array([5, 1])
    assert varied.linear(rows, 10, value, effects, some) == pytest.approx(
        expected[:, some], rel=1e-9, abs=1e-15
    )


def test_what_changes_on_the_way_is_told_for_a_witness(tmp_path: Path) -> None:
    machine, block, variables = on_path(tmp_path, EVERYTHING)
    varied = Varying(variables, block.joints, seed=2, run=1, places=np.arange(11) + 100)
    t = varied.at(varied.rows(0, 1), 0)[0]
    told = varied.on_the_way(t, machine.parameters)
    steady = np.where(variables.varies_along, 0.0, t)
    for point in (0, 6):
        here = variables.at(point)
        parameters, whole = here.parameters_moved(t[[point]])
        _, rest = here.parameters_moved(steady[[point]])
        expected = dict(zip((machine.parameters[k] for k in parameters), whole[0], strict=True))
        built = dict(zip(expected, rest[0], strict=True))
        for one in told:
            if one.point == 100 + point:
                assert one.run == 1
                built[one.parameter] += one.value
        assert built == pytest.approx(expected, abs=1e-18)
    assert {variables.variations[variables.names.index(one.variable)].word for one in told} == {
        "position",
        "visit",
    }


def test_before_a_drive_moves_its_flank_is_one_variable(tmp_path: Path) -> None:
    text = edited(
        PLANAR,
        ('name = "d1"\n', 'name = "d1"\nbacklash = { play = "10 um", threshold = "9 kN" }\n'),
        ("length_tolerance = [-0.3, 0.3]\n", ""),
    )
    machine = load_text(tmp_path, text)
    joints = [[0.3, 0.4], [0.3, 0.45], [0.3, 0.42], [0.35, 0.42], [0.35, 0.4], [0.3, 0.4]]
    poses = np.array([machine.forward(q) for q in joints])
    (block,) = PoseRun(machine, poses, machine.condition, path=True)
    variables = variables_at(machine, block, acting(machine))
    varied = Varying(variables, block.joints, seed=1)
    assert varied.constant
    assert variables.half_width[:, 0] == pytest.approx([5e-6] * 3 + [0.0] * 3)
    rows = varied.rows(0, SAMPLES)
    values = [varied.at_point(rows, 0, point)[:, 0] for point in range(3)]
    assert np.array_equal(values[0], values[1])
    assert np.array_equal(values[0], values[2])
    assert distance(values[0], UNIFORM) < CRITICAL
    offset = np.flatnonzero(variables.shift[0] == variables.columns[0])[0]
    # It lags behind: below on the way up, above on the way down.
    assert variables.shift[1][:, offset] == pytest.approx([0, 0, 0, -5e-6, -5e-6, 5e-6])
