"""Machines inside the bands that cannot be assembled: which poses stay, what is said of them.

Two struts of 500 mm between guideways 999 mm apart, the tool half way: with both carriages at one
height the struts of a machine meet where their lengths add up to 999 mm or more. With bands of
-+3 mm the sum of the two deviations is triangular over -+6 mm, and a machine is lost where it is
below -1 mm: (6 - 1)^2 / (2 x 6^2) = 25/72 of all.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from command_line import call
from machine_texts import PLANAR, edited, load_text
from truepose import _kernel
from truepose.errors import RequestError
from truepose.machine import Machine

LOST = 25.0 / 72.0
HALF_WAY = [0.4995, 0.2]
SAMPLES = 20_000

STRETCHED = edited(
    PLANAR,
    ("length = 500\nsection", "length = 500\nlength_tolerance = 3\nsection"),
    ("[-0.3, 0.3]", "[-3, 3]"),
    ("origin = [600", "origin = [999"),
    ("temperature = 35\n", ""),
    ("force = { x = 1200, y = -1500 }\n", ""),
    ("{ x = [200, 400, 5], y = [100, 300, 3] }", "{ x = [499.5, 499.5, 1], y = [200, 200, 1] }"),
)
# 600 mm apart, with bands so wide that they end a machine away from the middle.
LOOSE = edited(
    STRETCHED,
    ("length_tolerance = 3\n", "length_tolerance = 160\n"),
    ("[-3, 3]", "[-160, 160]"),
    ("origin = [999", "origin = [600"),
    ("[499.5, 499.5, 1]", "[120, 300, 2]"),
    ('target = "0.5 mm"', 'target = "2 m"'),
)


@pytest.fixture
def stretched(tmp_path: Path) -> Machine:
    return load_text(tmp_path, STRETCHED)


def scatter(share: float) -> float:
    """Five standard deviations of how many samples of that share there are."""
    return 5.0 * float(np.sqrt(SAMPLES * share * (1.0 - share)))


def test_as_many_samples_are_lost_as_cannot_meet(stretched: Machine) -> None:
    found = tp.monte_carlo(stretched, [HALF_WAY], SAMPLES)
    assert int(found.failed[0]) == pytest.approx(LOST * SAMPLES, abs=scatter(LOST))
    # More than 5 % are: nothing holds for 95 % of the machines, and nothing is stated.
    for name in ("lower", "upper", "shortest_lower", "magnitude_upper", "ellipse"):
        assert np.isnan(found[name]).all(), name
    assert np.isfinite(found["mean"]).all()
    lost = int(found.failed[0])
    assert found.attrs["not_assembled"] == f"{lost:,} of 20,000 could not be assembled"


def test_half_of_the_machines_are_within_where_a_third_is_lost(stretched: Machine) -> None:
    """The height y of the tool: a machine of lengths a and b over the base w = a cos + b cos."""
    found = tp.monte_carlo(stretched, [HALF_WAY], SAMPLES, probability=0.5)
    random = np.random.default_rng(5)
    a, b = 0.5 + random.uniform(-3e-3, 3e-3, (2, 1_000_000))
    width = 0.999
    along = (a**2 - b**2 + width**2) / (2.0 * width)
    square = a**2 - along**2
    fits = square > 0.0
    # The carriages stand where struts of 500 mm reach the tool: above it by the height of these.
    height = np.sqrt(0.25 - 0.4995**2)
    x = along[fits] - 0.4995
    y = height - np.sqrt(square[fits])
    sizes = np.full(a.size, np.inf)
    sizes[fits] = np.hypot(x, y)
    half = np.quantile(sizes, 0.5)
    assert found.magnitude_upper.values[0, 0] == pytest.approx(half, rel=0.02)
    # A quarter of all below and a quarter above, of which half of those lost.
    lost = np.count_nonzero(~fits)
    below = np.full(lost // 2, -np.inf)
    above = np.full(lost - lost // 2, np.inf)
    for at, component in enumerate((x, y)):
        ends = np.quantile(np.concatenate([below, component, above]), [0.25, 0.75])
        spread = component.std()
        assert abs(found.lower.values[0, at] - ends[0]) < 0.03 * spread
        assert abs(found.upper.values[0, at] - ends[1]) < 0.03 * spread


@pytest.mark.parametrize("failed", [0, 40, 100, 101])
def test_intervals_of_all_samples_are_those_of_sorted_numbers(failed: int) -> None:
    """2000 samples: of 5 % beyond, as many as 100 may have failed."""
    from truepose.uncertainty_analysis.failed_samples import OfAll

    random = np.random.default_rng(1)
    values = random.normal(size=2000 - failed)
    tallies = _kernel.Tallies(np.zeros((1, 1)), np.full((1, 1), 1e-3), 1, 1)
    tallies.add(np.ascontiguousarray(values[:, np.newaxis]))
    tallies.fail(failed)
    of_all = OfAll(tallies)
    lower, upper = of_all.between([0.025, 0.975])[0, 0]
    (size,) = of_all.below([0.95])[0, 0]
    first, last = of_all.shortest(0.95)[0, 0]
    if failed > 100:
        assert np.isnan([lower, upper, size, first, last]).all()
        return
    assert np.count_nonzero((values >= lower) & (values <= upper)) == pytest.approx(1900, abs=2)
    assert np.count_nonzero(values < lower) == pytest.approx((100 - failed) / 2, abs=2)
    assert np.count_nonzero(values <= size) == pytest.approx(1900, abs=2)
    assert np.count_nonzero((values >= first) & (values <= last)) == pytest.approx(1900, abs=8)
    assert last - first <= upper - lower + 1e-9


def test_a_pose_whose_corners_fail_is_left_out_with_that_reason(stretched: Machine) -> None:
    for run in (tp.budget, tp.worst_case, tp.bounds, tp.compensate):
        with pytest.raises(RequestError) as caught:
            run(stretched, [HALF_WAY])
        assert caught.value.problems[0].code == "no-pose-left"
        assert "1 where some machines inside the bands cannot" in str(
            caught.value.problems[0].found
        )
    assert tp.uncertainty(stretched, [HALF_WAY]).sizes["pose"] == 1
    assert tp.monte_carlo(stretched, [HALF_WAY], 1000).sizes["pose"] == 1


def test_the_linear_law_is_not_valid_where_machines_are_lost(stretched: Machine) -> None:
    found = tp.uncertainty(stretched, [HALF_WAY], validate=True, samples=2000)
    assert not found.valid.values.any()
    assert "of 2,000 could not be assembled" in str(found.reason.values[0])


@pytest.mark.parametrize("command", ["check", "budget"])
@pytest.mark.parametrize(("x", "met"), [("[300, 300, 1]", True), ("[120, 300, 2]", False)])
def test_no_verdict_is_a_yes_where_machines_are_lost(
    command: str, x: str, met: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Two metres are kept half way; at x = 120 mm a machine of two short struts does not exist.

    There the carriages stand 0.5 m up and down the struts: at heights sqrt(0.25 - x^2) above the
    tool, further apart than twice 500 - 160 mm.
    """
    heights = np.sqrt(0.25 - np.array([0.12, 0.48]) ** 2)
    assert np.hypot(0.6, heights[0] - heights[1]) > 2 * 0.34
    path = tmp_path / "machine.toml"
    path.write_text(edited(LOOSE, ("[120, 300, 2]", x)), encoding="utf-8")
    outcome = call(capsys, "check", path, "--format", "json")
    answer = json.loads(outcome.out)["answers"][0]
    assert (answer["met"], answer["not_assembled"]) == (met, int(not met))
    asked = [] if command == "check" else ["--require-accuracy"]
    outcome = call(capsys, command, path, *asked)
    assert outcome.code == int(not met)
    lost = "NOT met  position before compensation: a machine that cannot be assembled"
    assert any(line.startswith(lost) for line in outcome.out.splitlines()) == (not met)


def test_the_words_stand_beside_the_numbers(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "machine.toml"
    path.write_text(STRETCHED, encoding="utf-8")
    asked = ["montecarlo", path, "--samples", "1000"]
    outcome = call(capsys, *asked)
    lost = int(tp.monte_carlo(tp.load(path), samples=1000).failed[0])
    words = f"{lost} of 1,000 could not be assembled"
    assert words in " ".join(outcome.out.split())
    document = json.loads(call(capsys, *asked, "--format", "json").out)
    assert document["attributes"]["not_assembled"] == words
    assert document["variables"]["upper"]["values"] == [[None, None]]
    header, row = call(capsys, *asked, "--format", "csv").out.splitlines()
    cells = dict(zip(header.split(","), row.split(","), strict=True))
    assert (cells["samples"], cells["failed"]) == (str(1000 - lost), str(lost))
    assert cells["upper_x [mm]"] == ""
