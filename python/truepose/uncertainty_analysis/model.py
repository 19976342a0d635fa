"""A model as those that combine see it: outputs as a function of variables t.

A machine at one pose, whose outputs are the components of the error, and a plain function, whose
outputs are what it returns, are both `Model`s: everything that combines is written once for both.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from truepose._kernel import Points, Study
from truepose.arrays import Flags, Floats, Indices
from truepose.errors import Problem, RequestError
from truepose.machine import Condition, Machine
from truepose.runs.dataset import Schema, component_units
from truepose.runs.first_order import first_order
from truepose.runs.poses import Progress
from truepose.runs.quantities import quantities
from truepose.runs.run import Run
from truepose.runs.variables import Variables
from truepose.sources import PoseBlock
from truepose.sources.deviation import Distribution
from truepose.uncertainty_analysis.functions import derivatives
from truepose.uncertainty_analysis.functions.inputs import Correlation, Input, correlation_matrix
from truepose.uncertainty_analysis.sampler import study_of

if TYPE_CHECKING:
    import xarray as xr

KEPT = 4
"""Sets of points that the poses of a block share, kept at a time."""

VALUE = "value"
"""Output of a function that returns one array."""


@dataclass(frozen=True)
class LinearModel:
    """First order: output = value (m,) + effects (m, n_variable) @ t."""

    value: Floats
    effects: Floats


class Model(Protocol):
    """Outputs, of which there are m, as a function of n_variable variables t.

    `names`, `sources`, `distributions`, `correlation`, `directions`, `streams` and `numbers` of the
    variables are those of `Variables`; `dofs` (n_variable,): degrees of freedom of Student
    variables and of estimated standard uncertainties, else inf. `outputs` and `output_units`
    (m).
    """

    names: tuple[str, ...]
    sources: tuple[str, ...]
    distributions: tuple[Distribution, ...]
    correlation: Floats | None
    directions: tuple[Indices, ...]
    streams: Indices
    numbers: Indices
    dofs: Floats
    outputs: tuple[str, ...]
    output_units: tuple[str, ...]

    def linear(self) -> LinearModel:
        """The outputs where all variables are 0, and what each changes to first order."""
        ...

    def evaluate(self, t: Floats) -> tuple[Floats, Flags]:
        """Outputs (s, m) where the variables are t (s, n_variable), and (s,) whether they are."""
        ...


class SharedModel:
    """What the models of the poses of one block share."""

    def __init__(self, machine: Machine, block: PoseBlock, variables: Variables) -> None:
        self.machine, self.block, self.variables = machine, block, variables
        self.dofs: Floats = np.array(
            [distribution.degrees for distribution in variables.distributions], np.float64
        )
        self.output_units = tuple(component_units(machine))
        self._kept: list[tuple[Floats, Points]] = []

    @cached_property
    def linear(self) -> tuple[Floats, Floats]:
        """Value (n, m) and effects (n, m, n_variable) at every pose."""
        value, effects, _ = first_order(self.machine, self.block, self.variables)
        return value, effects

    @cached_property
    def study(self) -> Study:
        """The kernel's, of every pose."""
        return study_of(self.machine, self.block, self.variables)

    def points(self, t: Floats) -> Points:
        """Those for the kernel; of an array that cannot be written, made once for all poses."""
        for given, points in self._kept:
            if given is t:
                return points
        points = Points(np.ascontiguousarray(t, np.float64), len(self.variables.names))
        if isinstance(t, np.ndarray) and not t.flags.writeable:
            self._kept = [*self._kept[1 - KEPT :], (t, points)]
        return points

    @cached_property
    def worst_first(self) -> Indices:
        """(n,) numbers of the poses, the largest first-order variance first."""
        variances = first_order_variances(self.machine, self.variables, self.linear[1])
        return np.argsort(-variances, kind="stable")


def first_order_variances(machine: Machine, variables: Variables, effects: Floats) -> Floats:
    """(n,) variance of the tool's position, or of its rotation where it only turns; m^2 or rad^2.

    From effects (n, m, n_variable); 0 where that is no number.
    """
    sigmas = np.array([distribution.sigmas for distribution in variables.distributions])
    if not sigmas.size:
        return np.zeros(len(effects))
    chosen = next(iter(quantities(machine.components).values()))
    deviations = effects[:, chosen] / sigmas
    correlation = variables.correlation
    others = deviations if correlation is None else deviations @ correlation
    variances: Floats = np.nan_to_num((deviations * others).sum(axis=(1, 2)))
    return variances


