"""`truepose montecarlo | bounds | shares`: what is asked for, what is shown, what is written.

The results are stand-ins with the schemas of docs/results.md, so that their numbers are known.
"""

from __future__ import annotations

import csv
import io
import json
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import made_how_sure as made
import truepose
from command_line import MACHINES, PLANAR, call
from truepose.cli import _uncertainty
from truepose.errors import Problem, RequestError
from truepose.reporting import assembly

HEXAPOD = MACHINES / "hexapod.toml"  # in inches


class Asked:
    """Stands in for a function and remembers what it was asked."""

    def __init__(self, result: Any) -> None:
        self.result, self.settings = result, {}

    def __call__(self, machine: Any, poses: Any = None, **settings: Any) -> xr.Dataset:
        self.settings = settings
        return self.result(machine, machine.poses()[:3] if poses is None else poses)


def stand_in_for(monkeypatch: pytest.MonkeyPatch, name: str, function: Any) -> None:
    """Put another function in the place of a public one, where the report takes it from too."""
    monkeypatch.setattr(truepose, name, function, raising=False)
    module = import_module(f"truepose.uncertainty_analysis.{name}")
    monkeypatch.setattr(module, name, function)


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> dict[str, Asked]:
    stand_ins = {
        "monte_carlo": Asked(made.monte_carlo),
        "bounds": Asked(made.bounds),
        "shares": Asked(made.shares),
    }
    for name, each in stand_ins.items():
        stand_in_for(monkeypatch, name, each)
    return stand_ins


def test_montecarlo_asks_for_what_the_options_say(
    asked: dict[str, Asked], capsys: pytest.CaptureFixture[str]
) -> None:
    assert call(capsys, "montecarlo", PLANAR).code == 0
    given = asked["monte_carlo"].settings
    assert given.pop("progress") is None
    defaults = {"samples": None, "digits": 1, "probability": 0.95, "seed": 0, "sampling": "random"}
    nowhere = {"workers": None, "scheduler": None, "tls": None}
    assert given == defaults | nowhere
    options = ["--samples=1e6", "--digits=2", "--probability=0.99", "--seed=4", "--sampling=sobol"]
    assert call(capsys, "montecarlo", PLANAR, *options).code == 0
    given = asked["monte_carlo"].settings
    del given["progress"]
    assert given == {
        "samples": 1_000_000, "digits": 2, "probability": 0.99, "seed": 4, "sampling": "sobol",
        **nowhere,
    }  # fmt: skip


@pytest.mark.parametrize(
    "options",
    [
        ["--samples", "many"],
        ["--samples", "1.5"],
        ["--samples", "inf"],
        ["--digits", "3"],
        ["--sampling", "latin"],
        ["--probability", "high"],
    ],
)
def test_options_that_cannot_be_are_bad_input(
    options: list[str], asked: dict[str, Asked], capsys: pytest.CaptureFixture[str]
) -> None:
    outcome = call(capsys, "montecarlo", PLANAR, *options)
    assert outcome.code == 2
    assert options[0] in outcome.err
    assert outcome.out == ""


def test_montecarlo_shows_the_interval(
    asked: dict[str, Asked], capsys: pytest.CaptureFixture[str]
) -> None:
    outcome = call(capsys, "montecarlo", PLANAR)
    machine = truepose.load(PLANAR)
    found = made.monte_carlo(machine, machine.poses()[:3])
    assert "Sampled error, 95 % coverage intervals" in outcome.out
    upper = float(found["magnitude_upper"].max()) * 1e6
    lines = [line for line in outcome.out.splitlines() if line.startswith(" position, µm")]
    assert len(lines) == 2
    assert all(f"{upper:.2f}" in line for line in lines)
    assert "Sampled error over 3 poses" in outcome.out


