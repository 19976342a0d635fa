"""More closures than freedoms: the pose of least elastic energy, with clearances as dead zones.

The second road is NumPy and SciPy on the closures of tests/reference_kinematics.py: bounded least
squares where nothing loads the machine, and every choice of closures that touch, tried one by one,
where something does.
"""

from __future__ import annotations

import copy
import itertools
from collections.abc import Mapping, Sequence

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import lsq_linear  # type: ignore[import-untyped]

from build_machine import Description, awkward_files, deviated, machine_files
from machine_under_test import OK, MachineUnderTest
from reference_kinematics import (
    Reference,
    rotation_by_vector,
    rotation_of_quaternion,
    vector_of,
)
from truepose import _kernel

Floats = NDArray[np.float64]

CASES = [
    under_test
    for under_test in map(MachineUnderTest, [*machine_files(), *awkward_files()])
    if under_test.kernel.overconstrained
]
PLANAR = next(case for case in CASES if case.path.stem == "overconstrained")
# Without these struts the machine is isostatic, and no less stiff than before in any direction.
EXTRA = {"overconstrained": ["r2"], "overconstrained_body": ["a3", "b3"]}
SMALL = 2e-5
STEP = 1e-6


@pytest.fixture(params=CASES, ids=lambda case: case.path.stem)
def case(request: pytest.FixtureRequest) -> MachineUnderTest:
    found: MachineUnderTest = request.param
    return found


class State:
    """One pose of a machine with some parameters deviated, on the slow road."""

    def __init__(
        self, description: Description, kernel: _kernel.Machine, joints: Floats, placement: Floats
    ) -> None:
        self.reference = Reference(description)
        self.joints = joints
        self.point, self.rotation = placement[:3], rotation_of_quaternion(placement[3:])
        self.moves = [("x", "y", "z", "rx", "ry", "rz").index(c) for c in kernel.components]
        assert self.reference.stiffness is not None
        self.stiffness = self.reference.stiffness

    def placed(self, error: Floats) -> tuple[Floats, Floats]:
        """The placement displaced by an error (n_component,), m and rad."""
        whole = np.zeros(6)
        whole[self.moves] = error
        return self.point + whole[:3], rotation_by_vector(whole[3:]) @ self.rotation

    def residuals(self, error: Floats) -> Floats:
        return self.reference.closures(self.joints, *self.placed(error))

    def rows(self, error: Floats) -> Floats:
        """(n_closure, n_component) differences of the closures for small moves from there."""
        point, rotation = self.placed(error)
        rows = []
        for move in self.moves:
            whole = STEP * np.eye(6)[move]
            ends = [
                self.reference.closures(
                    self.joints,
                    point + sign * whole[:3],
                    rotation_by_vector(sign * whole[3:]) @ rotation,
                )
                for sign in (1, -1)
            ]
            rows.append((ends[0] - ends[1]) / (2 * STEP))
        return np.array(rows).T

    def moved(self, error: Floats, twist: Floats) -> Floats:
        """The error after a further small twist."""
        point, rotation = self.placed(error)
        whole = np.zeros(6)
        whole[self.moves] = twist
        rotation = rotation_by_vector(whole[3:]) @ rotation
        found = np.concatenate(
            [point + whole[:3] - self.point, vector_of(rotation @ self.rotation.T)]
        )
        return np.asarray(found[self.moves])

    def energy(self, error: Floats, gaps: Floats, wrench: Floats, start: Floats) -> float:
        """Elastic energy less the wrench's work on the way from `start`, J; the way is short."""
        beyond = np.maximum(np.abs(self.residuals(error)) - gaps, 0.0)
        work = wrench[self.moves] @ (error - start)
        return float(0.5 * self.stiffness @ beyond**2 - work)


def names_of(kernel: _kernel.Machine) -> list[str]:
    return [
        name
        for name in kernel.parameters
        if name.split(".")[-1] in ("length", "x", "y", "offset") and not name.startswith("tool")
    ]


def draw(case: MachineUnderTest, seed: int) -> tuple[dict[str, float], Floats, Floats]:
    """Deviations by name, a joints row and a placement of some pose."""
    random = np.random.default_rng(case.seed + seed)
    names = names_of(case.kernel)
    deviation = dict(zip(names, random.uniform(-SMALL, SMALL, len(names)), strict=True))
    joints, placements = case.placed
    return deviation, joints[seed : seed + 1], placements[seed : seed + 1]


