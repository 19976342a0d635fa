"""Fits a controller's small model to the actual machine, and says what error is left over.

The actual machine is the nominal one with every source at its shift, in the machine's condition.
The controller drives its joints to `model.joints(values, X)`, and the tool comes to Y; the values
are those that make the sum of squares of Y - X over the workspace least, rotations weighed with
the characteristic length. What is stated is then evaluated for the rounded numbers as they are
printed, at every pose of the workspace.

A number, or a mixture of numbers, that moves the tool by less than 1e-5 of its change is
not told by the workspace: it stays at the nominal machine's value. That is what the weak equations
`WEAK * (value - start) / size = 0` do; they move the tool by some nanometres per millimetre of
deviation at most.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from truepose import __version__
from truepose.budget.poses import OK, Walk, no_pose_left, pose_in_words
from truepose.calibration import least_squares
from truepose.compensation.commands import ActualMachine, blocks
from truepose.controllers._small_model import Printed, SmallModel, ascii_only
from truepose.errors import Problem, RequestError
from truepose.machine import Machine
from truepose.sources._base import Flags, Floats

MOST_FITTED = 2000
"""Poses that are fitted to, evenly spaced over the usable ones; all of them are judged."""

WEAK = 1e-5
"""Weight of the nominal numbers against the tool's error, m per m."""

KEPT = 0.1
"""Share of a number's certainty that comes from its nominal value, above which it is named."""

MOST_NAMED = 6
"""Names that one line holds."""

STEP = 1e-6
"""Step of central differences, in m, rad or sizes: their error is some 1e-10 of the derivative."""


@dataclass(frozen=True)
class Extent:
    """The largest of a quantity over poses, the pose where it is (n_commanded,), and its rms."""

    highest: float
    at: Floats
    rms: float


@dataclass(frozen=True)
class Error:
    """What the tool is off, controlled with some numbers.

    `position` in m, `orientation` in rad, None where no orientation is commanded; `parasitic`, rad:
    how far the platform turns where it cannot be commanded to, None where it cannot turn at all.
    """

    position: Extent
    orientation: Extent | None
    parasitic: Extent | None


@dataclass(frozen=True)
class Fit:
    """A fitted model: its numbers as `printed` and what they leave.

    `values` (n,): what the controller makes of `printed`. `before`: with the numbers of the
    nominal machine, `nominal`; `after`: with those printed. `kept`: names of numbers that the
    workspace does not tell. `settled`: whether the fit converged. `n_pose`, `n_left_out`: poses
    judged, and not usable.
    """

    printed: Printed
    values: Floats
    nominal: Printed
    before: Error
    after: Error
    kept: tuple[str, ...]
    settled: bool
    n_pose: int
    n_left_out: int

    def statement(self, machine: Machine) -> tuple[str, ...]:
        """Lines for the user: what is left, what was, and what the numbers cannot do."""
        poses = "the only pose" if self.n_pose == 1 else f"{self.n_pose} poses"
        lines = [
            f"left over with these numbers: {_words(machine, self.after)}",
            f"with the nominal machine's numbers: {_words(machine, self.before)}",
            f"over {poses} of the workspace, in the condition of the machine file",
        ]
        if self.n_left_out:
            lines.append(f"{self.n_left_out} poses of the workspace cannot be used and count not")
        if self.after.parasitic is not None:
            lines.append(
                f"besides, the platform turns by up to {_micro(self.after.parasitic.highest)} µrad "
                f"(before: {_micro(_highest(self.before.parasitic))} µrad), "
                "which this controller cannot command"
            )
        if not self.settled:
            lines.append("the fit has not converged: other numbers may leave less")
        if self.kept:
            lines.append(
                f"this workspace hardly tells {_listed(self.kept)}: "
                "what it does not tell stays at the nominal machine's values"
            )
        return tuple(lines)


def heading(machine: Machine, fit: Fit, controller: str) -> tuple[str, ...]:
    """Lines that say what a block is of, in ASCII, for its comment."""
    changes = [f"{key} = {value}" for key, value in machine.settings.items()]
    changes += [f"{key} = {value!r} (SI)" for key, value in machine.replaced.items()]
    lines = (
        f"{controller} parameters of {machine.name!r}, fitted by truepose {__version__}",
        f"machine file {machine.file}, SHA-256 {machine.file_hash}",
        *(f"changed: {change}" for change in changes),
        *fit.statement(machine),
    )
    return tuple(ascii_only(line) for line in lines)


