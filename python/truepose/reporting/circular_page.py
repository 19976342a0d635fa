"""The page of a circular test: one HTML file, which opens without any network."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from truepose.files.writing import replacing
from truepose.language import say
from truepose.reporting import circular_test
from truepose.reporting.polar_plot import figures
from truepose.reporting.shell import page_parts, template

if TYPE_CHECKING:
    import xarray as xr

    from truepose.machine import Machine


def html(machine: Machine, result: xr.Dataset) -> str:
    """The page as text."""
    return template("circular_page.html.jinja").render(
        machine=machine,
        attrs=result.attrs,
        lines=circular_test.summary(machine, result),
        tables=list(circular_test.tables(machine, result)),
        figures=figures(machine, result),
        **page_parts(say("{machine} · circular test", machine=machine.name)),
    )


def write(machine: Machine, result: xr.Dataset, path: Path) -> None:
    """Write the page to `path`, whole or not at all."""
    text = html(machine, result)
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
