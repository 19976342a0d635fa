"""`truepose.part` and its command: the same numbers everywhere, and answers that follow."""

from __future__ import annotations

import csv
import dataclasses
import functools
import io
import json
import pickle
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import truepose as tp
from command_line import MACHINES, PLANAR, Outcome, call
from sweeps import sweep
from truepose._kernel import instruction_set
from truepose.cluster.evaluator import Here
from truepose.machine import Machine
from truepose.verdict.states import AFTER, BEFORE
from truepose.workpiece.evaluate import evaluate_part
from truepose.workpiece.evaluation import MET, NOT_MET, UNDECIDED, PartEvaluation
from truepose.workpiece.read import read_part
from truepose.workpiece.result import dataset as dataset_of
from truepose.workpiece.samples import SampledState, sampled
from truepose.workpiece.worst import from_above

PROGRAM = """\
G21 G90
G0 X160 Y280
G1 X170 Y290 F1000
G1 X230
G1 Y330
G1 X170
G1 Y290
G0 X220 Y310
G3 X220 Y310 I-20 J0
M2
"""

FEATURES = """\
[[datum]]
name = "A"
lines = "4"

[[feature]]
name = "width"
kind = "size"
lines = ["5", "7"]
nominal = "60 mm"
tolerance = "±0.05 mm"

[[feature]]
name = "corner"
kind = "perpendicularity"
lines = "5"
datums = ["A"]
zone = "0.2 mm"

[[feature]]
name = "bore"
kind = "circle"
lines = "9"
roundness = "0.02 mm"
"""

WIDTH = FEATURES[FEATURES.index("[[feature]]") : FEATURES.index('[[feature]]\nname = "corner"')]
"""The width alone."""

ALONG = (
    "drive.d1.backlash={play='10 um'}",
    "drive.d2.actuator={periodic={amplitude='3 um',period='4 mm'}}",
    "drive.d1.sensor={resolution='2 um',scale_error=['-10 ppm','10 ppm']}",
)
"""What varies along the path: play, a ripple, a resolution."""


@pytest.fixture
def files(tmp_path: Path) -> tuple[Path, Path]:
    """The program and what is asked of its part."""
    program, features = tmp_path / "part.ngc", tmp_path / "part.toml"
    program.write_text(PROGRAM, encoding="utf-8")
    features.write_text(FEATURES, encoding="utf-8")
    return program, features


Shared = Callable[..., PartEvaluation]


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Shared:
    """The part as it is asked for above, of the machine with settings, evaluated once."""
    folder = tmp_path_factory.mktemp("part")
    files = folder / "part.ngc", folder / "part.toml"
    files[0].write_text(PROGRAM, encoding="utf-8")
    files[1].write_text(FEATURES, encoding="utf-8")

    @functools.cache
    def evaluation(*settings: str) -> PartEvaluation:
        return evaluated(tp.load(PLANAR, settings=settings), files, samples=1000)

    return evaluation


def evaluated(machine: Machine, files: tuple[Path, Path], **options: object) -> PartEvaluation:
    """Both states."""
    part = read_part(machine, *files)
    return evaluate_part(machine, part, machine.condition, **options)  # type: ignore[arg-type]


def sheet_of(outcome: Outcome) -> list[dict[str, str]]:
    """The rows of the sheet."""
    return list(csv.DictReader(io.StringIO(outcome.out)))


