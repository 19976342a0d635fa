"""The polar plot of a circular test: deviations magnified about the nominal circle, both ways."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from truepose.arrays import Floats
from truepose.reporting.figures import DrawnFigure
from truepose.reporting.figures._plot import Keys, Plot, trace
from truepose.reporting.figures._style import AXIS, GRID, INK, SOURCE_COLOURS, finish, small
from truepose.reporting.figures._text import as_text

if TYPE_CHECKING:
    import xarray as xr

    from truepose.machine import Machine

HEIGHT = 760

MIDDLE = 1.0
"""Radius at which the nominal circle is drawn."""

REACH = 0.62
"""Share of that which the largest deviation takes."""

STEPS = (1.0, 2.0, 5.0, 10.0)
"""Round numbers of a scale."""

MEASURED = ("#B23A48", "#7A1F2B")
BANDS = ("rgba(0, 114, 178, 0.16)", "rgba(213, 94, 0, 0.16)")


def figures(machine: Machine, result: xr.Dataset) -> list[DrawnFigure]:
    """One for each state; readings are of the machine as commanded."""
    return [
        DrawnFigure(
            f"polar-{at}",
            f"Polar plot, {state}",
            _caption(machine, result, at),
            as_text(_figure(machine, result, at)),
        )
        for at, state in enumerate(str(name) for name in result["state"].values)
    ]


def _caption(machine: Machine, result: xr.Dataset, state: int) -> str:
    unit = machine.shown.small_length
    ring, times = _ring(machine, result, state), _magnified(machine, result, state)
    text = (
        f"Radial deviation F outwards from the nominal circle, a ring each {ring:g} {unit.label}: "
        f"magnified {times:,.0f} times against a circle of radius "
        f"{machine.shown.length.text(float(result.attrs['radius']), 6)}. About the centre "
        "of the least-squares circle, which is dashed. Bands hold "
        f"{100.0 * result.attrs['probability']:.3g} % of the machines at each angle."
    )
    if result.sizes["turn"]:
        text += " Ticks at the rim: where a drive turns round."
    return text


def _ring(machine: Machine, result: xr.Dataset, state: int) -> float:
    """Distance of the rings, in the unit for people: a round number, some four in the reach."""
    aim = _reach(machine, result, state) / 4.0
    power = 10.0 ** np.floor(np.log10(aim)) if aim > 0.0 else 1.0
    return float(next(step * power for step in STEPS if step * power >= aim * 0.999))


def _reach(machine: Machine, result: xr.Dataset, state: int) -> float:
    """The largest deviation that is drawn, in the unit for people."""
    drawn = [np.abs(result[f"radial_{name}"].values[state]) for name in ("lower", "upper", "known")]
    if state == 0 and "reading" in result.sizes:
        drawn.append(np.abs(result["radial_measured"].values))
    finite = [values[np.isfinite(values)].max(initial=0.0) for values in drawn]
    return max(float(max(finite)), 1e-9) * machine.shown.small_length.per_si


def _magnified(machine: Machine, result: xr.Dataset, state: int) -> float:
    reach = _reach(machine, result, state) / machine.shown.small_length.per_si
    return float(result.attrs["radius"]) * REACH / reach


def _figure(machine: Machine, result: xr.Dataset, state: int) -> Plot:
    unit, turn = machine.shown.small_length, machine.shown.angle
    scale = REACH / _reach(machine, result, state)
    angles = np.asarray(result["angle"].values)
    figure = Plot()
    _rings(figure, machine, result, state, scale)
    ways = [str(name) for name in result["direction"].values]
    for way, name in enumerate(ways):
        low, high = (
            result[f"radial_{end}"].values[state, way] * unit.per_si for end in ("lower", "upper")
        )
        outline = [np.append(end, end[0]) for end in (high, low)]
        round_ = np.append(angles, angles[0])
        x, y = _at(
            np.concatenate([round_, round_[::-1]]),
            np.concatenate([outline[0], outline[1][::-1]]),
            scale,
        )
        figure.add_trace(
            trace(
                "scatter",
                x=small(x),
                y=small(y),
                mode="lines",
                line={"width": 0},
                fill="toself",
                fillcolor=BANDS[way],
                name=f"{name}, {100.0 * result.attrs['probability']:.3g} %",
                hoverinfo="skip",
            )
        )
    for way, name in enumerate(ways):
        known = np.asarray(result["radial_known"].values[state, way]) * unit.per_si
        _line(figure, angles, known, scale, name, SOURCE_COLOURS[way], unit.label, turn)
    if state == 0 and "reading" in result.sizes:
        _readings(figure, machine, result, scale)
    _least_squares(figure, machine, result, state, scale)
    _turns(figure, result, turn.per_si, turn.label)
    edge = MIDDLE + REACH + 0.26
    hidden: Keys = {"visible": False, "range": [-edge, edge]}
    finish(figure, HEIGHT, margin={"l": 20, "r": 20, "t": 70, "b": 20}, hovermode="closest")
    figure.update_xaxes(**hidden, constrain="domain")
    figure.update_yaxes(**hidden, scaleanchor="x", scaleratio=1, constrain="domain")
    return figure


def _at(angles: Floats, deviations: Floats, scale: float) -> tuple[Floats, Floats]:
    """Where a deviation, in the unit for people, is drawn."""
    radius = MIDDLE + scale * deviations
    return radius * np.cos(angles), radius * np.sin(angles)


def _line(
    figure: Plot,
    angles: Floats,
    values: Floats,
    scale: float,
    name: str,
    colour: str,
    unit: str,
    turn: object,
    **look: object,
) -> None:
    x, y = _at(np.append(angles, angles[0]), np.append(values, values[0]), scale)
    degrees = np.append(angles, angles[0]) * getattr(turn, "per_si", 1.0)
    told = [
        f"{name}, {angle:.4g} {getattr(turn, 'label', '')}: {value:.3g} {unit}"
        for angle, value in zip(degrees, np.append(values, values[0]), strict=True)
    ]
    figure.add_trace(
        trace(
            "scatter",
            x=small(x),
            y=small(y),
            mode="lines",
            line={"color": colour, "width": 2.0, **look},
            name=name,
            text=told,
            hoverinfo="text",
        )
    )


def _rings(figure: Plot, machine: Machine, result: xr.Dataset, state: int, scale: float) -> None:
    """Rings of equal deviation with their numbers, and spokes."""
    unit = machine.shown.small_length
    ring = _ring(machine, result, state)
    most = int(np.floor(_reach(machine, result, state) * 1.15 / ring + 1e-9)) or 1
    turn = np.linspace(0.0, 2.0 * np.pi, 361)
    notes = []
    for number in range(-most, most + 1):
        x, y = _at(turn, np.full(turn.size, number * ring), scale)
        nominal = number == 0
        figure.add_trace(
            trace(
                "scatter",
                x=small(x),
                y=small(y),
                mode="lines",
                line={"color": AXIS if nominal else GRID, "width": 1.6 if nominal else 1.0},
                name="nominal circle" if nominal else None,
                showlegend=nominal,
                hoverinfo="skip",
            )
        )
        label = "0" if nominal else f"{number * ring:+g}".replace("-", "\N{MINUS SIGN}")
        where = np.radians(11.0)
        notes.append(
            {
                "x": float((MIDDLE + scale * number * ring) * np.cos(where)),
                "y": float((MIDDLE + scale * number * ring) * np.sin(where)),
                "text": f"{label} {unit.label}" if number == most else label,
                "showarrow": False,
                "font": {"size": 11, "color": "#5b6779"},
                "bgcolor": "rgba(255, 255, 255, 0.75)",
            }
        )
    edge = MIDDLE + REACH * 1.05
    for degrees in range(0, 360, 45):
        way = np.radians(degrees)
        inner = MIDDLE - REACH
        figure.add_trace(
            trace(
                "scatter",
                x=small([inner * np.cos(way), edge * np.cos(way)]),
                y=small([inner * np.sin(way), edge * np.sin(way)]),
                mode="lines",
                line={"color": GRID, "width": 1.0},
                showlegend=False,
                hoverinfo="skip",
            )
        )
        angle = machine.shown.angle
        first, second = list(str(result.attrs["plane"]))
        axis = {0: f" (+{first})", 90: f" (+{second})"}.get(degrees, "")
        notes.append(
            {
                "x": float((edge + 0.13) * np.cos(way)),
                "y": float((edge + 0.13) * np.sin(way)),
                "text": f"{way * angle.per_si:.4g} {angle.label}{axis}".replace(" °", "°"),
                "showarrow": False,
                "font": {"size": 12, "color": INK},
            }
        )
    figure.update_layout(annotations=notes)


def _least_squares(
    figure: Plot, machine: Machine, result: xr.Dataset, state: int, scale: float
) -> None:
    """The least-squares circle of what is known, about its own centre."""
    names = [str(name) for name in result["quantity"].values]
    radius = float(result["known"].values[state, names.index("D")])
    turn = np.linspace(0.0, 2.0 * np.pi, 361)
    values = np.full(turn.size, radius * machine.shown.small_length.per_si)
    x, y = _at(turn, values, scale)
    figure.add_trace(
        trace(
            "scatter",
            x=small(x),
            y=small(y),
            mode="lines",
            line={"color": INK, "width": 1.0, "dash": "dash"},
            name="least-squares circle",
            hoverinfo="skip",
        )
    )


def _readings(figure: Plot, machine: Machine, result: xr.Dataset, scale: float) -> None:
    unit, turn = machine.shown.small_length, machine.shown.angle
    ways = np.array([str(name) for name in result["reading_direction"].values])
    angles = np.asarray(result["reading_angle"].values)
    values = np.asarray(result["radial_measured"].values) * unit.per_si
    for way, name in enumerate(str(word) for word in result["direction"].values):
        chosen = ways == name
        x, y = _at(angles[chosen], values[chosen], scale)
        figure.add_trace(
            trace(
                "scatter",
                x=small(x),
                y=small(y),
                mode="markers",
                marker={
                    "color": MEASURED[way],
                    "size": 4,
                    "symbol": "circle" if way == 0 else "x-thin-open",
                },
                name=f"measured, {name}",
                text=[
                    f"measured {name}, {angle * turn.per_si:.4g} {turn.label}: {value:.3g} "
                    f"{unit.label}"
                    for angle, value in zip(angles[chosen], values[chosen], strict=True)
                ],
                hoverinfo="text",
            )
        )


def _turns(figure: Plot, result: xr.Dataset, per_si: float, label: str) -> None:
    """Ticks at the rim."""
    angles = np.asarray(result["turn_angle"].values)[::2]
    drives = [str(name) for name in result["turn_drive"].values][::2]
    if not angles.size:
        return
    edge = MIDDLE + REACH * 1.05
    figure.add_trace(
        trace(
            "scatter",
            x=small(edge * np.cos(angles)),
            y=small(edge * np.sin(angles)),
            mode="markers+text",
            marker={"color": INK, "size": 7, "symbol": "diamond"},
            text=drives,
            textposition="top center",
            textfont={"size": 11},
            customdata=[
                f"{drive} turns at {a * per_si:.4g} {label}"
                for drive, a in zip(drives, angles, strict=True)
            ],
            hovertemplate="%{customdata}<extra></extra>",
            name="a drive turns round",
        )
    )
