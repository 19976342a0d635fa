"""D11: the worked examples of GUM, JCGM 101, NPL and NIST, linear and sampled.

Published figures in the digits published, sampled ones to a few units of the last.
"""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
import pytest
import xarray as xr
from numpy.typing import NDArray

import truepose as tp
from oracle_cases import Published, case
from truepose.uncertainty_analysis.functions.inputs import Input

Array = NDArray[np.float64]
CASE = case("d11_uncertainty")
SAMPLES = 2_000_000
SEED = 2008


def number(found: xr.DataArray) -> float:
    return float(found.squeeze())


def interval(found: xr.Dataset, kind: str = "") -> list[float]:
    return [number(found[f"{kind}{end}"]) for end in ("lower", "upper")]


def sampled(function: Any, inputs: dict[str, Input], **named: Any) -> xr.Dataset:
    return tp.monte_carlo(function, inputs, samples=SAMPLES, seed=SEED, **named)


def half_width(stated: str) -> float:
    """Of "uniform half-width 2e-6"."""
    return float(stated.rpartition(" ")[2])


class TestGumH1:
    """JCGM 100:2008, H.1: an end gauge, nm and K."""

    @staticmethod
    def length(
        ls: Array,
        d_mean: Array,
        d_random: Array,
        d_systematic: Array,
        alpha_s: Array,
        d_alpha: Array,
        d_theta: Array,
        theta_mean: Array,
        Delta: Array,
    ) -> Array:
        d, theta = d_mean + d_random + d_systematic, theta_mean + Delta
        return ls + d - ls * (d_alpha * theta + alpha_s * d_theta)

    @staticmethod
    def inputs() -> dict[str, Input]:
        made = {}
        for name, stated in CASE["gum_h1"]["inputs"].items():
            value, dof = stated["x"], stated.get("dof", np.inf)
            if "u" in stated:
                made[name] = Input.normal(value, stated["u"], dof)
                continue
            half = half_width(stated["dist"])
            if stated["dist"].startswith("arcsine"):
                made[name] = Input.arcsine(value - half, value + half)
            else:
                made[name] = Input.uniform(value - half, value + half, dof)
        return made

    @pytest.fixture
    def found(self) -> xr.Dataset:
        return tp.uncertainty(self.length, self.inputs(), probability=0.99)

    def test_estimate(self, found: xr.Dataset) -> None:
        assert round(number(found.value)) == CASE["gum_h1"]["published"]["l"]

    def test_first_and_second_order(self, found: xr.Dataset, published: Published) -> None:
        stated, reproduced = CASE["gum_h1"]["published"], CASE["gum_h1"]["reproduced"]
        first, second = number(found.standard_uncertainty), number(found.second_order_uncertainty)
        for order, ours in (("first", first), ("with_second", second)):
            theirs = stated[f"u_{order}_order"]
            what = f"GUM H.1, standard uncertainty, {order.replace('_', ' ')} order"
            published(what, theirs, ours, within=0.5, unit="nm")
        assert round(first, 3) == reproduced["u_first_order"]
        assert round(second, 3) == reproduced["u_second"]

    def test_degrees_of_freedom_and_coverage_factor(self, found: xr.Dataset) -> None:
        dof = number(found.effective_dof)
        assert round(dof, 2) == CASE["gum_h1"]["reproduced"]["dof"]
        assert int(dof) == CASE["gum_h1"]["published"]["effective_dof"]
        # H.1.6 takes 16, the next whole number below: 2.92 of 32 nm, rounded, are 93 nm.
        assert number(found.coverage_factor) == pytest.approx(2.92, abs=0.02)
        assert number(found.upper - found.value) == pytest.approx(2.904 * 31.66, abs=0.05)

    @pytest.mark.parametrize("name", CASE["gum_h1"]["published"]["components"])
    def test_components(self, name: str) -> None:
        inputs = {
            each: one if each == name else Input.exact(one.centre)
            for each, one in self.inputs().items()
        }
        alone = tp.uncertainty(self.length, inputs)
        expected = CASE["gum_h1"]["published"]["components"][name]
        assert number(alone.standard_uncertainty) == pytest.approx(expected, abs=0.05)

    def test_sampled(self) -> None:
        found = sampled(self.length, self.inputs())
        reproduced = CASE["gum_h1"]["reproduced"]["u_second"]
        assert number(found["mean"]) == pytest.approx(50000838, abs=0.1)
        assert number(found.standard_deviation) == pytest.approx(reproduced, abs=0.1)


def total(x1: Array, x2: Array, x3: Array, x4: Array) -> Array:
    return x1 + x2 + x3 + x4


def of_deviation(*deviations: float) -> dict[str, Input]:
    """Uniform inputs about 0 of these standard deviations."""
    root = np.sqrt(3.0)
    return {f"x{at}": Input.uniform(-root * s, root * s) for at, s in enumerate(deviations, 1)}


