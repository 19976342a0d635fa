"""Ratios and slopes: outright, within limits, as a rise over a length."""

from __future__ import annotations

import pytest

from truepose.files.dimensions import DIMENSIONS
from truepose.files.ratio import read_ratio, read_slope
from truepose.files.tolerance import Band, read_within
from truepose.files.units import QuantityError, UnitSystem, unit_of

UNITS = UnitSystem(
    {
        "length": unit_of("mm", DIMENSIONS["length"]),
        "angle": unit_of("deg", DIMENSIONS["angle"]),
    }
)
DEG = 0.017453292519943295


@pytest.mark.parametrize(
    ("written", "ratio"),
    [
        (1.5e-5, 1.5e-5),
        ("12 ppm", 12e-6),
        ("20 um/m", 20e-6),
        ("20 um / 300 mm", 20e-6 / 0.3),
        ("-20 um / .3 m", -20e-6 / 0.3),
        ("0.001/12 in", 0.001 / 304.8),
        ("10 arcsec / 360 deg", 10 / 3600 / 360),
        ("3 %", 0.03),
    ],
)
def test_every_way_to_write_a_ratio(written: object, ratio: float) -> None:
    assert read_ratio(written, UNITS) == pytest.approx(ratio, rel=1e-12)


@pytest.mark.parametrize(
    ("written", "slope"),
    [
        (0.5, 0.5 * DEG),
        ("0.5 deg", 0.5 * DEG),
        ("20 urad", 20e-6),
        ("20 um/m", 20e-6),
        ("6 um / 300 mm", 20e-6),
        ("0.02/1000", 20e-6),
    ],
)
def test_every_way_to_write_a_slope(written: object, slope: float) -> None:
    assert read_slope(written, UNITS) == pytest.approx(slope, rel=1e-12)


@pytest.mark.parametrize(
    ("written", "known", "band"),
    [
        ("12 ppm", True, (12e-6, 12e-6)),
        ("-12 ppm", True, (-12e-6, -12e-6)),
        ("12 ppm", False, (-12e-6, 12e-6)),
        ("+-12 ppm", True, (-12e-6, 12e-6)),
        ("± 12 ppm", False, (-12e-6, 12e-6)),
        (["-2 ppm", 1e-5], True, (-2e-6, 1e-5)),
        (["4 um / 2 m", "4 um / 2 m"], False, (2e-6, 2e-6)),
    ],
)
def test_one_value_is_known_or_a_half_band(
    written: object, known: bool, band: tuple[float, float]
) -> None:
    found = read_within(written, lambda each: read_ratio(each, UNITS), "a ratio", known=known)
    assert isinstance(found, Band)
    assert (found.lower, found.upper) == pytest.approx(band, rel=1e-12)


@pytest.mark.parametrize(
    ("written", "code"),
    [
        ("20 um / 300 deg", "wrong-dimension"),
        ("20 N / 300 mm", "wrong-dimension"),
        ("20 um / 0 mm", "not-positive"),
        ("20 um", "wrong-dimension"),
        ("3 um / 300 furlongz", "unknown-unit"),
        ("3 um / 4 mm / 5 mm", "unknown-unit"),
        (True, "wrong-type"),
        (None, "wrong-type"),
        ({}, "wrong-type"),
        (float("nan"), "not-finite"),
    ],
)
@pytest.mark.parametrize("read", [read_ratio, read_slope])
def test_what_is_neither(read: object, written: object, code: str) -> None:
    with pytest.raises(QuantityError) as caught:
        read(written, UNITS)  # type: ignore[operator]
    assert caught.value.code == code
    assert caught.value.expected
