"""The page of a part: one HTML file with everything in it, which opens without any network."""

from __future__ import annotations

from truepose.language import say
from truepose.reporting import part
from truepose.reporting.page import PartShown
from truepose.reporting.part_figures import DrawnPath, figures
from truepose.reporting.part_page_one import part_page_one
from truepose.reporting.shell import page_parts, template
from truepose.workpiece.evaluation import PartEvaluation
from truepose.workpiece.result import attributes


def shown(evaluation: PartEvaluation, path: DrawnPath, program: str) -> PartShown:
    """The part as any page shows it; `path` has looked on while the program was walked."""
    *tables, operators = part.tables(evaluation)
    count = len(evaluation.states)
    return PartShown(
        program,
        part_page_one(evaluation, program),
        tables[count:],
        figures(evaluation, path),
        [*tables[:count], operators],
        part.process(),
    )


def html(evaluation: PartEvaluation, path: DrawnPath, program: str) -> str:
    """The page as text."""
    return template("part_page.html.jinja").render(
        part=shown(evaluation, path, program),
        machine=evaluation.machine,
        attrs=attributes(evaluation),
        **page_parts(say("{program} · the part", program=program)),
    )


__all__ = ["DrawnPath", "html", "shown"]
