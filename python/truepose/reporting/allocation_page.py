"""The page of an allocation or of a cost curve: one HTML file, which opens without any network."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from truepose.files.writing import replacing
from truepose.language import say
from truepose.reporting import allocation as words
from truepose.reporting.allocation_figures import curve_figures, figures
from truepose.reporting.shell import page_parts, template

if TYPE_CHECKING:
    from truepose.design.cost_curve import CostCurve
    from truepose.design.result import Allocation
    from truepose.machine import Machine
    from truepose.reporting.figures import DrawnFigure
    from truepose.reporting.table import Table


def write(result: Allocation, path: Path) -> None:
    """Write the page of a design to `path`, whole or not at all."""
    tables = list(words.tables(result))
    _write(result.machine, list(words.sentences(result)), figures(result), tables, path)


def write_curve(result: CostCurve, path: Path) -> None:
    """The same of costs against targets."""
    drawn = curve_figures(result)
    _write(result.machine, [one.says for one in drawn], drawn, [words.curve(result)], path)


def _write(
    machine: Machine,
    sentences: Sequence[str],
    drawn: Sequence[DrawnFigure],
    tables: Sequence[Table],
    path: Path,
) -> None:
    text = template("allocation_page.html.jinja").render(
        machine=machine,
        sentences=sentences,
        figures=drawn,
        tables=tables,
        **page_parts(say("{machine} · allocation", machine=machine.name)),
    )
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


__all__ = ["write", "write_curve"]
