"""`truepose calibrate`: its answers, files, words and refusals."""

from __future__ import annotations

import csv
import io
import json
from contextlib import suppress
from pathlib import Path

import pytest

import truepose as tp
from command_line import PLANAR, Outcome, call
from truepose.sources.tolerance import bands_of

DATA = Path(__file__).parents[3] / "examples" / "data"
MACHINE = DATA / "delta_printer.toml"
HEIGHTS = DATA / "delta_heights.csv"
POSITIONS = DATA / "delta_positions.csv"

Capture = pytest.CaptureFixture[str]


def calibrate(capsys: Capture, data: Path, *arguments: object) -> Outcome:
    return call(capsys, "calibrate", MACHINE, data, *arguments)


def test_positions_are_accepted_and_the_tables_say_what_was_found(capsys: Capture) -> None:
    done = calibrate(capsys, POSITIONS)
    assert (done.code, done.err) == (0, "")
    assert done.out.startswith("Yes: the tool's position becomes known to within 18 µm")
    for title in ("What was found", "Measurements against the machine", "Uncertainty of the tool"):
        assert title in done.out
    for absent in ("What could not be determined", "Recommended next", "do not fit"):
        assert absent not in done.out
    assert "its target is taken as exact" in done.out
    (rod,) = [line for line in done.out.splitlines() if "length of strut a" in line]
    assert rod.split() == [
        "length", "of", "strut", "a", "288.1400", "mm", "288.5958", "mm", "+0.456", "mm",
        "0.29", "mm", "58", "µm", "██████████", "96",
    ]  # fmt: skip


def test_heights_alone_are_refused_with_what_would_help(capsys: Capture, tmp_path: Path) -> None:
    machine = tmp_path / "calibrated.toml"
    done = calibrate(
        capsys, HEIGHTS, "--no-prior", "--machine-output", machine, "--date", "2026-01-31"
    )
    assert done.code == 1
    assert done.out.startswith("No: ")
    folded = " ".join(done.out.split())
    assert "cannot be told apart by a flat bed" in folded
    assert "Recommended next measurement" in folded
    assert "probe in x and y too" in folded
    assert not machine.exists()
    assert f"{machine} is not written, since the answer is no" in done.err


def test_a_forced_file_says_so_inside(capsys: Capture, tmp_path: Path) -> None:
    machine = tmp_path / "calibrated.toml"
    asked = ("--no-prior", "--machine-output", machine, "--date", "2026-01-31", "--force")
    done = calibrate(capsys, HEIGHTS, *asked)
    assert done.code == 0
    assert done.out.startswith("No: ")
    assert "The answer is NO" in done.err
    text = machine.read_text("utf-8")
    assert "WARNING" in text.partition("[machine]")[0]
    written = tp.load(machine)
    assert written.calibration is not None
    assert "cannot be told apart" in written.calibration.warning[0]


@pytest.mark.parametrize(
    ("said", "holds"),
    [
        ((), "drawing"),
        (("--controller-holds", "drawing"), "drawing"),
        (("--controller-holds", "calibrated"), "calibrated"),
        (("--as-shifts",), "drawing"),
    ],
)
def test_the_calibrated_file_goes_on(
    said: tuple[str, ...], holds: str, capsys: Capture, tmp_path: Path
) -> None:
    machine = tmp_path / "calibrated.toml"
    asked = ("--machine-output", machine, "--date", "2026-01-31", *said)
    done = calibrate(capsys, POSITIONS, *asked)
    assert done.code == 0
    assert ("--controller-holds drawing is what it says" in done.err) == ("--as-shifts" in said)
    assert machine.read_text("utf-8").count(f'[controller]\nholds = "{holds}"\n') == 1
    written = tp.load(machine)
    assert written.calibration is not None
    assert written.calibration.date == "2026-01-31"
    assert written.calibration.data == "delta_positions.csv"
    at = written.parameters.index("strut.a.length")
    assert written.controller_holds == holds
    assert (written.nominal[at] == 0.28814) == (holds == "drawing")
    bands = bands_of(written)
    assert bands is not None
    known = written.nominal[at] + bands.shift[0, list(bands.parameters).index(at)]
    assert known == pytest.approx(0.2885958, abs=5e-8), "as the table says"
    assert call(capsys, "check", machine).code == 0
    assert call(capsys, "compensate", machine).code == 0


def test_json_has_everything_and_only_json(capsys: Capture, tmp_path: Path) -> None:
    output = tmp_path / "result.json"
    done = calibrate(capsys, HEIGHTS, "--no-prior", "--format", "json", "--output", output)
    assert done.code == 1
    found = json.loads(done.out)
    assert found == json.loads(output.read_text("utf-8"))
    assert found["command"] == "calibrate"
    assert found["attributes"]["accepted"] == 0
    assert found["attributes"]["seed"] == 0
    assert found["attributes"]["measurements"] == HEIGHTS.name
    names = found["coordinates"]["unknown"]["values"]
    value = found["variables"]["identified"]
    assert value["units"] == "mm"
    assert value["values"][names.index("strut.a.length")] == pytest.approx(286.05, abs=0.01)
    assert value["values"][names.index("delta radius")] is None


