"""Limits of a size, as drawings write them."""

from __future__ import annotations

import pytest

from truepose.files.size_limits import read_size_limits
from truepose.files.units import FileUnit, QuantityError, UnitSystem

MM = UnitSystem({"length": FileUnit("mm", 1e-3), "angle": FileUnit("deg", 0.01)})


@pytest.mark.parametrize(
    ("text", "lower", "upper"),
    [
        ("+0.025 0", 0.0, 0.025),
        ("0 -0.1", -0.1, 0.0),
        ("0  +0.025", 0.0, 0.025),
        ("+0.025 mm / -0.01 mm", -0.01, 0.025),
        ("+25 um -10 um", -0.01, 0.025),
        ("+25um-10um", -0.01, 0.025),
        ("+-0.05", -0.05, 0.05),
        ("±50 um", -0.05, 0.05),
        (0.05, -0.05, 0.05),
        ([0, 0.025], 0.0, 0.025),
    ],
)
def test_limits_are_read_either_way_round(text: object, lower: float, upper: float) -> None:
    band = read_size_limits(text, "length", MM).band(0.04)
    assert band.lower == pytest.approx(1e-3 * lower, abs=1e-18)
    assert band.upper == pytest.approx(1e-3 * upper, abs=1e-18)


@pytest.mark.parametrize(
    ("text", "code"),
    [("0.1 deg", "wrong-dimension"), ("+0.1 deg 0", "wrong-dimension"), ("wide", "unknown-unit")],
)
def test_what_are_no_limits_is_refused(text: str, code: str) -> None:
    with pytest.raises(QuantityError) as refused:
        read_size_limits(text, "length", MM)
    assert refused.value.code == code
