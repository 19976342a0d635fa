"""Formats agree with the Python results, and files are written whole or not at all."""

from __future__ import annotations

import csv
import io
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import truepose
from command_line import PLANAR, call
from sweeps import sweep

OUT_OF_REACH = "workspace.grid.x=[-900, 700, 9]"
OF = {"budget": truepose.budget, "compensate": truepose.compensate}
PER_UNIT = {"m": ("mm", 1e3), "rad": ("deg", 180 / np.pi), "N": ("N", 1.0)}


@pytest.mark.parametrize("machine", ["planar_two_slider", "rotary_delta"])
@pytest.mark.parametrize("command", ["budget", "compensate"])
def test_json_has_every_variable_in_the_units_of_the_file(
    command: str, machine: str, capsys: pytest.CaptureFixture[str]
) -> None:
    file = PLANAR.with_stem(machine)
    document = json.loads(call(capsys, command, file, "--format", "json").out)
    expected = OF[command](truepose.load(file))
    variables = set(expected.data_vars) | {n for n, c in expected.coords.items() if c.ndim > 1}
    assert set(document["variables"]) == variables
    for name in variables:
        found, variable = document["variables"][name], expected[name]
        assert tuple(found["dims"]) == variable.dims
        values = np.array(found["values"], dtype=object)
        assert values.shape == variable.shape
        if variable.dtype.kind != "f":
            assert found["values"] == variable.values.tolist()
            continue
        units = found["units"]
        if isinstance(units, str):
            scale = np.ones(variable.shape)
            si = variable.attrs["units"]
            label, factor = PER_UNIT.get(si, (si, 1.0))
            assert units == label
            scale *= factor
        else:
            by = expected[variable.attrs["units_by"]]
            per = [PER_UNIT[str(unit)] for unit in by.values]
            assert list(units.values()) == [label for label, _ in per]
            axis = variable.dims.index(by.dims[0])
            shape = [1] * variable.ndim
            shape[axis] = -1
            scale = np.array([factor for _, factor in per]).reshape(shape)
        number = np.where(values == None, np.nan, values).astype(float)  # noqa: E711
        full = variable.values * scale
        # A number of ten digits or fewer may stand for one that differs by rounding alone.
        few = np.vectorize(lambda each: float(f"{each:.9e}") == each)(number)
        off, size = np.abs(number - full), np.abs(full)
        there = np.isfinite(full)
        assert np.array_equal(np.isnan(number), np.isnan(full))
        assert (off <= np.where(few, 1e-14, 1e-15) * size)[there].all()


def test_json_names_left_out_poses_with_their_status(capsys: pytest.CaptureFixture[str]) -> None:
    outcome = call(capsys, "budget", PLANAR, "--set", OUT_OF_REACH, "--format", "json")
    document = json.loads(outcome.out)
    left_out = document["left_out"]
    assert len(left_out) == document["attributes"]["poses_left_out"] > 0
    assert {pose["status"] for pose in left_out} == {"unreachable"}
    assert left_out[0]["x"] == pytest.approx(-900)
    used = document["coordinates"]["pose"]["values"]
    assert sorted([*used, *(pose["pose"] for pose in left_out)]) == list(range(45))


def test_csv_is_tidy_and_names_its_units(capsys: pytest.CaptureFixture[str]) -> None:
    outcome = call(capsys, "budget", PLANAR, "--set", OUT_OF_REACH, "--format", "csv")
    rows = list(csv.DictReader(io.StringIO(outcome.out)))
    expected = truepose.budget(truepose.load(PLANAR, [OUT_OF_REACH]))
    used, left_out = expected.sizes["pose"], expected.sizes["left_out"]
    sources = [*expected["source"].values, "overall"]
    assert len(rows) == used * len(sources) + left_out
    assert [row["source"] for row in rows[: len(sources)]] == sources
    for row in rows[: used * len(sources)]:
        pose = expected.sel(pose=int(row["pose"]))
        name, at = row["source"], {"component": "y"}
        if name == "overall":
            errors = pose["overall_error_upper"].sel(at)
            assert row["worst_y [mm]"] == ""
        else:
            errors = pose["error_upper"].sel({**at, "source": name})
        assert float(row["error_upper_y [mm]"]) == pytest.approx(float(errors) * 1e3, rel=1e-15)
        assert float(row["pose_y [mm]"]) == pytest.approx(float(pose["pose_y"]) * 1e3, rel=1e-15)
        assert row["status"] == "ok"
    for row in rows[used * len(sources) :]:
        assert row["status"] == "unreachable"
        assert row["error_x [mm]"] == ""