def fit(machine: Machine, model: SmallModel, *, most_evaluations: int = 1000) -> Fit:
    """Find a model's numbers for the actual machine, and judge them.

    Raises `RequestError`: no-workspace, no-pose-left, and controller-cannot where the model does
    not reach the workspace with the nominal machine's numbers.
    """
    actual = ActualMachine(machine)
    poses, left_out = _usable(machine, actual)
    chosen = poses[_spread(len(poses), MOST_FITTED)]
    problem = _FitProblem(actual, model, chosen)
    start = np.array([parameter.start for parameter in model.parameters])
    if not np.isfinite(problem.residual(np.zeros(start.size))).all():
        raise RequestError(
            Problem(
                "controller-cannot",
                "the controller's model does not reach the workspace",
                file=machine.file,
                found="joints that cannot be computed with the nominal machine's numbers",
                expected="a workspace within the reach of the controller's model",
            )
        )
    solution = least_squares(
        problem.residual,
        problem.jacobian,
        np.zeros(start.size),
        most_evaluations=most_evaluations,
    )
    printed = model.printed(problem.values(solution.values))
    nominal = model.printed(start)
    values = model.taken(printed)
    return Fit(
        printed,
        values,
        nominal,
        _judge(actual, model, model.taken(nominal), poses),
        _judge(actual, model, values, poses),
        _kept(model, solution.jacobian),
        solution.converged,
        len(poses),
        left_out,
    )


class _FitProblem:
    """Residuals, m, of all poses, and the weak equations; unknowns are changes over their sizes."""

    def __init__(self, actual: ActualMachine, model: SmallModel, poses: Floats) -> None:
        self._actual, self._model = actual, model
        self._known = actual.known(poses)
        self._poses = poses
        machine = actual.machine
        self._rows = _commanded_components(machine)
        length = machine.characteristic_length
        self._unit = np.array(
            [1.0 if machine.components[row] in "xyz" else length for row in self._rows]
        )
        self._unit /= np.sqrt(len(poses))
        self._start = np.array([parameter.start for parameter in model.parameters])
        self._size = np.array([parameter.size for parameter in model.parameters])

    def values(self, change: Floats) -> Floats:
        """The model's numbers, SI."""
        found: Floats = self._start + self._size * change
        return found

    def residual(self, change: Floats) -> Floats:
        joints = self._model.joints(self.values(change), self._poses)
        return np.concatenate([self._error(joints).ravel(), WEAK * change])

    def jacobian(self, change: Floats) -> Floats:
        values = self.values(change)
        joints = self._model.joints(values, self._poses)
        by_joint = np.stack([self._by_joint(joints, at) for at in range(joints.shape[1])], axis=2)
        columns = []
        for at, size in enumerate(self._size):
            step = np.zeros(values.size)
            step[at] = STEP * size
            ahead = self._model.joints(values + step, self._poses)
            behind = self._model.joints(values - step, self._poses)
            turned = (ahead - behind) / (2.0 * STEP)
            columns.append(np.einsum("nij,nj->ni", by_joint, turned).ravel())
        return np.concatenate([np.stack(columns, axis=1), WEAK * np.eye(values.size)])

    def _by_joint(self, joints: Floats, at: int) -> Floats:
        step = np.zeros(joints.shape[1])
        step[at] = STEP
        found: Floats = (self._error(joints + step) - self._error(joints - step)) / (2.0 * STEP)
        return found

    def _error(self, joints: Floats) -> Floats:
        """(n, n_row) error of the commanded freedoms, weighed; NaN where the tool is nowhere."""
        if not np.isfinite(joints).all():
            return np.full((len(joints), len(self._rows)), np.nan)
        error, status = self._actual.error(self._known, np.ascontiguousarray(joints))
        error[status != OK] = np.nan
        found: Floats = error[:, self._rows] * self._unit
        return found


def _usable(machine: Machine, actual: ActualMachine) -> tuple[Floats, int]:
    """(n, n_commanded) poses of the workspace that can be used, and how many cannot."""
    table = machine.poses()
    walk = Walk(machine, table, actual.condition)
    kept = [table[block.indices] for block in walk]
    if not kept:
        raise no_pose_left(machine, table, walk.left_out, of_file=True)
    poses = np.concatenate(kept)
    return poses, len(table) - len(poses)


