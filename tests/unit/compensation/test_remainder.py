"""The remainder near singularities, where nothing is proven, and the majorants it is made of."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import truepose as tp
from build_machine import MACHINES
from made_source import MadeSource, with_sources
from truepose.compensation import majorants
from truepose.compensation.corrected import corrected
from truepose.compensation.remainder import TURNED, Bounds, Remainder
from truepose.errors import RequestError
from truepose.machine import Machine
from truepose.runs.first_order import ExactError, first_order
from truepose.runs.poses import OK, PoseRun
from truepose.sources import Deviation, acting

Floats = NDArray[np.float64]
EDGE = np.linspace(-1.0, 1.0, 41)
SQUARE = np.array(
    [[a, b] for a in EDGE for b in (-1.0, 1.0)] + [[a, b] for a in (-1.0, 1.0) for b in EDGE]
)
"""The rim of the box of two variables."""


@pytest.fixture(scope="module")
def above_and_below(tmp_path_factory: pytest.TempPathFactory) -> Machine:
    """One carriage above the tool and one below: singular where the struts are in line."""
    text = (MACHINES / "planar_two_slider.toml").read_text(encoding="utf-8")
    first, second = text.split('name = "d2"')
    second = second.replace("travel = [0, 900]", "travel = [-900, 900]", 1)
    second = second.replace('working_mode = "+"', 'working_mode = "-"', 1)
    path: Path = tmp_path_factory.mktemp("machine") / "machine.toml"
    path.write_text(f'{first}name = "d2"{second}', encoding="utf-8")
    return tp.load(path)


def poses_of_conditioning(machine: Machine, low: float, high: float) -> Floats:
    across = np.concatenate([0.3 + np.geomspace(1e-3, 0.1, 80), 0.3 - np.geomspace(1e-3, 0.1, 80)])
    poses = np.stack([across, np.full_like(across, 0.2)], axis=1)
    found = machine.conditioning(poses)
    return poses[(found >= low) & (found <= high)]


def at(machine: Machine, poses: Floats) -> tuple[ExactError, Floats, Bounds]:
    """Exact errors, the linear reach, and the remainder after compensation."""
    sources = acting(machine, machine.condition)
    block = next(iter(PoseRun(machine, poses, machine.condition)))
    after, spread, _ = corrected(machine, block, sources)
    value, effects, _ = first_order(machine, after, spread)
    assert np.abs(value).max() < 1e-13
    bounds = Remainder(machine).bound(after, spread, value, effects)
    return ExactError(machine, after, spread), np.abs(effects).sum(axis=2), bounds


def test_the_law_holds_near_a_singularity_or_is_not_claimed(above_and_below: Machine) -> None:
    poses = poses_of_conditioning(above_and_below, 0.02, 0.3)
    mover, linear, bounds = at(above_and_below, poses)
    ratios, lost = [], 0
    for pose in range(len(linear)):
        errors, status = mover(np.full(len(SQUARE), pose), SQUARE)
        if (status != OK).any():
            # Some machine inside the bands does not go there: nothing may be claimed.
            assert not bounds.proven[pose]
            assert np.isnan(bounds.components[pose]).all()
            lost += 1
            continue
        assert bounds.proven[pose]
        most = np.abs(errors).max(axis=0)
        assert (most <= linear[pose] + bounds.components[pose]).all()
        size = np.linalg.norm(errors, axis=1).max()
        assert size <= np.linalg.norm(linear[pose]) + bounds.norms[pose, 0]
        ratios.append(bounds.components[pose] / (most - linear[pose]))
    # The issue's own: at 0.04 the residual is up to a third beyond the linear bound.
    assert lost > 5
    assert np.max(ratios) < 1.2


def test_at_a_conditioning_of_a_tenth_nothing_is_refused(above_and_below: Machine) -> None:
    _, _, bounds = at(above_and_below, poses_of_conditioning(above_and_below, 0.1, 1.0))
    assert bounds.proven.all()


def test_where_no_machine_goes_there_is_no_bound(above_and_below: Machine) -> None:
    """Struts in line to a micrometre: the command says nothing of one of the tool's directions."""
    with pytest.raises(RequestError):
        tp.compensate(above_and_below, [0.300001, 0.2])


def test_more_closures_than_freedoms_prove_nothing_unless_all_is_known() -> None:
    machine = tp.load(MACHINES / "overconstrained.toml")
    found = tp.compensate(machine)
    assert not found.proven.any()
    assert np.isnan(found.second_order).all()
    source = MadeSource("s", Deviation.of(machine.kernel.length_parameters, 1e-5))
    known = tp.compensate(with_sources(machine, source))
    assert known.proven.all()
    assert not known.second_order.values.any()


