"""The steps that commands share: read the machine, evaluate, hand the result over."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING

import click
import numpy as np
from numpy.typing import ArrayLike

import truepose
from truepose.cli._options import Request
from truepose.cli._progress import progress, waiting
from truepose.cli._show import show_answers, show_tables
from truepose.cli._verbose import say_machine, say_result, step
from truepose.errors import Problem, RequestError
from truepose.files.document import MACHINE_FILE
from truepose.files.text_file import read_text
from truepose.files.wording import counted
from truepose.files.writing import replacing, require_writable, written_together
from truepose.reporting import assembly, formats
from truepose.reporting.display import pose_text
from truepose.reporting.result import Result
from truepose.reporting.study import Study
from truepose.reporting.table import Table
from truepose.runs.poses import Progress, faults_text, reason_text
from truepose.verdict.answer import BEFORE, NOT_MET

if TYPE_CHECKING:
    import xarray as xr

    from truepose.error_budget.evaluate import Evaluation
    from truepose.machine import Machine
    from truepose.plausibility import Oddity
    from truepose.reporting.workspace_check import WorkspaceCheck
    from truepose.verdict.answer import Answer

ASK = 'try it with --set accuracy.target="0.5 mm"'

MOST_PROBLEMS = 20
"""Poses named one by one when `--strict` refuses them."""


def read_machine(request: Request, endings: Sequence[str] = tuple(formats.FORMATS)) -> Machine:
    """Refuse files that cannot be written, then read the machine file.

    Raises `RequestError` (no-accuracy) where an accuracy is required that the file does not ask
    for: a silent yes would let a machine pass that nobody judged; no-witness where one is wanted
    of such a file.
    """
    if request.output is not None:
        require_writable(request.output, endings, [request.machine_file])
    if request.witness is not None:
        from truepose.verdict import witness_file

        require_writable(request.witness, [witness_file.ENDING], [request.machine_file])
    machine = load_machine(request.machine_file, request.settings)
    if request.require_accuracy and not machine.accuracy.asks:
        raise RequestError(
            Problem(
                "no-accuracy",
                "--require-accuracy needs an accuracy to judge by",
                file=str(request.machine_file),
                path="accuracy",
                found="nothing",
                expected='[accuracy] with target = "0.5 mm", or angle_target',
                hint=ASK,
            )
        )
    if request.witness is not None and not machine.accuracy.asks:
        raise _no_witness("no accuracy that is asked for", ASK)
    return machine


def load_machine(file: Path, settings: Sequence[str] = ()) -> Machine:
    """The machine of a file, and what it is for who wants to know (`--verbose`)."""
    with step("machine file"):
        machine = truepose.load(file, settings=settings)
        say_machine(machine)
    return machine


def machine_text(request: Request) -> str:
    """The machine file as it was read, once if it comes out of a pipe."""
    _, text = read_text(request.machine_file, MACHINE_FILE)
    return text


class Watching(assembly.Watcher):
    """Shows on stderr how far it is and what is warned of, and refuses what `--strict` does."""

    def __init__(self, request: Request) -> None:
        self.request = request
        self.odd: tuple[Oddity, ...] = ()

    def progress(self, what: str, unit: str = "poses") -> AbstractContextManager[Progress | None]:
        """A bar, where someone looks."""
        return progress(what, unit)

    def waiting(self, what: str) -> AbstractContextManager[None]:
        """A clock, where someone looks."""
        return waiting(what)

    def looked_at(
        self, machine: Machine, workspace: WorkspaceCheck, odd: tuple[Oddity, ...]
    ) -> None:
        """Keep what looks odd, and refuse left out poses if asked."""
        self.odd = odd
        out = ~workspace.usable
        poses, status = workspace.poses[out], workspace.status[out]
        refuse_left_out(self.request, machine, out.nonzero()[0], poses, status)

    def evaluated(self, machine: Machine, result: Evaluation) -> None:
        """Refuse left out poses if asked; what it warns of goes to stderr."""
        indices, status = result.run.left_out.sorted()
        refuse_left_out(self.request, machine, indices, result.run.poses[indices], status)
        show_warnings(result.warnings)

    def computed(self, machine: Machine, result: xr.Dataset) -> None:
        """Refuse left out poses if asked."""
        refuse_left_out_of(self.request, machine, result)


def evaluate(request: Request, machine: Machine) -> xr.Dataset:
    """The error budget over the file's workspace; what it warns of goes to stderr."""
    return assembly.evaluation(machine, Watching(request)).dataset()


def show_warnings(warnings: Iterable[Mapping[str, str]]) -> None:
    """What a result warns of, on stderr."""
    for warning in warnings:
        click.echo(f"warning[{warning['code']}]: {warning['sentence']}", err=True)


def strain(request: Request, machine: Machine) -> xr.Dataset:
    """The internal forces over the file's workspace."""
    return assembly.internal_forces(machine, Watching(request))


def over_time(request: Request, machine: Machine) -> xr.Dataset:
    """The error over the file's temperature log, at home."""
    with progress("error over time") as report:
        result = truepose.over_time(machine, progress=report)
    refuse_left_out_of(request, machine, result)
    return result


