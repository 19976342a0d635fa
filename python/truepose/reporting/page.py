"""The report: one HTML file with everything in it, which opens from disk without any network."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jinja2

from truepose.calibration.acceptance.sentences import sentence
from truepose.files.writing import replacing
from truepose.reporting import calibration, how_far, inputs, tables, uncertainty_tables
from truepose.reporting.accuracy import gains, told, where_answered
from truepose.reporting.figures import DrawnFigure, draw
from truepose.reporting.figures._json import as_json
from truepose.reporting.study import Study
from truepose.reporting.table import Table

if TYPE_CHECKING:
    from truepose.reporting.part import SummaryLine

LIMITS = (
    "These results hold for the sources found in the machine file and for the poses evaluated, "
    "nothing else. Sources that the file does not name (backlash, joint clearance, wear, control "
    "and measuring errors, bending of frame, platform and guides) are not in them. A linear "
    "maximum is of first order; a witness is one machine, solved exactly; a proven bound says so, "
    "and holds at the poses that it names. Loads and temperatures act on the nominal machine at "
    "the commanded pose."
)


def _folder_of_plotly() -> Path:
    """Where the package plotly keeps its files, of which no module is run: that takes long.

    Raises `ImportError` where the package is not there.
    """
    found = find_spec("plotly")
    if found is None or not found.submodule_search_locations:
        raise ImportError("no plotly", name="plotly")
    return Path(found.submodule_search_locations[0], "package_data")


# Looked for at once, so that a report without it is refused before it is worked out.
PLOTLY = _folder_of_plotly()


@dataclass(frozen=True)
class PartShown:
    """A part on a page: its program's name, what is told first, whose fault, figures, tables."""

    program: str
    lines: Sequence[SummaryLine]
    blame: Sequence[Table]
    figures: Sequence[DrawnFigure]
    tables: Sequence[Table]
    process: str


FIGURE_SETTINGS = {"displaylogo": False, "responsive": True, "displayModeBar": "hover"}


def render(study: Study, machine_text: str = "", part: PartShown | None = None) -> str:
    """The page as text. `machine_text` is the machine file, shown as it was read.

    `part`: what the machine makes of a program, where one is given.
    """
    results = [tables.ranking(study), tables.highest_absolute(study), tables.highest_percent(study)]
    if study.compensation is not None:
        results.append(tables.compensation(study))
    results += tables.strain(study)
    results += [tables.answers(study.machine, study.accuracy), how_far.table(study)]
    results += uncertainty_tables.tables(study)
    left_out = tables.poses_left_out(study)
    if left_out is not None:
        results.append(left_out)
    drawn = list(draw(study))
    return template("page.html.jinja").render(
        study=study,
        machine=study.machine,
        attrs=study.budget.attrs,
        answers=told(study.machine, study.accuracy),
        gains=gains(study.accuracy),
        where_answered=where_answered(study.accuracy) if study.accuracy else "",
        figures=[each for each in drawn if not _of_calibration(each)],
        calibration=None if study.calibration is None else study.calibration.attrs,
        calibration_figures=[each for each in drawn if _of_calibration(each)],
        calibration_tables=[]
        if study.calibration is None
        else calibration.of_page(study.calibration, study.units),
        results=results,
        warnings=tables.warnings(study),
        oddities=tables.oddities(study),
        inputs=[
            table(study.machine)
            for table in (inputs.machine, inputs.condition, inputs.sources, inputs.deviations)
        ],
        parameters=inputs.parameters(study.machine),
        machine_text=machine_text,
        part=part,
        limits=LIMITS,
        **page_parts(),
    )


def template(name: str) -> jinja2.Template:
    """A template of a page, with the filters that its figures need."""
    environment = jinja2.Environment(
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        loader=jinja2.FunctionLoader(_resource),
    )
    environment.filters["capitalise"] = sentence
    environment.filters["as_json"] = as_json
    return environment.get_template(name)


def page_parts() -> dict[str, Any]:
    """What the head of every page has: style, plotly and its settings."""
    return {
        "css": _resource("page.css"),
        "plotly_js": _of_plotly("plotly.min.js"),
        "figure_template": _of_plotly("templates", "plotly_white.json"),
        "figure_settings": FIGURE_SETTINGS,
    }


def _of_calibration(drawn: DrawnFigure) -> bool:
    """Whether a figure stands with the calibration, before what the machine as filed does."""
    return drawn.needs == "calibration"


def write(study: Study, path: Path, machine_text: str = "", part: PartShown | None = None) -> None:
    """Write the page to `path`, whole or not at all."""
    text = render(study, machine_text, part)
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def _resource(name: str) -> str:
    return files("truepose.reporting").joinpath(name).read_text(encoding="utf-8")


def _of_plotly(*path: str) -> str:
    return PLOTLY.joinpath(*path).read_text(encoding="utf-8")
