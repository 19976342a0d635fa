"""An accuracy at a coverage: against closed forms, against other roads to the same machines."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import integrate, optimize, stats

import truepose as tp
from build_machine import MACHINES
from command_line import call
from machine_texts import PLANAR, edited, load_text
from truepose.errors import RequestError
from truepose.machine import Envelope, Machine
from truepose.runs.first_order import ExactError, first_order
from truepose.runs.poses import PoseRun, required_sources
from truepose.runs.variables import Variables, variables_at
from truepose.sources import PoseBlock
from truepose.uncertainty_analysis.sampler import Random
from truepose.verdict import coverage as module
from truepose.verdict import screening
from truepose.verdict.coverage import CoverageAnswer, coverage
from two_slider import LENGTH, RAILS, displaced, tool

Floats = NDArray[np.float64]
State = tuple[PoseBlock, Variables]

P = 0.95
POSE = np.array([[0.3, 0.2]])
MM = 1e-3
DATA = Path(__file__).parents[3] / "examples" / "data"

QUIET = (
    ("temperature = 35\nforce = { x = 1200, y = -1500 }\n", ""),
    ("length_tolerance = [-0.3, 0.3]\n", ""),
)
"""Edits that take all sources out of the planar two-slider."""


def states(machine: Machine, poses: Floats | None = None, *, parts: int = 1) -> list[State]:
    """Blocks with the nominal command and their spreads, the poses of the file in `parts`."""
    table = machine.poses() if poses is None else poses
    sources = required_sources(machine, machine.condition)
    (block,) = PoseRun(machine, table, machine.condition)
    numbers = np.array_split(np.arange(block.indices.size), parts)
    blocks = [block.select(np.isin(np.arange(block.indices.size), some)) for some in numbers]
    return [(each, variables_at(machine, each, sources)) for each in blocks]


def on_tool(folder: Path, lines: str, more: str = "") -> Machine:
    """The two-slider with tolerances of its tool alone, which move it by themselves, exactly."""
    text = edited(PLANAR, *QUIET, ("[workspace]", f"[tolerance]\n{lines}\n{more}[workspace]"))
    return load_text(folder, text)


def number(machine: Machine, p: float = P, **more: object) -> CoverageAnswer:
    return coverage(machine, states(machine, POSE), "position", p, **more)  # type: ignore[arg-type]


def between(found: CoverageAnswer, exact: float) -> bool:
    """Whether the interval, which holds the number in 99 of 100 seeds, does, and is of use."""
    assert found.lower <= found.estimate <= found.upper
    assert found.upper - found.lower < 0.1 * found.estimate
    return found.lower <= exact <= found.upper


# --- closed forms


@pytest.mark.parametrize("p", [0.5, 0.9, 0.95, 0.997])
def test_one_uniform_variable(tmp_path: Path, p: float) -> None:
    machine = on_tool(tmp_path, '"tool.x" = 0.4')
    found = number(machine, p)
    assert between(found, p * 0.4 * MM)
    assert (found.failed, found.pose, found.poses, found.answer) == (0, 0, 1, None)


def test_the_share_within_a_size_is_that_of_the_draws(tmp_path: Path) -> None:
    found = number(on_tool(tmp_path, '"tool.x" = 0.4'))
    assert found.sizes.size == found.draws
    assert found.share_within(0.1 * MM) == pytest.approx(0.25, abs=0.01)
    assert (found.share_within(0.0), found.share_within(0.4 * MM)) == (0.0, 1.0)
    # Of poses of which some are looked at again, those of the one whose number is told.
    machine = tp.load(MACHINES / "planar_two_slider.toml")
    for target in (None, 5.5e-4, 5.6e-4):
        found = coverage(machine, states(machine), "position", P, target)
        assert found.sizes.size == found.draws
        assert found.sizes[math.ceil(P * found.draws * (1.0 - 1e-12)) - 1] == found.estimate
        assert found.share_within(found.estimate) >= P


@pytest.mark.parametrize("p", [0.5, 0.9, 0.95, 0.997])
def test_two_independent_normal_ones_are_rayleigh(tmp_path: Path, p: float) -> None:
    machine = on_tool(
        tmp_path,
        '"tool.x" = { standard_deviation = 0.1 }\n"tool.y" = { standard_deviation = 0.1 }',
    )
    assert between(number(machine, p), stats.rayleigh.ppf(p) * 0.1 * MM)
    # The interval of one component by itself is another number.
    assert not between(number(machine, p), stats.norm.ppf(0.5 + 0.5 * p) * 0.1 * MM)


def test_a_shift_and_a_band(tmp_path: Path) -> None:
    machine = on_tool(tmp_path, '"tool.y" = { band = [0.1, 0.5] }')
    assert between(number(machine), (0.1 + P * 0.4) * MM)
    # Here the lengths fold: from 0 to 0.1 there are two errors of each.
    machine = on_tool(tmp_path, '"tool.y" = { band = [-0.1, 0.3] }')
    assert between(number(machine), (0.3 - 0.4 * (1.0 - P)) * MM)


def test_listed_values_have_the_value_itself(tmp_path: Path) -> None:
    listed = '"tool.x" = { values = [-0.1, 0.1, 0.3], probabilities = [0.5, 0.44, 0.06] }'
    machine = on_tool(tmp_path, listed)
    found = number(machine)
    assert found.lower == found.estimate == found.upper == pytest.approx(0.3 * MM)
    found = number(machine, 0.9)
    assert found.lower == found.estimate == found.upper == pytest.approx(0.1 * MM)
    # On the number itself the target is met, below it it is not.
    assert number(machine, 0.9, target=found.estimate).answer == "met"
    assert number(machine, 0.9, target=np.nextafter(found.estimate, 0.0)).answer == "NOT met"


@pytest.mark.parametrize("coefficient", [-0.9, 0.5, 0.98])
def test_correlated_variables(tmp_path: Path, coefficient: float) -> None:
    """The length of two normal variables along their axes, of variances s^2 (1 +- rho)."""
    machine = on_tool(
        tmp_path,
        '"tool.x" = { standard_deviation = 0.1 }\n"tool.y" = { standard_deviation = 0.1 }',
        f'[[correlation]]\nbetween = ["tool.x", "tool.y"]\ncoefficient = {coefficient}\n',
    )
    wide, narrow = (math.sqrt(1.0 + sign * abs(coefficient)) for sign in (1.0, -1.0))

    def share(radius: float) -> float:
        def slice_(x: float) -> float:
            reach = math.sqrt(max(radius**2 - (wide * x) ** 2, 0.0)) / narrow
            return float(stats.norm.pdf(x) * (2.0 * stats.norm.cdf(reach) - 1.0))

        return float(integrate.quad(slice_, -radius / wide, radius / wide)[0])

    exact = optimize.brentq(lambda radius: share(radius) - P, 1.0, 5.0)
    assert between(number(machine), exact * 0.1 * MM)


def test_a_force_of_unknown_direction_has_the_quantile_of_its_circle(tmp_path: Path) -> None:
    """Stiffnesses along two axes; the length is that at an angle of which all are as likely."""
    text = edited(PLANAR, *QUIET, ('material = "steel"', 'modulus = "210 GPa"'))
    machine = load_text(tmp_path, text)
    pushed = machine.with_condition(
        machine.condition.replace(envelope=Envelope(400.0, (0.0, 0.0, 1.0)))
    )
    found = number(pushed)
    block, every = states(pushed, POSE)[0]
    angle = np.linspace(0.0, 2.0 * np.pi, 100_001)[:-1]
    t = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    errors, _ = ExactError(pushed, block, every)(np.zeros(len(t), np.intp), t)
    exact = float(np.quantile(np.linalg.norm(errors, axis=1), P))
    assert between(found, exact)


def test_what_has_no_band_has_one_number(tmp_path: Path) -> None:
    text = edited(PLANAR, ("length_tolerance = [-0.3, 0.3]\n", ""))
    machine = load_text(tmp_path, text)
    found = number(machine)
    error = np.asarray(tp.monte_carlo(machine, POSE, 2)["mean"])[0]
    assert found.lower == found.estimate == found.upper == pytest.approx(np.linalg.norm(error))


SINGULAR = (
    ("temperature = 35\nforce = { x = 1200, y = -1500 }\n", ""),
    ("length = 500\nsection", "length = 500\nlength_tolerance = [-0.3, 0.3]\nsection"),
    (
        'origin = [600, 0, 0]\naxis = [0, 1, 0]\ntravel = [0, 900]\nworking_mode = "+"',
        'origin = [600, 0, 0]\naxis = [0, 1, 0]\ntravel = [-900, 900]\nworking_mode = "-"',
    ),
)
"""One carriage above the tool, the other below it: at x = 300 both struts are one line."""


def near_singular(folder: Path) -> Machine:
    first, second, third = SINGULAR
    text = edited(PLANAR, first, third)
    head, middle, tail = text.partition('name = "2"\ndrive = "d2"')
    return load_text(folder, head + middle + edited(tail, second))


def lengths_by_circles(machine: Machine, pose: Floats, t: Floats) -> Floats:
    """(s,) lengths where the bands of the struts are at t (s, 2), infinite where none meet."""
    at = np.repeat(pose[np.newaxis], len(t), axis=0)
    joints = machine.inverse(at)
    centres = np.stack([np.broadcast_to(RAILS, joints.shape), joints], axis=2)
    with np.errstate(invalid="ignore"):
        places = tool(centres, LENGTH + 0.3 * MM * t, at)
    return np.nan_to_num(np.linalg.norm(places - at, axis=1), nan=np.inf)


# --- the worst pose


@pytest.mark.parametrize("parts", [1, 4])
def test_the_worst_pose_is_that_of_the_largest_quantile(tmp_path: Path, parts: int) -> None:
    machine = near_singular(tmp_path)
    poses = np.stack([np.linspace(0.36, 0.33, 31), np.full(31, 0.2)], axis=1)
    t = np.random.default_rng(0).uniform(-1.0, 1.0, (200_000, 2))
    each = np.array([np.quantile(lengths_by_circles(machine, pose, t), P) for pose in poses])
    found = coverage(machine, states(machine, poses, parts=parts), "position", P)
    assert between(found, each.max())
    assert found.pose == each.argmax() == 30
    assert (found.poses, found.within) == (31, found.sampled)
    assert np.count_nonzero(each > 0.91 * each.max()) <= found.sampled
    assert np.count_nonzero(each > 0.89 * each.max()) >= found.sampled
    assert 1 < found.sampled < 10


def test_shifts_count_in_choosing_the_poses(tmp_path: Path) -> None:
    """Heat alone differs from pose to pose: the band of the tool is the same everywhere."""
    text = edited(
        PLANAR,
        SINGULAR[2],
        QUIET[1],
        ("force = { x = 1200, y = -1500 }\n", ""),
        ("[workspace]", '[tolerance]\n"tool.x" = 0.02\n[workspace]'),
    )
    machine = load_text(tmp_path, text)
    poses = np.stack([np.linspace(0.45, 0.36, 31), np.full(31, 0.2)], axis=1)
    error = np.asarray(tp.budget(machine, poses).overall_error)
    t = np.random.default_rng(1).uniform(-1.0, 1.0, 100_000)
    aside = np.stack([0.02 * MM * t, np.zeros(len(t))], axis=1)
    each = np.array([np.quantile(np.linalg.norm(one + aside, axis=1), P) for one in error])
    found = coverage(machine, states(machine, poses), "position", P, 1.0)
    assert found.pose == each.argmax()
    assert found.estimate == pytest.approx(each.max(), rel=0.005)
    assert 1 < found.sampled < 10
    assert np.count_nonzero(each > 0.91 * each.max()) <= found.sampled
    assert np.count_nonzero(each > 0.89 * each.max()) >= found.sampled


def test_poses_are_chosen_by_other_machines_than_the_number_is_made_of(tmp_path: Path) -> None:
    """Else poses would be chosen that come out large by chance, and the interval hold less."""
    ((_, every),) = states(near_singular(tmp_path), np.array([[0.33, 0.2]]))
    draws = Random(every, 0)
    chosen, made = draws.rows(screening.FIRST, 20_000), draws.rows(0, 20_000)
    assert module.MOST < screening.FIRST
    assert abs(np.corrcoef(chosen[:, 0], made[:, 0])[0, 1]) < 5.0 / math.sqrt(20_000)
    assert abs(chosen.mean()) < 5.0 / math.sqrt(3.0 * chosen.size)


def test_it_does_not_matter_how_the_poses_come(tmp_path: Path) -> None:
    machine = load_text(tmp_path, PLANAR)
    whole = coverage(machine, states(machine), "position", P, target=0.5 * MM)
    parts = coverage(machine, states(machine, parts=4), "position", P, target=0.5 * MM)
    assert parts == whole
    assert whole.answer in ("met", "NOT met")


def test_it_does_not_matter_how_much_is_worked_on_together(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    machine = load_text(tmp_path, PLANAR)
    whole = coverage(machine, states(machine), "position", P)
    monkeypatch.setattr(module, "TOGETHER", 1)
    monkeypatch.setattr(screening, "AT_ONCE", 1)
    assert coverage(machine, states(machine), "position", P) == whole


def test_of_very_many_poses_few_are_screened_twice(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    machine = near_singular(tmp_path)
    poses = np.stack([np.linspace(0.34, 0.36, 41), np.full(41, 0.2)], axis=1)
    run = states(machine, poses, parts=3)
    every = coverage(machine, run, "position", P, 1.0)
    monkeypatch.setattr(screening, "REFINED", 1)
    few = coverage(machine, run, "position", P, 1.0, most_poses=2)
    assert (few.pose, few.estimate) == (every.pose, every.estimate)
    assert (few.sampled, every.sampled) == (2, every.within)
    # Those that are not looked at more closely may be the worst as well.
    assert every.within <= few.within <= 41
    # Fewer poses share the risk, and any of them may be the worst of those sampled.
    assert every.lower <= few.lower <= few.upper <= every.upper


def test_states_that_can_be_gone_through_but_once_are_refused(tmp_path: Path) -> None:
    machine = load_text(tmp_path, PLANAR)
    with pytest.raises(ValueError, match="but once"):
        coverage(machine, iter(states(machine)), "position", P)
    with pytest.raises(ValueError, match="no pose"):
        coverage(machine, [], "position", P)


def test_of_too_many_poses_the_largest_are_sampled_and_the_words_say_so(tmp_path: Path) -> None:
    machine = on_tool(tmp_path, '"tool.x" = 0.4')
    every = coverage(machine, states(machine), "position", P, target=1.0 * MM)
    assert (every.sampled, every.within, every.poses, every.pose) == (15, 15, 15, 0)
    assert "each of the 15 poses sampled" in every.rests_on
    few = coverage(machine, states(machine), "position", P, target=1.0 * MM, most_poses=4)
    assert (few.sampled, few.within, few.poses) == (4, 15, 15)
    assert "4 of 15 poses sampled, the largest by first order of 15 that may be" in few.rests_on


# --- the same machines as Monte Carlo


@pytest.mark.parametrize("name", ["planar_two_slider", "hexapod_all_sources", "3rpr", "tricept"])
def test_the_machines_are_those_of_monte_carlo(name: str) -> None:
    machine = tp.load(MACHINES / f"{name}.toml")
    pose = machine.poses()[[-1]]
    (state,) = states(machine, pose)
    t = Random(state[1], 5).rows(0, 20_000)
    errors, _ = ExactError(machine, *state)(np.zeros(len(t), np.intp), t)
    sampled = tp.monte_carlo(machine, pose, 20_000, 5, P)
    assert not sampled.failed.any()
    for kind, axes in (("position", "xyz"), ("orientation", ("rx", "ry", "rz"))):
        columns = [at for at, each in enumerate(machine.components) if each in axes]
        if not columns:
            continue
        # A target far off, so that 20,000 decide.
        found = coverage(machine, [state], kind, P, 1.0, seed=5)
        assert (found.draws, found.answer) == (20_000, "met")
        lengths = np.sort(np.linalg.norm(errors[:, columns], axis=1))
        assert found.estimate == pytest.approx(lengths[18_999], rel=1e-9)
        # Which is known to a bin of the histogram, of 50 or more in a deviation.
        upper = float(sampled.magnitude_upper.sel(quantity=kind)[0])
        assert abs(upper - found.estimate) < lengths.std() / 45.0


def test_the_corrected_command_is_a_state_like_any(tmp_path: Path) -> None:
    machine = load_text(tmp_path, PLANAR)
    (block, every), *_ = states(machine, POSE)
    remaining = tp.compensate(machine, POSE)
    corrected = dataclasses.replace(block, joints=np.asarray(remaining.joint_corrected))
    before = coverage(machine, [(block, every)], "position", P)
    after = coverage(machine, [(corrected, every)], "position", P)
    # What is left is the band of strut 1, uniform, to first order.
    off = np.stack(
        [np.random.default_rng(0).uniform(-0.3, 0.3, 200_000) * MM, np.zeros(200_000)], 1
    )
    errors = displaced(machine, np.repeat(POSE, len(off), axis=0), lengths=off)
    band = np.quantile(np.linalg.norm(errors, axis=1), P)
    assert after.estimate == pytest.approx(band, rel=0.01)
    assert before.lower > 1.2 * after.upper


@pytest.mark.parametrize("name", ["hexapod", "linear_delta"])
def test_equal_seeds_are_equal_whatever_the_threads(name: str) -> None:
    machine = tp.load(MACHINES / f"{name}.toml")
    poses = machine.poses()[:60]
    before = tp.threads()
    try:
        found = []
        for threads in (1, 2, 5):
            tp.threads(threads)
            found.append(coverage(machine, states(machine, poses), "position", P, seed=4))
    finally:
        tp.threads(before)
    assert found[0] == found[1] == found[2]
    other = coverage(machine, states(machine, poses), "position", P, seed=5)
    assert other.estimate != found[0].estimate
    assert other.estimate == pytest.approx(found[0].estimate, rel=0.05)


# --- the interval, and what more draws decide


@pytest.mark.parametrize(("confidence", "fewest", "most"), [(0.99, 0, 8), (0.6, 40, 109)])
def test_the_interval_holds_the_number_as_often_as_it_says(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    confidence: float,
    fewest: int,
    most: int,
) -> None:
    """Of 200 seeds, where there is one look at one pose; `most` is passed once in 1e4 runs."""
    machine = on_tool(tmp_path, '"tool.x" = 0.4\n"tool.y" = { band = [0.1, 0.5] }')
    monkeypatch.setattr(module, "CONFIDENCE", confidence)
    monkeypatch.setattr(module, "DRAWS", 500)
    monkeypatch.setattr(module, "MOST_UNASKED", 500)
    assert stats.binom(200, 1.0 - confidence).sf(most) < 1e-3
    grid = (np.arange(4000) + 0.5) / 4000
    x, y = 0.8 * grid[:, np.newaxis] - 0.4, 0.1 + 0.4 * grid
    exact = float(np.quantile(np.hypot(x, y), P)) * MM
    block = states(machine, POSE)
    found = [coverage(machine, block, "position", P, seed=seed) for seed in range(200)]
    missed = sum(not each.lower <= exact <= each.upper for each in found)
    assert {each.draws for each in found} == {500}
    assert fewest <= missed <= most


def test_the_interval_is_of_all_poses_and_looks_together(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Targets at the number itself: doubling on and on must not say yes or no but once in 100."""
    machine = on_tool(tmp_path, '"tool.x" = 0.4')
    monkeypatch.setattr(module, "DRAWS", 500)
    monkeypatch.setattr(module, "MOST", 16_000)
    run = states(machine, machine.poses()[:5])
    answers = [
        coverage(machine, run, "position", P, P * 0.4 * MM, seed=seed).answer for seed in range(200)
    ]
    assert answers.count("undecided") >= 192


