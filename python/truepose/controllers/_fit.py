"""Fits a controller's small model to the actual machine, and says what error is left over.

The actual machine is the nominal one with every source at its shift, in the machine's condition.
The controller drives its joints to `model.joints(values, X)`, and the tool comes to Y; the values
are those that make the sum of squares of Y - X over the workspace least, rotations weighed with
the characteristic length. What is stated is then evaluated for the rounded numbers as they are
printed, at every pose of the workspace.

A number, or a mixture of numbers, that moves the tool by less than 1e-5 of its change is
not told by the workspace: it stays at the nominal machine's value. That is what the weak equations
`WEAK * (value - start) / size = 0` do. Since the sum of squares with them is least, they add at
most WEAK times the root of the sum of squares of the changes to the least rms that there is.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from truepose.arrays import Flags, Floats
from truepose.calibration import Solution, least_squares
from truepose.compensation.commands import ActualMachine, blocks
from truepose.controllers._export import geometry_loaded
from truepose.controllers._homing import switch_words
from truepose.controllers._small_model import (
    INSTEAD,
    Printed,
    SmallModel,
    ascii_only,
    in_file_units,
    more_decimals,
    scales,
)
from truepose.errors import Problem, RequestError
from truepose.files.wording import counted
from truepose.machine import Machine
from truepose.machine.condition import STANDARD_GRAVITY
from truepose.runs.poses import OK, PoseRun, no_pose_left, pose_in_words
from truepose.spatial import angle_between
from truepose.version import version

MOST_FITTED = 2000
"""Poses that are fitted to, evenly spaced over the usable ones; all of them are judged."""

WEAK = 1e-5
"""Weight of the nominal numbers against the tool's error, m per m."""

KEPT = 0.1
"""Share of a number's certainty that comes from its nominal value, above which it is named."""

MOST_NAMED = 6
"""Names that one line holds."""

STEP = 1e-6
"""Step of central differences, in characteristic lengths or rad: their error is some 1e-10 of the
derivative."""

UNLIKE = 0.01
"""What the controller's model may miss the nominal machine by, in the diagonal of the workspace:
more is another machine."""

HELD = 1e-7
"""Of the characteristic length: what a model that holds the nominal machine may miss by."""

EXACT = 1e-12
"""Of the characteristic length: an rms error that is rounding and has nothing to be fitted."""

FEW = 50
"""Evaluations for the nominal machine, of which only the size of what is left is wanted."""

OUT = 0.01
"""How far a joint may be driven beyond its travel, in that travel, as corrections do at its ends:
farther, the controller does not count its joints as the machine does."""

ROUNDING = 1e-9
"""Of a travel: what a joint at its end may be beyond it."""

ALIKE = 1e-4
"""Errors that differ by less, in the highest of them, are no reason to name one pose and not
another."""

SMALL = 0.01
"""m: machines of a smaller characteristic length are told more decimals."""


