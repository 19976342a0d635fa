"""`truepose compare OLD NEW`: did it change?"""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path

import pytest

from command_line import PLANAR, call

CALIBRATION = f"""
[calibration]
data = "m.csv"
data_hash = "{"0" * 64}"
machine = "planar_two_slider.toml"
machine_hash = "{"1" * 64}"
date = "2026-01-02"
version = "1"
observations = 30
residual_rms_before = 20.5
residual_rms_after = 1.0
warning = ["the tool is not known any better"]
"""


@pytest.fixture
def changed(tmp_path: Path) -> Path:
    """The planar machine with another strut, calibrated by force."""
    text = PLANAR.read_text(encoding="utf-8")
    path = tmp_path / "new.toml"
    path.write_text(text.replace("\nlength = 500", "\nlength = 502", 1) + CALIBRATION, "utf-8")
    return path


def test_it_did_not_change(capsys: pytest.CaptureFixture[str]) -> None:
    found = call(capsys, "compare", PLANAR, PLANAR)
    assert found.code == 0
    assert "No change beyond uncertainty" in found.out
    assert not found.err


def test_it_changed(capsys: pytest.CaptureFixture[str], changed: Path) -> None:
    found = call(capsys, "compare", PLANAR, changed)
    assert found.code == 1
    for words in (
        "The machine changed: strut.",
        "2026-01-02",
        "the tool is not known any better",
        "2000.000 µm",
    ):
        assert words in found.out
    assert call(capsys, "compare", changed, PLANAR).code == 1


def test_for_programs(capsys: pytest.CaptureFixture[str], changed: Path, tmp_path: Path) -> None:
    found = call(capsys, "compare", PLANAR, changed, "--format", "json")
    data = json.loads(found.out)
    assert found.code == data["attributes"]["changed"] == 1
    assert data["attributes"]["new_date"] == "2026-01-02"
    assert data["attributes"]["old_date"] == ""
    at = data["coordinates"]["parameter"]["values"].index("strut.1.length")
    assert data["variables"]["difference"]["values"][at] == pytest.approx(2.0)
    assert data["variables"]["difference"]["units"]["strut.1.length"] == "mm"
    for ending in ("json", "csv"):
        path = tmp_path / f"out.{ending}"
        found = call(capsys, "compare", PLANAR, changed, "--format", ending, "-o", path)
        assert path.read_text(encoding="utf-8") == found.out
        assert found.code == 1
    rows = {row["parameter"]: row for row in csv.DictReader(io.StringIO(found.out))}
    assert float(rows["strut.1.length"]["difference"]) == pytest.approx(2.0)
    assert rows["strut.1.length"]["units"] == "mm"
    assert rows["strut.1.length"]["parameter_changed"] == "true"
    assert rows["drive.d1.axis.u"]["units"] in ("deg", "rad")


def test_what_is_refused(capsys: pytest.CaptureFixture[str], changed: Path, tmp_path: Path) -> None:
    found = call(capsys, "compare", PLANAR, PLANAR.parent / "hexapod.toml")
    assert found.code == 2
    assert found.codes == ["not-the-same-machine"]
    found = call(capsys, "compare", PLANAR, changed, "-o", changed)
    assert found.code == 2
    assert found.codes == ["output-ending"]
    found = call(capsys, "compare", PLANAR, tmp_path / "none.toml")
    assert found.code == 2
    assert found.codes == ["file-missing"]


def test_check_shows_where_a_file_comes_from(
    capsys: pytest.CaptureFixture[str], changed: Path
) -> None:
    found = call(capsys, "check", changed)
    assert "2026-01-02" in found.out
    assert "the tool is not known any better" in found.out
    data = json.loads(call(capsys, "check", changed, "--format", "json").out)
    assert data["calibration"]["observations"] == 30
    assert json.loads(call(capsys, "check", PLANAR, "--format", "json").out)["calibration"] is None
