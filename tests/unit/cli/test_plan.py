"""`truepose plan`: tables, data, the files it writes, and bad input."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import truepose
from command_line import MACHINES, PLANAR, call
from truepose.calibration.planning.comparison import compare_instruments
from truepose.calibration.planning.instruments import instruments_named
from truepose.calibration.planning.plan import plan

FILE = MACHINES / "tripod.toml"
TRACKER = "position=10um"
ASKED = ("plan", FILE, "--instrument", TRACKER, "--poses", 5)

HEAD = """#: [instrument.tracker]
#: kind = "position"
#: frame = "unknown"
#: uncertainty = "10 um"
#: [instrument.bar]
#: kind = "distance"
#: frame = { origin = ["0 mm", "0 mm", "-300 mm"], unknown = ["x", "y", "z"] }
#: target = ["0 mm", "0 mm", "20 mm"]
#: uncertainty = "1 um"
"""


def test_the_tables_say_what_every_pose_buys(capsys: pytest.CaptureFixture[str]) -> None:
    done = call(capsys, *ASKED)
    assert done.code == 0
    machine = truepose.load(FILE)
    found = plan(machine, instruments_named(machine, TRACKER), 5)
    lines = done.out.splitlines()
    start = next(at for at, line in enumerate(lines) if line.startswith(" poses "))
    for count in range(6):
        cells = lines[start + 2 + count].split()
        assert cells[0] == str(count)
        shown = [f"{value * 1e6:.3f}" for value in (found.rms[count, 0], found.highest[count, 0])]
        np.testing.assert_allclose(
            [float(cell) for cell in cells[-3 if count else -2 :][:2]],
            [float(value) for value in shown],
            rtol=1e-2,
        )
    for pose in found.poses:
        words = [f"{value * 1e3:.6g}" for value in pose]
        assert any(line.split()[1:4] == words for line in lines)
    last = f"{found.rms[-1, 0] * 1e6:.3g} µm rms"
    assert last in done.out
    assert "stay known mainly from their tolerances" in done.out


def test_ctrl_c_gives_the_best_plan_so_far(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def stop(done: int, total: int) -> None:
        assert total == 5
        if done == 2:
            raise KeyboardInterrupt

    def stopped(*given: Any, **asked: Any) -> Any:
        return plan(*given, **{**asked, "progress": stop})

    monkeypatch.setattr("truepose.calibration.planning.plan.plan", stopped)
    output, program = tmp_path / "plan.json", tmp_path / "poses.ngc"
    outcome = call(capsys, *ASKED, "--compare", "distance=2um", "-o", output, "--program", program)
    assert outcome.code == 130
    assert "Interrupted after 2 starts: the plan is the best" in outcome.err
    assert json.loads(output.read_text("utf-8"))["attributes"]["interrupted"] == 1
    assert "pose 5 of 5" in program.read_text("utf-8")
    monkeypatch.undo()
    done = call(capsys, *ASKED, "--format", "json")
    assert done.code == 0
    assert json.loads(done.out)["attributes"]["interrupted"] == 0


def test_json_csv_and_netcdf_have_the_plan(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    machine = truepose.load(FILE)
    found = plan(machine, instruments_named(machine, TRACKER), 5)
    document = json.loads(call(capsys, *ASKED, "--format", "json").out)
    assert document["command"] == "plan"
    assert set(document["variables"]) == set(map(str, found.dataset.data_vars))
    np.testing.assert_allclose(document["variables"]["rms"]["values"], found.rms * 1e3, rtol=1e-12)
    rows = list(csv.DictReader(io.StringIO(call(capsys, *ASKED, "--format", "csv").out)))
    assert [int(row["rank"]) for row in rows] == found.rank.tolist()
    np.testing.assert_allclose(
        [float(row["pose_z [mm]"]) for row in rows], found.poses[:, 2] * 1e3, rtol=1e-12
    )
    path = tmp_path / "plan.nc"
    assert call(capsys, *ASKED, "--output", path).code == 0
    with xr.open_dataset(path, engine="h5netcdf") as read:
        np.testing.assert_array_equal(read["rms"], found.rms)


def test_a_program_and_a_file_to_fill_in(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    program, template = tmp_path / "measure.ngc", tmp_path / "measurements.csv"
    done = call(
        capsys, *ASKED, "--program", program, "--template", template, "--dwell", "500 ms",
        "--feed", "10 mm/s",
    )  # fmt: skip
    assert done.code == 0
    assert f"wrote {program}" in done.err
    lines = program.read_text(encoding="ascii").splitlines()
    assert lines.count("G4 P0.5") == 5
    assert "F600" in lines
    text = template.read_text(encoding="utf-8")
    assert '#: kind = "position"' in text
    assert text.count("\nposition, ") == 5
    # The file is a head that can be planned with again.
    again = call(capsys, "plan", FILE, "--instrument", template, "--poses", 5)
    assert again.out == call(capsys, *ASKED).out


def test_a_file_names_its_instruments(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    path = tmp_path / "head.csv"
    path.write_text(HEAD, encoding="utf-8")
    both = call(capsys, "plan", FILE, "--instrument", path, "--poses", 4, "--format", "json")
    assert json.loads(both.out)["attributes"]["instruments"] == "tracker, bar"
    one = call(
        capsys, "plan", FILE, "--instrument", f"{path}:bar", "--poses", 4, "--format", "json"
    )
    assert json.loads(one.out)["attributes"]["instruments"] == "bar"
    none = call(capsys, "plan", FILE, "--instrument", f"{path}:bars", "--poses", 4)
    assert (none.code, none.codes) == (2, ["plan-instrument"])
    assert "bar" in none.err


def test_instruments_are_compared(capsys: pytest.CaptureFixture[str]) -> None:
    machine = truepose.load(FILE)
    fine = "coordinate:x,y=1um"
    found = compare_instruments(
        machine,
        [*instruments_named(machine, TRACKER), *instruments_named(machine, fine)],
        5,
    )
    done = call(capsys, *ASKED, "--compare", fine)
    (sentence,) = found.sentences
    assert done.out.splitlines()[-1] == f"{sentence[0].upper()}{sentence[1:]}."
    assert "do what 5 position readings do" in sentence
    beside = call(capsys, *ASKED, "--compare", fine, "--format", "json")
    json.loads(beside.out)
    assert sentence in beside.err


def test_long_plans_are_shortened_for_people(capsys: pytest.CaptureFixture[str]) -> None:
    done = call(capsys, "plan", PLANAR, "--instrument", TRACKER, "--poses", 40)
    assert done.code == 0
    assert "And 20 more poses: --output writes all." in done.out
    assert len(done.out.splitlines()) < 70


def test_what_is_not_determined_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    """Scales have no tolerance, and one height does not tell three of them."""
    done = call(
        capsys, "plan", FILE, "--instrument", "coordinate:z=10um", "--poses", 1,
        "--identify", "drive.*.scale",
    )  # fmt: skip
    assert done.code == 0
    assert "After 1 pose the position of the tool is not determined" in done.out
    assert "3 of 3 unknowns of the machine are not determined: scale of drive d1" in done.out
    assert "undetermined" in done.out
    enough = call(capsys, *ASKED, "--identify", "drive.*.scale")
    assert "5 poses take the uncertainty of the tool's position from unknown to" in enough.out
    assert "not determined" not in enough.out


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (("--instrument", "tracker=10um", "--poses", 3), "plan-instrument"),
        (("--instrument", "position=10kg", "--poses", 3), "plan-instrument"),
        (("--instrument", "position=-1um", "--poses", 3), "plan-instrument"),
        (("--instrument", "position=10", "--poses", 3), "plan-instrument"),
        (("--instrument", "position:height=1um", "--poses", 3), "plan-instrument"),
        (("--instrument", "coordinate:x,y,z=1um", "--poses", 3), "plan-instrument"),
        (("--instrument", "contact=1um", "--poses", 3), "plan-instrument"),
        (("--instrument", "nothing", "--poses", 3), "plan-instrument"),
        (("--instrument", "missing.csv", "--poses", 3), "file-missing"),
        (("--instrument", TRACKER, "--poses", 0), "plan-budget"),
        (("--instrument", TRACKER, "--poses", 100000), "plan-budget"),
        (("--instrument", TRACKER, "--poses", 3, "--dwell", "-2 s"), "plan-option"),
        (("--instrument", TRACKER, "--poses", 3, "--feed", "fast"), "plan-option"),
        (("--instrument", TRACKER, "--poses", 3, "--feed", "3 mm/h"), "plan-option"),
        (("--instrument", TRACKER, "--poses", 3, "--compare", "x=1"), "plan-instrument"),
        (("--instrument", TRACKER, "--poses", 3, "--identify", "nose"), "unknown-parameter"),
        (("--instrument", TRACKER, "--poses", 3, "--template", "a.txt"), "output-ending"),
        (("--instrument", TRACKER, "--poses", 3, "--program", FILE), "output-is-input"),
    ],
)
def test_bad_input_is_refused(
    capsys: pytest.CaptureFixture[str], arguments: tuple[object, ...], code: str
) -> None:
    done = call(capsys, "plan", FILE, *arguments)
    assert (done.code, done.codes) == (2, [code])
    assert not done.out


def test_a_head_that_is_wrong_is_told_with_its_line(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    path = tmp_path / "head.csv"
    path.write_text(HEAD.replace('"distance"', '"distances"'), encoding="utf-8")
    done = call(capsys, "plan", FILE, "--instrument", path, "--poses", 3)
    assert (done.code, done.codes) == (2, ["unknown-choice"])
    assert f"{path}:6:" in done.err
    path.write_text("x (mm)\n", encoding="utf-8")
    done = call(capsys, "plan", FILE, "--instrument", path, "--poses", 3)
    assert (done.code, done.codes) == (2, ["plan-instrument"])
