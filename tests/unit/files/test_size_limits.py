"""Limits of a size as drawings write them."""

from __future__ import annotations

import pytest

from truepose.files.size_limits import read_size_limits
from truepose.files.units import FileUnit, QuantityError, UnitSystem

UNITS = UnitSystem({"length": FileUnit("mm", 1e-3)})


@pytest.mark.parametrize(
    ("text", "lower", "upper"),
    [
        ("+0.025 0", 0.0, 0.025),
        ("0 +0.025", 0.0, 0.025),
        ("0 -0.1", -0.1, 0.0),
        ("0  +0.025", 0.0, 0.025),
        ("+25um-10um", -0.01, 0.025),
        ("+0.025 mm 0 mm", 0.0, 0.025),
        ("+0.025 mm / 0 mm", 0.0, 0.025),
        ("+0.025/0", 0.0, 0.025),
        ("+0.025, -0.01", -0.01, 0.025),
        ("+0.025-0.01", -0.01, 0.025),
        ("+25 µm -10 µm", -0.01, 0.025),
        ("+25 0 um", 0.0, 0.025),
        ("+25 um 0", 0.0, 0.025),
        ("-0.007 -0.02", -0.02, -0.007),
        ("±0.05 mm", -0.05, 0.05),
        ("+-0.05", -0.05, 0.05),
        ("+/-0.05 mm", -0.05, 0.05),
        (0.05, -0.05, 0.05),
        ([-0.01, 0.02], -0.01, 0.02),
        (["-10 um", "0.02 mm"], -0.01, 0.02),
        ("H7", 0.0, 0.025),
        ("H 7", 0.0, 0.025),
        ("h7", -0.025, 0.0),
        ("JS7", -0.0125, 0.0125),
        ("js7", -0.0125, 0.0125),
    ],
)
def test_limits_of_40_mm(text: object, lower: float, upper: float) -> None:
    """IT7 of 40 mm is 25 um (ISO 286-1)."""
    band = read_size_limits(text, "length", UNITS).band(0.04)
    assert band.lower == pytest.approx(lower * 1e-3, abs=1e-15)
    assert band.upper == pytest.approx(upper * 1e-3, abs=1e-15)


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("g6", "unknown-tolerance-class"),
        ("H99", "unknown-tolerance-class"),
        ([0.02, -0.01], "tolerance-reversed"),
        ([0.02], "wrong-type"),
        (-0.05, "negative"),
        (True, "wrong-type"),
        ("wide", "unknown-unit"),
        ("+0.025 kg 0 kg", "wrong-dimension"),
        ("", "unknown-unit"),
    ],
)
def test_limits_that_are_none(text: object, code: str) -> None:
    with pytest.raises(QuantityError) as caught:
        read_size_limits(text, "length", UNITS)
    assert caught.value.code == code


def test_an_angle_has_no_class() -> None:
    units = UnitSystem({"angle": FileUnit("deg", 0.1)})
    assert read_size_limits("+0.1 -0.2", "angle", units).band(1.0).lower == pytest.approx(-0.02)
    with pytest.raises(QuantityError) as caught:
        read_size_limits("H7", "angle", units)
    assert caught.value.code == "unknown-tolerance-class"