def test_ctrl_c_gives_the_result_so_far(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    def interrupted(machine: Any, poses: Any) -> xr.Dataset:
        return made.monte_carlo(machine, poses[:2], interrupted=1)

    monkeypatch.setattr(truepose, "monte_carlo", Asked(interrupted), raising=False)
    file = tmp_path / "found.json"
    outcome = call(capsys, "montecarlo", PLANAR, "--output", file)
    assert outcome.code == 130
    assert "Interrupted after 8,000 samples over 2 poses" in outcome.err
    assert "Sampled error" in outcome.out
    document = json.loads(file.read_text("utf-8"))
    assert document["attributes"]["interrupted"] == 1
    assert document["variables"]["samples"]["values"] == [4000, 4000]


def test_json_has_products_of_the_units_of_the_file(
    asked: dict[str, Asked], capsys: pytest.CaptureFixture[str]
) -> None:
    machine = truepose.load(HEXAPOD)
    found = made.monte_carlo(machine, machine.poses()[:3])
    document = json.loads(call(capsys, "montecarlo", HEXAPOD, "--format", "json").out)
    written = document["variables"]["covariance"]
    assert written["units"]["x y"] == "in^2"
    assert written["units"]["x rz"] == "in deg"
    assert written["units"]["rz x"] == "deg in"
    assert written["units"]["ry ry"] == "deg^2"
    factor = np.array([1 / 0.0254] * 3 + [180 / np.pi] * 3)
    expected = found["covariance"].values * factor[:, None] * factor
    np.testing.assert_allclose(written["values"], expected, rtol=1e-12)
    ellipse = document["variables"]["ellipse"]
    assert ellipse["units"] == "in^2"
    np.testing.assert_allclose(ellipse["values"], found["ellipse"] / 0.0254**2, rtol=1e-12)
    sizes = document["variables"]["magnitude_upper"]
    assert sizes["units"] == {"position": "in", "orientation": "deg"}
    assert document["attributes"]["seed"] == 7
    assert len(document["coordinates"]["level"]["values"]) == made.LEVELS.size


def test_csv_has_a_row_for_each_pose(
    asked: dict[str, Asked], capsys: pytest.CaptureFixture[str]
) -> None:
    machine = truepose.load(PLANAR)
    found = made.monte_carlo(machine, machine.poses()[:3])
    text = call(capsys, "montecarlo", PLANAR, "--format", "csv").out
    rows = list(csv.DictReader(io.StringIO(text)))
    assert len(rows) == 3
    assert float(rows[1]["upper_y [mm]"]) == pytest.approx(1e3 * found["upper"].values[1, 1])
    expected = 1e6 * found["covariance"].values[2, 0, 1]
    assert float(rows[2]["covariance_x_y [mm^2]"]) == pytest.approx(expected, rel=1e-12)
    assert rows[0]["samples"] == "4000"
    assert not [name for name in rows[0] if name.startswith(("quantile", "magnitude_quantile"))]


def test_bounds_asks_for_what_the_options_say(
    asked: dict[str, Asked], capsys: pytest.CaptureFixture[str]
) -> None:
    assert call(capsys, "bounds", PLANAR).code == 0
    assert asked["bounds"].settings == {"progress": None}
    assert call(capsys, "bounds", PLANAR, "--truncate", "3").code == 0
    assert asked["bounds"].settings == {"progress": None, "truncate": 3.0}


@pytest.mark.parametrize(
    ("file", "text", "region"),
    [
        (PLANAR, "x=200:400,y=100:300", {"x": (0.2, 0.4), "y": (0.1, 0.3)}),
        (PLANAR, " y = -100 : 1e2 ", {"y": (-0.1, 0.1)}),
        (PLANAR, "x=0.2 m:40 cm", {"x": (0.2, 0.4)}),
        (HEXAPOD, "z=10:20,a=-5:5", {"z": (0.254, 0.508), "a": (-np.pi / 36, np.pi / 36)}),
    ],
)
def test_a_region_is_in_the_units_of_the_file(file: Path, text: str, region: Any) -> None:
    found = _uncertainty.read_region(truepose.load(file), text)
    assert list(found) == list(region)
    for name, ends in region.items():
        assert found[name] == pytest.approx(ends)


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("", "nothing"),
        ("x", "x"),
        ("x=200", "x=200"),
        ("x=200:", "x=200:"),
        ("x=200:300:400", "x=200:300:400"),
        ("x=low:high", "x=low:high"),
        ("x=1 deg:2 deg", "x=1 deg:2 deg"),
        ("x=1:inf", "x=1:inf"),
        ("x=1:2,x=3:4", "x=3:4"),
        ("x=400:200", "x=400:200"),
        ("x=1:2,", "nothing"),
    ],
)
def test_a_region_that_cannot_be_read(
    text: str, found: str, asked: dict[str, Asked], capsys: pytest.CaptureFixture[str]
) -> None:
    outcome = call(capsys, "bounds", PLANAR, "--region", text)
    assert outcome.code == 2
    assert outcome.codes == ["bad-region"]
    assert found in outcome.err
    assert asked["bounds"].settings == {}


def test_all_that_is_wrong_with_a_region_is_told_at_once(
    asked: dict[str, Asked], capsys: pytest.CaptureFixture[str]
) -> None:
    outcome = call(capsys, "bounds", PLANAR, "--region", "x=1,y")
    assert outcome.codes == ["bad-region", "bad-region"]