@pytest.mark.parametrize(
    ("factor", "answer", "draws"),
    [
        (0.9, "NOT met", 20_000),
        (1.1, "met", 20_000),
        (0.995, "NOT met", None),
        (1.005, "met", None),
    ],
)
def test_draws_are_doubled_until_they_decide(
    tmp_path: Path, factor: float, answer: str, draws: int | None
) -> None:
    machine = on_tool(tmp_path, '"tool.x" = 0.4')
    calls: list[tuple[int, int]] = []
    found = number(
        machine,
        target=factor * P * 0.4 * MM,
        progress=lambda done, total: calls.append((done, total)),
    )
    assert found.answer == answer
    if draws is None:
        assert found.draws in (20_000, 40_000, 80_000, 160_000, 320_000)
    else:
        assert found.draws == draws
    assert calls[-1][0] == calls[-1][1] == 2 * found.draws - 20_000
    assert f"{found.draws:,} machines drawn at the worst pose, seed 0" in found.rests_on


def test_at_the_number_itself_a_million_do_not_decide(tmp_path: Path) -> None:
    found = number(on_tool(tmp_path, '"tool.x" = 0.4'), target=P * 0.4 * MM)
    assert (found.answer, found.draws) == ("undecided", 1_000_000)
    assert found.upper - found.lower < 0.005 * found.estimate


