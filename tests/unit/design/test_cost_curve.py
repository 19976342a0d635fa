"""`truepose allocate --curve`: costs against targets, the same as of one target at a time."""

from __future__ import annotations

import json
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

import truepose as tp
from command_line import call
from designs import file_with, row
from truepose.design import cost_curve as curves
from truepose.design.cost_curve import cost_curve
from truepose.errors import RequestError

Capture = pytest.CaptureFixture[str]
RODS = """[[cost.choice]]
name = "rods"
of = "strut.*"
options = [
  { name = "steel", set = {}, cost = 0 },
  { name = "invar", set = { expansion = "1.2e-6 1/K" }, cost = 3 },
]
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return file_with(tmp_path, "planar_two_slider", RODS)


@pytest.fixture
def hearing() -> Iterator[None]:
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def test_a_curve_is_of_single_allocations(file: Path) -> None:
    machine = tp.load(file)
    curve = cost_curve(machine, [0.5e-3, 0.1e-3, 0.26e-3, 0.4e-3])
    assert [point.target for point in curve.points] == [0.1e-3, 0.26e-3, 0.4e-3, 0.5e-3]
    costs = [point.cost for point in curve.points]
    assert costs == sorted(costs, reverse=True)
    assert costs[0] == float("inf")
    assert curve.points[0].allocation is None
    for point in curve.points[1:]:
        single = tp.allocate(tp.load(file, [f"accuracy.target={1e3 * point.target}"]))
        assert point.cost == pytest.approx(single.cost)
        assert point.allocation is not None
        assert point.allocation.options == single.options
        assert point.allocation.proven == "these poses"
    assert len({point.allocation.options for point in curve.points if point.allocation}) == 2


def test_the_command(file: Path, capsys: Capture) -> None:
    done = call(capsys, "allocate", file, "--curve", "0.1 mm:0.5:3", "--format", "json")
    assert done.code == 0
    document = json.loads(done.out)
    assert document["coordinates"]["target"]["values"] == pytest.approx([0.1, 0.3, 0.5])
    values = document["variables"]["cost"]["values"]
    assert values[0] is None
    assert values[1] > values[2]
    table = call(capsys, "allocate", file, "--curve", "0.1 mm:0.5:3").out
    assert "out of reach" in table
    assert "rods: steel" in table


@pytest.mark.parametrize("text", ["0.1 mm", "0.1:0.2", "0.1:0.2:0", "0:1:3", "1 kg:2 kg:3", "::"])
def test_a_curve_that_cannot_be_read(file: Path, capsys: Capture, text: str) -> None:
    assert call(capsys, "allocate", file, "--curve", text).codes == ["bad-allocation"]


def test_a_curve_has_no_design(file: Path, tmp_path: Path, capsys: Capture) -> None:
    done = call(capsys, "allocate", file, "--curve", "0.4:0.5:2", "-o", tmp_path / "d.toml")
    assert done.code == 2
    assert not (tmp_path / "d.toml").exists()


def test_no_target_is_none(file: Path) -> None:
    for targets in ([], [0.0], [-1.0], [float("nan")], [1e-3 * n for n in range(1, 1002)]):
        with pytest.raises(RequestError) as caught:
            cost_curve(tp.load(file), targets)
        assert caught.value.problems[0].code == "bad-allocation"


def test_other_refusals_stay(tmp_path: Path) -> None:
    path = file_with(tmp_path, "planar_two_slider", rows=())
    with pytest.raises(RequestError) as caught:
        cost_curve(tp.load(path), [1e-3])
    assert caught.value.problems[0].code == "no-cost"


def test_ctrl_c_gives_the_points_of_then(
    file: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    whole, count = tp.allocate, 0

    def stopped(*arguments: tp.Machine, **options: float) -> object:
        nonlocal count
        count += 1
        if count > 2:
            raise KeyboardInterrupt
        return whole(*arguments, **options)  # type: ignore[arg-type]

    monkeypatch.setattr(curves, "allocate", stopped)
    done = call(capsys, "allocate", file, "--curve", "0.3:0.5:5", "--format", "json")
    assert done.code == 130
    assert "Interrupted after 2 of 5 targets" in done.err
    document = json.loads(done.out)
    assert document["coordinates"]["target"]["values"] == pytest.approx([0.45, 0.5])
    assert document["attributes"]["interrupted"] == 1


def test_ctrl_c_before_the_first_point(file: Path, hearing: None) -> None:
    with pytest.raises(KeyboardInterrupt):
        cost_curve(tp.load(file), [4e-4], progress=lambda *_: signal.raise_signal(signal.SIGINT))


def test_a_unit_of_cost_that_is_called_like_a_length(tmp_path: Path) -> None:
    path = file_with(tmp_path, "planar_two_slider", rows=(row("strut.*.length"),))
    path.write_text(path.read_text().replace('unit = "EUR"', 'unit = "m"'))
    found = tp.allocate(tp.load(path))
    assert found.dataset["cost"].attrs["units"] == "1"
    assert found.dataset.attrs["cost_unit"] == "m"