AS_DRAWN = "controllers' models are symmetrical about the z axis, guideways upright"
"""What to look at where a nominal machine is not in the model."""


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
class ModelFit:
    """A fitted model: its numbers as `printed` and what they leave.

    `values` (n,): what the controller makes of `printed`. `before`: with the numbers of the
    nominal machine; `after`: with those printed; `designed`: what is left of the machine without
    any error, with the numbers that suit it best. `switches` (n_joint,): where they trip. `kept`:
    names of numbers that the workspace does not tell. `settled`: whether the fit converged.
    `n_pose`, `n_left_out`: poses judged, and not usable; `n_out`: judged ones at which a joint is
    driven beyond its travel.
    """

    printed: Printed
    values: Floats
    before: Error
    after: Error
    designed: Error
    switches: Floats
    kept: tuple[str, ...]
    settled: bool
    n_pose: int
    n_left_out: int
    n_out: int

    def statement(self, machine: Machine) -> tuple[str, ...]:
        """Lines for the user: what is left, what was, and what the numbers cannot do."""
        poses = "the only pose" if self.n_pose == 1 else f"{self.n_pose} poses"
        lines = []
        if self.kept:
            lines.append(
                f"this workspace hardly tells {_listed(self.kept)}: "
                "mixtures of these stay at the nominal machine's values"
            )
        lines += [
            f"left over with these numbers: {_words(machine, self.after)}",
            f"with the nominal machine's numbers: {_words(machine, self.before)}",
            f"over {poses} of the workspace, in this condition: {_condition(machine)}",
        ]
        designed = _small(machine, self.designed.position.highest)
        if float(designed.split()[0]) > 0.0:
            lines.append(
                "this model does not hold the machine as designed: "
                f"of that alone at most {designed} are left"
            )
        if self.n_left_out:
            left_out = counted(self.n_left_out, "pose")
            lines.append(f"{left_out} of the workspace cannot be used, and left out")
        if self.n_out:
            lines.append(
                f"at {counted(self.n_out, 'pose')} these numbers drive a joint out of its travel, "
                "by less than the hundredth part of it: do not command them"
            )
        if self.after.parasitic is not None:
            lines.append(
                "besides, the platform turns by up to "
                f"{_small_angle(machine, self.after.parasitic.highest)} "
                f"(before: {_small_angle(machine, _highest(self.before.parasitic))}) more than as "
                "designed, which this controller cannot command"
            )
        lines += _scales(machine)
        if not self.settled:
            lines.append("the fit has not converged: other numbers may leave less")
        return (*lines, *geometry_loaded(machine))


def heading(machine: Machine, fit: ModelFit, controller: str) -> tuple[str, ...]:
    """Lines that say what a block is of, in ASCII, for its comment."""
    units = dict(zip(machine.parameters, machine.units, strict=True))
    changes = [f"{key} = {value}" for key, value in machine.settings.items()]
    changes += [f"{key} = {value!r} {units[key]}" for key, value in machine.replaced.items()]
    lines = (
        f"{controller} parameters of {machine.name!r}, fitted by truepose {version()}",
        f"machine file {machine.file}, SHA-256 {machine.file_hash}",
        *(f"changed: {change}" for change in changes),
        *fit.statement(machine),
        switch_words(machine, fit.switches),
    )
    return tuple(ascii_only(line) for line in lines)


def fit(machine: Machine, model: SmallModel, *, most_evaluations: int = 1000) -> ModelFit:
    """Find a model's numbers for the actual machine, and judge them.

    Raises `RequestError`: no-workspace, no-pose-left, and controller-cannot where the model does
    not reach the workspace with the nominal machine's numbers.
    """
    actual = ActualMachine(machine)
    poses, left_out = _usable(machine, actual)
    chosen = poses[_spread(len(poses), MOST_FITTED)]
    start = np.array([parameter.start for parameter in model.parameters])
    as_designed = _NominalMachine(machine)
    designed, _ = _assess(as_designed, model, start, poses)
    if designed.position.highest > HELD * machine.characteristic_length:
        suited, _ = _solved(as_designed, model, chosen, FEW)
        designed, _ = _assess(as_designed, model, suited, poses)
        _require_alike(machine, designed, poses)
    fitted, solution = _solved(actual, model, chosen, most_evaluations)
    printed = model.format(fitted)
    values = model.parse(printed)
    before, _ = _assess(actual, model, model.parse(model.format(start)), poses)
    after, joints = _assess(actual, model, values, poses)
    return ModelFit(
        printed,
        values,
        before,
        after,
        designed,
        model.switches,
        _kept(model, solution.jacobian),
        solution.converged,
        len(poses),
        left_out,
        _out_of_travel(machine, joints),
    )


class _NominalMachine(ActualMachine):
    """The machine as designed, cold and unloaded: no source acts."""

    def __init__(self, machine: Machine) -> None:
        super().__init__(machine)
        self.sources = ()


