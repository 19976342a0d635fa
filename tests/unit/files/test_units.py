"""Quantities of a file: units of bare numbers, units in text, and the dimension check."""

from __future__ import annotations

import math
from decimal import Decimal

import numpy as np
import pytest

from truepose.files.dimensions import DIMENSIONS
from truepose.files.units import FileUnit, QuantityError, UnitSystem, default_units, meant, unit_of

DECLARED = {"length": "mm", "angle": "deg", "force": "kN", "temperature": "degC"}


def unit(text: str, dimension: str) -> FileUnit:
    return unit_of(text, DIMENSIONS[dimension])


@pytest.fixture(name="units")
def units_of_a_file() -> UnitSystem:
    return UnitSystem({name: unit(text, name) for name, text in DECLARED.items()})


@pytest.mark.parametrize(
    ("value", "dimension", "expected"),
    [
        (500, "length", 0.5),
        (0.3, "length", 0.0003),
        (90, "angle", math.pi / 2),
        (1.2, "force", 1200.0),
        (20, "temperature", 293.15),
        (2, "temperature_difference", 2.0),
        (-0.25, "ratio", -0.25),
        ("500", "length", 0.5),
        ("0.02 in", "length", 0.000508),
        (" -3um ", "length", -3e-6),
        ("3 µm", "length", 3e-6),  # micro sign
        ("3 μm", "length", 3e-6),  # Greek mu
        ("28.27 mm^2", "area", 28.27e-6),
        ("28.27 mm²", "area", 28.27e-6),
        ("210 GPa", "stress", 210e9),
        ("3000 N/mm^2", "stress", 3e9),
        ("1.1e-5 1/K", "expansion", 1.1e-5),
        ("1.1e-5/K", "expansion", 1.1e-5),
        ("11 ppm/K", "expansion", 1.1e-5),
        ("1.1e-5 1/degC", "expansion", 1.1e-5),
        ("50 N/um", "stiffness", 50e6),
        ("3 N m", "moment", 3.0),
        ("3 arcmin", "angle", math.pi / 3600),
        ("30°", "angle", math.pi / 6),
        ("0.1 mrad", "angle", 1e-4),
        ("300 K", "temperature", 300.0),
        ("68 degF", "temperature", 293.15),
        ("20 °C", "temperature", 293.15),
        ("2 K", "temperature_difference", 2.0),
        ("2 delta_degC", "temperature_difference", 2.0),
        ("9 delta_degF", "temperature_difference", 5.0),
        ("5 %", "ratio", 0.05),
    ],
)
def test_a_quantity_becomes_si(
    units: UnitSystem, value: object, dimension: str, expected: float
) -> None:
    assert units.read(value, dimension) == pytest.approx(expected, rel=1e-15, abs=0)


@pytest.mark.parametrize(
    ("value", "dimension", "code", "message"),
    [
        ("3 N", "length", "wrong-dimension", "expected a length, found a force"),
        ("3 mm", "force", "wrong-dimension", "expected a force, found a length"),
        ("3 mm", "angle", "wrong-dimension", "expected an angle, found a length"),
        ("3 %", "angle", "wrong-dimension", "expected an angle, found a plain number"),
        ("3 rad", "ratio", "wrong-dimension", "expected a plain number, found an angle"),
        ("3 degC", "temperature_difference", "wrong-dimension", "difference, found a temperature"),
        ("3 delta_degC", "temperature", "wrong-dimension", "found a temperature difference"),
        ("3 kg/m^3", "length", "wrong-dimension", "found a quantity in kg/m³"),
        ("3 C", "temperature", "wrong-dimension", "expected a temperature"),
        (3, "area", "no-unit", "no unit declared for an area"),
        ("3", "stress", "no-unit", "no unit declared for a stress"),
        (math.nan, "length", "not-finite", "not finite"),
        (10**400, "length", "not-finite", "not finite"),
        ("inf mm", "length", "not-finite", "not finite"),
        ("1e309 mm", "length", "not-finite", "not finite"),
        ("1e308 km", "length", "not-finite", "not finite"),
        ("1e54 mm", "length", "too-large", "far too large for any machine"),
        (-1e54, "length", "too-large", "far too large for any machine"),
        (True, "length", "wrong-type", "expected a length, found true or false"),
        ([3], "length", "wrong-type", "expected a length, found a list"),
        ("", "length", "unknown-unit", "not a number with a unit"),
        ("three mm", "length", "unknown-unit", "not a number with a unit"),
        ("3 mmm", "length", "unknown-unit", 'unknown unit "mmm"'),
        ("3 m^9^9^9^9", "length", "unknown-unit", "unknown unit"),
        ("3 m^(9**99)", "length", "unknown-unit", "unknown unit"),
        ("3 __import__('os')", "length", "unknown-unit", "unknown unit"),
        ("3 m;", "length", "unknown-unit", "unknown unit"),
        ("3 " + "(" * 50 + "m", "length", "unknown-unit", "unknown unit"),
    ],
)
def test_what_is_not_the_quantity_wanted(
    units: UnitSystem, value: object, dimension: str, code: str, message: str
) -> None:
    with pytest.raises(QuantityError, match=r".") as caught:
        units.read(value, dimension)
    assert caught.value.code == code
    assert message in caught.value.message
    assert caught.value.found
    assert caught.value.expected


