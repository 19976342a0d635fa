"""One look for all figures: colours, fonts, marks of numbers, rounding, thinning."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from truepose.arrays import Indices
from truepose.language import grouped, say, spoken
from truepose.reporting.figures._plot import Keys, Plot

# Paper, what is drawn on it without being data, and text.
PAPER, SCENE = "#FFFFFF", "#F6F8FB"
GRID, SCENE_GRID, AXIS = "#E3E7EE", "#D5DBE5", "#B8C0CC"
INK, QUIET = "#1B2A41", "#5B6779"
TARGET = INK
"""Of the line of what is asked: dashed everywhere."""

# Okabe and Ito's colours, told apart by colour-blind readers too (https://jfly.uni-koeln.de/color);
# those that are faint on white are darker here, of the same hue.
BLUE, VERMILION, GREEN = "#0072B2", "#D55E00", "#00916A"
PURPLE, ORANGE, SKY = "#BF6699", "#B07900", "#3690C6"
BROWN, GREY = "#8C6D31", "#7F8AA3"
SOURCE_COLOURS = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY, BROWN)
SYMBOLS = ("circle", "square", "diamond", "triangle-up", "cross", "x", "star")
"""Of the marks of sources, so that their colour is never alone."""

OVERALL = INK
BEFORE, BEFORE_FILL = "#C24E00", "rgba(194,78,0,0.10)"
"""Before compensation: an outline, dashed and hollow."""
AFTER, AFTER_FILL = "#00785A", "rgba(0,120,90,0.45)"
"""After compensation: filled."""
VERDICT_COLOURS = {"dominant": "#B8431F", "relevant": "#BF8A1A", "negligible": "#8A94A6"}

# What stands behind, or is inside of what is drawn.
PALE, PALE_BLUE, BLUE_FILL = "#B9CCDD", "#9FC5DF", "rgba(0,114,178,0.18)"
SHADE, SHADE_DARKER = "rgba(27,42,65,0.08)", "rgba(27,42,65,0.16)"
ON_MAP, BEHIND_MAP_TEXT = "#FDFDFD", "rgba(17,24,36,0.62)"
"""Of lines and text on a colour scale, which is the same by day and by night."""

LINES = (
    *SOURCE_COLOURS,
    *(INK, QUIET, GREY, BEFORE, AFTER, *VERDICT_COLOURS.values()),
)
"""The colours of lines, marks, bars and text: to be told from the paper."""

DARK = {
    PAPER: "#151B24",
    SCENE: "#1C2430",
    GRID: "#2B3442",
    SCENE_GRID: "#384353",
    AXIS: "#667386",
    INK: "#E6EBF2",
    QUIET: "#A7B1C0",
    BLUE: "#56A9DE",
    VERMILION: "#F58640",
    GREEN: "#2FC39A",
    PURPLE: "#E29BC3",
    ORANGE: "#E6A817",
    SKY: "#8FD0F5",
    BROWN: "#CBAE74",
    GREY: "#8792A8",
    BEFORE: "#F2803D",
    BEFORE_FILL: "rgba(242,128,61,0.12)",
    AFTER: "#4CC79B",
    AFTER_FILL: "rgba(76,199,155,0.45)",
    VERDICT_COLOURS["dominant"]: "#EE7A55",
    VERDICT_COLOURS["relevant"]: "#E3B04B",
    VERDICT_COLOURS["negligible"]: "#8B95A7",
    PALE: "#3D5268",
    PALE_BLUE: "#3A6C8F",
    BLUE_FILL: "rgba(86,169,222,0.25)",
    SHADE: "rgba(230,235,242,0.10)",
    SHADE_DARKER: "rgba(230,235,242,0.20)",
    ON_MAP: ON_MAP,
    BEHIND_MAP_TEXT: BEHIND_MAP_TEXT,
}
"""What each colour is on dark paper. No two of the light ones are equal but by name: a page may
swap them wherever they stand in a figure."""

_VIRIDIS = (
    *("#440154", "#482878", "#3e4989", "#31688e", "#26828e"),
    *("#1f9e89", "#35b779", "#6ece58", "#b5de2b", "#fde725"),
)
COLOUR_SCALE = [[step / (len(_VIRIDIS) - 1), colour] for step, colour in enumerate(_VIRIDIS)]

FONT = "Inter, 'Segoe UI', 'Helvetica Neue', Arial, 'Liberation Sans', sans-serif"

MOST_DRAWN = 2000
"""Traces over more poses than this are thinned, so that the file stays small."""

FEW = 100
"""So few numbers weigh nothing, and are drawn as they are."""
DIGITS = 5
"""Of many numbers so many are drawn, the first where their range has its first: an axis of a
thousand pixels shows three, the others are for who enlarges it."""

SHOWN = ".4r"
"""How a hover text writes a number (d3-format): four digits, no exponent."""


def source_colour(index: int) -> str:
    """The colour of a source, the same in every figure."""
    return SOURCE_COLOURS[index % len(SOURCE_COLOURS)]


def source_symbol(index: int) -> str:
    """The mark of a source, the same in every figure."""
    return SYMBOLS[index % len(SYMBOLS)]


def small(values: ArrayLike) -> NDArray[np.float32]:
    """Values in single precision, and where there are many, rounded to what is drawn.

    What is rounded to few decimals compresses to two thirds; `FEW` and `DIGITS` say when.
    """
    given = np.asarray(values, dtype=np.float64)
    if given.size > FEW:
        finite = given[np.isfinite(given)]
        span = float(np.ptp(finite)) if finite.size else 0.0
        if span > 0.0:
            given = np.round(given, DIGITS - 1 - int(np.floor(np.log10(span))))
    return given.astype(np.float32)


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
    return " " + say(
        "Drawn: one in {step} of the {total} poses, and the largest; tables use all.",
        step=step,
        total=grouped(total),
    )


def finish(figure: Plot, height: int, **layout: Any) -> Plot:
    """Put the common look on a figure."""
    language = spoken()
    figure.update_layout(
        height=height,
        font={"family": FONT, "size": 13, "color": INK},
        separators=language.decimal_mark + language.group_mark,
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
        paper_bgcolor=PAPER,
        plot_bgcolor=PAPER,
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
