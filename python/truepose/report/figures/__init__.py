"""The figures of the report: one figure is one file, `Study` in, plotly figure out.

A figure's module has `TITLE`, `caption(study)` and `figure(study)`. To add one: write the module
and name it in `FIGURES`, where the order is that of the report. A figure that shows what
compensation does sets `NEEDS_COMPENSATION = True` and is left out where there is none, one over
time sets `NEEDS_TIME = True`, one of internal forces `NEEDS_STRAIN = True`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from types import ModuleType

import plotly.graph_objects as go

from truepose.report.figures import (
    before_after,
    error_over_time,
    internal_forces,
    machine_drawing,
    overall_error,
    ranking,
    source_errors,
    workspace_maps,
)
from truepose.report.study import Study

FIGURES: tuple[ModuleType, ...] = (
    machine_drawing,
    ranking,
    source_errors,
    overall_error,
    workspace_maps,
    error_over_time,
    internal_forces,
    before_after,
)


@dataclass(frozen=True)
class Drawn:
    """One figure with its name (the module's), its title and its caption."""

    name: str
    title: str
    caption: str
    figure: go.Figure


def draw(study: Study) -> Iterator[Drawn]:
    """Every registered figure of a study, in the order of the report."""
    for module in FIGURES:
        if getattr(module, "NEEDS_COMPENSATION", False) and study.compensation is None:
            continue
        if getattr(module, "NEEDS_TIME", False) and study.over_time is None:
            continue
        if getattr(module, "NEEDS_STRAIN", False) and study.strain is None:
            continue
        yield Drawn(
            name=module.__name__.rpartition(".")[2],
            title=module.TITLE,
            caption=module.caption(study),
            figure=module.figure(study),
        )
