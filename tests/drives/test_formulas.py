"""Every kind of drive has its formulas here, and they agree with themselves."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from build_machine import described, deviated
from drive_kinds import KINDS, Row, fields_of, formulas, is_strut

STEP = 1e-6
"""Of a central difference, m and rad: cut-off and rounding leave some 1e-10."""
LENGTH = 3.0


def drive_of(kind: str, random: np.random.Generator) -> Row:
    """A row with a number, anything, in every field of the kind."""
    drawn = {
        field["name"]: random.normal(size=field["shape"] or None)
        for field in fields_of(kind)
        if field["name"] not in ("offset", "scale")
    }
    return {"kind": kind, "offset": 0.0, "scale": 1.0} | {
        name: value.tolist() if isinstance(value, np.ndarray) else value
        for name, value in drawn.items()
    }


@pytest.mark.parametrize("kind", KINDS)
def test_a_kind_has_its_formulas(kind: str) -> None:
    path = Path(__file__).with_name(f"{kind}.py")
    assert path.exists(), f"{path} is to say how a drive of kind {kind} moves (drive_kinds.py)"


@pytest.mark.parametrize("kind", KINDS)
def test_slopes_are_how_the_centre_moves(kind: str) -> None:
    random = np.random.default_rng(1)
    drive, base, actual = drive_of(kind, random), random.normal(size=3), float(random.normal())
    slopes = formulas(kind).slopes(drive, base, actual)
    names = {parameter["name"] for parameter in KINDS[kind]["parameters"]} - {"scale"}
    assert set(slopes) == (set() if is_strut(kind) else names)
    machine = described(["x"], [drive], [])
    for name, slope in slopes.items():
        ends = []
        for step in (STEP, -STEP):
            (row,) = deviated(machine, {f"drive.d1.{name}": step})["drives"]
            ends.append(formulas(kind).centre(row, base, actual + row["offset"]))
        assert np.abs((ends[0] - ends[1]) / (2 * STEP) - slope).max() < 1e-8


@pytest.mark.parametrize("kind", KINDS)
def test_a_strut_reaches_at_the_roots(kind: str) -> None:
    random = np.random.default_rng(2)
    reached = 0
    for _ in range(50):
        drive, base, platform = drive_of(kind, random), *random.normal(size=(2, 3))
        for actual in formulas(kind).roots(drive, base, platform, LENGTH):
            reached += 1
            away = platform - formulas(kind).centre(drive, base, actual)
            length = actual if is_strut(kind) else LENGTH
            assert np.linalg.norm(away) == pytest.approx(length, abs=1e-9)
    assert reached > 0
