"""The overall error at each pose, per axis (figure 4 of the founding paper, in form)."""

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
from truepose.reporting.figures._style import BEFORE, OVERALL, drawn_poses, small, thinning_note
from truepose.reporting.study import Study

TITLE = "Overall error at each pose"

LINES = (
    ("overall_error_upper", UPPER, BEFORE, "solid"),
    ("overall_error", "known error", OVERALL, "dot"),
    ("overall_error_lower", LOWER, "#0072B2", "dash"),
)


def caption(study: Study) -> str:
    """What the lines are."""
    drawn = drawn_poses(study.largest)
    return (
        "Exact error with all sources acting together: every source at its shift (the known "
        "error), and toleranced lengths all at the lower and all at the upper ends of their "
        "bands. That is not the worst case: lengths at unlike ends may do more."
        + thinning_note(len(drawn), study.n_pose)
    )


def figure(study: Study) -> Plot:
    """One panel for each component: all at lower ends, known error, all at upper ends."""
    drawn = drawn_poses(study.largest)
    figure = panels(study)
    for variable, name, colour, dash in LINES:
        errors = study.shown(study.values(variable)[drawn])
        for component in range(len(study.components)):
            figure.add_trace(
                trace(
                    "scatter",
                    x=study.numbers[drawn],
                    y=small(errors[:, component]),
                    name=name,
                    legendgroup=variable,
                    showlegend=component == 0,
                    mode=line_mode(drawn),
                    line={"color": colour, "dash": dash, "width": 1.8},
                    marker={"size": 4},
                    hovertemplate="%{y:.3f}",
                ),
                **place(study, component),
            )
    add_pose_labels(figure, study, drawn)
    return finish_panels(figure, study)
