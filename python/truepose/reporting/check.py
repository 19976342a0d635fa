"""What a machine file holds, and whether the accuracy asked is met: `truepose check`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from truepose.errors import RequestError
from truepose.machine import Machine
from truepose.plausibility import Oddity, oddities_where_checked
from truepose.reporting import assembly, inputs, workspace_check
from truepose.reporting.workspace_check import WorkspaceCheck, check_workspace
from truepose.representation import Facts, Represented, facts_html
from truepose.runs.arguments import checked
from truepose.verdict.answer import BEFORE, Answer, met

if TYPE_CHECKING:
    from collections.abc import Mapping

    from truepose.reporting.table import Table


@dataclass(frozen=True, eq=False, repr=False)
class MachineCheck(Represented):
    """A machine looked at: its `workspace`, what looks odd, and the `answers`, if there are any.

    `answers` is empty of a machine without a source that acts and of which nothing is asked.
    `warnings`: the `code` and `sentence` of each. As text it reads as the command prints it.
    """

    machine: Machine
    workspace: WorkspaceCheck
    oddities: tuple[Oddity, ...]
    answers: tuple[Answer, ...]
    warnings: tuple[Mapping[str, str], ...]

    @property
    def met(self) -> bool | None:
        """Whether all that is asked is met, as the machine is commanded; None if nothing is."""
        return met(self.answers, BEFORE)

    @property
    def tables(self) -> list[Table]:
        """All that there is to say, as tables for people."""
        from truepose.reporting import calibrated_files, tables
        from truepose.reporting.table import with_not_included
        from truepose.sources import not_included_text

        machine = self.machine
        left_out = not_included_text(machine, machine.condition)
        made = calibrated_files.calibration(machine)
        shown = [
            inputs.machine(machine),
            *([] if made is None else [made]),
            inputs.condition(machine),
            with_not_included(inputs.sources(machine), left_out),
            inputs.deviations(machine),
            workspace_check.table(machine, self.workspace),
        ]
        return [*shown, tables.answers(machine, self.answers)] if self.answers else shown

    def as_data(self) -> dict[str, Any]:
        """The same for programs, in the units of the machine file, which are named."""
        from truepose.reporting.accuracy import as_data
        from truepose.sources import NO_MATERIAL, not_included

        machine = self.machine
        made = machine.calibration
        left_out = not_included(machine, machine.condition)
        return {
            "command": "check",
            "machine": inputs.machine_data(machine),
            "calibration": None if made is None else made.model_dump(),
            "sources": inputs.source_data(machine),
            "not_included": [{"part": part, "why": NO_MATERIAL} for part in left_out],
            "oddities": [
                {"code": oddity.code, "sentence": oddity.sentence, "parts": list(oddity.parts)}
                for oddity in self.oddities
            ],
            "workspace": workspace_check.as_data(machine, self.workspace),
            "answers": [as_data(machine, answer) for answer in self.answers],
            "warnings": list(self.warnings),
        }

    def __str__(self) -> str:
        from truepose.reporting import terminal

        parts = [
            terminal.oddities_text(self.oddities),
            terminal.answers_text(self.machine, self.answers),
            terminal.tables_text(self.tables),
        ]
        return "".join(parts).rstrip("\n")

    def _facts(self) -> Facts:
        yield "machine", self.machine.name
        yield "met", self.met
        yield "poses", len(self.workspace.poses)
        yield "usable", int(self.workspace.usable.sum())
        yield "looks odd", [oddity.code for oddity in self.oddities] or None
        yield "warnings", [warning["code"] for warning in self.warnings] or None

    def _repr_html_(self) -> str:
        """What looks odd, and the answers."""
        from truepose.reporting.notebook import answers_html

        odd = [(f"looks odd: {oddity.code}", oddity.sentence) for oddity in self.oddities]
        facts = facts_html("MachineCheck", [*self._facts(), *odd])
        return facts + answers_html(self.machine, self.answers)


@checked
def check(machine: Machine) -> MachineCheck:
    """Describe a machine, and say if it is accurate enough.

    What `truepose check` says of its file: `str` of the result is what that prints. Raises
    `RequestError` (no-workspace, no-pose-left) and `TrueposeError` as the sources do.
    """
    return check_watched(machine, assembly.Watcher())


def check_watched(machine: Machine, watcher: assembly.Watcher) -> MachineCheck:
    """The same, while a `watcher` looks on."""
    workspace = check_workspace(machine)
    odd = oddities_where_checked(machine, workspace.codes)
    watcher.looked_at(machine, workspace, odd)
    answers, warnings = _answers(machine, watcher)
    return MachineCheck(machine, workspace, odd, answers, warnings)


def _answers(
    machine: Machine, watcher: assembly.Watcher
) -> tuple[tuple[Answer, ...], tuple[Mapping[str, str], ...]]:
    """The answers, and what the budget warns of."""
    # Without a source the file may still be asked about its workspace, unless it asks for more.
    asked = machine.accuracy.target is not None or machine.accuracy.angle_target is not None
    if not (asked or any(inputs.acting(machine))):
        return (), ()
    answers = assembly.answers(machine, watcher)
    try:
        return answers, tuple(assembly.evaluation(machine, watcher).warnings)
    except RequestError as error:
        # There are poses, as there are answers; only no budget of what bands leave of them.
        if [problem.code for problem in error.problems] != ["no-pose-left"]:
            raise
        return answers, ()


def text(result: MachineCheck, form: str) -> str:
    """A check as JSON, or as CSV one row an answer."""
    if form == "csv":
        return _csv(result)
    import json

    return json.dumps(result.as_data(), indent=1, ensure_ascii=False, allow_nan=False)


def _csv(result: MachineCheck) -> str:
    import csv
    import io

    from truepose.reporting.accuracy import as_data
    from truepose.reporting.result import in_file_units, pose_si
    from truepose.sources import not_included_text

    machine = result.machine
    buffer = io.StringIO()
    where = [
        f"pose_{name} [{in_file_units(machine, 0.0, pose_si(name))[1]}]"
        for name in machine.commanded
    ]
    columns = ["quantity", "state", "highest", "asked", "units", "met", "not_included"]
    columns += ["pose", "not_assembled", "answer", "witness", "linear", "bound", "rests_on"]
    left_out = not_included_text(machine, machine.condition)
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow([*columns, *where])
    for answer in result.answers:
        row = as_data(machine, answer)
        told = row | {"not_included": left_out}
        writer.writerow([*(told[column] for column in columns), *row["at"].values()])
    return buffer.getvalue().rstrip("\n")


__all__ = ["MachineCheck", "check", "check_watched", "text"]