def test_without_a_target_the_interval_becomes_narrow(tmp_path: Path) -> None:
    found = number(on_tool(tmp_path, '"tool.x" = { standard_deviation = 0.4 }'))
    assert found.answer is None
    assert 20_000 <= found.draws <= 100_000
    assert found.upper - found.lower < 0.03 * found.estimate


def test_a_coverage_beyond_all_draws_has_no_upper_end(tmp_path: Path) -> None:
    """One in ten million: a million draws can say that it is not met, and never that it is."""
    machine = on_tool(tmp_path, '"tool.x" = 0.4')
    found = number(machine, 1.0 - 1e-7, target=1.0 * MM)
    assert (found.answer, found.upper) == ("undecided", math.inf)
    assert number(machine, 1.0 - 1e-7, target=0.3 * MM).answer == "NOT met"


# --- machines that cannot be assembled


@pytest.mark.parametrize(
    ("x", "failing", "answer"),
    [(0.306, 0.3, "NOT met"), (0.312, 0.03, "NOT met"), (0.32, 0.0, "met")],
)
def test_machines_that_cannot_be_assembled_are_infinitely_far(
    tmp_path: Path, x: float, failing: float, answer: str
) -> None:
    machine = near_singular(tmp_path)
    pose = (x, 0.2)
    found = coverage(machine, states(machine, np.array([pose])), "position", P, 6 * MM, seed=3)
    ((_, every),) = states(machine, np.array([pose]))
    assert every.names == ("strut.1.length", "strut.2.length")
    t = Random(every, 3).rows(0, 20_000)
    sizes = np.sort(lengths_by_circles(machine, np.array(pose), t))
    assert (found.answer, found.draws) == (answer, 20_000)
    assert abs(found.failed - np.count_nonzero(np.isinf(sizes))) <= 2
    assert found.failed / found.draws == pytest.approx(failing, abs=0.04)
    if failing > 1.0 - P:
        assert found.estimate == found.lower == found.upper == math.inf
        # Nothing is met, however far off the target is; but of fewer machines it may be.
        far = coverage(machine, states(machine, np.array([pose])), "position", P, 1e3)
        assert far.answer == "NOT met"
        half = coverage(machine, states(machine, np.array([pose])), "position", 0.5, 1e3)
        assert half.answer == "met"
    else:
        assert found.estimate == pytest.approx(sizes[18_999], rel=1e-6)
    sampled = tp.monte_carlo(machine, [pose], 20_000, 3)
    assert int(sampled.failed[0]) == found.failed