def _solved(
    actual: ActualMachine, model: SmallModel, poses: Floats, most_evaluations: int
) -> tuple[Floats, Solution]:
    """The model's values (n,), SI, that fit a machine best at `poses`, and how they were found.

    Raises `RequestError` (controller-cannot) where the nominal numbers do not reach `poses`.
    """
    problem = _FitProblem(actual, model, poses)
    start = np.zeros(len(model.parameters))
    error = problem.residual(start)
    cost = float(error @ error)
    if not math.isfinite(cost):
        raise _out_of_reach(actual.machine)
    if math.sqrt(cost) <= EXACT * actual.machine.characteristic_length:
        # There is nothing to find, and rounding has no optimum.
        as_it_is = Solution(start, error, problem.jacobian(start), cost, "cost", 1, 0)
        return problem.values(start), as_it_is
    solution = least_squares(
        problem.residual, problem.jacobian, start, most_evaluations=most_evaluations
    )
    return problem.values(solution.values), solution


def _out_of_reach(machine: Machine) -> RequestError:
    return RequestError(
        Problem(
            "controller-cannot",
            "the controller's model does not reach the workspace",
            file=machine.file,
            found="joints that cannot be computed with the nominal machine's numbers",
            expected="a workspace within the reach of the controller's model",
            hint=f"{AS_DRAWN}; otherwise {INSTEAD}",
        )
    )


def _require_alike(machine: Machine, designed: Error, poses: Floats) -> None:
    """Refuse a machine that differs from the controller's model by more than errors do."""
    linear = [at for at, name in enumerate(machine.commanded) if name in "xyz"]
    diagonal = float(np.linalg.norm(np.ptp(poses[:, linear], axis=0)))
    if designed.position.highest <= UNLIKE * (diagonal or machine.characteristic_length):
        return
    left = in_file_units(machine, designed.position.highest, "length")
    raise RequestError(
        Problem(
            "controller-cannot",
            "the controller's model does not hold this machine",
            file=machine.file,
            found=f"{left} left of the machine as designed, without any error, "
            f"at {pose_in_words(machine, designed.position.at)}",
            expected=f"at most {UNLIKE:.0%} of the workspace's diagonal",
            hint=f"{AS_DRAWN}; otherwise {INSTEAD}",
        )
    )


def _out_of_travel(machine: Machine, joints: Floats) -> int:
    """At how many poses a joint of (n, n_joint) is out of its travel.

    Raises `RequestError` (controller-cannot) where one is so by more than corrections explain.
    """
    ends = np.array([drive.travel for drive in machine.drives])
    span = ends[:, 1] - ends[:, 0]
    beyond = np.maximum(ends[:, 0] - joints, joints - ends[:, 1]) / span
    pose, drive = np.unravel_index(int(np.argmax(beyond)), beyond.shape)
    if beyond[pose, drive] > OUT:
        worst = machine.drives[drive]
        there = in_file_units(machine, float(joints[pose, drive]), worst.coordinate)
        low, high = (in_file_units(machine, end, worst.coordinate) for end in worst.travel)
        raise RequestError(
            Problem(
                "controller-cannot",
                "with the controller's numbers a drive leaves its travel",
                file=machine.file,
                found=f"{worst.name} at {there}",
                expected=f"{low} to {high}",
                hint="the controller counts from the switches: see the option switches",
            )
        )
    return int((beyond > ROUNDING).any(axis=1).sum())


