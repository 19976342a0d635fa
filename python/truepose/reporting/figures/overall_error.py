"""The overall error at each pose, per axis (figure 4 of the founding paper, in form)."""

from __future__ import annotations

from truepose.language import say
from truepose.reporting.display import decimals_for, number, pose_text, where_highest
from truepose.reporting.figures._over_poses import Curve, how_drawn, largest_of, over_poses
from truepose.reporting.figures._plot import Plot
from truepose.reporting.figures._style import BLUE, OVERALL, VERMILION
from truepose.reporting.study import Study

TITLE = "Overall error at each pose"

LOOKS = {
    "overall_error_upper": (VERMILION, "solid", "circle"),
    "overall_error": (OVERALL, "dot", "cross"),
    "overall_error_lower": (BLUE, "dash", "square-open"),
}


def says(study: Study) -> str:
    """The axis of the largest error drawn, its size, and where it is."""
    largest = []
    for variable in LOOKS:
        errors = study.values(variable)
        pose, component = largest_of(study, errors)
        largest.append((abs(float(errors[pose, component])), pose, component))
    size, pose, component = largest[where_highest([size for size, *_ in largest])]
    unit = study.units.error(study.components[component])
    return say(
        "With all sources at once the largest error is {size} {unit} in {axis}, at {pose}.",
        size=number(size * unit.per_si, decimals_for(size * unit.per_si, 4)),
        unit=unit.label,
        axis=study.components[component],
        pose=pose_text(study.poses[pose], study.machine.commanded, study.units),
    )


def caption(study: Study) -> str:
    """What the lines are."""
    return " ".join(
        [
            say(
                "Exact error with all sources acting together: every source at its shift (the "
                "known error), and toleranced lengths all at the lower and all at the upper ends "
                "of their bands. That is not the worst case: lengths at unlike ends may do more."
            ),
            how_drawn(study),
        ]
    )


def figure(study: Study) -> Plot:
    """A panel for each component: all at lower ends, known error, all at upper ends."""
    names = {
        "overall_error_upper": say("all at upper ends"),
        "overall_error": say("known error"),
        "overall_error_lower": say("all at lower ends"),
    }
    return over_poses(
        study,
        [
            Curve(
                names[variable],
                (study.values(variable),),
                {
                    "line": {"color": colour, "dash": dash, "width": 1.8},
                    "marker": {"symbol": symbol},
                },
            )
            for variable, (colour, dash, symbol) in LOOKS.items()
        ],
    )
