"""Each source's error at each pose, per axis (figure 3 of the founding paper, in form)."""

from __future__ import annotations

import numpy as np

from truepose.language import say
from truepose.reporting.display import decimals_for, number, pose_text, where_highest
from truepose.reporting.figures._over_poses import Curve, how_drawn, is_few, largest_of, over_poses
from truepose.reporting.figures._plot import Keys, Plot
from truepose.reporting.figures._style import SOURCE_COLOURS, source_colour, source_symbol
from truepose.reporting.study import Study

TITLE = "Error of each source at each pose"


def says(study: Study) -> str:
    """The source and the axis of the largest error drawn, and where it is."""
    largest = []
    for source in range(len(study.sources)):
        for name in ("error_lower", "error_upper"):
            errors = study.values(name)[:, source]
            pose, component = largest_of(study, errors)
            largest.append((abs(float(errors[pose, component])), source, pose, component))
    size, source, pose, component = largest[where_highest([size for size, *_ in largest])]
    unit = study.units.error(study.components[component])
    return say(
        "Of single sources {source} makes the largest error: {size} {unit} in {axis}, at {pose}.",
        source=study.sources[source],
        size=number(size * unit.per_si, decimals_for(size * unit.per_si, 4)),
        unit=unit.label,
        axis=study.components[component],
        pose=pose_text(study.poses[pose], study.machine.commanded, study.units),
    )


def caption(study: Study) -> str:
    """What the lines are."""
    text = [say("Exact error of each source alone, actual minus commanded, in the base frame.")]
    if any(study.has_band):
        text.append(
            say(
                "Where a source has a tolerance band, the solid line has its lengths and offsets "
                "all at their upper ends, the dashed line all at their lower ends."
            )
            if is_few(study)
            else say(
                "Where a source has a tolerance band, its lengths and offsets are all at their "
                "upper or all at their lower ends, whichever makes the larger error."
            )
        )
    drawn = len(_drawn(study))
    if drawn < len(study.sources):
        text.append(
            say(
                "Drawn are the {drawn} of {total} sources that are ranked first.",
                drawn=drawn,
                total=len(study.sources),
            )
        )
    return " ".join([*text, how_drawn(study)])


def figure(study: Study) -> Plot:
    """A panel for each component, a line for each source and end, the first ranked first."""
    lines: list[Curve] = []
    for index in _drawn(study):
        source = study.sources[index]
        known, upper, lower = (
            np.asarray(study.values(name)[:, index])
            for name in ("error", "error_upper", "error_lower")
        )
        if not study.has_band[index]:
            lines.append(Curve(source, (known,), _look(index)))
        elif is_few(study):
            lines += [
                Curve(say("{source}, all at upper ends", source=source), (upper,), _look(index)),
                Curve(
                    say("{source}, all at lower ends", source=source),
                    (lower,),
                    _look(index, "dash", "-open"),
                ),
            ]
        else:
            lines.append(Curve(source, (upper, lower), _look(index)))
    return over_poses(study, lines)


def _drawn(study: Study) -> list[int]:
    """Indices of the sources that are drawn: as many as have colours of their own."""
    return study.by_rank[: len(SOURCE_COLOURS)]


def _look(index: int, dash: str = "solid", filled: str = "") -> Keys:
    return {
        "line": {"color": source_colour(index), "dash": dash, "width": 1.6},
        "marker": {"symbol": source_symbol(index) + filled},
    }