def test_the_worst_pose_of_a_run_with_a_singularity_is_there(tmp_path: Path) -> None:
    machine = near_singular(tmp_path)
    poses = np.stack([np.linspace(0.305, 0.4, 20), np.full(20, 0.2)], axis=1)
    found = coverage(machine, states(machine, poses), "position", P, 1e3)
    assert (found.answer, found.pose) == ("NOT met", 0)
    assert found.estimate == math.inf


def test_where_first_order_says_too_much_poses_are_measured_by_the_exact_number(
    tmp_path: Path,
) -> None:
    """Next to a singularity half of the machines are assembled, and first order knows no limit."""
    machine = near_singular(tmp_path)
    poses = np.stack([np.linspace(0.3002, 0.304, 20), np.full(20, 0.2)], axis=1)
    run, p = states(machine, poses), 0.3
    value, effects, _ = first_order(machine, *run[0])
    t = Random(run[0][1], 0).rows(0, 20_000)
    linear = np.linalg.norm(value[:, :, np.newaxis] + effects @ t.T, axis=1)
    quantile = np.quantile(linear, p, axis=1)
    exact = np.sort([lengths_by_circles(machine, pose, t) for pose in poses], axis=1)[:, 5_999]
    assert quantile.max() > 5.0 * exact.max()
    assert np.count_nonzero(quantile > 0.9 * quantile.max()) == 1
    assert np.count_nonzero(exact > 0.9 * exact.max()) == 4
    found = coverage(machine, run, "position", p, 1e3)
    assert found.estimate == pytest.approx(exact.max(), rel=1e-3)
    assert found.sampled == found.within == np.count_nonzero(quantile > 0.9 * exact.max())


