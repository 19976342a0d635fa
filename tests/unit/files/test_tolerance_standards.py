"""ISO 2768-1 and ISO 286-1 classes, and tolerances as a file writes them."""

from __future__ import annotations

import math

import pytest

from truepose.files.dimensions import DIMENSIONS
from truepose.files.tolerance import Band, read_tolerance
from truepose.files.tolerance_standards import (
    ToleranceClassError,
    canonical,
    designations,
    half_band,
)
from truepose.files.units import QuantityError, UnitSystem, unit_of

ARCMIN = math.pi / 10800
UNITS = UnitSystem(
    {
        "length": unit_of("mm", DIMENSIONS["length"]),
        "angle": unit_of("deg", DIMENSIONS["angle"]),
    }
)


@pytest.mark.parametrize(
    ("designation", "nominal_mm", "expected_um"),
    [
        ("ISO 2768-f", 500, 300),
        ("ISO 2768-m", 500, 800),
        ("ISO 2768-c", 2.5, 200),
        ("ISO 2768-v", 5, 500),
        ("ISO 2768-m", 3000, 2000),
        # "up to and including": a limit belongs to the smaller range
        ("ISO 2768-m", 400, 500),
        ("ISO 2768-m", 400.001, 800),
        ("IT7", 3, 5),
        ("IT7", 3.001, 6),
        # the whole width is tabulated: 63 um for IT7 over 400 up to 500 mm
        ("IT7", 500, 31.5),
        ("IT14", 500, 775),
        ("IT01", 40, 0.3),
        ("IT18", 3150, 16500),
    ],
)
def test_half_band_of_a_length(designation: str, nominal_mm: float, expected_um: float) -> None:
    assert half_band(designation, nominal_mm * 1e-3) == pytest.approx(expected_um * 1e-6, rel=1e-12)


@pytest.mark.parametrize(
    ("designation", "side_mm", "minutes"),
    [("ISO 2768-f", 10, 60), ("ISO 2768-c", 100, 30), ("ISO 2768-v", 5000, 20)],
)
def test_half_band_of_an_angle(designation: str, side_mm: float, minutes: float) -> None:
    found = half_band(designation, side_mm * 1e-3, "angle")
    assert found == pytest.approx(minutes * ARCMIN, rel=1e-12)


@pytest.mark.parametrize(
    ("designation", "nominal_mm", "words"),
    [
        ("ISO 2768-v", 2, "over 3 mm"),
        ("ISO 2768-f", 2500, "up to 2000 mm"),
        ("ISO 2768-m", 0.5, "over 0.5 mm"),
        ("IT01", 600, "up to 500 mm"),
        ("IT5", 3151, "up to 3150 mm"),
        ("IT5", 0, "over 0 mm"),
    ],
)
def test_a_size_without_a_value(designation: str, nominal_mm: float, words: str) -> None:
    with pytest.raises(ToleranceClassError) as caught:
        half_band(designation, nominal_mm * 1e-3)
    assert caught.value.code == "tolerance-out-of-range"
    assert words in caught.value.expected


@pytest.mark.parametrize(
    ("written", "name"),
    [
        ("it7", "IT7"),
        ("IT 7", "IT7"),
        ("IT01", "IT01"),
        ("ISO 2768-m", "ISO 2768-m"),
        ("iso2768-M", "ISO 2768-m"),
        ("ISO 2768-1 m", "ISO 2768-m"),
    ],
)
def test_a_class_however_it_is_spaced(written: str, name: str) -> None:
    assert canonical(written) == name


@pytest.mark.parametrize("written", ["IT19", "ISO 2768-x", "ISO 2768", "h7", "ISO 2768-1"])
def test_an_unknown_class(written: str) -> None:
    with pytest.raises(ToleranceClassError) as caught:
        canonical(written)
    assert caught.value.code == "unknown-tolerance-class"


def test_every_class_grows_with_the_size_and_with_the_grade() -> None:
    grades = [f"IT{grade}" for grade in ("01", *range(19))]
    assert set(grades) <= set(designations())
    for size in (0.002, 0.02, 0.2, 0.45):
        bands = [half_band(grade, size) for grade in grades]
        assert bands == sorted(bands)
        assert len(set(bands)) == len(bands)
    for name in designations():
        bands = [half_band(name, size) for size in (0.004, 0.04, 0.4)]
        assert bands == sorted(bands)


def test_it_grades_follow_the_standards_formula() -> None:
    """ISO 286-1: IT6 .. IT18 are 10, 16, 25, ... times i = 0.45 D^(1/3) + 0.001 D (um, mm)."""
    factors = {6: 10, 8: 25, 11: 100, 14: 400, 16: 1000}
    for low, high in ((18, 30), (80, 120), (250, 315), (400, 500)):
        mean = math.sqrt(low * high)
        unit = 0.45 * mean ** (1 / 3) + 0.001 * mean
        for grade, factor in factors.items():
            assert 2e6 * half_band(f"IT{grade}", high * 1e-3) == pytest.approx(
                factor * unit, rel=0.04
            )


@pytest.mark.parametrize(
    ("value", "lower", "upper"),
    [
        ([-0.3, 0.3], -0.3e-3, 0.3e-3),
        ([-0.15, 0.45], -0.15e-3, 0.45e-3),
        (["-1 um", 0.5], -1e-6, 0.5e-3),
        (0.02, -0.02e-3, 0.02e-3),
        (0, 0.0, 0.0),
        ("0.02 mm", -0.02e-3, 0.02e-3),
        ("±0.02 mm", -0.02e-3, 0.02e-3),
        ("+-0.02", -0.02e-3, 0.02e-3),
        ("+/- 20 um", -0.02e-3, 0.02e-3),
        ("ISO 2768-f", -0.3e-3, 0.3e-3),
        ("IT7", -31.5e-6, 31.5e-6),
    ],
)
def test_a_tolerance_as_written(value: object, lower: float, upper: float) -> None:
    band = read_tolerance(value, "length", UNITS).band(0.5)
    assert (band.lower, band.upper) == pytest.approx((lower, upper), rel=1e-12, abs=0)


def test_an_asymmetric_band_has_a_shift_and_a_half() -> None:
    band = Band(-0.15, 0.45)
    assert (band.shift, band.half) == pytest.approx((0.15, 0.30), rel=1e-15)


def test_a_class_for_an_angle_is_refused_for_nobody_knows_the_shorter_side() -> None:
    with pytest.raises(QuantityError, match="a tolerance class for an angle") as caught:
        read_tolerance("ISO 2768-m", "angle", UNITS)
    assert caught.value.code == "unknown-tolerance-class"
    assert read_tolerance("0.1 deg", "angle", UNITS).band(0.0).upper == pytest.approx(
        math.radians(0.1), rel=1e-15
    )
