"""The page of a study: one HTML file with everything in it, which opens without any network."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from truepose.files.writing import replacing
from truepose.language import say
from truepose.reporting import variants
from truepose.reporting.shell import page_parts, template
from truepose.reporting.variants_figures import figures

if TYPE_CHECKING:
    import xarray as xr

    from truepose.machine import Machine


def html(machine: Machine, result: xr.Dataset) -> str:
    """The page as text."""
    return template("variants_page.html.jinja").render(
        machine=machine,
        attrs=result.attrs,
        variables=[str(key) for key in result["variable"].values],
        count=result.sizes["variant"],
        figures=figures(machine, result),
        tables=variants.tables(machine, result),
        **page_parts(say("{machine} · study", machine=machine.name)),
    )


def write(machine: Machine, result: xr.Dataset, path: Path) -> None:
    """Write the page to `path`, whole or not at all."""
    text = html(machine, result)
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
