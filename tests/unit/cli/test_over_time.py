"""`truepose over-time`: the error over a temperature log, as a table and as data."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import truepose
from command_line import MACHINES, call


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """The planar machine, whose struts warm up by different amounts within a minute."""
    times = np.arange(0.0, 61.0)
    share = 1.0 - np.exp(-times / 20.0)
    rows = ["time (s),strut.1 (degC),strut.2 (degC)"]
    rows += [f"{t},{20 + 10 * s},{20 + 4 * s}" for t, s in zip(times, share, strict=True)]
    (tmp_path / "log.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    text = (MACHINES / "planar_two_slider.toml").read_text(encoding="utf-8")
    changed = text.replace("\ntemperature = 35", '\ntemperature_log = "log.csv"', 1)
    assert changed != text
    path = tmp_path / "machine.toml"
    path.write_text(changed, encoding="utf-8")
    return path


def test_csv_has_a_row_for_every_moment_in_the_units_of_the_file(
    capsys: pytest.CaptureFixture[str], file: Path
) -> None:
    expected = truepose.over_time(truepose.load(file))
    text = call(capsys, "over-time", file, "--format", "csv").out
    rows = list(csv.DictReader(io.StringIO(text)))
    assert len(rows) == 61
    for at in (0, 17, 60):
        row, found = rows[at], expected.isel(time=at, pose=0)
        assert float(row["time [s]"]) == at
        assert float(row["error_y [mm]"]) == pytest.approx(
            1e3 * float(found.error.sel(component="y")), rel=1e-12
        )
        warm = 20.0 + 10.0 * (1.0 - np.exp(-at / 20.0))
        assert float(row["temperature_strut.1 [degC]"]) == pytest.approx(warm, abs=1e-9)
        assert float(row["pose_x [mm]"]) == pytest.approx(1e3 * float(expected.pose_x[0]))


def test_json_and_netcdf_have_the_dataset(
    capsys: pytest.CaptureFixture[str], file: Path, tmp_path: Path
) -> None:
    expected = truepose.over_time(truepose.load(file))
    output = tmp_path / "found.nc"
    done = call(capsys, "over-time", file, "--format", "json", "--output", output)
    document = json.loads(done.out)
    assert document["units"]["temperature"] == "degC"
    assert document["variables"]["error"]["dims"] == ["time", "pose", "component"]
    found = np.array(document["variables"]["error"]["values"])
    np.testing.assert_allclose(found, 1e3 * expected.error.values, rtol=1e-12)
    with xr.open_dataset(output) as written:
        np.testing.assert_array_equal(written.error.values, expected.error.values)


def test_the_table_ends_with_the_worst_moment(
    capsys: pytest.CaptureFixture[str], file: Path
) -> None:
    done = call(capsys, "over-time", file)
    assert done.code == 0
    size = 1e6 * np.linalg.norm(truepose.over_time(truepose.load(file)).error.values[:, 0], axis=1)
    (line,) = [line for line in done.out.splitlines() if "(worst)" in line]
    assert f"{size.argmax() / 60:.2f} (worst)" in line
    assert float(line.split()[-1]) == pytest.approx(size.max(), rel=1e-3)


def test_a_file_without_a_log_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    done = call(capsys, "over-time", MACHINES / "planar_two_slider.toml")
    assert done.code == 2
    assert "no-temperature-log" in done.err
