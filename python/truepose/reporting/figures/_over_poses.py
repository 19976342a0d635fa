"""What the figures over the pose number share: one panel for each error component."""

from __future__ import annotations

import numpy as np

from truepose.arrays import Indices
from truepose.reporting.display import pose_text
from truepose.reporting.figures._plot import Plot, grid, trace
from truepose.reporting.figures._style import finish
from truepose.reporting.study import Study

PANEL_HEIGHT = 230
MOST_MARKED = 200
MOST_LABELLED = 1000


def place(study: Study, component: int) -> dict[str, int]:
    """Row and column of the panel of a component: lengths on the left, angles on the right."""
    left = component in study.positions
    among = study.positions if left else study.rotations
    return {"row": among.index(component) + 1, "col": 1 if left or not study.positions else 2}


def panels(study: Study) -> Plot:
    """Empty panels, one for each error component, sharing the pose number."""
    places = [place(study, component) for component in range(len(study.components))]
    rows = max(at["row"] for at in places)
    return grid(
        rows=rows,
        cols=max(at["col"] for at in places),
        spans={(at["row"], at["col"]): 1 for at in places},
        shared_xaxes="columns",
        vertical_spacing=0.07 if rows > 1 else 0.0,
        horizontal_spacing=0.1,
    )


def finish_panels(figure: Plot, study: Study) -> Plot:
    """Name the axes of `panels` and put the common look on."""
    rows = max(len(study.positions), len(study.rotations))
    finish(
        figure,
        95 + PANEL_HEIGHT * rows,
        margin={"l": 80, "r": 20, "t": 45, "b": 50},
        hovermode="x unified",
    )
    first, last = int(study.numbers[0]), int(study.numbers[-1])
    margin = 0.5 + 0.01 * (last - first + 1)
    figure.update_xaxes(range=[first - margin, last + margin], zeroline=False)
    for component, name in enumerate(study.components):
        at = place(study, component)
        figure.update_yaxes(
            title={"text": f"error in {name}, {study.units.error(name).label}"}, **at
        )
        lowest = at["row"] == len(study.positions if at["col"] == 1 else study.rotations)
        if lowest:
            figure.update_xaxes(title={"text": "pose number"}, showticklabels=True, **at)
    return figure


def line_mode(drawn: Indices) -> str:
    """Points are marked while they can be told apart."""
    return "lines+markers" if len(drawn) <= MOST_MARKED else "lines"


def add_pose_labels(figure: Plot, study: Study, drawn: Indices) -> None:
    """Let the hover box of each panel say which pose the number stands for."""
    if len(drawn) > MOST_LABELLED:
        return  # the labels would weigh more than the lines
    labels = [
        pose_text(study.poses[index], study.machine.commanded, study.units) for index in drawn
    ]
    for component in range(len(study.components)):
        figure.add_trace(
            trace(
                "scatter",
                x=study.numbers[drawn],
                y=np.zeros(len(drawn), dtype=np.float32),
                text=labels,
                mode="lines",
                line={"width": 0},
                hovertemplate="%{text}<extra></extra>",
                showlegend=False,
            ),
            **place(study, component),
        )
