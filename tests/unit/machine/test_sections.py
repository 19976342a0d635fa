"""Sections of beams against formulas written a second time from their sources (frame_sections)."""

from __future__ import annotations

import pytest

import frame_sections as second
from truepose.machine import sections

POISSON = [0.0, 0.26, 0.3, 0.45]


def same(found: sections.Section, expected: second.Section) -> None:
    """Height along y here, along z there."""
    assert found.area == pytest.approx(expected.area, rel=1e-12)
    assert found.about_z == pytest.approx(expected.second_moment_y, rel=1e-12)
    assert found.about_y == pytest.approx(expected.second_moment_z, rel=1e-12)
    assert found.torsion == pytest.approx(expected.torsion_constant, rel=1e-9)
    assert found.shear_y == pytest.approx(expected.shear_coefficient_z, rel=1e-12)
    assert found.shear_z == pytest.approx(expected.shear_coefficient_y, rel=1e-12)


@pytest.mark.parametrize("poisson", POISSON)
def test_round_sections(poisson: float) -> None:
    same(sections.bar(0.04, poisson), second.bar(0.04, poisson))
    same(sections.tube(0.05, 0.006, poisson), second.tube(0.05, 0.006, poisson))


@pytest.mark.parametrize("poisson", POISSON)
@pytest.mark.parametrize(("height", "width"), [(0.14, 0.09), (0.04, 0.1), (0.05, 0.05)])
def test_sections_with_sides(height: float, width: float, poisson: float) -> None:
    same(sections.rectangle(height, width, poisson), second.rectangle(width, height, poisson))
    box = second.box(width, height, 0.005, poisson)
    same(sections.box(height, width, 0.005, poisson), box)
    h_beam = second.h_section(width, height, 0.004, 0.006, poisson)
    same(sections.h_beam(height, width, 0.004, 0.006, poisson), h_beam)