def test_the_same_number_everywhere(
    capsys: pytest.CaptureFixture[str], files: tuple[Path, Path], tmp_path: Path
) -> None:
    """The Dataset, CSV, JSON and NetCDF; the file is in mm, the Dataset in m."""
    import xarray as xr

    dataset = tp.part(tp.load(PLANAR), *files, samples=300, seed=5)
    options = (PLANAR, files[0], "--features", files[1], "--samples", 300, "--seed", 5)
    rows = sheet_of(call(capsys, "part", *options, "--format", "csv"))
    told = json.loads(call(capsys, "part", *options, "--format", "json").out)["characteristics"]
    call(capsys, "part", *options, "--output", tmp_path / "part.nc")
    with xr.open_dataset(tmp_path / "part.nc") as filed:
        assert np.array_equal(filed["upper"].values, dataset["upper"].values)
    assert len(rows) == len(told) == dataset.sizes["state"] * dataset.sizes["characteristic"]
    names = {"known": "known", "upper": "interval_upper", "bound_upper": "bound_upper"}
    for row, other in zip(rows, told, strict=True):
        at = {"state": row["state"], "characteristic": f"{row['feature']}: {row['quantity']}"}
        for name, column in names.items():
            value = 1e3 * float(dataset[name].sel(at))
            assert float(row[column]) == pytest.approx(value, rel=1e-13, abs=1e-15)
            assert other[column] == float(row[column])
        assert row["verdict"] == other["verdict"] == str(dataset["verdict"].sel(at).values)


def test_an_unknown_name_of_a_rule(files: tuple[Path, Path]) -> None:
    """It is refused by name."""
    with pytest.raises(tp.errors.RequestError, match="bad-rule"):
        tp.part(tp.load(PLANAR), *files, rule="best")  # type: ignore[arg-type]


@pytest.mark.parametrize("settings", [(), ALONG], ids=["constant", "along"])
def test_what_is_reached_is_within_what_is_proven(
    shared: Shared, settings: tuple[str, ...]
) -> None:
    """So is every sample, and the known value."""
    evaluation = shared(*settings)
    for answers in evaluation.states:
        for at, answer in enumerate(answers.answers):
            room = 1e-12
            assert answer.above.proven
            assert answer.above.lower - room <= answer.search.lower.value
            assert answer.search.upper.value <= answer.above.upper + room
            if not settings:  # a ripple is nowhere 0 all along
                assert answer.search.lower.value <= answer.known + room
                assert answer.known - room <= answer.search.upper.value
            assert answer.search.effort > 100
            values = answers.sampled.values[:, at]
            assert answer.above.lower - room <= values.min()
            assert values.max() <= answer.above.upper + room


def test_what_the_geometry_bends_is_in_what_is_proven(shared: Shared) -> None:
    """By curvature times the square of how far points are off, either way."""
    evaluation = shared()
    before, of = evaluation.before(), evaluation.characteristics[0]
    bounds, scale = before.bounds, np.ones(len(before.state.variables.names))
    far = bounds.reach(of.members, scale)
    ends = []
    for curvature in (0.0, 1000.0):
        forms = dataclasses.replace(of.forms, curvature=curvature)
        above = from_above(before.state, bounds, evaluation.alignment, forms, of.members)
        ends.append((above.lower, above.upper))
    assert far > 1e-5
    assert ends[0][0] - ends[1][0] == pytest.approx(1000.0 * far**2, rel=1e-6)
    assert ends[1][1] - ends[0][1] == pytest.approx(1000.0 * far**2, rel=1e-6)


def test_compensation_makes_what_the_program_asks_for(shared: Shared) -> None:
    """Known values after it are those of the programmed path."""
    dataset = dataset_of(shared())
    after = dataset["known"].sel(state=AFTER).values
    assert np.abs(after - dataset["programmed"].values).max() < 1e-12
    assert np.abs(dataset["known"].sel(state=BEFORE).values - after).max() > 1e-6


def test_samples_are_those_of_monte_carlo(shared: Shared) -> None:
    """At a point of the part: the same machines, to the bit, as their mean and extremes say."""
    machine = tp.load(PLANAR)
    evaluation = shared()
    state = evaluation.states[0].state
    errors, good = state.exact_errors(state.varying(3), 0, 500)
    assert good.all()
    for point in (0, 40):
        pose = state.block.requested[[point]]
        other = tp.monte_carlo(machine, pose, samples=500, seed=3)
        for axis, name in enumerate(("x", "y")):
            of = other.sel(component=name)
            assert float(of["minimum"][0]) == errors[:, point, axis].min()
            assert float(of["maximum"][0]) == errors[:, point, axis].max()