def test_csv_has_a_row_for_each_unknown(capsys: Capture) -> None:
    done = calibrate(capsys, POSITIONS, "--format", "csv")
    rows = list(csv.DictReader(io.StringIO(done.out)))
    assert [row["unknown"] for row in rows][1] == "strut.a.length"
    assert len(rows) == 9
    assert rows[1]["units"] == "mm"
    assert float(rows[1]["identified"]) == pytest.approx(288.5958, abs=1e-4)
    assert rows[5]["nominal"] == ""
    assert {row["of"] for row in rows} == {"machine"}


def test_netcdf_is_the_dataset(capsys: Capture, tmp_path: Path) -> None:
    import xarray as xr

    output = tmp_path / "result.nc"
    assert calibrate(capsys, POSITIONS, "--output", output, "--seed", 3).code == 0
    with xr.open_dataset(output, engine="h5netcdf") as read:
        assert read["value"].attrs["units"] == "m"
        assert read.attrs["seed"] == 3


def test_options_reach_the_calibration(capsys: Capture) -> None:
    asked = ("--format", "json", "--identify", "strut.*.length=0.5 mm", "--folds", 3)
    found = json.loads(calibrate(capsys, POSITIONS, *asked, "--no-robust").out)
    assert found["coordinates"]["unknown"]["values"] == [f"strut.{name}.length" for name in "abc"]
    assert found["attributes"]["folds"] == 3
    assert set(found["variables"]["weight"]["values"]) == {1.0}
    strict = calibrate(capsys, POSITIONS, "--margin", "0.001")
    assert strict.code == 1