ADDITIVE = {
    "normal": {f"x{at}": Input.normal(0.0, 1.0) for at in range(1, 5)},
    "rectangular": of_deviation(1.0, 1.0, 1.0, 1.0),
    "dominant": of_deviation(1.0, 1.0, 1.0, 10.0),
}


class TestAdditive:
    """JCGM 101:2008, 9.2: Y = X1 + X2 + X3 + X4."""

    @pytest.mark.parametrize("name", ADDITIVE)
    def test_linear(self, name: str, published: Published) -> None:
        expected = CASE["jcgm101_9_2"][name]
        found = tp.uncertainty(total, ADDITIVE[name])
        assert number(found.value) == expected["y"]
        assert round(number(found.standard_uncertainty), 1) == expected["u"]
        ends = expected.get("interval95_guf", [-3.92, 3.92])
        digits = len(str(ends[1]).partition(".")[2])
        what = f"JCGM 101, 9.2, {name}: ends of the linear interval"
        published(what, ends, interval(found), within=0.5 * 10.0**-digits)

    @pytest.mark.parametrize("name", ADDITIVE)
    def test_sampled(self, name: str, published: Published) -> None:
        expected = CASE["jcgm101_9_2"][name]
        found = sampled(total, ADDITIVE[name])
        ends = expected.get("interval95_mcm") or expected["interval95"]
        slack = 0.1 if name == "dominant" else 0.02
        assert number(found.standard_deviation) == pytest.approx(expected["u"], abs=0.06)
        what = f"JCGM 101, 9.2, {name}: ends of the sampled interval"
        published(what, ends, interval(found), within=slack)

    def test_comparison(self) -> None:
        found = {
            name: tp.uncertainty(total, inputs, validate=True, digits=2, samples=SAMPLES, seed=SEED)
            for name, inputs in ADDITIVE.items()
        }
        assert bool(found["normal"].valid.all())
        # 9.2.3.4: four equal rectangular ones are valid to one digit and to two; one that
        # dominates is not.
        assert bool(found["rectangular"].valid.all())
        assert not bool(found["dominant"].valid.any())
        reason = str(found["dominant"].reason.values)
        assert "x4, which is uniform, makes 97 % of the variance" in reason


def mass(mR: Array, dmR: Array, ra: Array, rW: Array, rR: Array) -> Array:
    return (mR + dmR) * (1.0 + (ra - 1.2) * (1.0 / rW - 1.0 / rR)) - 100000.0


class TestMass:
    """JCGM 101:2008, 9.3: a weight in air, mg and kg/m^3."""

    EXPECTED = CASE["jcgm101_9_3"]

    def inputs(self) -> dict[str, Input]:
        made = {}
        for name, stated in self.EXPECTED["inputs"].items():
            first, second = (float(each) for each in stated[2:-1].split(","))
            make = Input.normal if stated[0] == "N" else Input.uniform
            made[name] = make(first, second)
        return made

    def test_linear(self) -> None:
        published = self.EXPECTED["published"]
        found = tp.uncertainty(mass, self.inputs())
        assert round(number(found.value), 3) == published["mean"]
        assert round(number(found.standard_uncertainty), 4) == published["u_guf1"]
        assert interval(found) == pytest.approx(published["interval_guf1"], abs=1e-4)

    def test_with_second_order_it_is_what_sampling_gives(self) -> None:
        # Of normal inputs, which the terms of next order assume: the published one has 0.0750.
        found = tp.uncertainty(mass, self.inputs())
        assert number(found.second_order_uncertainty) == pytest.approx(0.0750, abs=1e-4)

    def test_sampled(self, published: Published) -> None:
        stated = self.EXPECTED["published"]
        found = sampled(mass, self.inputs())
        assert number(found["mean"]) == pytest.approx(stated["mean"], abs=5e-4)
        deviation = number(found.standard_deviation)
        what = "JCGM 101, 9.3, weight: sampled standard deviation"
        published(what, stated["u_mcm"], deviation, within=2e-4, unit="mg")
        # The density is flat at its top: the shortest interval's ends wander by 0.001.
        shortest = stated["interval95_mcm_shortest"]
        assert interval(found, "shortest_") == pytest.approx(shortest, abs=0.0025)

    def test_comparison(self) -> None:
        found = tp.uncertainty(mass, self.inputs(), validate=True, digits=1, samples=SAMPLES)
        assert not bool(found.valid.any())
        assert "more than the linear one, which is of second order" in str(found.reason.values)


def power(x1: Array, x2: Array) -> Array:
    return x1**2 + x2**2


def name_of(one: dict[str, Any]) -> str:
    return f"x1 = {one['x1']}, r = {one['r']}"