def test_chunks_make_no_difference(shared: Shared, monkeypatch: pytest.MonkeyPatch) -> None:
    """However many samples are worked on at a time."""
    evaluation = shared(*ALONG)
    drawn = SampledState(evaluation.states[0].state, evaluation.values, 1)
    whole = sampled(drawn, 60, Here(), exact=False)
    monkeypatch.setattr("truepose.workpiece.samples.NUMBERS", 7 * drawn.state.points.size)
    pieces = sampled(drawn, 60, Here(), exact=False)
    assert np.abs(whole.values - pieces.values).max() < 1e-15


@pytest.mark.parametrize("alignment", ["clamped", "best-fit", "datums"])
@pytest.mark.parametrize("exact", [True, False])
def test_samples_that_others_draw_are_the_same(
    files: tuple[Path, Path], alignment: str, exact: bool
) -> None:
    """In whatever order the ranges of samples come, and of a state that was pickled."""

    class Elsewhere:
        """Tasks are pickled, and come the last first."""

        def begun_with(self) -> str:
            return instruction_set()

        def results(self, function: Any, shared: Any, tasks: Iterator[tuple[int, Any]]) -> Any:
            function, shared = pickle.loads(pickle.dumps((function, shared)))  # noqa: S301
            return [(number, function(shared, own)) for number, own in reversed(list(tasks))]

    text = f'[part]\nalignment = "{alignment}"\n'
    text += 'datums = ["A", "B"]\n' if alignment == "datums" else ""
    second = '[[datum]]\nname = "B"\nlines = "5"\n'
    files[1].write_text(f"{text}{FEATURES}{second}", encoding="utf-8")
    evaluation = evaluated(tp.load(PLANAR, settings=list(ALONG)), files, samples=2, exact=False)
    for answers in evaluation.states:
        drawn = SampledState(answers.state, evaluation.values, 5)
        here = sampled(drawn, 700, Here(), exact=exact)
        there = sampled(drawn, 700, Elsewhere(), exact=exact)
        np.testing.assert_array_equal(here.values, there.values)
        assert (here.failed, here.exact) == (there.failed, there.exact)


def test_first_order_is_told_from_exact(shared: Shared) -> None:
    """They differ by no more than is said of the samples that were solved both ways."""
    evaluation = shared()
    drawn = SampledState(evaluation.states[0].state, evaluation.values, 0)
    linear = sampled(drawn, 100, Here(), exact=False)
    exact = sampled(drawn, 100, Here(), exact=True)
    assert exact.exact
    assert not linear.exact
    off = np.abs(linear.values - exact.values).max(axis=0)
    assert (off <= linear.off).all()
    assert (linear.off > 0.0).all()


def test_each_point_from_its_own_machine_is_wider(shared: Shared) -> None:
    """The correlation is there: the width of one machine's part varies less."""
    evaluation = shared()
    state = evaluation.states[0].state
    together = state.linear_errors(state.varying(0), 0, 1000)
    apart = together.copy()
    for point in range(apart.shape[1]):
        apart[:, point] = np.roll(together[:, point], 17 * point, axis=0)
    one = evaluation.values(state.points + together).std(axis=0)
    other = evaluation.values(state.points + apart).std(axis=0)
    assert (other[:2] > 2.0 * one[:2]).all()