def settle(
    kernel: _kernel.Machine,
    joints: Floats,
    placements: Floats,
    deviation: Mapping[str, float],
    gaps: Floats | Sequence[float] | float = 0.0,
    wrench: Floats | None = None,
) -> tuple[Floats, Floats, Floats, Floats]:
    columns = [kernel.parameters.index(name) for name in deviation]
    error, force, absorbed, strain, status = kernel.settle_at(
        joints,
        placements,
        columns,
        np.array([list(deviation.values())]),
        np.broadcast_to(gaps, (1, len(kernel.closures))),
        np.zeros((1, 6)) if wrench is None else wrench[np.newaxis],
    )
    assert (status == OK).all()
    return error[0], force[0], absorbed[0], strain[0]


def load(case: MachineUnderTest, seed: int) -> Floats:
    """A wrench on the tool that the platform can carry in its freedoms, N and N m."""
    random = np.random.default_rng(case.seed + 100 + seed)
    wrench = random.uniform(-300, 300, 6) * [1, 1, 1, 0.05, 0.05, 0.05]
    held = np.isin(["x", "y", "z", "rx", "ry", "rz"], case.kernel.components)
    return np.asarray(wrench * held)


@pytest.mark.parametrize("seed", range(5))
def test_the_pose_is_that_of_least_energy_and_forces_are_stiffness_times_misfit(
    case: MachineUnderTest, seed: int
) -> None:
    deviation, joints, placement = draw(case, seed)
    error, force, absorbed, strain = settle(case.kernel, joints, placement, deviation)
    state = State(deviated(case.description, deviation), case.kernel, joints[0], placement[0])
    point, rotation = state.reference.forward(state.joints, state.point, state.rotation)
    expected = np.concatenate([point - state.point, vector_of(rotation @ state.rotation.T)])
    assert np.allclose(error, expected[state.moves], rtol=0, atol=1e-10)
    misfit = state.residuals(error)
    assert np.abs(misfit).max() > 0.05 * SMALL
    assert np.allclose(strain, misfit, rtol=0, atol=1e-12)
    assert np.allclose(force, state.stiffness * misfit, rtol=0, atol=1e-5)
    assert not absorbed.any()
    forward, status = case.kernel.displacement(
        joints,
        placement,
        [case.kernel.parameters.index(name) for name in deviation],
        [list(deviation.values())],
    )
    assert status[0] == OK
    assert np.allclose(error, forward[0], rtol=0, atol=1e-12)


@pytest.mark.parametrize("gap", [1e-6, 6e-6, 1.5e-5])
@pytest.mark.parametrize("seed", range(4))
def test_dead_zones_are_bounded_slacks_of_a_least_squares_problem(
    case: MachineUnderTest, seed: int, gap: float
) -> None:
    """min over pose and |slack| <= gap of sum K (g - slack)^2, linearised anew until it stands."""
    deviation, joints, placement = draw(case, seed)
    n_closure = len(case.kernel.closures)
    gaps = np.random.default_rng(seed).uniform(0.0, gap, n_closure)
    gaps[seed % n_closure] = 0.0
    _, force, absorbed, _ = settle(case.kernel, joints, placement, deviation, gaps)
    state = State(deviated(case.description, deviation), case.kernel, joints[0], placement[0])
    root = np.sqrt(state.stiffness / state.stiffness.max())
    free = np.full(len(state.moves), np.inf)
    bound = np.concatenate([free, np.maximum(gaps, 1e-18)])
    at = np.zeros(len(state.moves))
    for _ in range(4):
        rows = state.rows(at)
        matrix = root[:, None] * np.concatenate([rows, -np.eye(n_closure)], axis=1)
        # In micrometres, so that the solver's stopping rules see numbers near one.
        found = lsq_linear(
            matrix,
            -root * state.residuals(at) * 1e6,
            (-bound * 1e6, bound * 1e6),
            tol=1e-15,
            method="bvls",
        )
        twist, slack = found.x[: len(state.moves)] * 1e-6, found.x[len(state.moves) :] * 1e-6
        at = state.moved(at, twist)
    expected = state.stiffness * (state.residuals(at) - slack)
    assert np.allclose(force, expected, rtol=0, atol=1e-3)
    assert (np.abs(absorbed) <= gaps * (1 + 1e-9)).all()
    assert (np.abs(force)[np.abs(absorbed) < gaps * (1 - 1e-6)] < 1e-3).all(), "who floats is free"


