"""Colours that can be told from the paper, by day and by night, and numbers rounded to it."""

from __future__ import annotations

import re
from importlib.resources import files

import numpy as np
import pytest
from babel.numbers import format_decimal

from sweeps import thinned
from truepose.language import languages, speaking
from truepose.reporting.figures import _style
from truepose.reporting.figures._plot import Plot


def contrast(one: str, other: str) -> float:
    """Ratio of luminances as WCAG 2.2 has it (https://www.w3.org/TR/WCAG22/#dfn-contrast-ratio)."""

    def luminance(colour: str) -> float:
        shares = np.array([int(colour[at : at + 2], 16) for at in (1, 3, 5)]) / 255
        linear = np.where(shares <= 0.04045, shares / 12.92, ((shares + 0.055) / 1.055) ** 2.4)
        return float(linear @ [0.2126, 0.7152, 0.0722])

    darker, lighter = sorted((luminance(one), luminance(other)))
    return (lighter + 0.05) / (darker + 0.05)


def test_contrast_is_that_of_the_standard() -> None:
    assert contrast("#FFFFFF", "#000000") == pytest.approx(21.0)
    assert contrast("#777777", "#FFFFFF") == pytest.approx(4.48, abs=0.01)


@pytest.mark.parametrize("colour", dict.fromkeys(_style.LINES))
def test_a_line_is_told_from_the_paper_by_day_and_by_night(colour: str) -> None:
    # 3 is what graphics need (WCAG 2.2, 1.4.11), 4.5 text.
    needed = 4.5 if colour in (_style.INK, _style.QUIET) else 3.0
    assert contrast(colour, _style.PAPER) >= needed
    assert contrast(_style.DARK[colour], _style.DARK[_style.PAPER]) >= needed


def test_every_colour_has_one_for_the_night() -> None:
    named = {
        value
        for name, value in vars(_style).items()
        if name.isupper() and isinstance(value, str) and value.startswith(("#", "rgba"))
    }
    assert named | set(_style.LINES) <= set(_style.DARK)
    lines = [_style.DARK[colour] for colour in _style.SOURCE_COLOURS]
    assert len(set(lines)) == len(lines)


def test_no_figure_has_a_colour_of_its_own() -> None:
    folder = files("truepose.reporting.figures")
    own = re.compile('"#[0-9A-Fa-f]{3,8}"|rgba?\\(|"(white|black|red|green|blue)"')
    assert own.search('line={"color": "#0072B2"}')
    texts = {each.name: each.read_text() for each in folder.iterdir() if each.name.endswith(".py")}
    del texts["_style.py"]
    assert {name: found[0] for name, text in texts.items() if (found := own.search(text))} == {}


def test_many_numbers_are_rounded_to_what_is_drawn() -> None:
    values = np.linspace(100.0, 100.9, 1001) + 1e-7
    drawn = _style.small(values)
    assert drawn.dtype == np.float32
    assert np.abs(drawn - values).max() <= 1e-5 + 1e-5 / 2, "a hundred thousandth of the range"
    assert len({f"{value:.5f}" for value in drawn}) > 900
    few = _style.small(values[:100])
    np.testing.assert_array_equal(few, values[:100].astype(np.float32))


@pytest.mark.parametrize("value", [0.0, 123456.0, np.nan, np.inf])
def test_numbers_that_are_all_the_same_are_drawn(value: float) -> None:
    np.testing.assert_array_equal(_style.small(np.full(500, value)), np.full(500, value))


@pytest.mark.parametrize("code", thinned(languages(), quick={"de"}))
def test_a_figure_has_the_marks_of_the_language(code: str) -> None:
    with speaking(code):
        marks = _style.finish(Plot(), 100).layout["separators"]
    assert format_decimal(1234567.5, locale=code) == f"1{marks[1]}234{marks[1]}567{marks[0]}5"
