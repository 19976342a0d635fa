"""`truepose.part`: will the workpiece be good? Every toleranced quantity of it, answered."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, cast, get_args

import numpy as np

from truepose.arrays import Floats
from truepose.cluster.evaluator import Here, TaskEvaluator, evaluator_of
from truepose.cluster.instruction_sets import computing_with
from truepose.cluster.options import requested_cluster
from truepose.controllers.gcode.program import ProgramOptions
from truepose.controllers.gcode.work_offsets import Positions
from truepose.errors import Problem, RequestError
from truepose.machine import Condition, Machine
from truepose.runs.arguments import checked
from truepose.runs.poses import OK, REASONS, Progress, required_sources
from truepose.uncertainty_analysis.arguments import (
    required_probability,
    required_samples,
    required_seed,
)
from truepose.workpiece.alignment import Alignment
from truepose.workpiece.along import Sink, unusable_point, walk
from truepose.workpiece.along_file import fixed
from truepose.workpiece.datum_frame import datum_alignment
from truepose.workpiece.evaluation import PartEvaluation, Rule
from truepose.workpiece.first_order import FrameMotion
from truepose.workpiece.read import Part, read_part
from truepose.workpiece.states import PartState, part_states

if TYPE_CHECKING:
    import xarray as xr

SAMPLES = 4000
"""Machines that are drawn by default: the ends of a 95 % interval are then good to some 2 %."""


@checked
def part(
    machine: Machine,
    program: str | PathLike[str],
    features: str | PathLike[str] | None = None,
    condition: Condition | None = None,
    *,
    samples: int = SAMPLES,
    seed: int = 0,
    probability: float = 0.95,
    rule: Rule = "worst-case",
    exact: bool | None = None,
    units: str | None = None,
    start: Positions | None = None,
    offsets: Mapping[str, Positions] | None = None,
    parameter_file: str | PathLike[str] | None = None,
    block_delete: bool | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    tls: str | Path | None = None,
    progress: Progress | None = None,
) -> xr.Dataset:
    """What the machine makes of the part that a program of G-code asks for, against its tolerances.

    `program`: its file; `features`: a TOML file that names walls, bores and faces with their
    tolerances (docs/part_file.md), default the comments of the program. `condition`, default the
    file's. `samples` machines are drawn with `seed`, each of which goes to every point; intervals
    hold the share `probability` of them. `rule`: "worst-case" asks whether all machines inside the
    bands keep the limits, "iso-14253" whether the coverage interval does (ISO 14253-1). `exact`:
    whether samples are solved exactly; by default where first order is not enough. `units`,
    `start`, `offsets`, `parameter_file`, `block_delete` as in `truepose.correct_program`.
    `workers`: so many processes of this computer draw the samples, or those of the dask.distributed
    `scheduler`, "tcp://host:port" or "tls://host:port" with the folder `tls` (docs/scale.md); the
    numbers are the same. `progress` is called with (samples done, samples in all).

    Returns a Dataset over state ("before compensation", "after compensation") and characteristic,
    SI, described in docs/results.md. Effects of the process (cutter, clamping) are not in it.

    Raises `RequestError`: problems of the program (gcode-...) and of the features, no-source,
    bad-samples, bad-seed, bad-probability, bad-rule, bad-workers, no-scheduler, no-worker,
    worker-lost, extra-missing; `TrueposeError` as the sources do.
    """
    given = ProgramOptions(
        units,
        dict(start or {}),
        dict(offsets or {}),
        None if parameter_file is None else Path(parameter_file),
        block_delete,
    )
    cluster = requested_cluster(workers, scheduler, tls)
    asked = read_part(machine, Path(program), None if features is None else Path(features), given)
    with evaluator_of(cluster) as evaluator:
        evaluation = evaluate_part(
            machine,
            asked,
            machine.condition if condition is None else condition,
            samples=required_samples(samples, 2),
            seed=required_seed(seed),
            probability=required_probability(probability),
            rule=_required_rule(rule),
            exact=exact,
            evaluator=evaluator,
            progress=progress,
        )
    from truepose.workpiece.result import dataset

    return dataset(evaluation)


def _required_rule(rule: str) -> Rule:
    if rule not in get_args(Rule):
        raise RequestError(
            Problem(
                "bad-rule",
                "there is no such decision rule",
                found=f"{rule!r}",
                expected=" or ".join(f'"{name}"' for name in get_args(Rule)),
            )
        )
    return cast("Rule", rule)


def evaluate_part(
    machine: Machine,
    asked: Part,
    condition: Condition,
    *,
    samples: int = SAMPLES,
    seed: int = 0,
    probability: float = 0.95,
    rule: Rule = "worst-case",
    exact: bool | None = None,
    along: Callable[[PartState], Floats] | None = None,
    sinks: Sequence[Sink] = (),
    evaluator: TaskEvaluator | None = None,
    progress: Progress | None = None,
) -> PartEvaluation:
    """The same before it is a Dataset; `sinks` look at the whole path as it is walked.

    `evaluator`: who draws the samples, by default this process; all is computed on the instruction
    set that it begins with. `along`: what every variable of the state as commanded is at every
    point (n, n_variable), of one machine, which alone is evaluated then.
    """
    drawing = evaluator or Here()
    with computing_with(drawing.begun_with()):
        sources = required_sources(machine, condition)
        walked = walk(machine, condition, sources, asked.path(), asked.program, sinks)
        states, status = part_states(machine, condition, sources, walked.poses, walked.travel)
        lost = np.flatnonzero(status != OK)
        if lost.size:
            at = int(lost[0])
            line, pose = int(walked.lines[at]), walked.poses[at]
            raise unusable_point(machine, asked.program, line, pose, REASONS[status[at]])
        if along is not None:
            states = (fixed(states[0], along(states[0])),)
        return PartEvaluation(
            machine,
            condition,
            sources,
            states,
            asked.features,
            _alignment(asked, states[0].points),
            walked,
            asked.units,
            samples=samples,
            seed=seed,
            probability=probability,
            rule=rule,
            exact=exact,
            evaluator=drawing,
            progress=progress,
        )


def _alignment(asked: Part, points: Floats) -> Alignment:
    """As the part asks for it, of its programmed `points` (n, 3)."""
    if asked.alignment != "datums":
        return Alignment(asked.alignment, points, np.arange(len(points)))
    frame = datum_alignment(asked.datums, least_squares=False)
    members = np.concatenate([datum.place for datum in asked.datums])
    return Alignment("datums", points, members, frame, FrameMotion.of(frame.frame))


__all__ = ["SAMPLES", "evaluate_part", "part"]
