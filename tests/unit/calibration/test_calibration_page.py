"""docs/calibration.md: its example runs, its links lead somewhere, its figures are true."""

from __future__ import annotations

import re
import runpy
from pathlib import Path
from typing import Any

import pytest

from command_line import call

ROOT = Path(__file__).parents[3]
PAGE = (ROOT / "docs" / "calibration.md").read_text("utf-8")


def test_the_python_example_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    (example,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    names: dict[str, Any] = {}
    exec(example, names)  # noqa: S102 the page is ours
    assert names["found"].accepted
    assert names["calibrated"].parameters == names["m"].parameters


def test_links_lead_somewhere() -> None:
    links = re.findall(r"\]\(([^):]+)\)", PAGE)
    assert links
    assert not [link for link in links if not (ROOT / "docs" / link).exists()]


def test_the_figures_are_the_commands(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(ROOT)
    machine, data = "examples/data/delta_printer.toml", "examples/data/delta_{}.csv"
    alone = call(capsys, "calibrate", machine, data.format("heights"), "--no-prior").out
    text = " ".join(alone.split())
    for said in ("uncertain by 1.1 mm, against 0.99 mm", "probe in x and y too", "111.3 2.6"):
        assert said in text
    rods = re.findall(r"length of strut \w .*?\N{MINUS SIGN}(\d\.\d+) mm", alone)
    assert [round(float(rod), 1) for rod in rods] == [2.1, 2.6, 2.7]
    with_tolerances = call(capsys, "calibrate", machine, data.format("heights")).out
    text = " ".join(with_tolerances.split())
    assert text.startswith("No: probe: the readings are explained as well if the z axis")
    assert "one row at another commanded z" in text
    positions = call(capsys, "calibrate", machine, data.format("positions")).out
    assert "becomes known to within 18 µm" in positions
    assert re.search(r"294\.7 +8\.4 +294\.7 +13\.8", positions)


def test_the_committed_measurements_are_those_of_the_script(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    folder = ROOT / "examples" / "data"
    script = runpy.run_path(str(folder / "simulate_delta_printer.py"))
    (tmp_path / "delta_printer.toml").write_bytes((folder / "delta_printer.toml").read_bytes())
    monkeypatch.setitem(script["main"].__globals__, "FOLDER", tmp_path)
    script["main"]()
    for name in ("delta_heights.csv", "delta_positions.csv"):
        assert (tmp_path / name).read_bytes() == (folder / name).read_bytes()
