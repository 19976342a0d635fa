"""Measurements there and back, files that chance has spoilt, and the page that describes them."""

from __future__ import annotations

import random
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import truepose as tp
from build_machine import machine_files
from made_measurement_files import GOOD, HEAD, TABLE, read, several
from made_measurements import made_measurements, poses_within
from sweeps import thinned
from truepose.calibration import Measurements, joined, read_measurements, write_measurements
from truepose.calibration.instruments import FRAME_FREEDOMS, REGISTRY, Frame, Instrument
from truepose.calibration.measurements.write_csv import measurements_text
from truepose.errors import CATALOGUE, RequestError, TrueposeError
from truepose.machine import Condition, Machine

ROOT = Path(__file__).parents[3]
MACHINES = ROOT / "machines"
SPACE = ("x", "y", "z", "rx", "ry", "rz")


@pytest.fixture(scope="module")
def slider() -> Machine:
    return tp.load(MACHINES / "planar_two_slider.toml")


# There and back.


def same_numbers(one: Measurements, other: Measurements, rounding: float) -> None:
    for name in ("instrument", "held_out", "row", "observable", "strut"):
        assert np.array_equal(getattr(one, name), getattr(other, name)), name
    assert (one.other_joints is None) == (other.other_joints is None)
    of_two = ("other_joints",) if other.other_joints is not None else ()
    for name in ("joints", *of_two, "value", "uncertainty"):
        assert np.allclose(getattr(one, name), getattr(other, name), rtol=rounding, atol=0), name
    assert np.allclose(one.placements, other.placements, rtol=0, atol=1e-10)
    for mine, others in zip(one.instruments, other.instruments, strict=True):
        assert numbers_in(mine) == pytest.approx(numbers_in(others), rel=rounding, abs=0)
        assert replace(mine, frame=Frame(), target=(0, 0, 0), uncertainty={}) == replace(
            others, frame=Frame(), target=(0, 0, 0), uncertainty={}
        )
        assert mine.frame.unknown == others.frame.unknown
    for mine, others in zip(one.conditions, other.conditions, strict=True):
        assert mine.wrench == pytest.approx(others.wrench, rel=rounding, abs=0)
        for part in ("default", *others.part_temperatures):
            assert mine.temperature(part) == pytest.approx(others.temperature(part), rel=rounding)


def numbers_in(instrument: Instrument) -> list[float]:
    frame = instrument.frame
    return [*frame.origin, *frame.rotation, *instrument.target, *instrument.uncertainty.values()]


def made_of_every_kind(machine: Machine) -> Measurements:
    """Every kind that sees something of the machine, at poses of its own, some warm and loaded."""
    reference = machine.condition.reference_temperature
    warm = machine.condition.replace(
        temperature={"default": reference + 4.321, machine.parts[0]: reference + 0.1},
        force=(1.0, -2.2, 0.0),
        moment=(0.0, 0.0, 0.3),
        envelope=0.0,
    )
    plain = Condition(
        reference_temperature=reference,
        default_temperature=warm.default_temperature,
        part_temperatures=dict(warm.part_temperatures),
        force=warm.force,
        moment=warm.moment,
        gravity=warm.gravity,
        acceleration=warm.acceleration,
    )
    parts = []
    for number, (name, kind) in enumerate(REGISTRY.items()):
        if not kind.observed(machine.components):
            continue
        turn = np.array([0.3, -0.4, 0.5, 0.6 + 0.1 * number])
        turn /= np.linalg.norm(turn)
        plainly = kind.frame is None
        made = made_measurements(
            machine,
            name,
            poses_within(machine, 3, seed=number),
            name=name,
            frame=Frame()
            if plainly
            else Frame(
                (0.1 * number, 1.0 / 3.0, -0.7),
                tuple(turn.tolist()),
                (True, False, bool(number % 2), False, True, False),
            ),
            target=(0.0, 0.01, 1.0 / 30.0) if kind.has_target else (0.0, 0.0, 0.0),
            target_unknown=kind.has_target and number % 2 == 0,
            bias_unknown=number % 3 == 0,
            condition=plain if number % 2 else None,
            held_out=[False, True, False],
            values="zero" if name == "contact" else "nominal",
        )
        random_numbers = np.random.default_rng(number)
        uncertainty = 1e-5 * random_numbers.uniform(1.0, 2.0, made.n_observation)
        parts.append(made.with_values(made.value, uncertainty))
    return joined(*parts)


