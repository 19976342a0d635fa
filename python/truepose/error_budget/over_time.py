"""Error over time: what measured temperatures do to the tool, moment by moment."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from truepose.arrays import Floats
from truepose.errors import Problem, RequestError
from truepose.machine import Condition, Machine
from truepose.runs import displacement
from truepose.runs.arguments import checked
from truepose.runs.dataset import Schema, Variable, label
from truepose.runs.poses import BLOCK, OK, Progress
from truepose.runs.run import Run
from truepose.sources import PoseBlock, Thermal

if TYPE_CHECKING:
    import xarray as xr

SCHEMA: Schema = {
    "error": Variable(
        ("time", "pose", "component"), "component", "error from the temperatures of the moment"
    ),
    "temperature": Variable(("time", "part"), "K", "temperature of the part"),
}

# Results are filled a block of poses at a time: the pose is the first axis while they are.
_FILLED: Schema = {
    **SCHEMA,
    "error": dataclasses.replace(SCHEMA["error"], dims=("pose", "time", "component")),
}


@checked
def over_time(
    machine: Machine,
    poses: ArrayLike | None = None,
    condition: Condition | None = None,
    times: ArrayLike | None = None,
    *,
    progress: Progress | None = None,
) -> xr.Dataset:
    """The tool's error at home, or at `poses`, from the condition's temperature log, at every time.

    Exact. `poses` (..., n_commanded), SI; `condition`, default the file's, must have a
    temperature log; `times` (n_time,), s, within the log, default the log's own. Only the thermal
    source acts. A pose that cannot be used at some time is left out. The Dataset, SI, is described
    in docs/results.md.

    Raises `RequestError`: no-temperature-log, bad-times, outside-log, bad-poses, no-pose-left;
    `TrueposeError` (no-expansion) where a part is logged that does not say how it expands.
    """
    given = machine.condition if condition is None else condition
    moments = _times(machine, given, times)
    thermal, parts = Thermal(requested=True), machine.parts
    if poses is None:
        poses = _home(machine)
    run = Run(machine, poses, given, progress, sources=[thermal])
    run.begin(_FILLED, time=len(moments), part=len(parts))
    for block in run:
        error, status = _errors(thermal, block, moments)
        run.fill(block, {"error": error}, status)
    temperatures = np.empty((len(moments), len(parts)))
    for index, part in enumerate(parts):
        temperatures[:, index] = given.temperature(part, moments)
    coords = {
        "time": label("time", moments, "time in the temperature log", "s"),
        "part": label("part", list(parts), "part of the machine"),
    }
    dataset = run.dataset(over_all={"temperature": temperatures}, coords=coords)
    dataset["error"] = dataset["error"].transpose(*SCHEMA["error"].dims)
    return dataset


def _errors(thermal: Thermal, block: PoseBlock, times: Floats) -> tuple[Floats, np.ndarray]:
    """Errors (n_pose, n_time, n_component) and, of each pose, its worst status (n_pose,)."""
    machine, n_pose = block.machine, block.indices.size
    error = np.empty((n_pose, times.size, len(machine.components)))
    status = np.full(n_pose, OK, np.uint8)
    chunk = max(1, BLOCK // n_pose)
    for start in range(0, times.size, chunk):
        moments = times[start : start + chunk]
        # Every pose at the first moment, then every pose at the next.
        many = dataclasses.replace(
            block,
            indices=np.tile(block.indices, moments.size),
            joints=np.tile(block.joints, (moments.size, 1)),
            placements=np.tile(block.placements, (moments.size, 1)),
            travel=None,
            times=np.repeat(moments, n_pose),
        )
        deviation = thermal.deviation(machine, block.condition, many)
        moved = displacement.sum_deviations([(deviation.parameters, deviation.shift)])
        errors, failed = displacement.displacement(machine, many.joints, many.placements, moved)
        shape = (moments.size, n_pose)
        error[:, start : start + chunk] = errors.reshape(*shape, -1).swapaxes(0, 1)
        status = np.where(status == OK, failed.reshape(shape).max(axis=0), status)
    return error, status


def _home(machine: Machine) -> Floats:
    """(n_commanded,) where the machine starts."""
    return machine.home[[machine.dof.index(freedom) for freedom in machine.commanded]]


def _times(machine: Machine, condition: Condition, times: ArrayLike | None) -> Floats:
    """(n_time,) s, all within the log."""
    log = condition.temperature_log
    if log is None:
        raise RequestError(
            Problem(
                "no-temperature-log",
                "an error over time needs temperatures over time",
                machine.file,
                path="condition.temperature_log",
                found="no temperature log",
                expected='temperature_log = "file.csv" under [condition]',
            )
        )
    if times is None:
        return log.times
    try:
        moments = np.asarray(times, np.float64).reshape(-1)
    except (TypeError, ValueError):
        moments = np.empty(0)
    if moments.size == 0 or not np.isfinite(moments).all():
        raise RequestError(
            Problem(
                "bad-times",
                "these are no times",
                found="nothing, or something that is not a finite number",
                expected="(n_time,) numbers, s",
            )
        )
    log.require(moments)
    return moments


__all__ = ["SCHEMA", "over_time"]
