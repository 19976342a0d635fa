"""The overall error before and after compensation, per axis."""

from __future__ import annotations

from typing import Any

import numpy as np

from truepose.arrays import Floats
from truepose.reporting.figures._over_poses import add_pose_labels, finish_panels, panels, place
from truepose.reporting.figures._plot import Plot, trace
from truepose.reporting.figures._style import AFTER, BEFORE, drawn_poses, small, thinning_note
from truepose.reporting.study import Study

TITLE = "Before and after compensation"

NEEDS = "compensation"


def caption(study: Study) -> str:
    """What the bands are."""
    drawn = drawn_poses(study.largest)
    free = [name for name in study.machine.dof if name not in study.machine.commanded]
    parasitic = (
        f" Freedoms that are not commanded ({', '.join(free)}) cannot be corrected." if free else ""
    )
    return (
        "Bands: the error from all toleranced lengths at their lower ends to all at their upper "
        "ends, before compensation and after, both by exact simulation of the actual machine; "
        "lines: the known error. What is known is gone; what is not known remains, centred on "
        "zero." + parasitic + thinning_note(len(drawn), study.n_pose)
    )


def figure(study: Study) -> Plot:
    """One panel for each component: band and middle before and after."""
    drawn = drawn_poses(study.largest)
    figure = panels(study)
    states = (
        (
            "before",
            BEFORE,
            "rgba(178,58,72,0.20)",
            [study.values(f"overall_error{edge}") for edge in ("_lower", "_upper", "")],
        ),
        (
            "after",
            AFTER,
            "rgba(31,122,92,0.25)",
            [study.compensated(f"residual{edge}") for edge in ("_lower", "_upper", "_middle")],
        ),
    )
    for name, colour, fill, errors in states:
        edges = [study.shown(values[drawn]) for values in errors]
        for component in range(len(study.components)):
            lower, upper, middle = (edge[:, component] for edge in edges)
            common: dict[str, Any] = {"x": study.numbers[drawn], "legendgroup": name}
            _add_band(figure, place(study, component), lower, upper, name, colour, fill, common)
            figure.add_trace(
                trace(
                    "scatter",
                    y=small(middle),
                    name=f"{name}, known error",
                    showlegend=component == 0,
                    mode="lines",
                    line={"color": colour, "width": 2.2},
                    hovertemplate="%{y:.3f}",
                    **common,
                ),
                **place(study, component),
            )
    add_pose_labels(figure, study, drawn)
    return finish_panels(figure, study)


def _add_band(
    figure: Plot,
    at: dict[str, int],
    lower: Floats,
    upper: Floats,
    name: str,
    colour: str,
    fill: str,
    common: dict[str, Any],
) -> None:
    """Two thin edges with colour between them. The edges need not be ordered."""
    for values, filled, edge in (
        (np.minimum(lower, upper), None, "smaller end"),
        (np.maximum(lower, upper), "tonexty", "larger end"),
    ):
        figure.add_trace(
            trace(
                "scatter",
                y=small(values),
                name=f"{name}, {edge}" if filled is None else f"{name}, band",
                showlegend=filled is not None and at == {"row": 1, "col": 1},
                mode="lines",
                line={"color": colour, "width": 0.8},
                fill=filled,
                fillcolor=fill,
                hovertemplate="%{y:.3f}",
                **common,
            ),
            **at,
        )