@pytest.mark.parametrize("path", machine_files(), ids=lambda path: path.stem)
def test_written_measurements_are_read_back(tmp_path: Path, path: Path) -> None:
    machine = tp.load(path)
    made = made_of_every_kind(machine)
    file = tmp_path / "measured.csv"
    write_measurements(file, machine, made)
    found = read_measurements(file, machine)
    same_numbers(found, made, 4.5e-16)
    # What has been in the file's units once stays as it is.
    write_measurements(tmp_path / "again.csv", machine, found)
    again = read_measurements(tmp_path / "again.csv", machine)
    same_numbers(again, found, 0.0)
    assert (again.instruments, again.conditions) == (found.instruments, found.conditions)


def test_what_no_file_can_say_is_not_written(tmp_path: Path, slider: Machine) -> None:
    file = tmp_path / "measured.csv"
    file.write_text("before")
    poses = poses_within(slider, 2)
    steep = Condition(gradients={"strut.1": (1.0, 0.0, 0.0)})
    made = made_measurements(slider, "position", poses, condition=steep)
    contact = made_measurements(slider, "contact", poses, values="nominal")
    for bad_one in (made, contact):
        with pytest.raises(RequestError) as error:
            write_measurements(file, slider, bad_one)
        assert [p.code for p in error.value.problems] == ["bad-measurements"]
    with pytest.raises(RequestError) as error:
        write_measurements(tmp_path / "no" / "m.csv", slider, made.select([False, False]))
    assert [p.code for p in error.value.problems] == ["output-not-writable"]
    assert file.read_text() == "before"
    assert [each.name for each in tmp_path.iterdir()] == ["measured.csv"]


# Files that chance has spoilt.

PIECES = (
    "",
    ",",
    ";",
    '"',
    "#:",
    "#",
    "nan",
    "-1",
    "0",
    "1e999",
    "unknown",
    "[",
    "{",
    "\n",
    "\r",
    "\x00",
    "µm",
    "(mm)",
    "(degC)",
    "strut.",
    "joint.d1 (mm)",
    "instrument",
    ".uncertainty",
    "= 3",
    "= []",
    "[instrument.x]",
    "[[instrument]]",
)


@pytest.mark.parametrize("seed", thinned(range(8)))
def test_no_spoilt_file_crashes_the_reader(tmp_path: Path, slider: Machine, seed: int) -> None:
    chance = random.Random(seed)  # noqa: S311 no secret is made of it
    texts = [several(), GOOD, measurements_text(slider, made_of_every_kind(slider))]
    path = tmp_path / "measured.csv"
    for _ in range(120):
        path.write_bytes(spoilt(chance, chance.choice(texts)))
        found = read_or_refused(path, slider)
        if isinstance(found, Measurements):
            assert np.isfinite(found.value).all()
            assert np.isfinite(found.placements).all()
            assert (found.uncertainty > 0.0).all()
            assert np.isin(found.instrument, range(len(found.instruments))).all()
        else:
            assert found.problems
            assert all(problem.found and problem.expected for problem in found.problems)


def read_or_refused(path: Path, machine: Machine) -> Measurements | TrueposeError:
    try:
        return read_measurements(path, machine)
    except TrueposeError as error:
        return error


