"""Each source's error at each pose, per axis (figure 3 of the founding paper, in form)."""

from __future__ import annotations

from truepose.reporting.display import LOWER, UPPER
from truepose.reporting.figures._over_poses import (
    add_pose_labels,
    finish_panels,
    line_mode,
    panels,
    place,
)
from truepose.reporting.figures._plot import Plot, trace
from truepose.reporting.figures._style import drawn_poses, small, source_colour, thinning_note
from truepose.reporting.study import Study

WHERE = {"lower": LOWER, "upper": UPPER}
TITLE = "Error of each source at each pose"


def caption(study: Study) -> str:
    """What the lines are."""
    drawn = drawn_poses(study.largest)
    return (
        "Exact error of each source alone, actual minus commanded, in the base frame. Where a "
        "source has a tolerance band, the solid line has its lengths and offsets all at their "
        "upper ends, the dashed line all at their lower ends."
        + thinning_note(len(drawn), study.n_pose)
    )


def figure(study: Study) -> Plot:
    """One panel for each component, one line for each source and end."""
    drawn = drawn_poses(study.largest)
    figure = panels(study)
    for index, source in enumerate(study.sources):
        edges = (
            (("upper", "solid"), ("lower", "dash")) if study.has_band[index] else (("", "solid"),)
        )
        for edge, dash in edges:
            name = f"error_{edge}" if edge else "error"
            errors = study.shown(study.values(name)[drawn, index])
            for component in range(len(study.components)):
                figure.add_trace(
                    trace(
                        "scatter",
                        x=study.numbers[drawn],
                        y=small(errors[:, component]),
                        name=f"{source}, {WHERE[edge]}" if edge else source,
                        legendgroup=f"{source} {edge}",
                        showlegend=component == 0,
                        mode=line_mode(drawn),
                        line={"color": source_colour(index), "dash": dash, "width": 1.6},
                        marker={"size": 4},
                        hovertemplate="%{y:.3f}",
                    ),
                    **place(study, component),
                )
    add_pose_labels(figure, study, drawn)
    return finish_panels(figure, study)
