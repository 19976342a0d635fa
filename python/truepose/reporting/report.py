"""The report of a machine: its study, and the page that is written of it: `truepose report`."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from truepose.errors import MachineFileError, Problem, RequestError
from truepose.files.document import MACHINE_FILE
from truepose.files.text_file import read_text
from truepose.files.writing import require_writable
from truepose.language import say, speaking, spoken
from truepose.machine import Machine
from truepose.reporting import assembly
from truepose.reporting.drawing_packages import module_that_draws, speaking_for
from truepose.reporting.study import Study
from truepose.representation import Facts, Represented, facts_html
from truepose.runs.arguments import checked
from truepose.verdict.answer import AFTER, BEFORE, Answer, met

if TYPE_CHECKING:
    from truepose.calibration.measurements import Measurements
    from truepose.reporting.live.part import LivePart
    from truepose.reporting.page import PartShown
    from truepose.reporting.plot import MachinePlot
    from truepose.reporting.shell import Contents
    from truepose.reporting.table import Table
    from truepose.workpiece.evaluation import PartEvaluation

ENDINGS = (".html", ".pdf")


@dataclass(frozen=True, eq=False, repr=False)
class MachineReport(Represented):
    """A report: the `path` of its page, if one was written, and all results that it is of.

    `part`: what the machine makes of a program, where one was given. `machine_text`:
    the machine file, `language`: of the page.
    """

    study: Study
    language: str
    machine_text: str = ""
    part: PartEvaluation | None = None
    page_of_part: PartShown | None = None
    path: Path | None = None

    @property
    def machine(self) -> Machine:
        """The machine that it is of."""
        return self.study.machine

    @property
    def answers(self) -> tuple[Answer, ...]:
        """The verdict over the workspace, before and after compensation."""
        return self.study.accuracy

    @property
    def met(self) -> dict[str, bool | None]:
        """By state, before and after compensation: whether all is met; None if nothing is asked."""
        return {state: met(self.answers, state) for state in (BEFORE, AFTER)}

    def rendered(self, *, live: bool = True) -> tuple[str, Contents]:
        """The page as text, and what stands on it; `live`: with its live part, if it can be."""
        page = module_that_draws("truepose.reporting.page")
        with speaking(self.language):
            shown: LivePart | str = ""
            if live:
                from truepose.reporting.live.part import live_or_why_not

                shown = live_or_why_not(self.machine)
            text, contents = page.rendered(self.study, self.machine_text, self.page_of_part, shown)
        return text, contents

    @property
    def lines(self) -> list[tuple[str, str]]:
        """What is worst, what to do, what is not included, how many keep it: a name, a sentence."""
        from truepose.reporting import page_one, within

        kept = within.within_note(self.study)
        return [*page_one.lines(self.study), *([(say("How many"), kept)] if kept else [])]

    @property
    def tables(self) -> list[Table]:
        """The tables that the command prints."""
        from truepose.reporting import how_far, tables, uncertainty_tables

        study = self.study
        shown = [
            tables.ranking(study),
            tables.highest_absolute(study),
            tables.highest_percent(study),
            tables.compensation(study),
            *tables.strain(study),
            how_far.table(study),
            *uncertainty_tables.in_short(study),
            tables.answers(self.machine, self.answers),
            tables.poses_left_out(study),
        ]
        return [table for table in shown if table is not None]

    def write(self, path: str | PathLike[str], paper: str = "A4") -> None:
        """Write the page, whole or not at all; of a .pdf `paper` is "A4" or "Letter".

        Raises `RequestError` (no-browser, browser-failed) where no browser prints a PDF.
        """
        require_writable(Path(path), ENDINGS, [])
        write_page(self.rendered(live=not is_pdf(Path(path)))[0], Path(path), paper)

    def plot(self, figure: str = "machine_drawing") -> MachinePlot:
        """A figure of the page by its name, to be shown in a notebook."""
        from truepose.reporting.plot import drawn

        with speaking(self.language):
            return drawn(self.study, figure)

    def _facts(self) -> Facts:
        yield "machine", self.machine.name
        yield "page", None if self.path is None else str(self.path)
        yield "met before compensation", self.met[BEFORE]
        yield "met after compensation", self.met[AFTER]
        yield "poses", self.study.n_pose
        yield "sources", self.study.sources

    def _repr_html_(self) -> str:
        """Page one in brief: the verdict, what is worst and what to do, how far off the tool is."""
        from truepose.reporting import how_far
        from truepose.reporting.notebook import answers_html, table_html
        from truepose.reporting.page_one import page_one

        page = [] if self.path is None else [("page", str(self.path))]
        of_part = None if self.page_of_part is None else self.page_of_part.page_one
        with speaking(self.language):
            one = page_one(self.study, of_part)
            verdicts = [(verdict.question, verdict.word) for verdict in one.verdicts]
            said = [("machine", self.machine.name), *verdicts, *one.lines, *page]
            return (
                facts_html("MachineReport", said)
                + answers_html(self.machine, self.answers)
                + table_html(how_far.table(self.study))
            )


@checked
def report(
    machine: Machine,
    output: str | PathLike[str] | None = None,
    *,
    measurements: Measurements | str | Path | None = None,
    part: str | PathLike[str] | None = None,
    features: str | PathLike[str] | None = None,
    language: str | None = None,
) -> MachineReport:
    """Do all of it, and write one page: what `truepose report` does with its file.

    `output` ends with .html, or .pdf where a browser is installed that prints it; by default the
    page goes beside you, named after the machine file. `measurements`: the page then begins with
    a calibration. `part`: a program of which the page has what the machine makes of it, by the
    `features` of a file, or of its comments. `language` is a code such as "de", by default English.

    Raises `RequestError` (extra-missing, no-source, unknown-language, no-browser), and as
    `truepose.budget`, `truepose.calibrate` and `truepose.part` do.
    """
    module_that_draws("truepose.reporting.page")
    target = Path(output) if output is not None else default_page(machine)
    program = None if part is None else Path(part)
    listed = None if features is None else Path(features)
    if listed is not None and program is None:
        raise RequestError(
            Problem("bad-argument", "features go with a part", found=str(listed), expected="part")
        )
    inputs: Sequence[object] = (machine.file or None, measurements, program, listed)
    files = [Path(name) for name in inputs if isinstance(name, str | Path)]
    require_writable(target, ENDINGS, files)
    if is_pdf(target):
        from truepose.reporting import pdf

        pdf.installed_browser()
    with speaking_for(language or spoken().code):
        unwritten = made(
            machine, measurements, program, listed, file_text(machine), assembly.Watcher()
        )
    unwritten.write(target)
    return replace(unwritten, path=target)


def made(
    machine: Machine,
    measurements: Measurements | str | Path | None,
    program: Path | None,
    features: Path | None,
    machine_text: str,
    watcher: assembly.Watcher,
) -> MachineReport:
    """The report before its page is written, in the language spoken, while a `watcher` looks on."""
    study = assembly.study(machine, measurements, watcher)
    if program is None:
        return MachineReport(study, spoken().code, machine_text)
    part, shown = _part(machine, program, features, watcher)
    return MachineReport(study, spoken().code, machine_text, part, shown)


def _part(
    machine: Machine, program: Path, features: Path | None, watcher: assembly.Watcher
) -> tuple[PartEvaluation, PartShown]:
    """What the machine makes of a program, by the defaults of `truepose part`, and on a page."""
    from truepose.workpiece.evaluate import evaluate_part
    from truepose.workpiece.read import read_part

    page: Any = module_that_draws("truepose.reporting.part_page")
    path = page.DrawnPath(machine)
    with watcher.progress("part", "samples") as told:
        evaluation = evaluate_part(
            machine,
            read_part(machine, program, features),
            machine.condition,
            sinks=[path],
            progress=told,
        )
    return evaluation, page.shown(evaluation, path, program.name)


def write_page(text: str, path: Path, paper: str = "A4", browser: str | None = None) -> None:
    """Write a page, or have a `browser` print it, by default one that is installed."""
    if is_pdf(path):
        from truepose.reporting import pdf

        pdf.write(text, path, paper, browser)
        return
    module_that_draws("truepose.reporting.page").write_text(text, path)


def is_pdf(path: Path) -> bool:
    """Whether a page is to be printed: on paper there is no live part."""
    return path.suffix.lower() == ".pdf"


def default_page(machine: Machine) -> Path:
    """Where a page goes if nobody says: beside you, named after the machine file."""
    name = Path(machine.file).stem
    return Path(f"{name}.html" if name and "<" not in name else "report.html")


def file_text(machine: Machine) -> str:
    """The machine file as it was read, where it lies beside you and is still the same; else empty.

    A machine knows the name of its file only, so that results are the same in every folder.
    """
    try:
        content, text = read_text(Path(machine.file), MACHINE_FILE)
    except MachineFileError:
        return ""
    return text if hashlib.sha256(content).hexdigest() == machine.file_hash else ""


__all__ = [
    "MachineReport",
    "default_page",
    "file_text",
    "is_pdf",
    "made",
    "report",
    "write_page",
]