@pytest.mark.parametrize("seed", range(6))
def test_dead_zones_under_load_by_trying_every_set_of_contacts(seed: int) -> None:
    deviation, joints, placement = draw(PLANAR, seed)
    wrench = load(PLANAR, seed)
    gaps = np.random.default_rng(seed).uniform(0.0, 2e-5, 4)
    error, force, absorbed, _ = settle(PLANAR.kernel, joints, placement, deviation, gaps, wrench)
    state = State(deviated(PLANAR.description, deviation), PLANAR.kernel, joints[0], placement[0])
    at = np.zeros(3)
    for _ in range(5):
        twist, expected = every_contact(state, at, gaps, wrench)
        at = state.moved(at, twist)
    assert np.allclose(force, expected, rtol=0, atol=1e-4)
    assert np.allclose(error, at, rtol=0, atol=1e-9)
    assert np.allclose(absorbed, np.clip(state.residuals(at), -gaps, gaps), rtol=0, atol=1e-9)


def every_contact(state: State, at: Floats, gaps: Floats, wrench: Floats) -> tuple[Floats, Floats]:
    """Twist and forces of the choice of closures that touch which contradicts nothing."""
    rows, residuals = state.rows(at), state.residuals(at)
    found = []
    for sides in itertools.product((-1.0, 0.0, 1.0), repeat=len(gaps)):
        side = np.array(sides)
        stiffness = np.where(side != 0.0, state.stiffness, 0.0)
        normal = rows.T * stiffness @ rows
        if np.linalg.cond(normal / stiffness.max(initial=1.0)) > 1e9:
            continue
        open_by = residuals - side * gaps
        twist = np.linalg.solve(normal, wrench[state.moves] - rows.T @ (stiffness * open_by))
        force = stiffness * (open_by + rows @ twist)
        inside = np.abs(residuals + rows @ twist) <= gaps + 1e-15
        if np.where(side != 0.0, side * force >= 0.0, inside).all():
            found.append((twist, force))
    assert found
    assert all(np.allclose(force, found[0][1], atol=1e-6) for _, force in found)
    return found[0]


@pytest.mark.parametrize("gap", [0.0, 3e-6, 3e-5])
@pytest.mark.parametrize("seed", range(3))
def test_no_pose_nearby_has_less_energy(case: MachineUnderTest, seed: int, gap: float) -> None:
    deviation, joints, placement = draw(case, seed)
    wrench = load(case, seed)
    gaps = np.full(len(case.kernel.closures), gap)
    error, *_ = settle(case.kernel, joints, placement, deviation, gaps, wrench)
    state = State(deviated(case.description, deviation), case.kernel, joints[0], placement[0])
    least = state.energy(error, gaps, wrench, error)
    random = np.random.default_rng(seed)
    for size in (1e-7, 1e-6, 1e-5, 1e-4):
        for _ in range(20):
            other = state.moved(error, size * random.uniform(-1, 1, len(error)))
            assert state.energy(other, gaps, wrench, error) >= least * (1 - 1e-9)


@pytest.mark.parametrize("gap", [0.0, 4e-6])
@pytest.mark.parametrize("seed", range(4))
def test_the_forces_balance_the_wrench(case: MachineUnderTest, seed: int, gap: float) -> None:
    """W^T force = wrench, W by differences of the distances of joint centres."""
    deviation, joints, placement = draw(case, seed)
    gaps = np.full(len(case.kernel.closures), gap)
    description = deviated(case.description, deviation)
    state = State(description, case.kernel, joints[0], placement[0])
    for wrench in (np.zeros(6), load(case, seed)):
        error, force, *_ = settle(case.kernel, joints, placement, deviation, gaps, wrench)
        balance = state.rows(error).T @ force
        rounding = 1e-6 * np.abs(force).max() + 1e-4
        assert np.allclose(balance, wrench[state.moves], rtol=0, atol=rounding)
        assert np.abs(force).max() > 1.0 or gap > 0.0


def isostatic(case: MachineUnderTest) -> tuple[Description, _kernel.Machine]:
    """The machine without its extra struts."""
    fewer = copy.deepcopy(case.description)
    extra = EXTRA[case.path.stem]
    fewer["struts"] = [strut for strut in fewer["struts"] if strut["name"] not in extra]
    fewer["closure_compliance"] = None
    kernel = _kernel.Machine(fewer)
    assert not kernel.overconstrained
    return fewer, kernel


def isostatic_error(
    kernel: _kernel.Machine, joints: Floats, placement: Floats, deviation: Mapping[str, float]
) -> Floats:
    own = {name: value for name, value in deviation.items() if name in kernel.parameters}
    error, status = kernel.displacement(
        joints,
        placement,
        [kernel.parameters.index(name) for name in own],
        [list(own.values())],
    )
    assert status[0] == OK
    return error[0]