def answers_of(request: Request, machine: Machine, *states: str) -> tuple[Answer, ...]:
    """The verdict over the file's workspace in the states asked, by default both."""
    return assembly.answers(machine, Watching(request), *states)


def compared(request: Request, machine: Machine) -> Study:
    """The machine with both results, and the verdict on both."""
    return assembly.compared(machine, Watching(request))


def deliver(
    request: Request,
    result: Result,
    tables: Iterable[Table | None],
    answers: Sequence[Answer] = (),
    *,
    witness_of: str = BEFORE,
    beside: Sequence[tuple[Path, str]] = (),
) -> None:
    """Write the files that are asked for, and print the result in the format asked.

    For people the `answers` come first. `witness_of`: the state whose witness is written;
    `beside`: other files, and their texts. Raises `RequestError` (no-witness) at the end, where
    that is asked for and there is none.
    """
    say_result(result.dataset)
    with written_together():
        if request.output is not None:
            with step(f"{request.output} written"):
                formats.write(result, request.output)
        written = write_witness(request, answers, witness_of)
        for path, text in beside:
            with replacing(path) as temporary:
                temporary.write_text(text, encoding="utf-8", newline="\n")
    if request.format == "table":
        show_answers(result.machine, answers)
        show_tables(table for table in tables if table is not None)
    else:
        sys.stdout.writelines(formats.text(result, f".{request.format}"))
    note_written(request.output, request.witness if written else None)
    note_written(*(path for path, _ in beside))
    if not written:
        raise no_witness(answers, witness_of)


def write_witness(request: Request, answers: Sequence[Answer], state: str) -> bool:
    """Write the witness of the first answer of a state that is NOT met; whether there is one.

    True too where none is asked for.
    """
    path = request.witness
    if path is None:
        return True
    from truepose.verdict import witness_file

    for answer in answers:
        if answer.state == state and answer.answer == NOT_MET and answer.example is not None:
            example, original = answer.example, request.machine_file
            witness_file.write_witness(example.machine, example, path, original=original)
            return True
    return False


def no_witness(answers: Sequence[Answer], state: str) -> RequestError:
    """What is raised where a witness was asked for, and the answers of the state have none."""
    words = [
        f"{answer.quantity}: {answer.answer or 'nothing asked'}"
        for answer in answers
        if answer.state == state
    ]
    sampled = any(answer.coverage is not None for answer in answers)
    hint = "a coverage has no one machine: try --set accuracy.at=worst" if sampled else None
    return _no_witness(f"{state}, {', '.join(words)}", hint)


def _no_witness(found: str, hint: str | None) -> RequestError:
    return RequestError(
        Problem(
            "no-witness",
            "there is no witness to write",
            found=found,
            expected="an accuracy that is NOT met: the machine that exceeds it is the witness",
            hint=hint,
        )
    )


def exit_code(request: Request, met: bool | None) -> int:
    """1 where the accuracy asked is required and not met, else 0."""
    return int(request.require_accuracy and met is False)


def note_written(*paths: Path | None) -> None:
    """Say on stderr which files were written, so that stdout stays what was asked for."""
    for path in filter(None, paths):
        click.echo(f"wrote {path}", err=True)


def refuse_left_out(
    request: Request, machine: Machine, numbers: ArrayLike, poses: ArrayLike, statuses: ArrayLike
) -> None:
    """With `--strict`, raise `RequestError` (unusable-pose) where poses were left out.

    `numbers` (n,) in the poses asked for, `poses` (n, n_commanded) SI, `statuses` (n,) by name.
    """
    left_out = list(zip(np.asarray(numbers), np.asarray(poses), np.asarray(statuses), strict=True))
    if not (request.strict and left_out):
        return
    line = machine.workspace.line if machine.workspace is not None else None
    problems = [
        Problem(
            "unusable-pose",
            f"pose {number} cannot be used: {pose_text(pose, machine.commanded, machine.shown)}",
            file=machine.file,
            line=line,
            found=_why(machine, pose, str(status)),
            expected="a pose within reach and travel, off singularities",
        )
        for number, pose, status in left_out[:MOST_PROBLEMS]
    ]
    if len(left_out) > MOST_PROBLEMS:
        problems.append(
            Problem(
                "unusable-pose",
                f"{counted(len(left_out) - MOST_PROBLEMS, 'more pose')} cannot be used",
                file=machine.file,
                line=line,
                found=f"{len(left_out)} poses that cannot be used, the first {MOST_PROBLEMS} above",
                expected="none",
                hint="`truepose check` counts them and says why",
            )
        )
    raise RequestError(*problems)


def _why(machine: Machine, pose: np.ndarray, status: str) -> str:
    """The status of a pose that cannot be used, and which part fails by how much."""
    because = faults_text(machine, machine.kernel.explain(pose))
    return reason_text(status) + (f": {because}" if because else "")


def refuse_left_out_of(request: Request, machine: Machine, dataset: xr.Dataset) -> None:
    """The same of the poses that a result left out."""
    poses = [dataset[f"left_out_{name}"].values for name in machine.commanded]
    refuse_left_out(
        request,
        machine,
        dataset["left_out_index"].values,
        np.stack(poses, axis=-1),
        dataset["left_out_status"].values,
    )