class MachineModel:
    """The exact error of a machine at one pose of a block, m and rad, base frame."""

    def __init__(self, of_block: SharedModel, pose: int) -> None:
        """`pose`: number of the pose in the block."""
        self.of_block, self.pose = of_block, pose
        self.machine, self.block = of_block.machine, of_block.block
        variables = of_block.variables
        self.names, self.sources = variables.names, variables.sources
        self.distributions, self.correlation = variables.distributions, variables.correlation
        self.streams, self.numbers = variables.streams, variables.numbers
        self.directions = variables.directions
        self.dofs = of_block.dofs
        self.outputs: tuple[str, ...] = self.machine.components
        self.output_units = of_block.output_units

    @cached_property
    def at(self) -> PoseBlock:
        """The block of this pose alone."""
        chosen = np.zeros(self.block.indices.size, np.bool_)
        chosen[self.pose] = True
        return self.block.select(chosen)

    def linear(self) -> LinearModel:
        """Value and slopes where all sources are at their shift."""
        value, effects = self.of_block.linear
        return LinearModel(value[self.pose], effects[self.pose])

    def evaluate(self, t: Floats) -> tuple[Floats, Flags]:
        """Errors (s, m), exact; not ok, and NaN, where the moved machine cannot be placed."""
        points = self.of_block.points(t)
        values, failed = self.of_block.study.errors(self.pose, points)
        good: Flags = np.ones(len(values), np.bool_)
        if failed:
            good = np.asarray(np.isfinite(values).all(axis=1))
        return values, good


class FunctionModel:
    """A plain function of uncertain inputs.

    It is called with one array (s,) for each input, by its name, and returns an array (s,), or a
    dict of them by the outputs' names. `correlation`: coefficients by pairs of input names, or a
    matrix in the order of `inputs`.

    Raises `RequestError`: no-input, unknown-input, bad-function, not-finite at the estimates, and
    as `truepose.uncertainty_analysis.functions.inputs.correlation_matrix` does.
    """

    def __init__(
        self,
        function: Callable[..., Any],
        inputs: Mapping[str, Input],
        correlation: Correlation = None,
    ) -> None:
        self.function = _callable(function)
        self.inputs: dict[str, Input] = _inputs(inputs)
        _check_arguments(function, self.inputs)
        self.names = tuple(self.inputs)
        self.sources = self.names
        given = tuple(self.inputs.values())
        self.distributions = tuple(one.distribution for one in given)
        self.correlation = correlation_matrix(self.names, correlation)
        self.directions: tuple[Indices, ...] = ()
        self.streams: Indices = np.zeros(len(given), np.intp)
        self.numbers: Indices = np.arange(len(given), dtype=np.intp)
        self.dofs: Floats = np.array(
            [min(one.dof, one.distribution.degrees) for one in given], np.float64
        )
        self._centre = np.array([one.centre for one in given], np.float64)
        self._half = np.array([one.half for one in given], np.float64)
        self.outputs, self._value = self._probe()
        self.output_units = ("1",) * len(self.outputs)

    def evaluate(self, t: Floats) -> tuple[Floats, Flags]:
        """Outputs (s, m), and (s,) whether all of a sample are finite."""
        with np.errstate(all="ignore"):
            values = np.asarray(self._call(self._centre + self._half * t), np.float64)
        fine: Flags = np.asarray(np.isfinite(values).all(axis=1))
        return values, fine

    def linear(self) -> LinearModel:
        """Value at the estimates, and effects by differences, or a complex step where it can."""
        scale = derivatives.steps(self._centre, self._half)
        slopes = derivatives.slopes(self._call, self._centre, scale)
        return LinearModel(self._value, slopes * self._half)

    def _call(self, arguments: np.ndarray) -> np.ndarray:
        """Outputs (s, m) at arguments (s, n)."""
        columns = {name: arguments[:, at].copy() for at, name in enumerate(self.names)}
        returned = self.function(**columns)
        named = returned if isinstance(returned, Mapping) else {VALUE: returned}
        return np.stack([np.asarray(named[name]) for name in self.outputs], axis=1)

    def _probe(self) -> tuple[tuple[str, ...], Floats]:
        """Names of the outputs, and their values (m,) at the estimates."""
        count = 3
        columns = {
            name: np.full(count, centre)
            for name, centre in zip(self.names, self._centre.tolist(), strict=True)
        }
        with np.errstate(all="ignore"):
            try:
                returned = self.function(**columns)
            except (TypeError, ValueError) as error:
                raise _bad_function(
                    "the function cannot be called with arrays", f"{type(error).__name__}: {error}"
                ) from error
        named = returned if isinstance(returned, Mapping) else {VALUE: returned}
        if not named:
            raise _bad_function("the function returns nothing", "a dict without an entry")
        for name, values in named.items():
            if not isinstance(name, str):
                raise _bad_function("an output is named by text", repr(name))
            _check_returned(name, values, count)
        first = np.array([np.asarray(values, np.float64)[0] for values in named.values()])
        unfit = [name for name, fine in zip(named, np.isfinite(first), strict=True) if not fine]
        if unfit:
            raise RequestError(
                Problem(
                    "not-finite",
                    "the function has no finite value at the estimates of its inputs",
                    found=", ".join(unfit),
                    expected="a finite number",
                    hint="look at the estimates: "
                    + ", ".join(f"{name} = {one.centre:g}" for name, one in self.inputs.items()),
                )
            )
        return tuple(named), first