class _FitProblem:
    """Residuals, m, of all poses, and the weak equations; unknowns are changes over their sizes."""

    def __init__(self, actual: ActualMachine, model: SmallModel, poses: Floats) -> None:
        self._actual, self._model = actual, model
        self._known = actual.deviations_at(poses)
        self._poses = poses
        machine = actual.machine
        self._rows = _commanded_components(machine)
        length = machine.characteristic_length
        # Steps that move the tool by like lengths, in machines of any size.
        self._step = STEP * length
        self._joint_steps = np.array(
            [self._step if d.coordinate == "length" else STEP for d in machine.drives]
        )
        self._unit = np.array(
            [1.0 if machine.components[row] in "xyz" else length for row in self._rows]
        )
        self._unit /= np.sqrt(len(poses))
        self._start = np.array([parameter.start for parameter in model.parameters])
        self._size = np.array([parameter.size for parameter in model.parameters])

    def values(self, change: Floats) -> Floats:
        """The model's numbers, SI."""
        values: Floats = self._start + self._size * change
        return values

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
            step[at] = self._step * size
            ahead = self._model.joints(values + step, self._poses)
            behind = self._model.joints(values - step, self._poses)
            turned = (ahead - behind) / (2.0 * self._step)
            columns.append(np.einsum("nij,nj->ni", by_joint, turned).ravel())
        return np.concatenate([np.stack(columns, axis=1), WEAK * np.eye(values.size)])

    def _by_joint(self, joints: Floats, at: int) -> Floats:
        step = np.zeros(joints.shape[1])
        step[at] = self._joint_steps[at]
        ahead, behind = self._error(joints + step), self._error(joints - step)
        slope: Floats = (ahead - behind) / (2.0 * step[at])
        return slope

    def _error(self, joints: Floats) -> Floats:
        """(n, n_row) error of the commanded freedoms, weighed; NaN where the tool is nowhere."""
        if not np.isfinite(joints).all():
            return np.full((len(joints), len(self._rows)), np.nan)
        error, status = self._actual.error(self._known, np.ascontiguousarray(joints))
        error[status != OK] = np.nan
        residual: Floats = error[:, self._rows] * self._unit
        return residual


def _usable(machine: Machine, actual: ActualMachine) -> tuple[Floats, int]:
    """(n, n_commanded) poses of the workspace that can be used, and how many cannot."""
    table = machine.poses()
    walk = PoseRun(machine, table, actual.condition)
    kept = [table[block.indices] for block in walk]
    if not kept:
        raise no_pose_left(machine, table, walk.left_out.counts(), of_file=True)
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


def _assess(
    actual: ActualMachine, model: SmallModel, values: Floats, poses: Floats
) -> tuple[Error, Floats]:
    """The error with some numbers at all poses, the shifts taken where the tool comes to.

    And the joints (n, n_joint) to which they drive.
    """
    machine = actual.machine
    parts = [_errors(actual, model, values, poses[rows]) for rows in blocks(len(poses))]
    position, orientation, parasitic, joints = (
        np.concatenate(columns) for columns in zip(*parts, strict=True)
    )
    turns = any(name in "abc" for name in machine.commanded)
    can_turn = any(name not in "xyz" for name in machine.components)

    def over(values: Floats) -> Extent:
        # Where many are as bad, rounding would choose: the one nearest to the middle.
        alike = np.flatnonzero(values >= (1.0 - ALIKE) * values.max())
        away = (poses[alike] - 0.5 * (poses.min(axis=0) + poses.max(axis=0))) / actual.unit
        nearest = poses[alike[int(np.argmin(np.linalg.norm(away, axis=1)))]]
        return replace(extent(values, poses), at=nearest)

    error = Error(
        over(position),
        over(orientation) if turns else None,
        over(parasitic) if can_turn and not turns else None,
    )
    return error, joints


