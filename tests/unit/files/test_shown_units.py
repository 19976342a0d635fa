"""People are answered in units that suit those of the file."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from command_line import MACHINES, PLANAR, call
from page_data import figures_of
from truepose.files.dimensions import DIMENSIONS
from truepose.files.shown_units import Shown, ShownUnits, shown_units
from truepose.files.units import unit_of

HEXAPOD = MACHINES / "hexapod.toml"


def units(**declared: str) -> ShownUnits:
    return shown_units({name: unit_of(text, DIMENSIONS[name]) for name, text in declared.items()})


@pytest.mark.parametrize(
    ("length", "label", "one", "small", "millionth"),
    [
        ("mm", "mm", 1e-3, "µm", 1e-6),
        ("m", "mm", 1e-3, "µm", 1e-6),
        ("um", "mm", 1e-3, "µm", 1e-6),
        ("in", "in", 25.4e-3, "µin", 25.4e-9),
        ("ft", "in", 25.4e-3, "µin", 25.4e-9),
        ("thou", "in", 25.4e-3, "µin", 25.4e-9),
    ],
)
def test_lengths(length: str, label: str, one: float, small: str, millionth: float) -> None:
    found = units(length=length)
    assert (found.pose("x").label, found.error("position").label) == (label, small)
    assert found.pose("z").per_si * one == pytest.approx(1.0, rel=1e-15)
    assert found.error("y").per_si * millionth == pytest.approx(1.0, rel=1e-15)


@pytest.mark.parametrize(
    ("angle", "label", "one", "small", "little"),
    [
        ("deg", "°", math.pi / 180, "mdeg", math.pi / 180e3),
        ("rad", "rad", 1.0, "µrad", 1e-6),
        ("mrad", "mrad", 1e-3, "µrad", 1e-6),
        ("arcmin", "°", math.pi / 180, "arcsec", math.pi / 648000),
        ("arcsec", "°", math.pi / 180, "arcsec", math.pi / 648000),
    ],
)
def test_angles(angle: str, label: str, one: float, small: str, little: float) -> None:
    found = units(angle=angle)
    assert (found.pose("a").label, found.error("orientation").label) == (label, small)
    assert found.pose("c").per_si * one == pytest.approx(1.0, rel=1e-15)
    assert found.error("rx").per_si * little == pytest.approx(1.0, rel=1e-15)


def test_forces_and_temperatures() -> None:
    found = units(force="lbf", temperature="degF")
    assert found.force.label == "lbf"
    # A pound is 0.45359237 kg, standard gravity 9.80665 m/s².
    assert found.force.per_si * 0.45359237 * 9.80665 == pytest.approx(1.0, rel=1e-12)
    assert found.degree == "°F"
    assert found.temperature(np.array([273.15, 373.15])) == pytest.approx([32.0, 212.0])
    assert (units(temperature="K").degree, units(temperature="degC").degree) == ("°C", "°C")
    assert units().force == Shown("N", 1.0)


def test_no_digit_before_the_point_is_lost() -> None:
    micrometre = Shown("µm", 1e6)
    assert micrometre.text(1.64e-6) == "1.64 µm"
    assert micrometre.text(12.3456e-3) == "12346 µm"
    assert micrometre.text(-5e-8) == "-0.05 µm"


@pytest.mark.parametrize(
    ("key", "asked", "says"),
    [
        ("target", '"0.4 mm"', "0.4 mm"),
        ("target", '"0.0005 in"', "0.0005 in"),
        ("target", "0.02", "0.02 in"),
        ("angle_target", '"0.4 deg"', "0.4 deg"),
        ("angle_target", "0.4", "0.4 deg"),
        ("angle_target", '"50 urad"', "50 urad"),
    ],
)
def test_what_is_asked_is_said_as_it_was_asked(key: str, asked: str, says: str) -> None:
    machine = tp.load(HEXAPOD, settings=[f"accuracy.{key}={asked}"])
    quantity = "position" if key == "target" else "orientation"
    assert machine.accuracy.said(quantity) == says


def test_an_inch_machine_is_answered_in_inches(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The budget's own numbers, SI, divided by 25.4 nm and by a thousandth of a degree."""
    text = call(capsys, "check", HEXAPOD).out
    found = tp.budget(tp.load(HEXAPOD))
    position = found.linear_maximum.values[:, 0].max() / 25.4e-9
    turn = np.degrees(found.linear_maximum.values[:, 1].max()) * 1e3
    rows = (line.strip() for line in text.splitlines() if "before compensation" in line)
    (of_position, of_turn) = (row for row in rows if ":" not in row)
    assert f"{position:.1f} µin" in of_position
    assert f"0.1 mm ({0.1e-3 / 25.4e-9:.0f} µin)" in of_position
    assert f"{turn:.3f} mdeg" in of_turn
    assert "0.03 deg (30 mdeg)" in of_turn
    assert "±200.000" in text, "0.0002 in of tolerance"
    assert "z 20 in" in text
    for word in ("µm", "µrad", " mm,", "rad "):
        assert word not in text, word


@pytest.mark.parametrize(
    "command",
    [
        ["check"],
        ["budget"],
        ["compensate"],
        ["montecarlo", "--samples", "50"],
        ["bounds"],
        ["shares", "--samples", "64"],
        ["plan", "--instrument", "position=10um", "--poses", "12"],
    ],
    ids=lambda command: command[0],
)
def test_no_command_speaks_of_other_units(
    command: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    """A hexapod in inches and degrees: no mm, no µm, no µrad in what it is told."""
    ask = [command[0], HEXAPOD, *command[1:], "--set", 'accuracy.target="0.004 in"']
    grid = ["x=[-4, 4, 2]", "y=[0, 0, 1]", "z=[18, 22, 2]", "a=[-10, 10, 2]", "b=[0, 0, 1]"]
    for axis in grid:
        ask += ["--set", f"workspace.grid.{axis}"]
    outcome = call(capsys, *ask)
    assert outcome.code in (0, 1), outcome.err
    for word in ("µm", "µrad", " mm", " rad"):
        assert word not in outcome.out + outcome.err, (word, outcome.out)
    if command[0] != "plan":
        assert "µin" in outcome.out or command[0] == "shares"


def test_the_page_speaks_the_units_of_the_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    ask = ["report", HEXAPOD, "--output", tmp_path / "page.html"]
    for axis in ("x=[0, 4, 2]", "y=[0, 0, 1]", "z=[18, 22, 2]", "a=[0, 0, 1]", "b=[0, 0, 1]"):
        ask += ["--set", f"workspace.grid.{axis}"]
    outcome = call(capsys, *ask)
    assert outcome.code in (0, 1), outcome.err
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    text = re.sub(r"<(script|style|pre)\b.*?</\1>", "", page, flags=re.DOTALL)
    for word in ("µm", "µrad"):
        assert word not in text
    assert "lengths in in, errors in µin and mdeg" in text
    assert "asked 0.1 mm (3937 µin)" in text
    # Figures: the titles of their axes.
    said = re.findall(r'"text": "([^"]*)"', json.dumps(figures_of(page), ensure_ascii=False))
    assert any(title.endswith("µin") for title in said)
    assert any(title.endswith("mdeg") for title in said)
    assert not [title for title in said if title.endswith(("µm", "µrad", ", mm"))]


def test_a_machine_in_millimetres_stays_so(capsys: pytest.CaptureFixture[str]) -> None:
    text = call(capsys, "check", PLANAR, "--set", 'accuracy.target="250 um"').out
    assert "250 um" in text
    assert "(250" not in text, "the same unit is not said twice"
    assert "µin" not in text
