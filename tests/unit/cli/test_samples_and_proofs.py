"""`truepose montecarlo | bounds | shares` on real machines: what is refused, Ctrl-C, and seeds."""

from __future__ import annotations

import csv
import io
import json
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import truepose
from command_line import MACHINES, PLANAR, Outcome, call
from sweeps import sweep
from truepose.errors import RequestError

FEW = ["--set", "workspace.grid={ x = [250, 350, 2], y = [200, 200, 1] }"]
NORMAL = [
    "--set",
    'strut.1.length_tolerance={ band = 0.3, distribution = "normal", sigmas = 3 }',
]


@pytest.mark.parametrize(
    ("options", "code"),
    [
        (["--samples", "0"], "bad-samples"),
        (["--samples", "-5"], "bad-samples"),
        (["--probability", "0"], "bad-probability"),
        (["--probability", "1"], "bad-probability"),
        (["--probability", "95"], "bad-probability"),
        (["--probability", "nan"], "bad-probability"),
        (["--seed", "-1"], "bad-seed"),
        (["--sampling", "sobol", "--samples", "1000"], "bad-samples"),
    ],
)
def test_a_sampling_that_cannot_be(
    options: list[str], code: str, capsys: pytest.CaptureFixture[str]
) -> None:
    outcome = call(capsys, "montecarlo", PLANAR, *options)
    assert (outcome.code, outcome.codes, outcome.out) == (2, [code], "")


@pytest.mark.parametrize(
    ("region", "code"),
    [
        ("z=0:1", "bad-region"),
        ("x=200:400,c=0:1", "bad-region"),
        ("x=200:900,y=100:300", "region-out-of-reach"),
        ("x=-4000:-3000", "region-out-of-reach"),
    ],
)
def test_a_region_that_the_machine_cannot_have(
    region: str, code: str, capsys: pytest.CaptureFixture[str]
) -> None:
    outcome = call(capsys, "bounds", PLANAR, "--region", region)
    assert (outcome.code, outcome.codes, outcome.out) == (2, [code], "")


@pytest.mark.parametrize(
    ("options", "code"),
    [
        (["--region", "x=290:310", "--gap", "0"], "bad-gap"),
        (["--region", "x=290:310", "--gap", "2"], "bad-gap"),
        (["--truncate", "0"], "bad-truncation"),
        (["--truncate", "nan"], "bad-truncation"),
    ],
)
def test_a_proof_that_cannot_be(
    options: list[str], code: str, capsys: pytest.CaptureFixture[str]
) -> None:
    outcome = call(capsys, "bounds", PLANAR, *options)
    assert (outcome.code, outcome.codes, outcome.out) == (2, [code], "")


def test_shares_of_no_samples(capsys: pytest.CaptureFixture[str]) -> None:
    outcome = call(capsys, "shares", PLANAR, "--samples", "0")
    assert (outcome.code, outcome.codes) == (2, ["bad-samples"])


def test_shares_where_nothing_varies(capsys: pytest.CaptureFixture[str]) -> None:
    exact = ["--set", "strut.*.length_tolerance=[0, 0]"]
    outcome = call(capsys, "shares", PLANAR, *exact)
    assert (outcome.code, outcome.codes) == (2, ["nothing-varies"])


def test_the_same_seed_gives_the_same_and_another_another(
    capsys: pytest.CaptureFixture[str],
) -> None:
    asked = ["montecarlo", PLANAR, *FEW, "--samples", "3000", "--format", "csv", "--seed"]
    first, again, other = (call(capsys, *asked, seed).out for seed in ("1", "1", "2"))
    assert first == again
    assert first != other
    rows = list(csv.DictReader(io.StringIO(first)))
    found = truepose.monte_carlo(truepose.load(PLANAR, FEW[1:]), samples=3000, seed=1)
    for row, upper in zip(rows, found["upper"].values, strict=True):
        assert float(row["upper_x [mm]"]) == pytest.approx(upper[0] * 1e3, rel=1e-12)
        assert row["samples"] == "3000"


def test_a_distribution_without_ends_is_taken_as_stated_or_where_it_is_cut(
    capsys: pytest.CaptureFixture[str],
) -> None:
    stated = " ".join(call(capsys, "bounds", PLANAR, *FEW, *NORMAL).out.split())
    assert "Deviations without ends are taken at their stated k sigma: normal, 3 sigma." in stated
    three = call(capsys, "bounds", PLANAR, *FEW, *NORMAL, "--truncate=3")
    assert "(normal, 3 sigma) are taken to end at 3 standard" in " ".join(three.out.split())
    highest = []
    for sigmas in ("2", "3", "4"):
        done = call(capsys, "bounds", PLANAR, *FEW, *NORMAL, "--truncate", sigmas, "--format=json")
        document = json.loads(done.out)
        assert document["attributes"]["truncate"] == float(sigmas)
        assert document["variables"]["status"]["values"] == ["proven", "proven"]
        highest.append(document["variables"]["upper"]["values"][0][0])
    assert highest == sorted(highest)
    assert highest[0] < highest[2]