def spoilt(chance: random.Random, text: str) -> bytes:
    for _ in range(chance.randint(1, 3)):
        at = chance.randrange(len(text) + 1)
        what = chance.randrange(5)
        if what == 0:
            text = text[:at] + chance.choice(PIECES) + text[at:]
        elif what == 1:
            text = text[:at] + text[at + chance.randint(1, 30) :]
        elif what == 2:
            text = in_cells(chance, text)
        elif what == 3:
            lines = text.split("\n")
            one, other = chance.randrange(len(lines)), chance.randrange(len(lines))
            lines[one], lines[other] = lines[other], lines[one]
            text = "\n".join(lines)
        else:
            text = text[:at] + chr(chance.choice([0, 9, 34, 65533, 10, 44, 91])) + text[at + 1 :]
    content = text.encode()
    if chance.random() < 0.1:
        at = chance.randrange(len(content) + 1)
        content = content[:at] + bytes([chance.randrange(256)]) + content[at:]
    return content


def in_cells(chance: random.Random, text: str) -> str:
    """A cell replaced, or two exchanged."""
    lines = text.split("\n")
    at = chance.randrange(len(lines))
    cells = lines[at].split(",")
    one, other = chance.randrange(len(cells)), chance.randrange(len(cells))
    if chance.random() < 0.5:
        cells[one] = chance.choice(PIECES)
    else:
        cells[one], cells[other] = cells[other], cells[one]
    lines[at] = ",".join(cells)
    return "\n".join(lines)


@given(
    st.lists(
        st.sampled_from([*PIECES, *HEAD.splitlines(True), TABLE, "300", "200,", "\n"]), max_size=30
    )
)
@settings(
    max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
def test_no_text_crashes_the_reader(tmp_path: Path, slider: Machine, pieces: Sequence[str]) -> None:
    path = tmp_path / "measured.csv"
    path.write_text("".join(pieces), encoding="utf-8", newline="")
    with pytest.raises(TrueposeError):
        read_measurements(path, slider)


# The page.


def page() -> str:
    return (ROOT / "docs" / "measurements.md").read_text(encoding="utf-8")


def rows_of_kinds() -> list[str]:
    """The rows that the page's table of kinds must have."""
    rows = []
    for kind in REGISTRY.values():
        dots = "strut.N." if kind.of_struts else ""
        columns = " ".join(f"`{dots}{word}`" for word in kind.reads) or "none"
        columns = columns if kind.poses else "`parameter.NAME`"
        unknown = "no frame"
        if kind.frame is not None:
            flags = kind.frame(kind.observed(SPACE), SPACE)
            unknown = " ".join(n for n, flag in zip(FRAME_FREEDOMS, flags, strict=True) if flag)
        rows.append(f"| [`{kind.name}`](#{kind.name}) | {columns} | {kind.doc} | {unknown} |")
    return rows


def examples() -> list[str]:
    return re.findall(r"```csv\n(.*?)```", page(), re.DOTALL)


def test_the_page_has_every_kind() -> None:
    table = re.findall(r"^\| \[`.*$", page(), re.MULTILINE)
    assert table == rows_of_kinds()
    named = set(re.findall(r'^#: kind = "(.*)"$', page(), re.MULTILINE))
    assert named == set(REGISTRY)
    assert re.findall(r"^### (.*)$", page(), re.MULTILINE) == list(REGISTRY)


@pytest.mark.parametrize("example", examples(), ids=lambda text: text.split('"')[1])
def test_the_examples_of_the_page_are_read(tmp_path: Path, example: str) -> None:
    machine = tp.load(MACHINES / "linear_delta.toml")
    found = read(tmp_path, example, machine)
    assert found.n_observation >= found.n_row > 0


def test_the_python_example_of_the_page_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (example,) = re.findall(r"```python\n(.*?)```", page(), re.DOTALL)
    (tmp_path / "machines").symlink_to(MACHINES)
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    exec(example, names)  # noqa: S102 the page is ours
    found = read_measurements("measured.csv", names["machine"])
    assert [each.name for each in found.instruments] == ["tracker", "probe"]
    same_numbers(found, names["both"], 4.5e-16)


def test_the_page_names_the_codes() -> None:
    codes = re.findall(r"`([a-z]+(?:-[a-z]+)+)`", page().partition("## What is refused")[2])
    assert set(codes) <= set(CATALOGUE)
