"""The polar plot of a circular test: deviations magnified about the nominal circle, both ways."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from truepose.arrays import Floats
from truepose.files.shown_units import Shown
from truepose.language import marked, say
from truepose.reporting.display import number
from truepose.reporting.figures import DrawnFigure
from truepose.reporting.figures._plot import Keys, Plot, trace
from truepose.reporting.figures._style import (
    AXIS,
    BEFORE_FILL,
    BLUE_FILL,
    BROWN,
    GRID,
    INK,
    PAPER,
    PURPLE,
    QUIET,
    SOURCE_COLOURS,
    finish,
    small,
)
from truepose.reporting.figures._text import as_text

if TYPE_CHECKING:
    import xarray as xr

    from truepose.machine import Machine

HEIGHT = 760

MIDDLE = 1.0
"""Radius at which the nominal circle is drawn."""

REACH = 0.62
"""Share of that which the largest deviation takes."""

RIM = MIDDLE + REACH * 1.05
EDGE = MIDDLE + REACH + 0.26
"""Where drives are marked, and where the picture ends."""

STEPS = (1.0, 2.0, 5.0, 10.0)
"""Round numbers of a scale."""

MEASURED = (PURPLE, BROWN)
BANDS = (BLUE_FILL, BEFORE_FILL)


def figures(machine: Machine, result: xr.Dataset) -> list[DrawnFigure]:
    """One for each state; readings are of the machine as commanded."""
    drawn = []
    for at, state in enumerate(str(name) for name in result["state"].values):
        polar = _Polar(machine, result, at)
        drawn.append(
            DrawnFigure(
                f"polar-{at}",
                f"Polar plot, {state}",
                polar.caption(),
                as_text(polar.drawn()),
                says=polar.finding(),
            )
        )
    return drawn


@dataclass
class _Polar:
    """The plot of one state, as it is drawn. Deviations are in the unit for people."""

    machine: Machine
    result: xr.Dataset
    state: int
    figure: Plot = field(default_factory=Plot)

    @property
    def unit(self) -> Shown:
        return self.machine.shown.small_length

    @property
    def turn(self) -> Shown:
        return self.machine.shown.angle

    @property
    def read(self) -> bool:
        """Whether there are readings to draw."""
        return self.state == 0 and "reading" in self.result.sizes

    def of(self, name: str) -> Floats:
        """(2, n) a variable of F in this state."""
        return np.asarray(self.result[f"radial_{name}"].values[self.state] * self.unit.per_si)

    @property
    def readings(self) -> Floats:
        """(m,) measured F."""
        return np.asarray(self.result["radial_measured"].values * self.unit.per_si)

    @property
    def reach(self) -> float:
        """The largest deviation that is drawn."""
        all_ = [self.of(name) for name in ("lower", "upper", "known")]
        if self.read:
            all_.append(self.readings)
        most = max(float(np.abs(one[np.isfinite(one)]).max(initial=0.0)) for one in all_)
        return max(most, 1e-9 * self.unit.per_si)

    @property
    def ring(self) -> float:
        """Distance of the rings: a round number, some four in the reach."""
        aim = self.reach / 4.0
        power = 10.0 ** np.floor(np.log10(aim))
        return float(next(step * power for step in STEPS if step * power >= aim * 0.999))

    @property
    def percent(self) -> str:
        return f"{100.0 * self.result.attrs['probability']:.3g} %"

    def finding(self) -> str:
        """Where what is known is farthest off the nominal circle."""
        known = self.of("known")
        way, at = np.unravel_index(int(np.nanargmax(np.abs(known))), known.shape)
        angle = float(self.result["angle"].values[at]) * self.turn.per_si
        return say(
            "What is known is farthest off the nominal circle at {angle}, by {size}.",
            angle=f"{marked(f'{angle:.4g}')} {self.turn.label}",
            size=f"{number(float(known[way, at]), 1)} {self.unit.label}",
        )

    def caption(self) -> str:
        """How to read it."""
        radius = float(self.result.attrs["radius"])
        times = radius * self.unit.per_si * REACH / self.reach
        text = (
            f"Radial deviation F outwards from the nominal circle, a ring each {self.ring:g} "
            f"{self.unit.label}: magnified {times:,.0f} times against a circle of radius "
            f"{self.machine.shown.length.text(radius, 6)}. About the centre of the least-squares "
            f"circle, which is dashed. Bands hold {self.percent} of the machines at each angle."
        )
        marked = " Marks at the rim: where a drive turns round."
        return text + marked if self.result.sizes["turn"] else text

    def drawn(self) -> Plot:
        """The figure."""
        self._rings()
        self._spokes()
        self._bands()
        self._known()
        if self.read:
            self._readings()
        self._least_squares()
        self._turns()
        hidden: Keys = {"visible": False, "range": [-EDGE, EDGE], "constrain": "domain"}
        margin = {"l": 20, "r": 20, "t": 70, "b": 20}
        finish(self.figure, HEIGHT, margin=margin, hovermode="closest")
        self.figure.update_xaxes(**hidden)
        self.figure.update_yaxes(**hidden, scaleanchor="x", scaleratio=1)
        return self.figure

    def _draw(self, angles: Floats, deviations: Floats, **keys: Any) -> None:
        """A trace of deviations at angles."""
        radius = MIDDLE + REACH / self.reach * deviations
        self._place(radius * np.cos(angles), radius * np.sin(angles), **keys)

    def _place(self, x: Floats, y: Floats, **keys: Any) -> None:
        if "text" not in keys:
            keys["hoverinfo"] = "skip"
        self.figure.add_trace(trace("scatter", x=small(x), y=small(y), **keys))

    def _note(self, angle: float, radius: float, text: str, **keys: Any) -> None:
        x, y = float(radius * np.cos(angle)), float(radius * np.sin(angle))
        notes = self.figure.layout.setdefault("annotations", [])
        notes.append({"x": x, "y": y, "text": text, "showarrow": False, **keys})

    def _told(self, name: str, angles: Floats, deviations: Floats) -> list[str]:
        return [
            f"{name}, {angle * self.turn.per_si:.4g} {self.turn.label}: {value:.3g} "
            f"{self.unit.label}"
            for angle, value in zip(angles, deviations, strict=True)
        ]

    def _rings(self) -> None:
        """Rings of equal deviation, and their numbers."""
        ring = self.ring
        most = int(np.floor(self.reach * 1.15 / ring + 1e-9)) or 1
        for count in range(-most, most + 1):
            nominal = count == 0
            self._draw(
                _ROUND,
                np.full(_ROUND.size, count * ring),
                mode="lines",
                line={"color": AXIS if nominal else GRID, "width": 1.6 if nominal else 1.0},
                name="nominal circle" if nominal else None,
                showlegend=nominal,
            )
            label = "0" if nominal else f"{count * ring:+g}".replace("-", "\N{MINUS SIGN}")
            self._note(
                np.radians(11.0),
                MIDDLE + REACH / self.reach * count * ring,
                f"{label} {self.unit.label}" if count == most else label,
                font={"size": 11, "color": QUIET},
                bgcolor=PAPER,
            )

    def _spokes(self) -> None:
        first, second = list(str(self.result.attrs["plane"]))
        for degrees in range(0, 360, 45):
            way = np.radians(degrees)
            ends = np.array([MIDDLE - REACH, RIM])
            look = {"color": GRID, "width": 1.0}
            x, y = ends * np.cos(way), ends * np.sin(way)
            self._place(x, y, mode="lines", line=look, showlegend=False)
            axis = {0: f" (+{first})", 90: f" (+{second})"}.get(degrees, "")
            text = f"{way * self.turn.per_si:.4g} {self.turn.label}{axis}".replace(" °", "°")
            self._note(way, RIM + 0.13, text, font={"size": 12, "color": INK})

    @property
    def _ways(self) -> list[str]:
        return [str(name) for name in self.result["direction"].values]

    @property
    def _closed(self) -> Floats:
        """Angles, the first again at the end."""
        angles = np.asarray(self.result["angle"].values)
        return np.append(angles, angles[0])

    def _bands(self) -> None:
        low, high = self.of("lower"), self.of("upper")
        for way, name in enumerate(self._ways):
            outer, inner = (np.append(end[way], end[way, 0]) for end in (high, low))
            self._draw(
                np.concatenate([self._closed, self._closed[::-1]]),
                np.concatenate([outer, inner[::-1]]),
                mode="lines",
                line={"width": 0},
                fill="toself",
                fillcolor=BANDS[way],
                name=f"{name}, {self.percent}",
            )

    def _known(self) -> None:
        for way, name in enumerate(self._ways):
            values = np.append(self.of("known")[way], self.of("known")[way, 0])
            self._draw(
                self._closed,
                values,
                mode="lines",
                line={"color": SOURCE_COLOURS[way], "width": 2.0},
                name=name,
                text=self._told(name, self._closed, values),
                hoverinfo="text",
            )

    def _readings(self) -> None:
        ways = np.array([str(name) for name in self.result["reading_direction"].values])
        angles = np.asarray(self.result["reading_angle"].values)
        for way, name in enumerate(self._ways):
            chosen = ways == name
            there, values = angles[chosen], self.readings[chosen]
            symbol = ("circle", "x-thin-open")[way]
            self._draw(
                there,
                values,
                mode="markers",
                marker={"color": MEASURED[way], "size": 4, "symbol": symbol},
                name=f"measured, {name}",
                text=self._told(f"measured {name}", there, values),
                hoverinfo="text",
            )

    def _least_squares(self) -> None:
        """The circle of what is known, about its own centre."""
        radius = float(self.result["known"].sel(quantity="D").values[self.state])
        self._draw(
            _ROUND,
            np.full(_ROUND.size, radius * self.unit.per_si),
            mode="lines",
            line={"color": INK, "width": 1.0, "dash": "dash"},
            name="least-squares circle",
        )

    def _turns(self) -> None:
        """Marks at the rim."""
        angles = np.asarray(self.result["turn_angle"].values)[::2]
        drives = [str(name) for name in self.result["turn_drive"].values][::2]
        if not angles.size:
            return
        told = [
            f"{drive} turns at {angle * self.turn.per_si:.4g} {self.turn.label}"
            for drive, angle in zip(drives, angles, strict=True)
        ]
        self._place(
            RIM * np.cos(angles),
            RIM * np.sin(angles),
            mode="markers+text",
            marker={"color": INK, "size": 7, "symbol": "diamond"},
            text=drives,
            textposition="top center",
            textfont={"size": 11},
            customdata=told,
            hovertemplate="%{customdata}<extra></extra>",
            name="a drive turns round",
        )


_ROUND = np.linspace(0.0, 2.0 * np.pi, 361)
