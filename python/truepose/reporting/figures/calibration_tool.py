"""What is known of the tool's place over the workspace, before and after calibration."""

from __future__ import annotations

import numpy as np

from truepose.language import say
from truepose.reporting.display import decimals_for, number, pose_text, where_highest
from truepose.reporting.figures._maps import label_map_axes, map_trace, places_of
from truepose.reporting.figures._plot import Plot, grid
from truepose.reporting.figures._style import COLOUR_SCALE, finish
from truepose.reporting.study import Study

TITLE = "Uncertainty at the tool"
NEEDS = "calibration"
HEIGHT = 420
GAP = 0.17
"""Share of the width between the two maps: the scale of the first and a name of the second."""
_MARGINS = {True: {"l": 5, "r": 5, "t": 40, "b": 5}, False: {"l": 65, "r": 60, "t": 45, "b": 55}}
"""Pixels about the maps, by whether they are spatial."""


def says(study: Study) -> str:
    """The largest uncertainty after calibration, where it is, and what it was before."""
    before, after = _sizes(study, "before"), _sizes(study, "after")
    unit = study.units.error(_quantity(study)).label
    if not np.isfinite(after).all():
        return say(
            "At {count} of {every} poses nothing limits the uncertainty of the tool.",
            count=int((~np.isfinite(after)).sum()),
            every=after.size,
        )
    worst = where_highest(after)
    names = study.machine.commanded
    pose = [study.calibrated[f"pose_{name}"].values[worst] for name in names]
    is_known = bool(np.isfinite(before).all())
    places = decimals_for([after[worst], before.max() if is_known else 0.0], 4)
    said = {
        "after": f"{number(float(after[worst]), places)} {unit}",
        "pose": pose_text(pose, names, study.units),
    }
    if not is_known:
        return say(
            "After calibration the tool's standard uncertainty is at most {after}, at {pose}.",
            **said,
        )
    return say(
        "After calibration the tool's standard uncertainty is at most {after}, at {pose}; before "
        "it was up to {before}.",
        before=f"{number(float(before.max()), places)} {unit}",
        **said,
    )


def caption(study: Study) -> str:
    """What the colour is, and what is not in it."""
    result = study.calibrated
    parts = [
        say(
            "Standard uncertainty of where the tool is, over the workspace. Before: from the "
            "tolerances. After: from the measurements, and the tolerances where they were used. "
            "The two scales differ."
        )
    ]
    if result.attrs["relative"]:
        parts.append(
            say("Where the machine as a whole stands in the instrument's frame is not in it.")
        )
    if not np.isfinite(_sizes(study, "before")).any():
        parts.append(say("Not every unknown has a tolerance, so there is no before."))
    if np.isinf(_sizes(study, "after")).any():
        parts.append(say("Poses without a point: nothing limits the uncertainty there."))
    return " ".join(parts)


def figure(study: Study) -> Plot:
    """Two maps over the workspace, each with its own scale."""
    result = study.calibrated
    names = study.machine.commanded
    places = places_of(
        np.stack([result[f"pose_{name}"].values for name in names], axis=-1), names, study.units
    )
    kinds = [when for when in ("before", "after") if np.isfinite(_sizes(study, when)).any()]
    spatial = len(places.axes) == 3
    figure = grid(
        rows=1,
        cols=2,
        titles=[say("before") if when == "before" else say("after") for when in kinds],
        spatial=spatial,
        horizontal_spacing=GAP,
    )
    finish(figure, HEIGHT, margin=_MARGINS[spatial])
    unit = study.units.error(_quantity(study)).label
    for nth, when in enumerate(kinds):
        sizes = np.full(len(places.points), np.nan)
        at_poses = _sizes(study, when)
        np.fmax.at(sizes, places.of_pose, np.where(np.isfinite(at_poses), at_poses, np.nan))
        drawn = np.flatnonzero(np.isfinite(sizes))
        axis = "coloraxis" if nth == 0 else "coloraxis2"
        figure.add_trace(map_trace(places, drawn, sizes, unit, axis), row=1, col=nth + 1)
        figure.update_layout(
            **{
                axis: {
                    "colorscale": COLOUR_SCALE,
                    "cmin": 0.0,
                    "cmax": float(sizes[drawn].max()) or 1.0,
                    "colorbar": {
                        "title": {"text": unit},
                        "thickness": 14,
                        "len": 0.85,
                        "x": (1.0 - GAP) / 2 + 0.005 if nth == 0 else 1.005,
                    },
                }
            }
        )
    label_map_axes(figure, places, 2)
    return figure


def _quantity(study: Study) -> str:
    """Position, or orientation of a machine that only turns."""
    return str(study.calibrated["quantity"].values[0])


def _sizes(study: Study, when: str) -> np.ndarray:
    """(n_pose,) in the unit for people."""
    sizes: np.ndarray = study.calibrated[f"tool_size_{when}"].values[:, 0]
    return sizes * study.units.error(_quantity(study)).per_si