def test_a_region_is_answered_in_words(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    stand_in = Asked(lambda machine, poses: made.region(machine))
    monkeypatch.setattr(truepose, "bounds", stand_in, raising=False)
    asked = ["bounds", PLANAR, "--region", "x=200:400,y=100:300", "--gap", "0.01"]
    outcome = call(capsys, *asked)
    assert outcome.code == 0
    assert stand_in.settings == {
        "progress": None,
        "gap": 0.01,
        "region": {"x": (0.2, 0.4), "y": (0.1, 0.3)},
    }
    sentence, verdict = outcome.out.splitlines()[-2:]
    assert sentence.startswith("Nowhere in this region does the tool deviate")
    assert verdict == "Accuracy asked, position: 0.5 mm: met, everywhere in the region."
    machine = truepose.load(PLANAR)
    found = made.region(machine)
    bound, reached = (float(found[f"{of}magnitude"][0]) * 1e3 for of in ("", "reached_"))
    for below, word in ((bound, "undecided"), (reached, "NOT met")):
        smaller = f"accuracy.target={below * (1.0 - 1e-9)!r} mm"
        outcome = call(capsys, *asked, "--set", smaller, "--require-accuracy")
        assert f"mm: {word}" in outcome.out.splitlines()[-1]
        assert outcome.code == 1
    rows = list(csv.DictReader(io.StringIO(call(capsys, *asked, "--format", "csv").out)))
    assert [row["name"] for row in rows] == ["x", "y", "position"]
    assert float(rows[0]["lower"]) == pytest.approx(1e3 * float(found["lower"][0]))
    assert float(rows[2]["upper"]) == pytest.approx(1e3 * float(found["magnitude"][0]))
    assert rows[2]["lower"] == ""
    assert float(rows[1]["where_lower_x [mm]"]) == pytest.approx(1e3 * machine.home[0])
    assert float(rows[1]["where_x [mm]"]) == pytest.approx(1.1e3 * machine.home[0])
    assert float(rows[2]["where_y [mm]"]) == pytest.approx(1e3 * machine.home[1])
    assert rows[2]["where_lower_y [mm]"] == ""
    assert {row["units"] for row in rows} == {"mm"}
    assert {(row["status"], row["boxes"]) for row in rows} == {("proven", "321")}
    document = json.loads(call(capsys, *asked, "--format", "json").out)
    assert document["left_out"] == []
    assert document["variables"]["status"]["values"] == "proven"
    assert document["variables"]["where"]["units"] == "mm"


@pytest.mark.parametrize("factor", [0.99, 1.01])
def test_bounds_of_other_machines_may_be_required_to_keep_the_accuracy(
    factor: float, asked: dict[str, Asked], capsys: pytest.CaptureFixture[str]
) -> None:
    machine = truepose.load(PLANAR)
    most = float(made.bounds(machine, machine.poses()[:3])["magnitude"].max())
    setting = ["--set", f"accuracy.target={most * factor!r} m"]
    # The verdict is on the file's bands; of those cut elsewhere what is proven here decides.
    arguments = ["bounds", PLANAR, *setting, "--truncate", "3", "--require-accuracy"]
    outcome = call(capsys, *arguments)
    assert outcome.code == int(factor < 1)
    assert "position before compensation" not in outcome.out
    assert call(capsys, *arguments[:-1]).code == 0


def test_bounds_of_the_file_have_the_verdict_of_all_commands(
    asked: dict[str, Asked], capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["bounds", PLANAR, "--require-accuracy"]
    answer, *_ = call(capsys, *arguments).out.splitlines()
    assert answer == call(capsys, "check", PLANAR).out.splitlines()[0]
    assert call(capsys, *arguments).code == 1
    assert call(capsys, *arguments, "--set", "accuracy.target=2 mm").code == 0


def test_what_is_not_proven_is_not_kept(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def unproven(machine: Any, poses: Any) -> xr.Dataset:
        return made.bounds(machine, poses, status="box_too_wide")

    monkeypatch.setattr(truepose, "bounds", Asked(unproven), raising=False)
    setting = ["--set", "accuracy.target=1 m"]
    cut = ["--truncate", "3"]
    outcome = call(capsys, "bounds", PLANAR, *setting, *cut, "--require-accuracy")
    assert outcome.code == 1
    assert "Poses without a proof: 1 of 3" in outcome.out


def test_a_region_without_a_proof_is_undecided(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    stand_in = Asked(lambda machine, poses: made.region(machine, "box_too_wide"))
    monkeypatch.setattr(truepose, "bounds", stand_in, raising=False)
    region = ["--region", "x=200:400,y=100:300", "--set", "accuracy.target=9 m"]
    outcome = call(capsys, "bounds", PLANAR, *region, "--require-accuracy")
    assert outcome.code == 1
    last = outcome.out.splitlines()[-1]
    assert last == "Accuracy asked, position: 9 m: undecided, for no bound is proven."


def test_shares_are_shown_and_written(
    asked: dict[str, Asked], capsys: pytest.CaptureFixture[str]
) -> None:
    outcome = call(capsys, "shares", PLANAR, "--samples", "256", "--seed", "3")
    given = asked["shares"].settings
    assert (outcome.code, given["samples"], given["seed"]) == (0, 256, 3)
    assert "To be tightened first: strut.1.length." in outcome.out
    assert "Shares of the position's variance, by source" in outcome.out
    machine = truepose.load(PLANAR)
    found = made.shares(machine, machine.poses()[:3])
    rows = list(csv.DictReader(io.StringIO(call(capsys, "shares", PLANAR, "--format", "csv").out)))
    parameters, sources = len(made.PARAMETERS), found.sizes["source"]
    assert len(rows) == 3 * (parameters + sources + 1)
    assert [row["of"] for row in rows[: parameters + sources + 1]] == (
        ["parameter"] * parameters + ["source"] * sources + ["all"]
    )
    row = rows[parameters + sources + 1 + 1]
    assert (row["pose"], row["name"]) == ("1", "strut.2.length")
    assert float(row["total_y"]) == pytest.approx(float(found["total"].values[1, 1, 1]))
    source = rows[parameters]
    expected = found["source_first_confidence"].values[0, 0, 0]
    assert float(source["first_confidence_x"]) == pytest.approx(expected)
    together = rows[parameters + sources]
    expected = 1e3 * found["standard_deviation"].values[0, 1]
    assert float(together["standard_deviation_y [mm]"]) == pytest.approx(expected)
    assert together["evaluations"] == "7000"
    assert together["first_x"] == ""


@pytest.mark.parametrize("command", ["montecarlo", "bounds", "shares"])
def test_netcdf_reads_back(
    command: str, asked: dict[str, Asked], capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    file = tmp_path / "found.nc"
    assert call(capsys, command, PLANAR, "--output", file).code == 0
    with xr.open_dataset(file, engine="h5netcdf") as found:
        assert found.sizes["pose"] == 3


def test_the_report_asks_at_the_middle_and_the_worst_pose(
    asked: dict[str, Asked],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
) -> None:
    poses: list[np.ndarray] = []

    def bounds(machine: Any, at: Any) -> xr.Dataset:
        poses.append(at)
        raise RequestError(Problem("bad-region", "strut.1.length has no ends", found="normal"))

    stand_in_for(monkeypatch, "bounds", Asked(bounds))
    page = tmp_path / "page.html"
    outcome = call(capsys, "report", PLANAR, "--output", page)
    assert outcome.code == 0
    (two,) = poses
    np.testing.assert_allclose(two[0], [0.3, 0.2])
    assert len(two) == 2
    assert asked["monte_carlo"].settings["samples"] == assembly.ELLIPSE_SAMPLES
    assert "How far off can the tool be?" in outcome.out
    text = page.read_text("utf-8")
    assert "<td>proven bound</td><td>strut.1.length has no ends (normal).</td>" in text
    for name in ("distribution", "coverage_ellipses", "tornado"):
        assert f'id="figure-{name}"' in text


def test_ctrl_c_ends_the_report_too(
    monkeypatch: pytest.MonkeyPatch,
    asked: dict[str, Asked],
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
) -> None:
    def interrupted(machine: Any, poses: Any) -> xr.Dataset:
        return made.monte_carlo(machine, poses, interrupted=1)

    stand_in_for(monkeypatch, "monte_carlo", Asked(interrupted))
    outcome = call(capsys, "report", PLANAR, "--output", tmp_path / "page.html")
    assert outcome.code == 130
    assert list(tmp_path.iterdir()) == []


def test_a_machine_that_is_known_exactly_has_a_report_without_them(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    for name in ("monte_carlo", "bounds", "shares", "worst_case"):
        stand_in_for(monkeypatch, name, None)
    page = tmp_path / "page.html"
    exact = ["--set", "strut.*.length_tolerance=[0, 0]"]
    assert call(capsys, "report", PLANAR, *exact, "--output", page).code == 0
    assert 'id="figure-distribution"' not in page.read_text("utf-8")
