"""What is known of the tool's place over the workspace, before and after calibration."""

from __future__ import annotations

import numpy as np

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


def caption(study: Study) -> str:
    """What the colour is, and what is not in it."""
    result = study.calibrated
    what = _quantity(study)
    text = (
        f"Standard uncertainty of the tool's {what} over the workspace. Before: from the "
        "tolerances. After: from the measurements, and the tolerances where they were used. "
        "The two scales differ."
    )
    if result.attrs["relative"]:
        text += " Where the machine as a whole stands in the instrument's frame is not in it."
    if not np.isfinite(_sizes(study, "before")).any():
        text += " Not every unknown has a tolerance, so there is no before."
    if np.isinf(_sizes(study, "after")).any():
        text += " Poses without a point: nothing limits the uncertainty there."
    return text


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
        titles=kinds,
        spatial=spatial,
        horizontal_spacing=GAP,
    )
    finish(figure, HEIGHT, margin=_MARGINS[spatial])
    unit = study.units.error(_quantity(study)).label
    for number, when in enumerate(kinds):
        sizes = np.full(len(places.points), np.nan)
        at_poses = _sizes(study, when)
        np.fmax.at(sizes, places.of_pose, np.where(np.isfinite(at_poses), at_poses, np.nan))
        drawn = np.flatnonzero(np.isfinite(sizes))
        axis = "coloraxis" if number == 0 else "coloraxis2"
        figure.add_trace(map_trace(places, drawn, sizes, unit, axis), row=1, col=number + 1)
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
                        "x": (1.0 - GAP) / 2 + 0.005 if number == 0 else 1.005,
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