class TestLossOfPower:
    """JCGM 101:2008, 9.4: dY = X1^2 + X2^2 near nothing, as the error next to a singularity."""

    CASES = CASE["jcgm101_9_4"]["cases"]
    UNIT = float(CASE["jcgm101_9_4"]["unit"])

    @staticmethod
    def known(one: dict[str, Any]) -> tuple[dict[str, Input], dict[tuple[str, str], float]]:
        inputs = {"x1": Input.normal(one["x1"], 0.005), "x2": Input.normal(0.0, 0.005)}
        return inputs, {("x1", "x2"): one["r"]}

    @pytest.mark.parametrize("one", CASES, ids=name_of)
    def test_linear(self, one: dict[str, Any]) -> None:
        inputs, correlation = self.known(one)
        found = tp.uncertainty(power, inputs, correlation=correlation)
        first = number(found.standard_uncertainty) / self.UNIT
        assert first == pytest.approx(2.0 * one["x1"] * 0.005 / self.UNIT, rel=1e-12)
        if "guf_u" in one:
            assert round(first) == one["guf_u"]
        if "guf_mean" in one:
            assert round(number(found.value) / self.UNIT) == one["guf_mean"]

    @pytest.mark.parametrize("one", CASES, ids=name_of)
    def test_with_second_order_it_is_exact(self, one: dict[str, Any]) -> None:
        inputs, correlation = self.known(one)
        found = tp.uncertainty(power, inputs, correlation=correlation)
        second = number(found.second_order_uncertainty) / self.UNIT
        # A quadratic of normal inputs has no terms of higher order.
        assert second == pytest.approx(one["u"], abs=1.0)

    @pytest.mark.parametrize("one", CASES, ids=name_of)
    def test_sampled(self, one: dict[str, Any]) -> None:
        inputs, correlation = self.known(one)
        found = sampled(power, inputs, correlation=correlation)
        unit = self.UNIT
        assert number(found["mean"]) / unit == pytest.approx(one["mean"], abs=1.0)
        assert number(found.standard_deviation) / unit == pytest.approx(one["u"], abs=1.0)
        ends = [end / unit for end in interval(found, "shortest_")]
        assert ends == pytest.approx(one["shortest95"], abs=max(3.0, 0.02 * one["u"]))

    def test_comparison(self) -> None:
        inputs, _ = self.known(self.CASES[0])
        found = tp.uncertainty(power, inputs, validate=True, samples=SAMPLES, seed=SEED)
        assert not bool(found.valid.any())
        assert "its sensitivity is nearly zero here" in str(found.reason.values)


class TestLogarithm:
    """NPL DEM-ES-011, 9.2: y = ln x, x uniform on 0.1 .. 1.1."""

    EXPECTED = CASE["npl_log"]
    INPUTS: ClassVar = {"x": Input.uniform(0.1, 1.1)}

    @staticmethod
    def logarithm(x: Array) -> Array:
        return np.log(x)

    def test_linear(self) -> None:
        found = tp.uncertainty(self.logarithm, self.INPUTS)
        assert round(number(found.value), 3) == self.EXPECTED["guf"]["y"]
        assert round(number(found.standard_uncertainty), 3) == self.EXPECTED["guf"]["u"]

    def test_sampled(self) -> None:
        expected = self.EXPECTED["mcm"]
        found = sampled(self.logarithm, self.INPUTS)
        assert number(found["mean"]) == pytest.approx(expected["y"], abs=0.002)
        assert number(found.standard_deviation) == pytest.approx(expected["u"], abs=0.002)
        ends = expected["shortest95"]
        assert interval(found, "shortest_") == pytest.approx(ends, abs=0.004)

    def test_comparison(self) -> None:
        found = tp.uncertainty(self.logarithm, self.INPUTS, validate=True, samples=SAMPLES)
        reason = str(found.reason.values)
        assert "the distribution is skewed" in reason
        assert "x, which is uniform, makes 100 % of the variance" in reason


def expansion(L0: Array, L1: Array, T0: Array, T1: Array) -> Array:
    return (L1 - L0) / (L0 * (T1 - T0))


class TestExpansion:
    """NIST TN 1900, example E13: a coefficient of expansion from t-distributed inputs."""

    EXPECTED = CASE["nist_e13"]

    def inputs(self) -> dict[str, Input]:
        stated = {name: at for name, at in self.EXPECTED["inputs"].items() if name != "dist"}
        return {name: Input.student_t(*at, 3.0) for name, at in stated.items()}

    def test_linear(self) -> None:
        found = tp.uncertainty(expansion, self.inputs())
        value, u = self.EXPECTED["published"]["first_order"]
        assert number(found.value) == pytest.approx(value, abs=0.5e-9)
        assert number(found.standard_uncertainty) == pytest.approx(u, abs=0.5e-8)
        _, reproduced = self.EXPECTED["reproduced"]["first_order"]
        assert number(found.standard_uncertainty) == pytest.approx(reproduced, abs=0.5e-10)

    def test_sampled(self) -> None:
        value, u = self.EXPECTED["published"]["mc"]
        found = sampled(expansion, self.inputs())
        assert number(found["mean"]) == pytest.approx(value, abs=1e-8)
        # A t-distribution of 3 degrees of freedom has no fourth moment: its sampled standard
        # deviation settles slowly.
        assert number(found.standard_deviation) == pytest.approx(u, abs=5e-8)
