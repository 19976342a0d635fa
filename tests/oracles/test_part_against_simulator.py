"""Every kind of feature of parts that sampled machines make, against the simulator in NumPy.

The same variables are given to both: what a machine has once goes to its parameters by name, and
what runs along the path (ripple, rounding, the flank of play) is made by the simulator's own laws
of the phases drawn. Where the machine then goes, and what the drawing tolerates, is its own.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from part_simulator.errors import (
    Error,
    Force,
    Play,
    Repeatability,
    Resolution,
    Ripple,
    Scale,
    Sums,
    Table,
    Tolerances,
    written,
)
from part_simulator.part_under_test import MACHINES, PartUnderTest, without_errors
from part_simulator.questions import CLOSED, QUESTIONS
from sweeps import thinned
from truepose.sources.variation import Ripple as SourceRipple
from truepose.workpiece.features import REGISTRY
from truepose.workpiece.states import PartState

Floats = NDArray[np.float64]

NAMES = (
    "linear_delta",
    "planar_two_slider",
    "hexapod",
    "rotary_delta",
    "orthoglide",
    "hexaglide",
    "five_bar",
)
SAMPLES, SEED = 4, 7

TOLERANCES = Tolerances({"strut.*.base.*": 20.0, "strut.*.platform.*": 15.0})
ALONG = (Scale(-15.0, 35.0), Ripple(3.0, 4.0), Resolution(2.0), Play(8.0))
EVERYTHING = (TOLERANCES, *ALONG, Force(80.0, 20.0), Repeatability(1.0))
TABLED = (TOLERANCES, Table(3))
CASES = [(name, method) for name in NAMES for method in ("iso", "least-squares")]


def same(value: Floats, expected: Floats) -> bool:
    """To 1e-12 m, and 1e-9 of its size."""
    return bool((np.abs(value - expected) <= 1e-12 + 1e-9 * np.abs(expected)).all())


def deviations(under_test: PartUnderTest, errors: tuple[Error, ...]) -> dict[str, Floats]:
    """What the drawn variables are to the parameters, by the simulator's laws of the path."""
    state = under_test.states[0]
    variables, varying = state.variables, state.varying(SEED)
    rows = varying.rows(0, SAMPLES)
    along = varying.at(rows, 0)
    sums = Sums()
    own = {type(error): error for error in errors}
    half = np.broadcast_to(variables.half_width, (len(state.points), variables.columns.size))
    drives = {f"drive.{drive['name']}.offset": drive for drive in under_test.simulated.drives}
    for column, parameter in enumerate(variables.columns):
        number = variables.variable_of[column]
        name = under_test.machine.parameters[parameter]
        law = variables.variations[number].law
        if law is None:
            sums.add(name, half[:, column] * along[:, :, number])
            continue
        drive = drives[name]
        q = under_test.way.coordinate(drive)[under_test.on_elements]
        error = own[Ripple if isinstance(law, SourceRipple) else Resolution]
        sums.add(name, error.at(drive, q, 0.5 * (rows[:, [number]] + 1.0)))
    known(under_test, errors, sums)
    return sums.values


def known(under_test: PartUnderTest, errors: tuple[Error, ...], sums: Sums) -> None:
    """What is known of each machine: the middle of the scales, and the flank once it is known."""
    for drive in under_test.simulated.drives:
        name, q = f"drive.{drive['name']}.offset", under_test.way.coordinate(drive)
        for error in errors:
            if isinstance(error, Scale | Play | Table):
                sums.add(name, error.known(drive, q)[np.newaxis, under_test.on_elements])


def test_every_kind_of_feature_is_asked() -> None:
    assert {question.kind for question in QUESTIONS} == set(REGISTRY)


@pytest.mark.parametrize(
    "case",
    thinned(CASES, {(name, ("iso", "least-squares")[at % 2]) for at, name in enumerate(NAMES)}),
    ids="-".join,
)
@pytest.mark.parametrize("errors", [EVERYTHING, TABLED], ids=["everything", "tabled"])
def test_values_are_the_simulators(
    case: tuple[str, str], errors: tuple[Error, ...], tmp_path: Path
) -> None:
    name, method = case
    file = written(errors, without_errors(MACHINES / f"{name}.toml"), tmp_path)
    under_test = PartUnderTest(name, file, tmp_path, least_squares=method != "iso")
    require_same(under_test, errors)


@pytest.mark.parametrize("method", ["iso", "least-squares"])
def test_a_closed_contour_has_no_end(method: str, tmp_path: Path) -> None:
    """Where it begins and ends there is a corner as any other."""
    file = written(EVERYTHING, without_errors(MACHINES / "hexapod.toml"), tmp_path)
    under_test = PartUnderTest("hexapod", file, tmp_path, [CLOSED], least_squares=method != "iso")
    require_same(under_test, EVERYTHING)


def require_same(under_test: PartUnderTest, errors: tuple[Error, ...]) -> None:
    state: PartState = under_test.states[0]
    found, good = state.exact_errors(state.varying(SEED), 0, SAMPLES)
    assert good.all()
    points = state.points + found
    expected = under_test.driven(deviations(under_test, errors))
    assert np.abs(points - expected).max() < 1e-12
    assert np.abs(points - state.points).max() > 1e-6
    values = under_test.evaluated(points)
    off = {}
    for sample in range(SAMPLES):
        for label, quantities in under_test.measured(expected[sample]).items():
            if not same(values[label][sample], np.array(quantities)):
                off[label, sample] = values[label][sample] - quantities
    assert not off