def test_verdicts_follow_the_limits(files: tuple[Path, Path]) -> None:
    """Limits beyond the proof: met. Limits that a machine breaks: NOT met. Between: undecided."""
    machine = tp.load(PLANAR)
    files[1].write_text(WIDTH, encoding="utf-8")
    answer = evaluated(machine, files, samples=100).states[0].answers[0]
    nominal = 0.06

    def verdict(half: float) -> str:
        text = WIDTH.replace("±0.05 mm", f"±{1e3 * half:.9f} mm")
        files[1].write_text(text, encoding="utf-8")
        return evaluated(machine, files, samples=100).states[0].answers[0].verdict

    reached, proven = answer.search.upper.value - nominal, answer.above.upper - nominal
    assert reached < proven
    assert verdict(1.001 * proven) == MET
    assert verdict(0.5 * (reached + proven)) == UNDECIDED
    assert verdict(0.999 * reached) == NOT_MET


@pytest.mark.parametrize(("half", "word"), [("0.2", MET), ("0.05", UNDECIDED)])
def test_the_rule_of_iso_14253(files: tuple[Path, Path], half: str, word: str) -> None:
    """The coverage interval, 60.029 ± 0.053 mm, within the limits; or a limit within it."""
    text = WIDTH.replace("±0.05 mm", f"±{half} mm")
    files[1].write_text(text, encoding="utf-8")
    evaluation = evaluated(tp.load(PLANAR), files, samples=1000, rule="iso-14253")
    assert evaluation.states[0].answers[0].verdict == word


def test_outside_by_the_rule_of_iso_14253(files: tuple[Path, Path]) -> None:
    """The whole interval beyond a limit."""
    files[1].write_text(WIDTH.replace("±0.05 mm", "-0.5 -0.1"), encoding="utf-8")
    evaluation = evaluated(tp.load(PLANAR), files, samples=1000, rule="iso-14253")
    assert evaluation.states[0].answers[0].verdict == NOT_MET


def test_exit_code(capsys: pytest.CaptureFixture[str], files: tuple[Path, Path]) -> None:
    """1 where a quantity is NOT met in the state that is asked for."""
    files[1].write_text(
        FEATURES.replace("±0.05 mm", "±0.08 mm").replace("0.02 mm", "0.2 mm"), encoding="utf-8"
    )
    options = ("part", PLANAR, files[0], "--features", files[1], "--samples", 100)
    before = call(capsys, *options)
    after = call(capsys, *options, "--after")
    assert (before.code, after.code) == (1, 0)
    assert "NOT met" in before.out
    assert before.out == after.out
    assert "What the process adds" in before.out


@pytest.mark.parametrize("settings", [(), ALONG], ids=["constant", "along"])
def test_the_witness_gives_its_number_again(
    capsys: pytest.CaptureFixture[str],
    files: tuple[Path, Path],
    tmp_path: Path,
    settings: tuple[str, ...],
) -> None:
    """To 1e-9, from its two files, or from the machine file alone."""
    witness = tmp_path / "witness.toml"
    changed = [argument for setting in settings for argument in ("--set", setting)]
    options = (files[0], "--features", files[1], "--samples", 100, "--format", "csv")
    asked = call(capsys, "part", PLANAR, *options, *changed, "--witness", witness)
    assert asked.code == 1
    along = witness.with_suffix(".csv")
    assert along.exists() is bool(settings)
    again = ("--along", along) if settings else ()
    rows = sheet_of(call(capsys, "part", witness, *options, *again))
    reached = sheet_of(asked)
    shares = []
    for row, one in zip(reached, rows, strict=False):
        if row["state"] != BEFORE:
            continue
        ends = [float(row["reached_lower"]), float(row["reached_upper"])]
        shares.append(min(abs(float(one["known"]) - end) for end in ends) / max(map(abs, ends)))
    assert min(shares) < 1e-9
    broken = [row for row in rows if row["verdict"] == NOT_MET and row["state"] == BEFORE]
    assert broken


def test_a_witness_where_all_is_met(
    capsys: pytest.CaptureFixture[str], files: tuple[Path, Path], tmp_path: Path
) -> None:
    """There is none, and no file."""
    text = FEATURES.replace("±0.05 mm", "±1 mm").replace("0.02 mm", "1 mm")
    files[1].write_text(text, encoding="utf-8")
    witness = tmp_path / "witness.toml"
    outcome = call(
        capsys, "part", PLANAR, files[0], "--features", files[1], "--samples", 50,
        "--witness", witness,
    )  # fmt: skip
    assert outcome.code == 2
    assert outcome.codes == ["no-witness"]
    assert not witness.exists()