def _callable(function: Callable[..., Any]) -> Callable[..., Any]:
    if callable(function):
        return function
    raise _bad_function(
        "neither a machine nor a function", f"something of type {type(function).__name__}"
    )


def _inputs(inputs: Mapping[str, Input]) -> dict[str, Input]:
    """The inputs by name, checked to be some."""
    given = isinstance(inputs, Mapping)
    if not given or not inputs:
        raise RequestError(
            Problem(
                "no-input",
                "a function needs inputs that are uncertain",
                found="nothing"
                if given or inputs is None
                else f"something of type {type(inputs).__name__}",
                expected='inputs by name, such as {"x": tp.Input.normal(1.0, 0.1)}',
            )
        )
    for name, one in inputs.items():
        if not isinstance(one, Input):
            raise RequestError(
                Problem(
                    "wrong-type",
                    f"{name} is no input",
                    found=repr(one),
                    expected="a tp.Input",
                    hint=f"tp.Input.exact({one!r}) is a value without uncertainty",
                )
            )
    return dict(inputs)


def _check_arguments(function: Callable[..., Any], inputs: Mapping[str, Input]) -> None:
    """Whether the function takes just these inputs; one that cannot be asked is simply called."""
    try:
        signature = inspect.signature(function)
    except (TypeError, ValueError):
        return
    try:
        signature.bind(**inputs)
    except TypeError as error:
        raise RequestError(
            Problem(
                "unknown-input",
                f"the function does not take these inputs: {error}",
                found=", ".join(inputs),
                expected=", ".join(signature.parameters) or "no argument",
            )
        ) from None


def _check_returned(name: str, values: Any, count: int) -> None:
    try:
        array = np.asarray(values)
        real = array.dtype.kind in "biuf"
    except (TypeError, ValueError):
        real, array = False, np.empty(0)
    if not real:
        raise _bad_function(
            f"{name}: the function does not return real numbers", f"{type(values).__name__}"
        )
    if array.shape != (count,):
        raise _bad_function(
            f"{name}: the function does not return one number for each sample",
            f"shape {array.shape} where arrays of {count} went in",
        )


def _bad_function(message: str, found: str) -> RequestError:
    return RequestError(
        Problem(
            "bad-function",
            message,
            found=found,
            expected="a function of arrays of one length, by name, that returns such an array, "
            "or a dict of them",
            hint="numpy's functions take arrays: np.sqrt for math.sqrt, np.where for if; "
            "np.vectorize makes any function take them",
        )
    )


class Models:
    """The machine at each of some poses, one after the other; poses that cannot be used set aside.

    `condition`, default the file's; `progress` is called with (poses done, poses in all).
    Raises `RequestError`: bad-poses, no-workspace, no-source.
    """

    def __init__(
        self,
        machine: Machine,
        poses: ArrayLike | None = None,
        condition: Condition | None = None,
        progress: Progress | None = None,
    ) -> None:
        self.machine = machine
        self._progress = progress
        self._run = Run(machine, poses, condition)

    def __iter__(self) -> Iterator[tuple[int, MachineModel]]:
        """The worst pose of a block first, so that what is stopped early holds the worst."""
        total, done = len(self._run.poses), 0
        for block, variables in self._run.with_variables():
            of_block = SharedModel(self.machine, block, variables)
            for pose in of_block.worst_first.tolist():
                yield int(block.indices[pose]), MachineModel(of_block, pose)
                done += 1
                if self._progress is not None:
                    self._progress(done, total)
        if self._progress is not None:
            self._progress(total, total)

    def leave_out(self, model: MachineModel, status: int) -> None:
        """Set a pose aside for a reason that turned out, a kernel code or a number of `REASONS`."""
        self._run.left_out.add(model.at.indices, np.array([status], np.uint8))

    def begin(self, schema: Schema, **others: int) -> None:
        """Make room for a result over all poses; `others`: lengths of dims that no machine has."""
        self._run.begin(schema, **others)

    def fill(self, block: PoseBlock, poses: Indices, values: Mapping[str, np.ndarray]) -> None:
        """The `poses` (n,), ascending, of a block of the result, with `values` (n, ...)."""
        chosen = np.zeros(block.indices.size, np.bool_)
        chosen[poses] = True
        self._run.fill(block.select(chosen), values)

    def dataset(self, coords: Mapping[str, xr.Variable]) -> xr.Dataset:
        """The Dataset of the poses filled. Raises `RequestError` (no-pose-left) if none was."""
        return self._run.dataset(coords=coords)


def models(
    machine: Machine,
    poses: ArrayLike | None = None,
    condition: Condition | None = None,
    progress: Progress | None = None,
) -> Models:
    """(number in the poses asked for, model), the worst of a block first; see `Models`."""
    return Models(machine, poses, condition, progress)


__all__ = [
    "FunctionModel",
    "LinearModel",
    "MachineModel",
    "Model",
    "Models",
    "models",
]