@pytest.mark.parametrize("seed", range(4))
def test_where_the_extra_struts_fit_it_is_the_isostatic_root(
    case: MachineUnderTest, seed: int
) -> None:
    """The extra struts are made as long as they must be where the others put the platform."""
    deviation, joints, placement = draw(case, seed)
    _, fewer = isostatic(case)
    expected = isostatic_error(fewer, joints, placement, deviation)
    state = State(deviated(case.description, deviation), case.kernel, joints[0], placement[0])
    misfit = dict(zip(case.kernel.closures, state.residuals(expected), strict=True))
    for name in EXTRA[case.path.stem]:
        deviation[f"strut.{name}.length"] += misfit[name]
    error, force, *_ = settle(case.kernel, joints, placement, deviation)
    assert np.allclose(error, expected, rtol=0, atol=1e-11)
    assert np.abs(force).max() < 1e-3


@pytest.mark.parametrize("seed", range(4))
def test_struts_of_infinite_compliance_carry_nothing_and_hold_nothing(
    case: MachineUnderTest, seed: int
) -> None:
    deviation, joints, placement = draw(case, seed)
    _, fewer = isostatic(case)
    expected = isostatic_error(fewer, joints, placement, deviation)
    extra = EXTRA[case.path.stem]
    soft = [
        float("inf") if name in extra else compliance
        for name, compliance in zip(
            case.kernel.closures, case.description["closure_compliance"], strict=True
        )
    ]
    kernel = _kernel.Machine(case.description | {"closure_compliance": soft})
    error, force, *_ = settle(kernel, joints, placement, deviation)
    assert np.allclose(error, expected, rtol=0, atol=1e-11)
    assert not force[np.isin(kernel.closures, extra)].any()
    assert np.abs(force).max() < 1e-3
    forward, status = kernel.displacement(
        joints,
        placement,
        [kernel.parameters.index(name) for name in deviation],
        [list(deviation.values())],
    )
    assert status[0] == OK
    assert np.allclose(forward[0], expected, rtol=0, atol=1e-11)


@pytest.mark.parametrize("seed", range(4))
def test_the_compliance_is_the_displacement_under_a_wrench(
    case: MachineUnderTest, seed: int
) -> None:
    """To first order: what remains falls with the square of the wrench."""
    _, joints, placement = draw(case, seed)
    own = np.array([case.description["closure_compliance"]])
    compliance, status = case.kernel.compliance_at(
        joints, placement, case.kernel.length_parameters, own
    )
    assert status[0] == OK
    moves = [("x", "y", "z", "rx", "ry", "rz").index(c) for c in case.kernel.components]
    scale = case.unit_of_component
    for size, left in ((1.0, 2e-3), (0.01, 2e-5)):
        wrench = size * load(case, seed)
        expected = compliance[0] @ wrench[moves]
        error, *_ = settle(case.kernel, joints, placement, {}, wrench=wrench)
        assert np.abs((error - expected) / scale).max() < left * np.abs(expected / scale).max()


@pytest.mark.parametrize("seed", range(3))
def test_internal_forces_of_unit_deviations(case: MachineUnderTest, seed: int) -> None:
    """They are K (I - W (W^T K W)^-1 W^T K), balance each other, and are what a step settles to."""
    _, joints, placement = draw(case, seed)
    columns = case.kernel.length_parameters
    force, status = case.kernel.internal_forces_at(joints, placement, columns)
    assert status[0] == OK
    state = State(case.description, case.kernel, joints[0], placement[0])
    rows, stiffness = state.rows(np.zeros(len(state.moves))), np.diag(state.stiffness)
    spread = np.linalg.solve(rows.T @ stiffness @ rows, rows.T @ stiffness)
    # A longer strut closes with a negative residual: it is pressed.
    expected = -stiffness @ (np.eye(len(rows)) - rows @ spread)
    assert np.allclose(force[0], expected, rtol=0, atol=1e-7 * state.stiffness.max())
    assert np.abs(rows.T @ force[0]).max() < 1e-7 * state.stiffness.max()
    for index, column in enumerate(columns):
        small = 1e-7
        _, settled, *_ = settle(
            case.kernel, joints, placement, {case.kernel.parameters[column]: small}
        )
        assert np.allclose(settled / small, force[0, :, index], atol=1e-5 * state.stiffness.max())