@pytest.mark.parametrize(
    ("rows", "found"),
    [
        (",0,nobody,1\n", "nobody"),
        (",0,strut.1.length,1.5\n", "1.5"),
        ("100000,0,strut.1.length,1\n", "100000"),
        (",0,strut.2.length,1\n0,0,strut.1.length,1\n", "nothing at point 1"),
    ],
    ids=["name", "beyond", "point", "missing"],
)
def test_a_wrong_file_of_what_varies(
    capsys: pytest.CaptureFixture[str],
    files: tuple[Path, Path],
    tmp_path: Path,
    rows: str,
    found: str,
) -> None:
    """Names of nothing, values beyond the band, points that are none, and points that lack one."""
    along = tmp_path / "along.csv"
    along.write_text("point,run,variable,value\n" + rows, encoding="utf-8")
    outcome = call(
        capsys, "part", PLANAR, files[0], "--features", files[1],
        "--along", along,
    )  # fmt: skip
    assert outcome.code == 2
    assert set(outcome.codes) == {"bad-along"}
    assert found in outcome.err


def test_points_of_the_path(
    capsys: pytest.CaptureFixture[str], files: tuple[Path, Path], tmp_path: Path
) -> None:
    """Every point with its line and known error; that is the budget's there."""
    points = tmp_path / "points.csv"
    call(
        capsys, "part", PLANAR, files[0], "--features", files[1], "--samples", 50,
        "--points", points,
    )  # fmt: skip
    rows = list(csv.DictReader(io.StringIO(points.read_text(encoding="utf-8"))))
    assert {row["line"] for row in rows} == {"2", "3", "4", "5", "6", "7", "8", "9"}
    machine = tp.load(PLANAR)
    some = rows[:: len(rows) // 7]
    poses = [[1e-3 * float(row["x (mm)"]), 1e-3 * float(row["y (mm)"])] for row in some]
    budget = tp.budget(machine, poses)
    for row, error in zip(some, budget["overall_error"].values, strict=True):
        known = [1e-3 * float(row[f"known_{axis} (mm)"]) for axis in "xy"]
        assert known == pytest.approx(error[:2].tolist(), abs=1e-15)
        assert float(row["half_95 (mm)"]) > 0.0


def test_blame_adds_up(shared: Shared) -> None:
    """To first order what sources are known to add sums up, and their half widths as squares."""
    evaluation = shared()
    before = evaluation.before()
    known = sum(one.known for one in before.blame)
    for at in (0, 1):
        answer = before.answers[at]
        assert answer.known - before.programmed[at] == pytest.approx(known[at], abs=3e-7)
        half = 0.5 * (answer.interval[1] - answer.interval[0])
        squares = np.sqrt(sum(one.half[at] ** 2 for one in before.blame))
        assert half == pytest.approx(squares, rel=0.1)


def test_what_would_mend_it_mends_it(shared: Shared) -> None:
    """With the bands so narrow it is met, by that state's proof; as they are it is not."""
    from truepose.workpiece.advice import advice

    found = advice(shared(), 3)
    assert found is not None
    assert found.source == "tolerance"
    for share, met in ((found.narrowed, True), (1.0, False)):
        band = 0.3 * share
        settings = [f"strut.{name}.length_tolerance=[-{band},{band}]" for name in "12"]
        evaluation = shared(*settings)
        states = {one.state.name: one for one in evaluation.states}
        assert (states[found.state].answers[3].verdict == MET) is met


def test_a_program_that_aims_at_a_limit(files: tuple[Path, Path]) -> None:
    """After compensation half of the parts are out; aimed at the middle, none is."""
    from truepose.workpiece.advice import advice

    machine = tp.load(PLANAR)
    files[1].write_text(WIDTH.replace("±0.05 mm", "+0.2 0"), encoding="utf-8")
    evaluation = evaluated(machine, files, samples=100)
    for at in (0, 1):
        suggested = advice(evaluation, at)
        assert suggested is not None
        assert suggested.aim == pytest.approx(1e-4, abs=5e-6)
    wider = PROGRAM.replace("X170", "X169.9")
    files[0].write_text(wider, encoding="utf-8")
    (_, after) = evaluated(machine, files, samples=100).states
    assert [answer.verdict for answer in after.answers] == [MET, MET]


def test_what_compensation_takes_out_can_be_aimed_better(files: tuple[Path, Path]) -> None:
    """Heat brings all parts within the limits, of which the program asks for the lower one."""
    from truepose.workpiece.advice import advice

    machine = tp.load(PLANAR, settings=["condition.temperature=80"])
    files[1].write_text(WIDTH.replace("±0.05 mm", "+0.2 0"), encoding="utf-8")
    evaluation = evaluated(machine, files, samples=100, rule="iso-14253")
    before, after = (state.answers[0].verdict for state in evaluation.states)
    assert (before, after) == (MET, UNDECIDED)
    suggested = advice(evaluation, 0)
    assert suggested is not None
    assert suggested.aim == pytest.approx(1e-4, abs=5e-6)


def test_a_part_is_told_in_the_units_of_its_drawing(
    capsys: pytest.CaptureFixture[str], files: tuple[Path, Path]
) -> None:
    """The machine is in mm, the features file in inches: the same numbers, told in other units."""
    options = ("part", PLANAR, files[0], "--features", files[1], "--samples", 100)
    in_mm = sheet_of(call(capsys, *options, "--format", "csv"))
    files[1].write_text('units = { length = "in" }\n' + FEATURES, encoding="utf-8")
    in_inches = sheet_of(call(capsys, *options, "--format", "csv"))
    for row, other in zip(in_mm, in_inches, strict=True):
        assert (row["unit"], other["unit"]) == ("mm", "in")
        assert float(row["known"]) == pytest.approx(25.4 * float(other["known"]), rel=1e-12)
    table = call(capsys, *options).out
    assert "2.362204724 in" in table
    assert "µin" in table


def test_another_size_than_the_program_has(
    capsys: pytest.CaptureFixture[str], files: tuple[Path, Path]
) -> None:
    """The wrong walls, or a tool radius that is missing: nothing of the machine mends that."""
    files[1].write_text(WIDTH.replace("60 mm", "54 mm"), encoding="utf-8")
    outcome = call(
        capsys, "part", PLANAR, files[0], "--features", files[1], "--samples", 100,
    )  # fmt: skip
    assert outcome.code == 1
    told = " ".join(outcome.out.split())
    assert "the program itself asks for 60 mm, out of tolerance" in told


def test_none_of_the_samples_out_is_no_certainty(
    capsys: pytest.CaptureFixture[str], files: tuple[Path, Path]
) -> None:
    """None of 100: below 3 %."""
    files[1].write_text(WIDTH.replace("±0.05 mm", "±1 mm"), encoding="utf-8")
    outcome = call(
        capsys, "part", PLANAR, files[0], "--features", files[1], "--samples", 100,
    )  # fmt: skip
    assert "< 3 %" in outcome.out


@sweep
@pytest.mark.parametrize("alignment", ["clamped", "best-fit", "datums"])
def test_alignment_moves_no_size(files: tuple[Path, Path], alignment: str) -> None:
    """Sizes and forms are the same however the part is looked at."""
    plain = tp.part(tp.load(PLANAR), *files, samples=200)
    head = f'[part]\nalignment = "{alignment}"\n'
    head += 'datums = ["A", "B"]\n[[datum]]\nname = "B"\nlines = "7"\n\n'
    files[1].write_text(head + FEATURES, encoding="utf-8")
    moved = tp.part(tp.load(PLANAR), *files, samples=200)
    for name in ("known", "lower", "upper", "bound_upper"):
        assert np.abs(plain[name].values - moved[name].values).max() < 1e-12


def test_a_larger_machine(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    """A delta whose platform tilts by itself: 3-D points, and a page with pictures."""
    program, features = tmp_path / "part.ngc", tmp_path / "part.toml"
    program.write_text(
        "G21 G90\nG0 X20 Y0 Z20\nG1 Z10 F500\nG3 X20 Y0 I-20 J0\nM2\n", encoding="utf-8"
    )
    features.write_text(
        '[[feature]]\nname = "bore"\nkind = "circle"\nlines = "4"\nroundness = "0.1 mm"\n',
        encoding="utf-8",
    )
    page = tmp_path / "part.html"
    outcome = call(
        capsys, "part", MACHINES / "linear_delta.toml", program, "--features", features,
        "--samples", 100, "--output", page,
    )  # fmt: skip
    assert outcome.code == 0
    text = page.read_text(encoding="utf-8")
    assert "What the process adds" in text
    assert "http" not in text.split("</script>")[-1]


def test_no_sample_is_beyond_what_machines_reach(shared: Shared) -> None:
    """The search has the samples too, also where what varies on the way has no corners."""
    for settings in ((), ALONG):
        for answers in shared(*settings).states:
            values = answers.sampled.values
            for at, answer in enumerate(answers.answers):
                slack = answers.sampled.off[at] + 1e-3 * np.ptp(values[:, at]) + 1e-12
                assert answer.search.lower.value <= values[:, at].min() + slack
                assert answer.search.upper.value >= values[:, at].max() - slack


def test_limits_on_one_side_ask_for_a_program_in_their_middle(
    files: tuple[Path, Path], tmp_path: Path
) -> None:
    """Compensation brings a bore to its nominal value, where half of them are out: not advised."""
    from truepose.workpiece.advice import advice

    bore = '[[feature]]\nname = "bore"\nkind = "circle"\nlines = "9"\ndiameter = "40 mm"\n'
    file = tmp_path / "bore.toml"
    settings = [f"strut.{name}.length_tolerance=0.01" for name in "12"]
    machine = tp.load(PLANAR, settings=settings)

    def part(limits: str, program: str) -> PartEvaluation:
        file.write_text(f"{bore}tolerance = {limits}\n", encoding="utf-8")
        files[0].write_text(program, encoding="utf-8")
        return evaluated(machine, (files[0], file), samples=200)

    first = part('"+0.5 mm / 0 mm"', PROGRAM)
    found = advice(first, 0)
    assert found is not None
    assert found.aim == pytest.approx(0.25e-3, rel=0.1)
    assert first.states[1].answers[0].verdict == NOT_MET
    wider = PROGRAM.replace("X220 Y310", "X220.125 Y310").replace("I-20", "I-20.125")
    followed = part('"+0.5 mm / 0 mm"', wider)
    states = {one.state.name: one for one in followed.states}
    assert {answer.verdict for answer in states[found.state].answers} == {MET}


def test_what_is_not_proven_is_not_told_to_be_mended(files: tuple[Path, Path]) -> None:
    """What an alignment moves has no proof, however narrow the bands are."""
    from truepose.workpiece.advice import advice

    head = '[part]\nalignment = "best-fit"\n'
    asked = '[[feature]]\nname = "place"\nkind = "position"\nlines = "9"\nzone = "5 mm"\n'
    files[1].write_text(head + asked, encoding="utf-8")
    evaluation = evaluated(tp.load(PLANAR), files, samples=200)
    found = advice(evaluation, 0)
    assert evaluation.before().answers[0].verdict == "undecided"
    assert found is not None
    assert not found.source
    assert found.why == evaluation.before().answers[0].above.why