# --- a calibrated machine


def normal_quantile(machine: Machine, state: State) -> float:
    """The largest quantile of |N(c, C)| of a block, by its covariances and NumPy's numbers."""
    value, effects, _ = first_order(machine, *state)
    sigmas = np.array([each.sigmas for each in state[1].distributions])
    spread_ = effects[:, :3] / sigmas
    correlation = state[1].correlation
    assert correlation is not None
    covariance = spread_ @ correlation @ np.swapaxes(spread_, 1, 2)
    rng, found = np.random.default_rng(7), 0.0
    for centre, each in zip(value[:, :3], covariance, strict=True):
        sizes = np.linalg.norm(rng.multivariate_normal(centre, each, 40_000), axis=1)
        found = max(found, float(np.quantile(sizes, P)))
    return found


def test_what_a_calibration_knows_counts(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The delta printer of the examples: known to 11 um, and bands by themselves reach 0.6 mm."""
    path = tmp_path / "calibrated.toml"
    files = (DATA / "delta_printer.toml", DATA / "delta_positions.csv")
    asked = ("--set", "accuracy.target=0.05 mm", "--date", "2026-01-31", "--machine-output", path,
             "--controller-holds", "calibrated")  # fmt: skip
    done = call(capsys, "calibrate", *files, *asked)
    assert "the tool's position becomes known to within 18 µm" in done.out
    machine = tp.load(path)
    accuracy = machine.accuracy
    assert accuracy.at == P
    assert accuracy.target is not None
    run = states(machine)
    found = coverage(machine, run, "position", accuracy.at, accuracy.target)
    assert found.answer == "met"
    # Another road: the posterior's covariance at the tool, through which normal numbers go.
    known = np.asarray(tp.budget(machine).sel(source="tolerance").uncertainty)
    assert np.linalg.norm(known, axis=1).max() == pytest.approx(11e-6, abs=0.5e-6)
    exact = max(normal_quantile(machine, state) for state in run)
    assert found.lower <= exact <= found.upper
    worst = tp.worst_case(machine).magnitude_linear.sel(quantity="position").max()
    assert float(worst) > 30.0 * found.upper
    assert coverage(machine, run, "position", accuracy.at, 10e-6).answer == "NOT met"


# --- bad input


def test_bad_input(tmp_path: Path) -> None:
    machine = load_text(tmp_path, PLANAR)
    for p in (0.0, 1.0, 95.0):
        with pytest.raises(RequestError) as caught:
            number(machine, p)
        assert caught.value.problems[0].code == "bad-probability"
    with pytest.raises(RequestError) as caught:
        number(machine, seed=-1)
    assert caught.value.problems[0].code == "bad-seed"
    with pytest.raises(ValueError, match="no orientation"):
        coverage(machine, states(machine), "orientation", P)