def _errors(
    actual: ActualMachine, model: SmallModel, values: Floats, poses: Floats
) -> tuple[Floats, Floats, Floats, Floats]:
    """(n,) lengths of the error in position, in orientation and of the parasitic rotation.

    And the joints (n, n_joint). Raises `RequestError` (controller-cannot).
    """
    joints = np.ascontiguousarray(model.joints(values, poses))
    if not np.isfinite(joints).all():
        raise _out_of_reach(actual.machine)
    reached, status = actual.reached(joints, poses)
    lost = int((status != OK).sum())
    if lost:
        raise RequestError(
            Problem(
                "controller-cannot",
                "with the controller's numbers the machine does not come to its workspace",
                file=actual.machine.file,
                found=f"{counted(lost, 'pose')} where the tool is nowhere near",
                expected="poses off singularities and off the edges of the machine's reach",
                hint="make the workspace smaller, or drop the poses at its edges",
            )
        )
    linear = [at for at, name in enumerate(actual.machine.commanded) if name in "xyz"]
    position = np.linalg.norm((reached - poses)[:, linear], axis=1)
    kernel = actual.machine.kernel
    asked_for, got = kernel.placement_of(poses), kernel.placement_of(reached)
    orientation = angle_between(asked_for[:, 3:], got[:, 3:])
    known = actual.deviations_at(poses)
    error, _ = actual.error(known, joints)
    turning = [at for at, name in enumerate(actual.machine.components) if name not in "xyz"]
    return position, orientation, np.linalg.norm(error[:, turning], axis=1), joints


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
        f"at most {_small(machine, position.highest)} "
        f"(at {pose_in_words(machine, position.at)}), rms {_small(machine, position.rms)}"
    )
    if error.orientation is None:
        return text
    turned = error.orientation
    return (
        f"{text}; at most {_small_angle(machine, turned.highest)} "
        f"(at {pose_in_words(machine, turned.at)}), rms {_small_angle(machine, turned.rms)}"
    )


def _condition(machine: Machine) -> str:
    """Temperatures and loads of the machine's condition, for people, in the file's units."""
    known = machine.condition

    def vector(name: str, values: Sequence[float], dimension: str) -> list[str]:
        shown = [in_file_units(machine, value, dimension) for value in values]
        return [f"{name} {', '.join(shown)}"] if any(values) else []

    def degrees(kelvin: float) -> str:
        return in_file_units(machine, kelvin, "temperature")

    parts = [f"temperature {degrees(known.default_temperature)}"]
    parts += [f"{part} {degrees(kelvin)}" for part, kelvin in known.part_temperatures.items()]
    parts.append(f"reference {degrees(known.reference_temperature)}")
    parts += [
        f"gradient of {part} {', '.join(f'{value:.6g}' for value in gradient)} K/m"
        for part, gradient in known.gradients.items()
    ]
    if known.temperature_log is not None:
        time = "at its end" if known.time is None else f"at {known.time:g} s"
        parts.append(f"temperature log {time}")
    parts += vector("force", known.force, "force")
    parts += vector("moment", known.moment, "moment")
    parts += vector("acceleration", known.acceleration, "acceleration")
    if known.gravity != STANDARD_GRAVITY:
        parts.append(f"gravity {in_file_units(machine, known.gravity, 'acceleration')}")
    parts += [f"{key} {value}" for key, value in known.source_keys.items()]
    return "; ".join(parts)


def _scales(machine: Machine) -> list[str]:
    """What the controller's steps must be of, where a drive's coordinate is not its travel."""
    odd = [
        f"{drive.name} {scale:.9g}"
        for drive, scale in zip(machine.drives, scales(machine), strict=True)
        if scale != 1.0
    ]
    if not odd:
        return []
    return [
        "the controller counts true travel: its steps per mm or degree are those of the machine "
        f"file's joint coordinate divided by the drive's scale: {', '.join(odd)}"
    ]


def _listed(names: Sequence[str]) -> str:
    if len(names) <= MOST_NAMED:
        return ", ".join(names)
    return f"{len(names)} of the numbers ({', '.join(names[:MOST_NAMED])}, ...)"


def _small(machine: Machine, value: float) -> str:
    unit = machine.shown.small_length
    places = 1 + more_decimals(machine.characteristic_length, SMALL)
    return f"{value * unit.per_si:.{places}f} {unit.label}"


def _small_angle(machine: Machine, value: float) -> str:
    unit = machine.shown.small_angle
    places = 1 if unit.per_si >= 1e6 else 3
    return f"{value * unit.per_si:.{places}f} {unit.label}"


def _highest(extent: Extent | None) -> float:
    return 0.0 if extent is None else extent.highest


__all__ = ["Error", "Extent", "ModelFit", "extent", "fit", "heading"]