def test_csv_of_the_compensation_has_the_corrected_joints(
    capsys: pytest.CaptureFixture[str],
) -> None:
    rows = list(
        csv.DictReader(io.StringIO(call(capsys, "compensate", PLANAR, "--format", "csv").out))
    )
    expected = truepose.compensate(truepose.load(PLANAR))
    assert len(rows) == expected.sizes["pose"]
    found = [
        [float(row["joint_corrected_d1 [mm]"]), float(row["joint_corrected_d2 [mm]"])]
        for row in rows
    ]
    np.testing.assert_allclose(found, expected["joint_corrected"].values * 1e3, rtol=1e-15)


@pytest.mark.filterwarnings("ignore")  # of h5py and xarray about each other
@pytest.mark.parametrize("command", ["budget", "compensate"])
def test_netcdf_reads_back_as_the_dataset(
    command: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    file = tmp_path / "result.nc"
    assert call(capsys, command, PLANAR, "--output", file).code == 0
    with xr.open_dataset(file, engine="h5netcdf") as found:
        expected = OF[command](truepose.load(PLANAR))
        assert set(found.variables) == set(expected.variables)
        for name, variable in expected.variables.items():
            np.testing.assert_array_equal(found[name].values, variable.values)
            assert found[name].attrs["units"] == variable.attrs["units"]
        assert found.attrs["machine_hash"] == expected.attrs["machine_hash"]


def test_netcdf_without_its_packages(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("truepose.reporting.formats.netcdf.find_spec", lambda name: None)
    outcome = call(capsys, "budget", PLANAR, "--output", tmp_path / "result.nc")
    assert (outcome.code, outcome.codes) == (2, ["extra-missing"])
    assert "pip install 'truepose[netcdf]'" in outcome.err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("form", ["json", "csv"])
@pytest.mark.parametrize("command", ["check", "budget", "compensate"])
def test_a_file_holds_what_is_printed(
    command: str, form: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    file = tmp_path / f"result.{form}"
    file.write_text("old")
    outcome = call(capsys, command, PLANAR, "--format", form, "--output", file)
    assert file.read_text() == outcome.out
    assert f"wrote {file}" in outcome.err
    assert list(tmp_path.iterdir()) == [file]


def test_a_failure_leaves_the_old_file_and_nothing_else(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "result.json"
    file.write_text("old")

    def full(result: object) -> object:
        yield "{"
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("truepose.reporting.formats.json_text.text", full)
    outcome = call(capsys, "budget", PLANAR, "--output", file)
    assert outcome.code == 2
    assert "output-not-writable" in outcome.codes
    assert "No space left on device" in outcome.err
    assert file.read_text() == "old"
    assert list(tmp_path.iterdir()) == [file]


def test_ctrl_c_leaves_the_old_file(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "result.json"
    file.write_text("old")

    def interrupted(result: object) -> object:
        yield "{"
        raise KeyboardInterrupt

    monkeypatch.setattr("truepose.reporting.formats.json_text.text", interrupted)
    outcome = call(capsys, "budget", PLANAR, "--output", file)
    assert outcome.code == 130
    assert "Traceback" not in outcome.err
    assert file.read_text() == "old"
    assert list(tmp_path.iterdir()) == [file]


# A child of a background job starts deaf to Ctrl-C.
HEARING = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)"


@sweep
def test_ctrl_c_in_the_middle_of_long_work(tmp_path: Path) -> None:
    grid = ["--set", "workspace.grid.x=[200,400,3000]", "--set", "workspace.grid.y=[100,300,300]"]
    process = subprocess.Popen(
        [
            sys.executable, "-c", f"{HEARING}; from truepose.cli import main; main()",
            "budget", PLANAR, *grid, "--output", tmp_path / "result.json",
        ],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    began = time.monotonic()
    while not list(tmp_path.iterdir()):  # the temporary file: the result is being written
        assert process.poll() is None
        assert time.monotonic() - began < 120
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130, errors
    assert "Traceback" not in errors
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("form", ["csv", "json", "table"])
def test_a_reader_that_goes_away_is_no_error(form: str) -> None:
    reading, writing = os.pipe()
    process = subprocess.Popen(
        [
            sys.executable, "-c", "from truepose.cli import main; main()",
            "budget", PLANAR, "--format", form, "--set", "workspace.grid.x=[200,400,500]",
        ],
        stdout=writing, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    os.close(writing)
    os.close(reading)  # gone before the first byte
    _, errors = process.communicate(timeout=60)
    assert (process.returncode, errors) == (141, "")


def test_the_report_is_named_after_the_machine_file(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    outcome = call(capsys, "report", PLANAR)
    assert outcome.code == 0
    assert [path.name for path in tmp_path.iterdir()] == ["planar_two_slider.html"]
    assert "The sources compared" in outcome.out
    assert "Before and after compensation" in outcome.out
