"""Where in the workspace the measurements do not fit, before and after calibration."""

from __future__ import annotations

import numpy as np

from truepose.arrays import Floats
from truepose.language import say
from truepose.reporting.display import column, number, where_highest
from truepose.reporting.figures._maps import Places, label_map_axes, map_trace, places_of
from truepose.reporting.figures._plot import Plot, grid
from truepose.reporting.figures._style import COLOUR_SCALE, finish
from truepose.reporting.study import Study

TITLE = "Residuals in the workspace"
NEEDS = "calibration"
HEIGHT = 420
GAP = 0.17
"""Share of the width between the two maps: the scale of the first and a name of the second."""
_MARGINS = {True: {"l": 5, "r": 5, "t": 40, "b": 5}, False: {"l": 65, "r": 60, "t": 45, "b": 55}}
"""Pixels about the maps, by whether they are spatial."""


def says(study: Study) -> str:
    """Where the calibrated machine fits worst."""
    places, of_row = _places(study)
    sizes = _by_place(
        study, study.calibrated["normalised_after"].values, of_row, len(places.points)
    )
    if not np.isfinite(sizes).any():
        return say("No measured pose has a place in the workspace.")
    worst = where_highest(sizes)
    parts = zip(places.axes, column(places.points[worst], 1), places.units, strict=True)
    return say(
        "After calibration the readings fit worst at {place}, where their residuals are {size} "
        "times their stated uncertainties.",
        place=", ".join(" ".join(part) for part in parts),
        size=number(float(sizes[worst]), 2),
    )


def caption(_: Study) -> str:
    """What the colour is."""
    return say(
        "Each point is a measured pose, its colour the root mean square of its residuals over "
        "their stated uncertainties. The two scales differ. After calibration no place should "
        "stand out, and all should be near one; places that do show what the model lacks."
    )


def figure(study: Study) -> Plot:
    """Two maps over the measured poses, each with its own scale."""
    result = study.calibrated
    places, of_row = _places(study)
    kinds = [(say("before"), "normalised_before"), (say("after"), "normalised_after")]
    spatial = len(places.axes) == 3
    figure = grid(
        rows=1,
        cols=2,
        titles=[name for name, _ in kinds],
        spatial=spatial,
        horizontal_spacing=GAP,
    )
    finish(figure, HEIGHT, margin=_MARGINS[spatial])
    for nth, (_, name) in enumerate(kinds):
        sizes = _by_place(study, result[name].values, of_row, len(places.points))
        drawn = np.flatnonzero(np.isfinite(sizes))
        axis = "coloraxis" if nth == 0 else "coloraxis2"
        trace = map_trace(places, drawn, sizes, say("stated uncertainties"), axis)
        figure.add_trace(trace, row=1, col=nth + 1)
        highest = float(sizes[drawn].max(initial=1.0))
        figure.update_layout(
            **{
                axis: {
                    "colorscale": COLOUR_SCALE,
                    "cmin": 0.0,
                    "cmax": highest,
                    "colorbar": {
                        "thickness": 14,
                        "len": 0.85,
                        "x": (1.0 - GAP) / 2 + 0.005 if nth == 0 else 1.005,
                    },
                }
            }
        )
    label_map_axes(figure, places, 2)
    return figure


def _places(study: Study) -> tuple[Places, np.ndarray]:
    """The measured places, and at which of them each row is: beyond the last, at none."""
    result, names = study.calibrated, study.machine.commanded
    poses = np.stack([result[f"row_{name}"].values for name in names], axis=-1)
    posed = np.isfinite(poses).all(axis=1)
    places = places_of(poses[posed], names, study.units)
    of_row = np.full(len(poses), len(places.points))
    of_row[posed] = places.of_pose
    return places, of_row


def _by_place(study: Study, values: Floats, of_row: np.ndarray, count: int) -> Floats:
    """(n_place,) root mean square of the residuals at each place; NaN where none was fitted."""
    rows = study.calibrated["observation_row"].values
    there = np.isfinite(values) & (of_row[rows] < count)
    at = of_row[rows[there]]
    total = np.bincount(at, values[there] ** 2, minlength=count)
    number = np.bincount(at, minlength=count)
    with np.errstate(invalid="ignore"):
        sizes: Floats = np.sqrt(total / number)
    return sizes
