"""Maps of the worst position error over the workspace, each on its own scale or all on one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from truepose.arrays import Floats
from truepose.files.shown_units import Shown
from truepose.language import say
from truepose.reporting.display import decimals_for, number, pose_text, where_highest
from truepose.reporting.figures._flow import Flow
from truepose.reporting.figures._map_panels import (
    MapPanel,
    add_ends,
    add_panel,
    contours_between,
    panels_of,
    slices_left_out,
)
from truepose.reporting.figures._maps import Places, places_of
from truepose.reporting.figures._plot import Keys, Plot
from truepose.reporting.figures._style import AXIS, COLOUR_SCALE, INK, PAPER, finish
from truepose.reporting.study import Study

TITLE = "Where in the workspace"

MOST_MAPS = {1: 6, 2: 4, 3: 4}
"""By the number of panels that one map has."""

MENU = 42
"""Pixels of the buttons on top."""


@dataclass(frozen=True)
class WorkspaceMap:
    """One map: its title and the worst position error at each place (n_place,), for people."""

    title: str
    worst: Floats


def says(study: Study) -> str:
    """Where the largest error is, and where on the map the least."""
    places, unit = _places(study), _unit(study)
    sizes = _maps(study, places)[0].worst
    worst, least = where_highest(study.largest), where_highest(-sizes)
    digits = decimals_for(np.nanmax(sizes), 4)
    there = pose_text(study.poses[worst], study.machine.commanded, study.units)
    largest = number(float(np.nanmax(sizes)), digits)
    if len(sizes) == 1:
        return say(
            "At {there} the error is {size} {unit}.", there=there, size=largest, unit=unit.label
        )
    here = places.points[least] / [study.units.pose(name).per_si for name in places.axes]
    return say(
        "The error is largest at {there}: {largest} {unit}; it is least at {here}: {least} {unit}.",
        there=there,
        largest=largest,
        here=pose_text(here, places.axes, study.units),
        least=number(float(sizes[least]), digits),
        unit=unit.label,
    )


def caption(study: Study) -> str:
    """What the colour is, and what is not shown."""
    places = _places(study)
    hidden = [
        name
        for index, name in enumerate(study.machine.commanded)
        if name not in places.axes and np.ptp(study.poses[:, index]) > 0
    ]
    text = [
        say(
            "Colour: the largest position error possible at each place (the shift and the whole "
            "band of the sources), {unit}.",
            unit=_unit(study).label,
        )
        if study.positions
        else say(
            "Colour: the largest orientation error possible at each place (the shift and the whole "
            "band of the sources), {unit}.",
            unit=_unit(study).label,
        ),
        say(
            "Each map has its own scale, from its least to its largest, and so shows best where "
            "it is large; on one scale, from zero, maps may be compared. A triangle that points "
            "up marks the largest of a panel, one that points down the least."
        ),
    ]
    if hidden:
        text.append(say("Over {names} the largest is shown.", names=", ".join(hidden)))
    slices = slices_left_out(places)
    if slices is not None:
        text.append(
            say(
                "Drawn are {drawn} of {total} slices in z: the lowest, the highest, and the one "
                "with the largest error, or the middle one.",
                drawn=slices[0],
                total=slices[1],
            )
        )
    drawn = [map_.title for map_ in _maps(study, places)]
    if not set(study.sources) <= set(drawn):
        text.append(say("Only the sources that are ranked first have maps of their own."))
    return " ".join(text)


def figure(study: Study) -> Plot:
    """A map for all sources together, one for what compensation leaves, some for sources."""
    places, unit = _places(study), _unit(study)
    maps = _maps(study, places)
    panels = panels_of(places, maps[0].worst)
    flow = _flow(maps, panels)
    figure = flow.empty()
    highest = max(float(np.nanmax(map_.worst)) for map_ in maps)
    common = contours_between(0.0, highest)
    own: list[Keys] = []
    grids: list[bool] = []
    for row, map_ in enumerate(maps):
        low, high = float(np.nanmin(map_.worst)), float(np.nanmax(map_.worst))
        high = high if high > low else low + 1.0
        scale = f"coloraxis{row + 2}"
        # The bar of the first stands for all: what it says holds for each.
        bar = _bar(unit) | {
            "tickvals": [low, high],
            "ticktext": [say("least of the map"), say("largest of the map")],
        }
        colours = {"colorscale": COLOUR_SCALE, "cmin": low, "cmax": high}
        figure.update_layout(**{scale: colours | {"showscale": row == 0, "colorbar": bar}})
        for at, panel in enumerate(panels):
            position = row * len(panels) + at
            grids.append(
                add_panel(
                    figure,
                    flow,
                    position,
                    panel,
                    places,
                    map_.worst,
                    unit.label,
                    f"{map_.title} {panel.title}".strip(),
                    contours_between(low, high),
                    scale,
                )
            )
            own.append({"scale": scale, **contours_between(low, high)})
    for row, map_ in enumerate(maps):
        for at, panel in enumerate(panels):
            add_ends(figure, flow, row * len(panels) + at, panel, places, map_.worst)
    finish(figure, flow.height, margin={"l": 55, "r": 15, "t": flow.top, "b": flow.bottom})
    figure.update_xaxes(title={"font": {"size": 11}}, tickfont={"size": 11})
    figure.update_yaxes(title={"font": {"size": 11}}, tickfont={"size": 11})
    figure.update_layout(
        coloraxis={
            "colorscale": COLOUR_SCALE,
            "cmin": 0.0,
            "cmax": highest if highest > 0 else 1.0,
            "showscale": False,
            "colorbar": _bar(unit),
        },
        meta={"narrow": _narrow(figure, flow)},
        updatemenus=[_menu(own, grids, common, 12 + 17 * _title_lines(panels))],
    )
    return figure


def _narrow(figure: Plot, flow: Flow) -> Keys:
    """What else changes on a small screen: numbers and ticks are smaller, and there are fewer."""
    changed: Keys = {"margin.l": 42, "margin.r": 8}
    for note in range(len(flow.titles), len(figure.layout["annotations"])):
        changed[f"annotations[{note}].font.size"] = 9
    for axis in (name for name in figure.layout if name[1:5] == "axis"):
        ends = [float(f"{end:.3g}") for end in figure.layout[axis]["range"]]
        changed |= {f"{axis}.tickvals": ends, f"{axis}.tickangle": 0, f"{axis}.tickfont.size": 10}
    return changed


def _bar(unit: Shown) -> Keys:
    """The bar of a colour axis, below the maps."""
    return {
        "orientation": "h",
        "title": {"text": unit.label, "side": "right", "font": {"size": 12}},
        "thickness": 12,
        "len": 0.6,
        "x": 0.5,
        "xanchor": "center",
        "y": 0.0,
        "yref": "container",
        "yanchor": "bottom",
        "nticks": 5,
        "tickfont": {"size": 11},
    }


def _menu(own: list[Keys], grids: list[bool], common: Keys, above: int) -> Keys:
    """Two buttons: each map on a colour axis of its own, or all on the common one.

    They stand `above` the panels, px.
    """
    count = len(grids)

    def button(label: str, scales: list[Keys], shown: bool) -> Keys:
        names = [scale["scale"] for scale in scales]
        changed: Keys = {
            # A grid has its scale itself, points have it in their marks.
            "coloraxis": [name if grid else None for name, grid in zip(names, grids, strict=True)],
            "marker.coloraxis": [
                None if grid else name for name, grid in zip(names, grids, strict=True)
            ],
        }
        if all(grids):
            del changed["marker.coloraxis"]
        elif not any(grids):
            del changed["coloraxis"]
        if any(grids):
            for key in ("start", "end", "size"):
                changed[f"contours.{key}"] = [scale[key] for scale in scales]
        return {
            "label": label,
            "method": "update",
            "args": [
                changed,
                {"coloraxis.showscale": shown, "coloraxis2.showscale": not shown},
                list(range(count)),
            ],
        }

    return {
        "type": "buttons",
        "direction": "right",
        # What plotly paints the active one is not to be read by night; the bar says which it is.
        "showactive": False,
        "active": 0,
        "x": 0.0,
        "xanchor": "left",
        "y": 1.0,
        "yanchor": "bottom",
        "pad": {"b": above, "l": 0, "t": 0, "r": 0},
        "bgcolor": PAPER,
        "bordercolor": AXIS,
        "font": {"color": INK, "size": 11},
        "buttons": [
            button(say("own scales"), own, False),
            button(say("one scale"), [{"scale": "coloraxis", **common}] * count, True),
        ],
    }


def _title_lines(panels: list[MapPanel]) -> int:
    return 2 if panels[0].title else 1


def _flow(maps: list[WorkspaceMap], panels: list[MapPanel]) -> Flow:
    """The panels of one map stand beside each other, maps below; flat ones three in a row."""
    titles = [f"{map_.title}\n{panel.title}".strip() for map_ in maps for panel in panels]
    lines = _title_lines(panels)
    columns = len(panels) if len(panels) > 1 else 3
    return Flow(
        titles,
        columns=columns,
        narrow=len(panels) if len(panels) > 1 else 2,
        panel=170 if len(panels) > 1 else 210,
        narrow_panel=100,
        gap=30 + 16 * lines if len(panels) > 1 else 68,
        top=MENU + 12 + 17 * lines,
        narrow_top=MENU + 12 + 17 * lines,
        bottom=90,
        apart=(0.07, 0.13),
    )


def _places(study: Study) -> Places:
    return places_of(study.poses, study.machine.commanded, study.units)


def _unit(study: Study) -> Shown:
    """Of the quantity that the maps show: position, orientation where nothing moves."""
    return study.units.error("position" if study.positions else "orientation")


def _maps(study: Study, places: Places) -> list[WorkspaceMap]:
    """All sources together, what remains, then sources by rank, dominant ones where space is."""
    per_si = _unit(study).per_si

    def over_places(worst: Floats) -> Floats:
        highest = np.full(len(places.points), np.nan)
        np.fmax.at(highest, places.of_pose, worst * per_si)
        return highest

    maps = [WorkspaceMap(say("all sources"), over_places(study.largest))]
    if study.compensation is not None and np.isfinite(study.remaining_largest).any():
        remaining = over_places(study.remaining_largest)
        maps.append(WorkspaceMap(say("after compensation"), remaining))
    n_panel = len(panels_of(places, maps[0].worst))
    verdicts = study.values("verdict")
    ranked = [
        index
        for number, index in enumerate(study.by_rank)
        if n_panel == 1 or number == 0 or str(verdicts[index]) == "dominant"
    ]
    worst = study.values("largest")[:, :, 0]
    maps += [WorkspaceMap(study.sources[at], over_places(worst[:, at])) for at in ranked]
    return maps[: MOST_MAPS[n_panel]]