def _spread(count: int, most: int) -> np.ndarray:
    """Numbers of at most `most` of `count` poses, evenly spaced."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(np.intp))


def _commanded_components(machine: Machine) -> list[int]:
    """Components of an error that commands can act on."""
    turns = any(name in "abc" for name in machine.commanded)
    return [
        at
        for at, name in enumerate(machine.components)
        if name in machine.commanded or (turns and name not in "xyz")
    ]


def _judge(actual: ActualMachine, model: SmallModel, values: Floats, poses: Floats) -> Error:
    """The error with some numbers at all poses, the shifts taken where the tool comes to."""
    machine = actual.machine
    parts = [_errors(actual, model, values, poses[rows]) for rows in blocks(len(poses))]
    position, orientation, parasitic = (np.concatenate(each) for each in zip(*parts, strict=True))
    turns = any(name in "abc" for name in machine.commanded)
    can_turn = any(name not in "xyz" for name in machine.components)
    return Error(
        extent(position, poses),
        extent(orientation, poses) if turns else None,
        extent(parasitic, poses) if can_turn and not turns else None,
    )


def _errors(
    actual: ActualMachine, model: SmallModel, values: Floats, poses: Floats
) -> tuple[Floats, Floats, Floats]:
    """(n,) lengths of the error in position, in orientation and of the parasitic rotation."""
    joints = np.ascontiguousarray(model.joints(values, poses))
    reached, status = actual.reached(joints, poses)
    if (status != OK).any():
        raise RequestError(
            Problem(
                "controller-cannot",
                "with the controller's numbers the machine does not come to its workspace",
                file=actual.machine.file,
                found=f"{int((status != OK).sum())} poses where the tool is nowhere near",
                expected="poses off singularities and off the edges of the machine's reach",
            )
        )
    linear = [at for at, name in enumerate(actual.machine.commanded) if name in "xyz"]
    position = np.linalg.norm((reached - poses)[:, linear], axis=1)
    kernel = actual.machine.kernel
    orientation = angle_between(kernel.placement_of(poses), kernel.placement_of(reached))
    known = actual.known(poses)
    error, _ = actual.error(known, joints)
    turning = [at for at, name in enumerate(actual.machine.components) if name not in "xyz"]
    return position, orientation, np.linalg.norm(error[:, turning], axis=1)


def angle_between(one: Floats, other: Floats) -> Floats:
    """(n,) angle, rad, between the unit quaternions of placements (n, 7).

    By the chord between them, which keeps its digits where the angle is small.
    """
    a, b = one[:, 3:], other[:, 3:]
    side = np.where(np.sum(a * b, axis=1, keepdims=True) < 0.0, -1.0, 1.0)
    chord = np.linalg.norm(a - side * b, axis=1)
    angles: Floats = 4.0 * np.arcsin(np.minimum(0.5 * chord, 1.0))
    return angles


def extent(values: Floats, poses: Floats, even: Flags | None = None) -> Extent:
    """Extent of `values` (n,) over `poses`; the rms over those that lie `even` (n,), if given."""
    worst = int(np.argmax(values))
    mean = float(np.mean(values**2 if even is None else values[even] ** 2))
    return Extent(float(values[worst]), poses[worst], math.sqrt(mean))


def _kept(model: SmallModel, jacobian: Floats) -> tuple[str, ...]:
    """Names of the numbers whose certainty comes from the weak equations."""
    n = jacobian.shape[1]
    told = np.linalg.inv(jacobian.T @ jacobian)
    shares = WEAK**2 * np.diagonal(told)
    return tuple(model.parameters[at].name for at in range(n) if shares[at] > KEPT)


def _words(machine: Machine, error: Error) -> str:
    position = error.position
    text = (
        f"at most {_micro(position.highest)} µm (at {pose_in_words(machine, position.at)}), "
        f"rms {_micro(position.rms)} µm"
    )
    if error.orientation is None:
        return text
    turned = error.orientation
    return (
        f"{text}; at most {_micro(turned.highest)} µrad "
        f"(at {pose_in_words(machine, turned.at)}), rms {_micro(turned.rms)} µrad"
    )


def _listed(names: Sequence[str]) -> str:
    if len(names) <= MOST_NAMED:
        return ", ".join(names)
    return f"{len(names)} of the numbers ({', '.join(names[:MOST_NAMED])}, ...)"


def _micro(value: float) -> str:
    return f"{value * 1e6:.1f}"


def _highest(extent: Extent | None) -> float:
    return 0.0 if extent is None else extent.highest


__all__ = ["Error", "Extent", "Fit", "angle_between", "extent", "fit", "heading"]
