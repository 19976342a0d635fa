"""The figures of the report: one figure is one file, `Study` in, `Plot` out.

A figure's module has `TITLE`, `says(study)`, one sentence of what the figure shows with its number,
`caption(study)`, how it is read, and `figure(study)`. To add one: write the module
and name it in `FIGURES`, where the order is that of the report. A figure of a result that not every
study has names it, `NEEDS = "compensation"`, and is left out where `study.compensation` is None.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from types import ModuleType

from truepose.reporting.figures import (
    before_after,
    calibration_correlation,
    calibration_map,
    calibration_residuals,
    calibration_tool,
    calibration_unknowns,
    coverage_ellipses,
    distribution,
    error_over_time,
    internal_forces,
    machine_drawing,
    overall_error,
    ranking,
    source_errors,
    tornado,
    workspace_maps,
)
from truepose.reporting.figures._plot import Plot
from truepose.reporting.figures._text import as_text
from truepose.reporting.study import Study

FIGURES: tuple[ModuleType, ...] = (
    calibration_residuals,
    calibration_unknowns,
    calibration_tool,
    calibration_map,
    calibration_correlation,
    machine_drawing,
    distribution,
    coverage_ellipses,
    ranking,
    source_errors,
    overall_error,
    workspace_maps,
    tornado,
    error_over_time,
    internal_forces,
    before_after,
)


@dataclass(frozen=True)
class DrawnFigure:
    """One figure with its name (the module's), its title and the result it needs.

    `says` is one sentence of what it shows, `caption` how it is read.
    """

    name: str
    title: str
    caption: str
    figure: Plot
    needs: str | None = None
    says: str = ""


def _there(result: object) -> bool:
    """Whether a study has a result: a Dataset, or answers, of which there may be none."""
    return len(result) > 0 if isinstance(result, tuple) else result is not None


def draw(study: Study) -> Iterator[DrawnFigure]:
    """Every registered figure of a study, in the order of the report."""
    for module in FIGURES:
        if is_there(study, module):
            yield draw_one(study, module)


def is_there(study: Study, module: ModuleType) -> bool:
    """Whether a study has the result that a figure is of."""
    needed: str | None = getattr(module, "NEEDS", None)
    return needed is None or _there(getattr(study, needed))


def draw_one(study: Study, module: ModuleType) -> DrawnFigure:
    """One registered figure of a study that has the result that it is of."""
    return DrawnFigure(
        name=module.__name__.rpartition(".")[2],
        title=module.TITLE,
        caption=module.caption(study),
        figure=as_text(module.figure(study)),
        needs=getattr(module, "NEEDS", None),
        says=module.says(study) if hasattr(module, "says") else "",
    )