def test_a_page_has_the_calibration_on_top(capsys: Capture, tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    done = calibrate(capsys, HEIGHTS, "--no-prior", "--report", page)
    assert done.code == 1
    text = page.read_text("utf-8")
    body = text.rpartition("</script>")[0]
    for name in ("residuals", "map", "unknowns", "correlation", "tool"):
        assert f'id="figure-calibration_{name}"' in body
    questions = ("May the calibrated machine be used?", "Is the machine as filed good enough?")
    first, second = map(text.index, questions)
    assert first < second
    assert "probe in x and y too" in text
    assert f"Measurements {HEIGHTS.name}" in text


def test_a_report_may_begin_with_a_calibration(capsys: Capture, tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    done = call(capsys, "report", MACHINE, "--measurements", POSITIONS, "--output", page)
    assert done.code == 0
    assert 'id="figure-calibration_tool"' in page.read_text("utf-8")


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        (["--machine-output", "new.toml"], "--machine-output needs --date"),
        (["--machine-output", "new.toml", "--date", "tomorrow"], "'tomorrow' is not a day"),
        (["--machine-output", "new.toml", "--date", "2026-02-30"], "is not a day"),
        (["--force"], "--force is for a machine file"),
        (["--as-shifts"], "--as-shifts is for a machine file"),
        (["--controller-holds", "drawing"], "--controller-holds is for a machine file"),
        (["--controller-holds", "paper"], "--controller-holds"),
        (
            ["--as-shifts", "--controller-holds", "calibrated"],
            "--as-shifts means --controller-holds drawing, and excludes calibrated",
        ),
        (["--folds", "1"], "--folds"),
        (["--margin", "0"], "--margin"),
    ],
)
def test_options_that_do_not_go_together(
    asked: list[str], said: str, capsys: Capture, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    done = calibrate(capsys, POSITIONS, *asked)
    assert done.code == 2
    assert said in done.err
    assert done.out == ""
    assert list(tmp_path.iterdir()) == []


def test_bad_measurements_are_told_all_at_once(capsys: Capture, tmp_path: Path) -> None:
    bad = tmp_path / "bad.csv"
    text = POSITIONS.read_text("utf-8").replace("y (mm), z (mm)\n", "y, z (mm)\n")
    bad.write_text(text.replace("105.6088", "nothing", 1), encoding="utf-8")
    done = calibrate(capsys, bad, "--format", "json")
    assert done.code == 2
    problems = json.loads(done.out)["problems"]
    assert all(each["file"].endswith("bad.csv") and each["line"] for each in problems)
    assert [each["code"] for each in problems] == done.codes
    assert calibrate(capsys, tmp_path / "none.csv").code == 2


def test_measurements_of_another_machine_are_refused(capsys: Capture) -> None:
    done = call(capsys, "calibrate", PLANAR, POSITIONS)
    assert done.code == 2
    assert "other-machine" in done.codes


@pytest.mark.parametrize(
    ("pattern", "code"),
    [("strut.a.lenght", "unknown-parameter"), ("strut.a.length=-1 mm", "bad-band")],
)
def test_what_cannot_be_identified(pattern: str, code: str, capsys: Capture) -> None:
    done = calibrate(capsys, POSITIONS, "--identify", pattern)
    assert (done.code, done.codes) == (2, [code])


@pytest.mark.parametrize("option", ["--output", "--machine-output", "--report"])
def test_no_file_is_written_over_what_was_read(
    option: str, capsys: Capture, tmp_path: Path
) -> None:
    data = tmp_path / "data.csv"
    data.write_bytes(POSITIONS.read_bytes())
    date = ("--date", "2026-01-31") if option == "--machine-output" else ()
    done = calibrate(capsys, data, option, data, *date)
    assert done.code == 2
    assert data.read_bytes() == POSITIONS.read_bytes()


def changed(path: Path, original: Path, *changes: tuple[str, str]) -> Path:
    """A copy with texts exchanged."""
    text = original.read_text("utf-8")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path.write_text(text, encoding="utf-8")
    return path


def test_too_few_readings_say_how_many_more(capsys: Capture, tmp_path: Path) -> None:
    few = tmp_path / "few.csv"
    lines = HEIGHTS.read_text("utf-8").splitlines(keepends=True)
    few.write_text("".join(lines[:-6]), encoding="utf-8")
    done = calibrate(capsys, few, "--no-prior")
    assert (done.code, done.codes) == (2, ["too-few-measurements"])
    assert "4 more readings: 4 more rows" in done.err


def test_a_machine_without_tolerances_has_nothing_to_identify(
    capsys: Capture, tmp_path: Path
) -> None:
    machine = tmp_path / "exact.toml"
    head, _, tail = MACHINE.read_text("utf-8").partition("[tolerance]")
    tail = tail[tail.index("[workspace]") :]
    machine.write_text(head.replace("length_tolerance = 0.5\n", "") + tail, encoding="utf-8")
    done = call(capsys, "calibrate", machine, POSITIONS)
    assert (done.code, done.codes) == (2, ["no-unknowns"])
    named = call(capsys, "calibrate", machine, POSITIONS, "--identify", "strut.*.length")
    assert named.code in (0, 1)


def test_a_group_whose_middles_move_apart_is_refused(capsys: Capture, tmp_path: Path) -> None:
    machine = changed(
        tmp_path / "apart.toml",
        MACHINE,
        ('{ band = 0.5, group = "delta radius" }', '{ band = [0, 1], group = "delta radius" }'),
    )
    done = call(capsys, "calibrate", machine, POSITIONS)
    assert (done.code, done.codes) == (2, ["bad-prior"])


def test_readings_that_no_machine_gives(capsys: Capture, tmp_path: Path) -> None:
    wild = changed(tmp_path / "wild.csv", POSITIONS, ("105.6088, 0.3352", "-9e5, 9e5"))
    done = calibrate(capsys, wild, "--no-prior", "--no-robust")
    assert (done.code, done.codes) == (2, ["no-fit"])


def test_files_are_written_before_anything_is_printed(
    capsys: Capture, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stopped(*found: object) -> None:
        raise RuntimeError

    monkeypatch.setattr("truepose.reporting.calibration.tables", stopped)
    paths = [tmp_path / name for name in ("machine.toml", "result.json")]
    asked = ("--machine-output", paths[0], "--date", "2026-01-31", "--output", paths[1])
    with suppress(RuntimeError, SystemExit):
        calibrate(capsys, POSITIONS, *asked)
    assert all(path.exists() for path in paths)


def test_a_file_without_what_was_found_of_a_property_says_so(
    capsys: Capture, tmp_path: Path
) -> None:
    machine = tmp_path / "calibrated.toml"
    asked = ("--machine-output", machine, "--date", "2026-01-31", "--force")
    named = ("--identify", "strut.*.length", "--identify", "strut.a.expansion=1e-6 1/K")
    done = calibrate(capsys, POSITIONS, *named, *asked)
    assert "Warning, inside the file too: the uncertainty of " in done.err
    written = tp.load(machine)
    assert written.calibration is not None
    (said,) = [each for each in written.calibration.warning if "expansion" in each]
    assert said in " ".join(done.err.split())


def test_tolerances_that_are_wholly_correlated_can_be_written(
    capsys: Capture, tmp_path: Path
) -> None:
    text = MACHINE.read_text("utf-8")
    linked = '\n[[correlation]]\nbetween = ["tower a sideways", "tower b sideways"]\n'
    machine, output = tmp_path / "machine.toml", tmp_path / "calibrated.toml"
    machine.write_text(f"{text}{linked}coefficient = 1.0\n", "utf-8")
    asked = ("--machine-output", output, "--date", "2026-01-31", "--force", "--no-prior")
    done = call(capsys, "calibrate", machine, HEIGHTS, *asked)
    assert done.code == 0, done.err
    assert tp.load(output).calibration is not None
