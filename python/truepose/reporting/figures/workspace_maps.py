"""Maps of the worst position error over the workspace, one colour scale for all of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.reporting.figures._maps import Places, label_map_axes, map_trace, places_of
from truepose.reporting.figures._plot import Plot, grid
from truepose.reporting.figures._style import COLOUR_SCALE, drawn_poses, finish, thinning_note
from truepose.reporting.study import Study

TITLE = "Where in the workspace"

# A browser keeps 16 pictures in three dimensions alive; the drawing of the machine needs one too.
MOST_MAPS = 6
PER_ROW = 3
ROW_HEIGHT = {2: 300, 3: 310}
TITLE_MARGIN = 30
"""Pixels that keep the titles of the first row clear of plotly's buttons."""


@dataclass(frozen=True)
class Map:
    """One map: its title and the worst position error at each place (n_place,), for people."""

    title: str
    worst: Floats


def caption(study: Study) -> str:
    """What the colour is, and what is not shown."""
    places = places_of(study.poses, study.machine.commanded, study.units)
    hidden = [
        name
        for index, name in enumerate(study.machine.commanded)
        if name not in places.axes and np.ptp(study.poses[:, index]) > 0
    ]
    text = (
        "Largest position error possible at each pose (the shift and the whole band of the "
        f"sources), {study.units.small_length.label}. All maps share one colour scale from "
        "zero, so they may be compared."
    )
    if hidden:
        text += f" Over {', '.join(hidden)} the largest is shown."
    left_out = len(study.sources) + 2 - MOST_MAPS
    if left_out > 0 and len(study.sources) + 1 + (study.compensation is not None) > MOST_MAPS:
        text += " Only the sources ranked first are drawn."
    drawn = len(_drawn(study, places))
    return text + thinning_note(drawn, len(places.points))


def figure(study: Study) -> Plot:
    """A map for all sources together, one for each source, one for what compensation leaves."""
    places = places_of(study.poses, study.machine.commanded, study.units)
    maps, unit = _maps(study, places), study.units.small_length
    drawn = _drawn(study, places)
    spatial = len(places.axes) == 3
    columns = min(PER_ROW, len(maps))
    rows = -(-len(maps) // columns)
    figure = grid(
        rows=rows,
        cols=columns,
        titles=[map_.title for map_ in maps],
        spatial=spatial,
        horizontal_spacing=0.03 if spatial else 0.09,
        vertical_spacing=0.08 if spatial else 0.3 / rows,
    )
    for number, map_ in enumerate(maps):
        figure.add_trace(
            map_trace(places, drawn, map_.worst, unit.label),
            row=number // columns + 1,
            col=number % columns + 1,
        )
    finish(figure, 80 + TITLE_MARGIN + ROW_HEIGHT[len(places.axes)] * rows)
    label_map_axes(figure, places, len(maps))
    highest = max(float(np.nanmax(map_.worst)) for map_ in maps)
    figure.update_layout(
        coloraxis={
            "colorscale": COLOUR_SCALE,
            "cmin": 0.0,
            "cmax": highest if highest > 0 else 1.0,
            "colorbar": {"title": {"text": unit.label}, "thickness": 16, "len": 0.9},
        },
        margin={"l": 5, "r": 5, "t": 30 + TITLE_MARGIN, "b": 0}
        if spatial
        else {"l": 70, "t": 40 + TITLE_MARGIN, "b": 55},
    )
    return figure


def _maps(study: Study, places: Places) -> list[Map]:
    """All sources together, what remains, then the sources by rank, at most `MOST_MAPS`."""
    unit = study.units.small_length

    def over_places(worst: Floats) -> Floats:
        highest = np.zeros(len(places.points))
        np.fmax.at(highest, places.of_pose, worst * unit.per_si)
        return highest

    maps = [Map("all sources", over_places(study.largest))]
    if study.compensation is not None:
        remaining = study.remaining_largest
        maps.append(Map("after compensation", over_places(remaining)))
    worst = study.values("largest")[:, :, 0]
    maps += [Map(study.sources[index], over_places(worst[:, index])) for index in study.by_rank]
    return maps[:MOST_MAPS]


def _drawn(study: Study, places: Places) -> Indices:
    """Indices of the places to draw."""
    return drawn_poses(_maps(study, places)[0].worst)
