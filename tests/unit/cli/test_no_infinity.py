"""Machines that are nearly singular, degenerate or of absurd sizes: a status or a problem."""

from __future__ import annotations

import json
import re
from itertools import product
from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from command_line import MACHINES, call
from sweeps import thinned

COMMANDS = (
    ("check",),
    ("budget",),
    ("compensate",),
    ("montecarlo", "--samples", "200"),
    ("bounds",),
    ("shares", "--samples", "8"),
)
NO_NUMBER = re.compile(r"(?i)(?<![\w.])[+-]?(inf|infinity|nan)(?![\w.])")
FEWER = re.compile(r"^grid = .*$", re.MULTILINE)
AXIS = re.compile(r"^axis = .*$", re.MULTILINE)


def with_axis(name: str, drive: int, axis: str) -> str:
    """A machine of the library with the axis of one of its drives turned."""
    text = (MACHINES / f"{name}.toml").read_text(encoding="utf-8")
    at = [match.span() for match in AXIS.finditer(text)][drive]
    return text[: at[0]] + f"axis = {axis}" + text[at[1] :]


TURNED = [with_axis("linear_delta", drive, "[-1, 0, 1]") for drive in range(3)]


def answers(path: Path, command: tuple[str, ...], capsys: pytest.CaptureFixture[str]) -> None:
    """Every form of a command's answer: a number, a word, or a problem and exit code 2."""
    name, *options = command
    for form in ("table", "json", "csv"):
        outcome = call(capsys, name, path, *options, "--format", form)
        assert outcome.code in (0, 1, 2)
        assert not NO_NUMBER.search(outcome.out)
        if outcome.code == 2:
            return
        if form == "json":
            json.loads(outcome.out, parse_constant=pytest.fail)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: command[0])
@pytest.mark.parametrize("drive", thinned(range(3), {1}))
def test_a_delta_with_a_turned_axis(
    drive: int, command: tuple[str, ...], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "machine.toml"
    text = FEWER.sub("grid = { x = [-80, 40, 4], y = [0, 40, 2], z = [0, 50, 2] }", TURNED[drive])
    path.write_text(text, encoding="utf-8")
    answers(path, command, capsys)


def test_a_band_that_has_no_bound_is_no_yes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The second guideway turned: some poses are so near to singular that no law bounds them."""
    path = tmp_path / "machine.toml"
    path.write_text(TURNED[1], encoding="utf-8")
    machine = tp.load(path, ["accuracy.target=10 m"])
    found = tp.compensate(machine)
    proven = found.proven.values
    assert proven.any()
    assert not proven.all()
    for variable in ("joint_corrected", "bound", "residual_lower", "residual_upper"):
        assert np.isfinite(found[variable]).all()
    assert (np.isfinite(found.second_order).all("component").values == proven).all()
    # There the errors of the lengths are carried to the tool more than anywhere else.
    kernel = machine.kernel
    lengths = kernel.sensitivity(machine.poses()[found["pose"].values])
    lengths = lengths[:, :3, kernel.length_parameters]
    largest = np.linalg.svd(lengths, compute_uv=False)[:, 0]
    assert largest[~proven].min() >= np.quantile(largest, 0.9)
    outcome = call(capsys, "check", path, "--set", "accuracy.target=10 m", "--format", "json")
    after = next(a for a in json.loads(outcome.out)["answers"] if a["state"].startswith("after"))
    assert (after["answer"], after["met"], after["bound"]) == ("undecided", False, None)
    assert 0 < after["witness"] < 10_000
    assert after["rests_on"].startswith("no proof within ")
    shown = call(capsys, "check", path, "--set", "accuracy.target=10 m").out
    odd, _, answer = shown.partition("\n\n")
    assert odd.startswith("looks odd[")
    where, first, *_ = answer.splitlines()
    assert where.strip().startswith("At 112 of the workspace's 125 poses ONLY")
    assert first.startswith("undecided  position before compensation: ")
    assert " µm or more, asked 10 m (10000000 µm), at " in first
    assert "; no proof within " in first


@pytest.mark.parametrize(
    ("name", "axis"),
    list(product(["linear_delta", "planar_two_slider"], ["[0, 0, 0]", "[1, 0, 0]"])),
)
def test_degenerate_axes(
    name: str, axis: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "machine.toml"
    text = with_axis(name, 0, axis)
    if name == "linear_delta":
        text = FEWER.sub("grid = { x = [-80, 80, 2], y = [0, 80, 2], z = [0, 50, 2] }", text)
    path.write_text(text, encoding="utf-8")
    for command in COMMANDS:
        answers(path, command, capsys)


@pytest.mark.parametrize("value", ["1e3", "1e49", "1e60", "1e308", "inf", "nan"])
def test_absurd_tolerances(value: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = (MACHINES / "planar_two_slider.toml").read_text(encoding="utf-8")
    path = tmp_path / "machine.toml"
    path.write_text(
        re.sub(r"(?m)^length_tolerance = .*$", f"length_tolerance = {value}", text),
        encoding="utf-8",
    )
    for command in COMMANDS:
        answers(path, command, capsys)
    outcome = call(capsys, "check", path)
    if value in ("1e3", "1e49"):
        # A band is no error of the file: some machine inside it is the witness of a no.
        assert outcome.code == 1
        lost = "NOT met  position before compensation: a machine that cannot be assembled"
        odd, _, answer = outcome.out.partition("\n\n")
        assert odd.startswith("looks odd[wide-tolerance]")
        assert answer.splitlines()[1].startswith(lost)
        return
    assert outcome.code == 2
    assert outcome.codes[0] == ("too-large" if value in ("1e60", "1e308") else "not-finite")