@sweep
def test_the_report_says_why_it_has_no_bound(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    page = tmp_path / "page.html"
    done = call(capsys, "report", MACHINES / "overconstrained.toml", "--output", page)
    assert done.code == 0
    text = page.read_text("utf-8")
    assert "more closures than freedoms" in text
    assert "<td>proven bound</td>" in text
    assert 'id="dots-position"' in text
    assert 'id="table-bounds"' not in text
    # A distribution without ends has one.
    assert call(capsys, "report", PLANAR, *FEW, *NORMAL, "--output", page).code == 0
    text = page.read_text("utf-8")
    assert 'id="table-bounds"' in text
    assert "taken at their stated k sigma: normal, 3 sigma." in " ".join(text.split())


def test_a_region_is_proven_and_what_is_reached_lies_in_it(
    capsys: pytest.CaptureFixture[str],
) -> None:
    asked = ["bounds", PLANAR, "--region", "x=290:310,y=195:205", "--gap", "0.1", "--format"]
    rows = list(csv.DictReader(io.StringIO(call(capsys, *asked, "csv").out)))
    assert [row["name"] for row in rows] == ["x", "y", "position"]
    for row in rows:
        assert row["status"] == "proven"
        assert 0 < float(row["reached_upper"]) <= float(row["upper"])
        assert 290 <= float(row["where_x [mm]"]) <= 310
        assert 195 <= float(row["where_y [mm]"]) <= 205
    size = rows[2]
    assert float(size["upper"]) <= 1.1 * float(size["reached_upper"])
    said, verdict = call(capsys, *asked, "table").out.splitlines()[-2:]
    assert said.startswith("Nowhere in this region does the tool deviate more than ")
    assert verdict == "Accuracy asked, position: 0.5 mm: NOT met: what is reached exceeds it."


# A child of a background job starts deaf to Ctrl-C. The first sign of progress is told to the test.
TOLD = """
import importlib, signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
import truepose
name, after = sys.argv.pop(1), int(sys.argv.pop(1))
whole = getattr(importlib.import_module(f"truepose.uncertainty_analysis.{name}"), name)

def told(*arguments, progress, **settings):
    said = []
    def tell(done, total):
        if not said and done >= after:
            said.append(print("begun", flush=True))
    return whole(*arguments, progress=tell, **settings)

setattr(truepose, name, told)
from truepose.cli import main
main()
"""


def interrupted(function: str, *arguments: str, after: int = 0) -> tuple[int, str, str]:
    """Exit code, stdout and stderr of a command that gets Ctrl-C in the middle of a function.

    It gets it once so many poses, samples or boxes are done.
    """
    process = subprocess.Popen(
        [sys.executable, "-c", TOLD, function, str(after), *arguments],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert process.stdout is not None
    assert process.stdout.readline() == "begun\n"
    process.send_signal(signal.SIGINT)
    shown, errors = process.communicate(timeout=60)
    return process.returncode, shown, errors


def test_ctrl_c_in_the_middle_of_sampling_gives_the_result_so_far(tmp_path: Path) -> None:
    output = tmp_path / "found.json"
    asked = ["montecarlo", str(PLANAR), *FEW, "--samples", "1e9", "--output", str(output)]
    code, shown, errors = interrupted("monte_carlo", *asked)
    assert code == 130, errors
    assert "Traceback" not in errors
    assert "Interrupted after " in errors
    assert "Interrupted: fewer than were asked for." in shown
    document = json.loads(output.read_text("utf-8"))
    assert document["attributes"]["interrupted"] == 1
    samples = np.array(document["variables"]["samples"]["values"])
    assert samples.size == 2
    assert (samples > 0).all()
    assert (samples < 1e9).all()


def test_ctrl_c_of_shares_gives_the_worst_poses(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    whole = truepose.shares

    def stopped(*given: Any, **asked: Any) -> Any:
        def stop(done: int, total: int) -> None:
            if done == 4:
                raise KeyboardInterrupt

        return whole(*given, **{**asked, "progress": stop})

    monkeypatch.setattr(truepose, "shares", stopped, raising=False)
    output = tmp_path / "found.json"
    outcome = call(capsys, "shares", PLANAR, "--samples", "16", "--output", output)
    assert outcome.code == 130
    assert "Interrupted after 4 poses" in outcome.err
    document = json.loads(output.read_text("utf-8"))
    assert document["attributes"]["interrupted"] == 1
    assert len(document["variables"]["standard_deviation"]["values"]) == 4


@pytest.mark.parametrize(
    ("machine", "options", "because"),
    [
        ("overconstrained", [], "more closures than freedoms"),
        ("hexapod_all_sources", ["--region", "x=-5:5"], "loads: it differs from pose to pose"),
    ],
)
def test_where_the_method_has_no_proof(
    machine: str, options: list[str], because: str, capsys: pytest.CaptureFixture[str]
) -> None:
    outcome = call(capsys, "bounds", MACHINES / f"{machine}.toml", *options)
    assert (outcome.code, outcome.codes, outcome.out) == (2, ["no-proof"], "")
    assert because in outcome.err


def test_ctrl_c_in_the_middle_of_a_proof_gives_bounds_that_hold(tmp_path: Path) -> None:
    first, second = tmp_path / "first.nc", tmp_path / "second.json"
    region = ["--region", "x=200:400,y=100:300", "--gap", "0.001"]
    asked = ["bounds", str(PLANAR), *region]
    code, shown, errors = interrupted("bounds", *asked, "--output", str(first), after=500)
    assert code == 130, errors
    assert errors.startswith("Interrupted after ")
    assert "the bounds hold over the whole region, and lie up to" in errors
    assert "Interrupted. The gap asked, 0.1 %, was not reached." in shown
    code, _, errors = interrupted(
        "bounds", *asked, "--resume", str(first), "--output", str(second), after=2000
    )
    assert code == 130, errors
    boxes = json.loads(second.read_text("utf-8"))["variables"]["boxes"]["values"]
    assert 2000 <= boxes < 6000
    with xr.open_dataset(first, engine="h5netcdf") as before:
        assert 500 <= int(before.boxes) < boxes


def stopped_bounds(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], *options: object, at: int
) -> Outcome:
    """`truepose bounds` of the planar machine, with Ctrl-C once so many are done."""
    whole = truepose.bounds

    def stopped(*given: Any, **asked: Any) -> Any:
        def stop(done: int, total: int) -> None:
            if done >= at:
                raise KeyboardInterrupt

        return whole(*given, **{**asked, "progress": stop})

    with monkeypatch.context() as patched:
        patched.setattr(truepose, "bounds", stopped, raising=False)
        return call(capsys, "bounds", PLANAR, *options)


def test_ctrl_c_of_bounds_at_poses_gives_the_worst(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    output = tmp_path / "found.json"
    outcome = stopped_bounds(monkeypatch, capsys, "--output", output, at=16)
    assert outcome.code == 130
    assert "Interrupted after 16 poses, those of the largest first-order" in outcome.err
    document = json.loads(output.read_text("utf-8"))
    assert document["attributes"]["interrupted"] == 1
    assert len(document["variables"]["magnitude"]["values"]) == 16


def test_ctrl_c_before_anything_is_proven_says_so_and_the_search_goes_on(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    wide = ["--region", "x=200:400,y=100:300", "--set", "strut.1.length_tolerance=20"]
    output = tmp_path / "part.nc"
    outcome = stopped_bounds(monkeypatch, capsys, *wide, "--output", output, at=1)
    assert outcome.code == 130
    assert "Interrupted after 1 box: of 1 part of the region nothing is proven yet" in outcome.err
    assert "Not proven" in outcome.out
    further = stopped_bounds(monkeypatch, capsys, *wide, "--resume", output, at=20)
    assert further.code == 130
    assert "Interrupted after 31 boxes: of 16 parts of the region" in further.err


def test_a_file_that_no_search_goes_on_from(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    region = ["--region", "x=290:310,y=195:205", "--gap", "0.1"]
    finished, text = tmp_path / "finished.nc", tmp_path / "text.nc"
    assert call(capsys, "bounds", PLANAR, *region, "--output", finished).code == 0
    text.write_text("no NetCDF")
    for file, code in (
        (finished, "bad-resume"),
        (text, "file-unreadable"),
        (tmp_path / "none.nc", "file-missing"),
        (tmp_path, "file-is-directory"),
    ):
        outcome = call(capsys, "bounds", PLANAR, *region, "--resume", file)
        assert (outcome.code, outcome.codes, outcome.out) == (2, [code], "")
    again = call(capsys, "bounds", PLANAR, *region, "--resume", finished, "--output", finished)
    assert (again.code, again.codes) == (2, ["output-is-input"])
    at_poses = call(capsys, "bounds", PLANAR, "--resume", finished)
    assert (at_poses.code, at_poses.codes) == (2, ["bad-resume"])


def test_a_way_of_sampling_that_is_not_there() -> None:
    with pytest.raises(RequestError) as refusal:
        truepose.monte_carlo(truepose.load(PLANAR), sampling="latin")
    assert [problem.code for problem in refusal.value.problems] == ["bad-sampling"]
