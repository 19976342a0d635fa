"""One look for all figures: colours, fonts, sizes, thinning."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from truepose.arrays import Indices
from truepose.reporting.figures._plot import Keys, Plot

# Okabe and Ito's colours, told apart by colour-blind readers too (https://jfly.uni-koeln.de/color).
SOURCE_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#8C6D31")
OVERALL = "#1B2A41"
BEFORE, AFTER = "#B23A48", "#1F7A5C"
GRID = "#E3E7EE"
AXIS = "#B8C0CC"
INK = "#1B2A41"
FONT = "Inter, 'Segoe UI', 'Helvetica Neue', Arial, 'Liberation Sans', sans-serif"
VERDICT_COLOURS = {"dominant": "#B23A48", "relevant": "#E0A030", "negligible": "#8A94A6"}
_VIRIDIS = (
    *("#440154", "#482878", "#3e4989", "#31688e", "#26828e"),
    *("#1f9e89", "#35b779", "#6ece58", "#b5de2b", "#fde725"),
)
COLOUR_SCALE = [[step / (len(_VIRIDIS) - 1), colour] for step, colour in enumerate(_VIRIDIS)]

MOST_DRAWN = 5000
"""Traces over more poses than this are thinned, so that the file stays small."""


def source_colour(index: int) -> str:
    """The colour of a source, the same in every figure."""
    return SOURCE_COLOURS[index % len(SOURCE_COLOURS)]


def small(values: ArrayLike) -> NDArray[np.float32]:
    """Values rounded to single precision: half the file size, far finer than a pixel."""
    return np.asarray(values, dtype=np.float32)


def drawn_poses(size: ArrayLike) -> Indices:
    """Indices of the poses to draw, at most about `MOST_DRAWN`: every k-th and the largest.

    `size` (n_pose,) says how large the error at each pose is; the pose where it is largest is
    always among those drawn.
    """
    sizes = np.asarray(size, dtype=np.float64)
    step = -(-len(sizes) // MOST_DRAWN)
    chosen = np.arange(0, len(sizes), max(step, 1))
    return np.union1d(chosen, [int(np.argmax(sizes))]) if len(sizes) else chosen


def thinning_note(drawn: int, total: int) -> str:
    """What a caption says where not every pose is drawn, else nothing."""
    if drawn == total:
        return ""
    step = -(-total // MOST_DRAWN)
    return f" Drawn: one in {step} of the {total:,} poses, and the largest; tables use all."


def finish(figure: Plot, height: int, **layout: Any) -> Plot:
    """Put the common look on a figure."""
    figure.update_layout(
        height=height,
        font={"family": FONT, "size": 13, "color": INK},
        margin={"l": 70, "r": 20, "t": 40, "b": 55},
        legend={
            "orientation": "h",
            "yanchor": "top",
            "y": 1.0,
            "yref": "container",
            "xanchor": "left",
            "x": 0.0,
            "xref": "container",
            "font": {"size": 12},
        },
        hoverlabel={"font": {"family": FONT, "size": 12}},
        paper_bgcolor="white",
        plot_bgcolor="white",
    )
    figure.update_layout(**layout)
    axis: Keys = {
        "gridcolor": GRID,
        "zerolinecolor": AXIS,
        "linecolor": AXIS,
        "ticks": "outside",
        "title": {"font": {"size": 13}},
    }
    figure.update_xaxes(**axis)
    figure.update_yaxes(**axis)
    return figure
