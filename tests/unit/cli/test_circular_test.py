"""`truepose part --test circular`: what is printed and written, what is refused, the exit code."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from command_line import call
from made_circular import PLAY, Truth, readings_text, with_keys
from page_data import unpacked

Capture = pytest.CaptureFixture[str]

OPEN = f'backlash = {{ play = "{1e3 * PLAY} mm", threshold = "5 kN" }}'
ASKED = ("part", "m.toml", "--test", "circular", "--radius", "50 mm", "--centre", "x=300,y=20 cm")
QUICK = (*ASKED, "--samples", "200")


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("m.toml").write_text(with_keys(drive=OPEN))
    quiet = np.zeros((2, 180))
    Path("good.csv").write_text(readings_text(Truth((1e-4, 0.0), PLAY), 0.05, quiet))
    Path("bad.csv").write_text(readings_text(Truth((12e-4, 0.0), PLAY), 0.05, quiet))
    return tmp_path


def test_the_command_has_the_numbers_of_the_function(capsys: Capture) -> None:
    outcome = call(capsys, *QUICK, "--format", "json")
    assert outcome.code == 0
    found = json.loads(outcome.out)["variables"]
    expected = tp.circular_test(tp.load("m.toml"), 0.05, {"x": 0.3, "y": 0.2}, samples=200)
    for name in ("known", "lower", "radial_known", "uncertain_share"):
        scale = {"mm": 1e3, "1": 1.0}[found[name]["units"]]
        values = np.array(found[name]["values"]) / scale
        assert values == pytest.approx(expected[name].values, rel=1e-12, abs=1e-17)


def test_a_table_of_quantities_then_of_causes(capsys: Capture) -> None:
    out = call(capsys, *QUICK).out
    places = [out.index(word) for word in ("G(b)", "Where drives turn", "Causes", "test uncertain")]
    assert places == sorted(places)
    assert "ISO 230-4:2005" in out


def test_csv_has_a_row_for_each_quantity_and_angle(capsys: Capture) -> None:
    outcome = call(capsys, *QUICK, "--step", "2 deg", "--measured", "good.csv", "--format", "csv")
    rows = list(csv.DictReader(io.StringIO(outcome.out)))
    kinds = [row["of"] for row in rows]
    assert kinds.count("quantity") == 2 * 9
    assert kinds.count("radial deviation") == 2 * 2 * 180
    assert kinds.count("reading") == 360
    of_state = {(row["state"], row["name"]): row for row in rows if row["of"] == "quantity"}
    assert float(of_state["before compensation", "H"]["known [mm]"]) > 0.8 * 1e3 * PLAY


@pytest.mark.parametrize(
    ("file", "code", "word"), [("good", 0, "within"), ("bad", 1, "NOT within")]
)
def test_what_is_measured_is_answered(file: str, code: int, word: str, capsys: Capture) -> None:
    outcome = call(capsys, *ASKED, "--samples", "1000", "--measured", f"{file}.csv")
    assert outcome.code == code
    assert outcome.out.startswith(word)
    assert ("strut.1.length off by" in outcome.out) == (code == 1)


def test_readings_for_a_calibration_and_the_page_are_written(capsys: Capture) -> None:
    outcome = call(
        capsys, *QUICK, "--measured", "bad.csv", "--readings", "r.csv", "--output", "test.html"
    )
    assert "wrote test.html" in outcome.err
    assert "wrote r.csv" in outcome.err
    page = Path("test.html").read_text("utf-8")
    assert "Polar plot, after compensation" in page
    assert b"measured, clockwise" in unpacked(page, "figures-data")
    assert 'kind = "distance"' in Path("r.csv").read_text()
    found = call(capsys, "calibrate", "m.toml", "r.csv")
    assert "length of strut 1 would be 501.2 mm" in " ".join(found.out.split())


@pytest.mark.parametrize(
    ("arguments", "code", "found"),
    [
        (ASKED[:4], "test-option", "no --radius"),
        (ASKED[:6], "test-option", "no --centre"),
        ((*ASKED[:7], "x=300"), "test-option", "x"),
        ((*ASKED[:7], "300, 200"), "test-option", "300"),
        ((*ASKED, "--overshoot", "5 mm"), "test-option", "mm"),
        ((*ASKED, "--plane", "zx"), "test-option", "zx"),
        ((*ASKED, "--measured", "none.csv"), "file-missing", "nothing"),
        ((*ASKED[:5], "2 m", *ASKED[6:]), "circle-out-of-reach", "the first 0 deg"),
    ],
)
def test_what_cannot_be_is_refused(
    arguments: tuple[str, ...], code: str, found: str, capsys: Capture
) -> None:
    outcome = call(capsys, *arguments)
    assert outcome.code == 2
    assert f"error[{code}]" in outcome.err
    assert found in outcome.err


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("part", "m.toml", "part.ngc", *ASKED[2:]), "--test takes no PART.ngc"),
        ((*ASKED, "--features", "f.toml"), "--test takes no --features"),
        (("part", "m.toml", "part.ngc", "--radius", "5 mm"), "--radius is of a --test"),
        (("part", "m.toml"), "PART.ngc"),
    ],
)
def test_a_part_and_a_test_are_not_both(
    arguments: tuple[str, ...], said: str, capsys: Capture
) -> None:
    Path("part.ngc").write_text("M2\n")
    Path("f.toml").write_text("")
    outcome = call(capsys, *arguments)
    assert outcome.code == 2
    assert said in outcome.err
