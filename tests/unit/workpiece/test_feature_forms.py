"""The linear forms of every kind against its value: nothing beyond what they allow."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from features_of_elements import every_case, followed, perturbed, points_of, value
from sweeps import thinned
from truepose.arrays import Floats
from truepose.workpiece.features import REGISTRY, Forms

ROUNDING = 3e-15
COUNT = 60


def _rigid(rng: np.random.Generator, points: Floats, form: Forms) -> Floats:
    turn, shift = rng.standard_normal((2, COUNT, 1, 3))
    return np.asarray(np.cross(turn, points) + shift * np.abs(points).max())


def _worst(rng: np.random.Generator, points: Floats, form: Forms) -> Floats:
    """Every point as far as it goes, to where one of the forms, or one of its datums', grows."""
    every = np.concatenate([form.weights, *(besides.weights for besides in form.plus)])
    weights = every[rng.integers(0, len(every), COUNT)] * rng.choice([-1.0, 1.0], (COUNT, 1, 1))
    lengths = np.linalg.norm(weights, axis=-1, keepdims=True)
    return np.asarray(weights / np.maximum(lengths, 1e-9 * max(lengths.max(), 1e-300)))


ERRORS: dict[str, Callable[[np.random.Generator, Floats, Forms], Floats]] = {
    "normal": lambda rng, points, form: rng.standard_normal((COUNT, *points.shape)),
    "signs": lambda rng, points, form: rng.choice([-1.0, 1.0], (COUNT, *points.shape)),
    "rigid": _rigid,
    "strain": lambda rng, points, form: points @ rng.standard_normal((COUNT, 3, 3)),
    "spikes": lambda rng, points, form: (
        rng.standard_normal((COUNT, *points.shape))
        * (rng.uniform(size=(COUNT, len(points), 1)) < 3.0 / len(points))
        + 1e-12
    ),
    "worst": _worst,
}


@pytest.mark.parametrize(
    "name", thinned(every_case("iso"), quick={"slot", "bore to walls", "line"})
)
@pytest.mark.parametrize("method", ["iso", "least-squares"])
@pytest.mark.parametrize("kind", ERRORS)
def test_a_value_is_where_its_forms_say(name: str, method: str, kind: str) -> None:
    feature = every_case(method)[name]  # type: ignore[arg-type]
    nominal = np.concatenate([points[0] for points in points_of(feature)])
    rng = np.random.default_rng(5)
    for quantity, form in zip(feature.quantities, feature.forms(), strict=True):
        assert form.reach > 1e-5
        errors = ERRORS[kind](rng, nominal - nominal.mean(axis=0), form)
        errors /= np.linalg.norm(errors, axis=-1).max(axis=1)[:, np.newaxis, np.newaxis]
        for scale in (1.0, 0.3, 0.1, 1e-2, 1e-3, 1e-4):
            rho = 0.999 * scale * min(form.reach, 1e-3)
            actual = value(feature, perturbed(feature, rho * errors), quantity.name)
            said, allowed = followed(form, rho * errors)
            more = actual - said if form.rule == "spread" else np.abs(actual - said)
            assert np.all(more <= allowed + ROUNDING), (quantity.name, scale)


@pytest.mark.parametrize("method", ["iso", "least-squares"])
def test_a_program_rounds(method: str) -> None:
    """To whole micrometres: the forms are those of the drawing, and know what it is off."""
    rng = np.random.default_rng(8)
    for name, feature in every_case(method, 1e-6).items():  # type: ignore[arg-type]
        count = sum(points.shape[1] for points in points_of(feature))
        for quantity, form in zip(feature.quantities, feature.forms(), strict=True):
            for rho in (0.0, 1e-9, 1e-7, 1e-6, 0.9 * min(form.reach, 1e-4)):
                errors = rng.standard_normal((20, count, 3))
                errors *= rho / np.linalg.norm(errors, axis=-1).max(axis=1)[:, None, None]
                actual = value(feature, perturbed(feature, errors), quantity.name)
                said, allowed = followed(form, errors)
                more = actual - said if form.rule == "spread" else np.abs(actual - said)
                assert np.all(more <= allowed + ROUNDING), (name, quantity.name, rho)


@pytest.mark.parametrize("method", ["iso", "least-squares"])
def test_a_common_shift_adds_nothing_of_second_order(method: str) -> None:
    """However far all points are moved as one: the rest bounds what the forms leave out."""
    rng, shift = np.random.default_rng(12), np.array([2e-3, -3e-3, 1e-3])
    for name, feature in every_case(method).items():  # type: ignore[arg-type]
        count = sum(points.shape[1] for points in points_of(feature))
        for quantity, form in zip(feature.quantities, feature.forms(), strict=True):
            for rho in (1e-9, 1e-6, 0.9 * min(form.reach, 1e-4)):
                errors = rng.standard_normal((20, count, 3))
                errors *= rho / np.linalg.norm(errors, axis=-1).max(axis=1)[:, None, None]
                actual = value(feature, perturbed(feature, errors + shift), quantity.name)
                said, allowed = followed(form, errors + shift, shift)
                more = actual - said if form.rule == "spread" else np.abs(actual - said)
                assert np.all(more <= allowed + 10.0 * ROUNDING), (name, quantity.name, rho)


def test_every_kind_is_held_against_its_forms() -> None:
    assert {feature.kind for feature in every_case("iso").values()} == set(REGISTRY)


@pytest.mark.parametrize("name", ["slot", "bore to walls", "bore to bores", "walls at 30"])
def test_forms_are_the_derivative(name: str) -> None:
    """Of what is smooth: by differences, at points that are off the drawing already."""
    feature = every_case("least-squares")[name]
    count = sum(points.shape[1] for points in points_of(feature))
    rng = np.random.default_rng(1)
    for quantity, form in zip(feature.quantities, feature.forms(), strict=True):
        if form.rule != "between" or len(form.weights) > 1:
            continue
        direction = rng.standard_normal((1, count, 3))
        above, below = (
            value(feature, perturbed(feature, sign * 1e-7 * direction), quantity.name)
            for sign in (1.0, -1.0)
        )
        slope = float(np.einsum("kni,sni->", form.weights, direction))
        assert (above - below)[0] / 2e-7 == pytest.approx(slope, rel=1e-6)


def test_a_value_whose_weights_sum_to_nothing_is_the_same_anywhere() -> None:
    for method in ("iso", "least-squares"):
        for name, feature in every_case(method).items():  # type: ignore[arg-type]
            nominal = points_of(feature)
            before, shift = feature.values(nominal), np.array([3e-4, -2e-4, 1e-4])
            after = feature.values([points + shift for points in nominal])
            for place, form in enumerate(feature.forms()):
                if np.abs(form.weights.sum(axis=1)).max() < 1e-9:
                    assert after[0, place] == pytest.approx(before[0, place], abs=1e-14), name
                else:
                    assert after[0, place] > before[0, place] + 1e-5, name
