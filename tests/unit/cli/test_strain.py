"""`truepose strain`: the internal forces, as tables, as data, and refused where there are none."""

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
from sweeps import sweep

FILE = MACHINES / "overconstrained.toml"
PLAY = "each.strut.base_joint.clearance=0.005"
PER_UNIT = {"m": ("mm", 1e3), "N": ("N", 1.0)}


def test_the_tables_say_what_clearances_leave(capsys: pytest.CaptureFixture[str]) -> None:
    done = call(capsys, "strain", FILE, "--set", PLAY)
    assert done.code == 0
    found = truepose.strain(truepose.load(FILE, [PLAY]))
    for source, verdict in (("tolerance", "partly"), ("thermal", "partly")):
        (line,) = [line for line in done.out.splitlines() if line.startswith(f" {source} ")]
        highest = float(found.highest_force.sel(source=source))
        rigid = float(found.highest_force_rigid.sel(source=source))
        assert verdict in line
        assert f"{highest:.1f}" in line
        assert f"{rigid:.1f}" in line
        assert f"{100 * highest / rigid:.1f}" in line
        assert "2.5000" in line, "half of 5 µm"
    assert "Forces in the closures" in done.out
    lowest = float(found.overall_force.sel(closure="r1").min())
    (line,) = [line for line in done.out.splitlines() if line.startswith(" r1 ")]
    assert f"{abs(lowest):.2f}" in line


def test_json_and_csv_have_the_dataset_in_the_units_of_the_file(
    capsys: pytest.CaptureFixture[str],
) -> None:
    expected = truepose.strain(truepose.load(FILE))
    document = json.loads(call(capsys, "strain", FILE, "--format", "json").out)
    assert document["command"] == "strain"
    assert set(document["variables"]) == set(expected.data_vars)
    for name, variable in expected.data_vars.items():
        found = document["variables"][name]
        unit, factor = PER_UNIT.get(variable.attrs["units"], ("1", 1.0))
        assert found["units"] == unit
        if variable.dtype.kind == "f":
            np.testing.assert_allclose(found["values"], variable.values * factor, rtol=1e-12)
        else:
            assert found["values"] == variable.values.tolist()
    text = call(capsys, "strain", FILE, "--format", "csv").out
    rows = list(csv.DictReader(io.StringIO(text)))
    assert len(rows) == 25 * 3
    assert [row["source"] for row in rows[:3]] == ["tolerance", "thermal", "overall"]
    assert float(rows[1]["force_l1 [N]"]) == expected.force.values[0, 1, 0]
    assert float(rows[2]["force_l1 [N]"]) == expected.overall_force.values[0, 0]
    assert rows[2]["force_rigid_l1 [N]"] == ""


def test_a_file_is_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "forces.nc"
    assert call(capsys, "strain", FILE, "--output", path).code == 0
    with xr.open_dataset(path, engine="h5netcdf") as read:
        expected = truepose.strain(truepose.load(FILE))
        np.testing.assert_array_equal(read.force.values, expected.force.values)
        assert list(read.verdict.values) == list(expected.verdict.values)


def test_poses_left_out_are_listed_or_refused(capsys: pytest.CaptureFixture[str]) -> None:
    far = ["--set", "workspace.grid.x=[-100, 3000, 2]"]
    done = call(capsys, "strain", FILE, *far)
    assert done.code == 0
    assert "Poses left out: 5 of 10" in done.out
    strict = call(capsys, "strain", FILE, *far, "--strict")
    assert strict.code == 2
    assert "error[unusable-pose]" in strict.err


def test_a_machine_that_nothing_strains_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    done = call(capsys, "strain", MACHINES / "hexapod.toml")
    assert done.code == 2
    assert "error[nothing-strains]: nothing strains" in done.err
    assert "as many closures as freedoms" in done.err
    assert done.out == ""


@sweep
def test_the_report_has_a_section_where_there_are_internal_forces(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name, there in (("overconstrained", True), ("planar_two_slider", False)):
        page = tmp_path / f"{name}.html"
        done = call(capsys, "report", MACHINES / f"{name}.toml", "--output", page)
        assert done.code == 0
        assert ("Internal forces from each source" in done.out) is there
        text = page.read_text("utf-8")
        for part in ("figure-internal_forces", "table-internal_forces", "table-closure_forces"):
            assert (f'id="{part}"' in text) is there