def rotation(turn: Floats) -> Floats:
    angle = float(np.linalg.norm(turn))
    x, y, z = turn / angle
    matrix = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(
        np.eye(3) + np.sin(angle) * matrix + (1.0 - np.cos(angle)) * (matrix @ matrix)
    )


def vector_of(matrix: Floats) -> Floats:
    """Rotation vector of a rotation by less than a right angle."""
    axial = 0.5 * np.array(
        [matrix[2, 1] - matrix[1, 2], matrix[0, 2] - matrix[2, 0], matrix[1, 0] - matrix[0, 1]]
    )
    sine = float(np.linalg.norm(axial))
    return np.asarray(axial * (np.arctan2(sine, 0.5 * (np.trace(matrix) - 1.0)) / sine))


def drawn(random: np.random.Generator, size: float) -> Floats:
    vector = random.normal(size=3)
    return np.asarray(vector * (size / np.linalg.norm(vector)))


def test_a_rotation_vector_beyond_its_derivative() -> None:
    random = np.random.default_rng(1)
    share = []
    for _ in range(400):
        v, r = drawn(random, random.uniform(0.05, 0.6)), drawn(random, random.uniform(0.05, 0.4))

        def of(turn: Floats, v: Floats = v) -> Floats:
            return vector_of(rotation(turn) @ rotation(v))

        step = 1e-5
        slope = (of(step * r) - of(-step * r)) / (2.0 * step)
        beyond = np.linalg.norm(of(r) - v - slope)
        share.append(beyond / ((np.linalg.norm(v) + np.linalg.norm(r)) * (r @ r)))
    assert 0.05 < np.max(share) < TURNED


Beyond = Callable[[np.random.Generator, float], float]


def of_turn(random: np.random.Generator, size: float) -> float:
    """exp(r) a - a - r x a of a unit vector."""
    r, a = drawn(random, size), drawn(random, 1.0)
    return float(np.linalg.norm(rotation(r) @ a - a - np.cross(r, a)))


def of_unit(random: np.random.Generator, size: float) -> float:
    """(axis + t) / |axis + t| beyond first order, t across the axis."""
    axis = drawn(random, 1.0)
    tilt = np.cross(axis, drawn(random, 1.0))
    tilt *= size / np.linalg.norm(tilt)
    moved = axis + tilt
    return float(np.linalg.norm(moved / np.linalg.norm(moved) - axis - tilt))


def of_length(random: np.random.Generator, size: float) -> float:
    """|v + d| - |v| - u . d of a unit vector, d of half that size along and all of it across."""
    unit = drawn(random, 1.0)
    across = np.cross(unit, drawn(random, 1.0))
    across *= size / np.linalg.norm(across)
    along = 0.5 * size * random.choice([-1.0, 1.0])
    return float(np.linalg.norm(unit + across + along * unit) - 1.0 - along)


@pytest.mark.parametrize(
    ("beyond", "majorant"),
    [
        (of_turn, majorants.turn_bent),
        (of_unit, lambda s: majorants.unit_bent(s, np.zeros(1))),
        (of_length, lambda s: majorants.length_bent(np.ones(1), s, 0.5 * s)),
    ],
    ids=["turn", "unit", "length"],
)
def test_a_majorant_is_never_less_and_nearly_reached(
    beyond: Beyond, majorant: Callable[[Floats], Floats]
) -> None:
    random = np.random.default_rng(2)
    for size in (1e-4, 1e-2, 0.3):
        most = max(beyond(random, size) for _ in range(300))
        bound = float(majorant(np.array([size]))[0])
        assert most <= bound * (1.0 + 1e-7)
        # Its part of second order is exact.
        if size < 0.1:
            assert bound <= most * (1.0 + 3.0 * size) + 1e-15


def test_a_majorant_has_no_negative_slope_and_ends_where_its_series_does() -> None:
    sizes = np.linspace(0.0, 3.0, 301)
    ones = np.ones_like(sizes)
    for values in (
        majorants.turn(sizes),
        majorants.turn_bent(sizes),
        majorants.unit(sizes, 0.1 * ones),
        majorants.unit_bent(sizes, 0.1 * ones),
        majorants.length_bent(2.0 * ones, sizes, 0.5 * sizes),
    ):
        finite = values[np.isfinite(values)]
        assert values[0] == 0.0
        # Convex and growing.
        assert (np.diff(finite) >= 0.0).all()
        assert (np.diff(finite, n=2) >= -1e-12).all()
    assert np.isinf(majorants.unit(np.array([1.0]), np.zeros(1))).all()
    assert np.isinf(majorants.length_bent(np.ones(1), np.array([0.8]), np.array([0.3]))).all()