def test_a_temperature_difference_goes_by_the_degree_of_the_declared_temperature() -> None:
    units = UnitSystem({"temperature": unit("degF", "temperature")})
    assert units.read(9, "temperature_difference") == pytest.approx(5.0, rel=1e-15)
    assert units.read(32, "temperature") == pytest.approx(273.15, rel=1e-15)


def test_no_temperature_declared_is_none_for_a_difference() -> None:
    with pytest.raises(QuantityError, match="no unit declared for a temperature difference"):
        UnitSystem({}).read(9, "temperature_difference")


@pytest.mark.parametrize("text", ["mm", "in", "um", "m", "ft"])
def test_file_units_go_both_ways(text: str) -> None:
    length = unit(text, "length")
    values = np.array([0.1, 0.3, 123.456, -7.0, 604.8652])
    assert length.to_file(length.to_si(values)) == pytest.approx(values, rel=4e-16, abs=0)


def test_millimetres_come_back_as_they_were_written() -> None:
    millimetre = unit("mm", "length")
    written = np.round(np.arange(1, 2000) * 0.1, 1)
    assert (millimetre.to_si(written) == written / 1000).all()
    assert np.abs(millimetre.to_file(millimetre.to_si(written)) / written - 1).max() < 3e-16


def test_temperatures_go_both_ways() -> None:
    celsius = unit("degC", "temperature")
    assert celsius.to_si(20.0) == 293.15
    assert celsius.to_file(308.15) == 35.0
    tenths = [Decimal(n) / 10 for n in range(-500, 1000)]
    kelvins = np.array([float(tenth + Decimal("273.15")) for tenth in tenths])
    assert celsius.to_file(kelvins).tolist() == [float(tenth) for tenth in tenths]


def test_every_dimension_has_an_si_unit_that_measures_it() -> None:
    for name, dimension in DIMENSIONS.items():
        if name != "ratio":
            assert unit_of(dimension.si, dimension).scale == 1.0
        assert UnitSystem({}).read(dimension.example, name) != 0.0
    assert default_units().keys() == DIMENSIONS.keys()


@pytest.mark.parametrize(
    ("computed", "text"),
    [
        (124.99999999999999, "125.0"),
        (350.00000000000006, "350.0"),
        (-0.30000000000000004, "-0.3"),
        (62.50000000000023, "62.5"),
        (1e-9 * (1.0 + 2.3e-16), "1e-09"),
        (1234567890.0000005, "1234567890.0"),
        (6.0220000000000003e23, "6.022e+23"),
        (0.0, "0.0"),
        (math.inf, "inf"),
        (math.nan, "nan"),
    ],
)
def test_what_is_meant(computed: float, text: str) -> None:
    assert repr(float(meant(computed))) == text


def test_what_has_all_digits_keeps_them() -> None:
    """By decimal arithmetic: changed is what a number of ten digits lies 5e-15 from, or less."""
    random = np.random.default_rng(13)
    values = random.uniform(1.0, 10.0, 3000) * 10.0 ** random.integers(-10, 10, 3000)
    close = np.array([float(f"{value:.5g}") for value in values[:1000]])
    close *= 1.0 + random.uniform(-8e-15, 8e-15, 1000)
    near = np.concatenate([values, -close])
    for value, found in zip(near.tolist(), meant(near).tolist(), strict=True):
        few = float(f"{value:.9e}")
        off = abs(Decimal(few) - Decimal(value)) / abs(Decimal(value))
        if off < Decimal("4.5e-15"):
            assert found == few
        elif off > Decimal("5.5e-15"):
            assert found == value
    # Of numbers of all digits one in ten thousand at most lies as near: twice 5e-15 in 1e-10.
    assert np.mean(meant(values) == values) > 0.998


def test_a_file_is_given_what_was_meant() -> None:
    inch = unit_of("in", DIMENSIONS["length"])
    millimetre = unit_of("mm", DIMENSIONS["length"])
    degree = unit_of("deg", DIMENSIONS["angle"])
    tenths = [Decimal(n) / 10 for n in range(1, 2000, 7)]
    for unit, si in ((inch, Decimal("0.0254")), (millimetre, Decimal("0.001"))):
        values = [float(tenth * si) for tenth in tenths]
        assert [repr(float(x)) for x in unit.to_file(values)] == [repr(float(t)) for t in tenths]
    assert [float(x) for x in degree.to_file(np.deg2rad([float(t) for t in tenths]))] == [
        float(t) for t in tenths
    ]
