"""The base file of a study: all that a variant is made of, and the poses that it is asked for.

It is handed from process to process with the tasks, so it holds the text of the machine file and
its data files and needs neither again. Its poses are those that the file's verdict is about: those
that the file itself cannot be commanded to are asked of no variant.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from truepose.arrays import Flags, Indices
from truepose.error_budget.evaluate import Evaluation, evaluate
from truepose.errors import Problem, RequestError
from truepose.files.document import MACHINE_FILE
from truepose.files.text_file import held, read_text
from truepose.machine import Machine, Workspace
from truepose.machine import loader as machine_loader
from truepose.runs.poses import (
    BAND,
    REASONS,
    PoseRun,
    SkippedPoses,
    broken,
    is_path,
    no_pose_left,
)
from truepose.sources import REGISTRY


@dataclass(frozen=True, eq=False)
class BaseMachine:
    """A machine file with its data files, and the poses of a study.

    `file`: its name, for messages, and `text`; `data`: contents of the data files by path;
    `workspace`: the poses of the study, `numbers` (n,) their numbers in the file's workspace, and
    `has` (n,) which of them the base machine has, so that a variant can lose them.
    """

    file: str
    text: str
    data: Mapping[str, bytes]
    settings: tuple[str, ...]
    workspace: Workspace | None = None
    numbers: Indices | None = None
    has: Flags | None = None
    components: tuple[str, ...] = ()
    commanded: tuple[str, ...] = ()

    def machine(self, settings: Sequence[str] = ()) -> Machine:
        """The file with its own settings, then these, at the poses of the study.

        Raises as `truepose.load`.
        """
        with held({self.file: self.text.encode(), **self.data}):
            machine = machine_loader.load_text(
                self.file, self.text, settings=(*self.settings, *settings), registry=REGISTRY
            )
        return machine if self.workspace is None else replace(machine, workspace=self.workspace)

    def with_data_of(self, machine: Machine) -> BaseMachine:
        """The base with the data files that a variant of it names besides."""
        folder = Path(self.file).parent
        names = {str(folder / name): sha for name, sha in machine.data_files.items()}
        new = {path: sha for path, sha in names.items() if path not in self.data}
        if not new:
            return self
        contents = {path: Path(path).read_bytes() for path in new}
        for path, content in contents.items():
            if hashlib.sha256(content).hexdigest() != new[path]:
                raise RequestError(_changed_meanwhile(path))
        return replace(self, data={**self.data, **contents})

    @property
    def data_hashes(self) -> dict[str, str]:
        """SHA-256 of every data file, by its path from the folder of the machine file."""
        folder = Path(self.file).parent
        return {
            os.path.relpath(path, folder): hashlib.sha256(content).hexdigest()
            for path, content in sorted(self.data.items())
        }


def read_base(path: str | Path, settings: Sequence[str]) -> tuple[BaseMachine, Machine]:
    """The base of a machine file with some settings, and the machine that it describes.

    Raises `MachineFileError` and `RequestError` as `truepose.load`, `RequestError` (no-workspace,
    no-pose-left) where it has no pose.
    """
    _, text = read_text(Path(path), MACHINE_FILE)
    machine = machine_loader.load(path, settings=settings, registry=REGISTRY)
    base = BaseMachine(
        str(path),
        text,
        {},
        tuple(settings),
        components=machine.components,
        commanded=machine.commanded,
    ).with_data_of(machine)
    poses = machine.poses()
    assert machine.workspace is not None
    skipped, _ = evaluated(machine)
    indices, status = skipped.sorted()
    fit = np.ones(len(poses), np.bool_)
    fit[indices[~broken(status)]] = False
    has = np.ones(len(poses), np.bool_)
    has[indices] = False
    if not has.any():
        raise no_pose_left(machine, poses, skipped.counts(), of_file=True)
    workspace = machine.workspace
    if not fit.all():
        workspace = Workspace(listed=poses[fit], line=workspace.line, is_path=workspace.is_path)
    base = replace(base, workspace=workspace, numbers=np.flatnonzero(fit), has=has[fit])
    return base, replace(machine, workspace=workspace)


def evaluated(machine: Machine) -> tuple[SkippedPoses, Evaluation | None]:
    """The poses that the budget of a machine leaves out, and the budget.

    None where there is no budget, for nothing acts on the machine or no pose is left. Raises as
    `truepose.budget` for what else it cannot evaluate.
    """
    try:
        evaluation = evaluate(machine)
    except RequestError as failure:
        codes = {problem.code for problem in failure.problems}
        if not codes <= {"no-source", "no-pose-left"}:
            raise
        run = PoseRun(machine, machine.poses(), machine.condition, path=is_path(machine))
        usable = np.concatenate([np.empty(0, np.intp), *(block.indices for block in run)])
        if codes == {"no-pose-left"}:  # and so the machines inside the bands lost the others
            run.left_out.add(usable, np.full(usable.size, REASONS.index(BAND), np.uint8))
        return run.left_out, None
    return evaluation.run.left_out, evaluation


def _changed_meanwhile(path: str) -> Problem:
    return Problem(
        "machine-file-changed",
        f"{path} changed while it was read",
        path,
        found="other contents than a moment ago",
        expected="data files that stay as they are",
    )


__all__ = ["BaseMachine", "evaluated", "read_base"]
