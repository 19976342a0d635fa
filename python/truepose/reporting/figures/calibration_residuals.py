"""What was measured against the machine before and after calibration, reading by reading."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from truepose.arrays import Floats
from truepose.calibration.identification.robust import OUTLIER
from truepose.files.shown_units import Shown
from truepose.language import say
from truepose.reporting.calibration import odd_readings, rms
from truepose.reporting.display import decimals_for, number
from truepose.reporting.figures._plot import Keys, Plot, grid, trace
from truepose.reporting.figures._style import (
    AFTER,
    BEFORE,
    OVERALL,
    SHADE,
    finish,
    small,
)
from truepose.reporting.study import Study

if TYPE_CHECKING:
    import xarray as xr

TITLE = "Residuals"
NEEDS = "calibration"

PANEL_HEIGHT = 270
COVERAGE = 2.0
"""Standard uncertainties within which 95 of 100 readings should be."""


def says(study: Study) -> str:
    """How much smaller the residuals are after calibration, of the first kind of readings."""
    result = study.calibrated
    kinds = zip(
        result["row_instrument"].values[result["observation_row"].values].tolist(),
        result["observation_units"].values.tolist(),
        strict=True,
    )
    instrument, unit = next(kinds)
    before, after, stated = residual_sizes(result, instrument, unit)
    scale = _scale(study, unit)
    places = decimals_for([size * scale.per_si for size in (before, after)], 4)
    return say(
        "The residuals of {instrument} fall from {before} to {after} {unit} (root mean square); "
        "stated were {stated} {unit}.",
        instrument=instrument,
        before=number(before * scale.per_si, places),
        after=number(after * scale.per_si, places),
        stated=number(stated * scale.per_si, places),
        unit=scale.label,
    )


def caption(study: Study) -> str:
    """What the points are, and where they should be."""
    parts = [
        say(
            "Predicted minus measured. Left, on one scale: the machine as filed (hollow), its "
            "instruments placed as fits it best, against the calibrated one (filled). Right: the "
            "calibrated machine alone, where 95 in 100 points should lie in the grey band of twice "
            "the stated uncertainty, and show no pattern."
        )
    ]
    if _named(study).any():
        parts.append(say("Readings that do not fit are further out than it shows."))
    kind = study.calibrated.attrs["validation"]
    if kind == "folds":
        parts.append(say("Crosses: rows predicted by a fit that did not use them."))
    if kind == "stated set":
        parts.append(say("Crosses: rows that the file keeps from the fit."))
    return " ".join(parts)


def figure(study: Study) -> Plot:
    """One row of panels for each unit: before and after on one scale, then after alone."""
    result = study.calibrated
    units = list(dict.fromkeys(result["observation_units"].values.tolist()))
    figure = grid(
        rows=len(units),
        cols=2,
        horizontal_spacing=0.09,
        vertical_spacing=0.25 / len(units),
        column_titles=[say("before and after"), say("after, enlarged")],
    )
    rows = result["observation_row"].values
    lines = result["row_line"].values
    in_file = bool((lines > 0).all())
    where = (lines if in_file else result["row"].values)[rows]
    labels = _labels(study)
    sigma = result["uncertainty"].values
    for nth, unit in enumerate(units):
        mine = result["observation_units"].values == unit
        scale = _scale(study, unit)
        factor, shown = scale.per_si, scale.label
        sets = {
            name: (result[name].values * (sigma if normalised else 1.0))[mine] * factor
            for name, normalised in (
                ("residual_before", False),
                ("residual_after", False),
                ("held_out_after", True),
            )
        }
        at, text = where[mine], labels[mine]
        first = nth == 0
        for column in (1, 2):
            place = {"row": nth + 1, "col": column}
            if column == 1:
                figure.add_trace(
                    _points(
                        at,
                        sets["residual_before"],
                        text,
                        say("before"),
                        BEFORE,
                        first,
                        "circle-open",
                    ),
                    **place,
                )
            else:
                for edge in _band(at, sigma[mine] * factor):
                    figure.add_trace(edge, **place)
            figure.add_trace(
                _points(
                    at, sets["residual_after"], text, say("after"), AFTER, first and column == 1
                ),
                **place,
            )
            if column == 2 and np.isfinite(sets["held_out_after"]).any():
                figure.add_trace(
                    _points(
                        at,
                        sets["held_out_after"],
                        text,
                        say("not used for the fit"),
                        OVERALL,
                        first,
                        "x-thin-open",
                    ),
                    **place,
                )
        figure.update_yaxes(title={"text": say("residual, {unit}", unit=shown)}, row=nth + 1, col=1)
        fit = mine & ~_named(study)
        after = (result["normalised_after"].values * sigma)[fit] * factor
        held_out = (result["held_out_after"].values * sigma)[fit] * factor
        reach = np.abs(np.concatenate([after, held_out, 2.5 * sigma[mine] * factor]))
        most = 1.08 * float(np.nanmax(reach))
        figure.update_yaxes(range=[-most, most], row=nth + 1, col=2)
    finish(figure, 110 + PANEL_HEIGHT * len(units), margin={"l": 75, "r": 20, "t": 70, "b": 55})
    name = say("line of the file") if in_file else say("row")
    figure.update_xaxes(title={"text": name}, row=len(units))
    return figure


def residual_sizes(result: xr.Dataset, instrument: str, unit: str) -> tuple[float, float, float]:
    """Root mean squares before, after and as stated of an instrument's readings in a unit, SI.

    The same readings as in the table of residuals: those that are odd are left out.
    """
    of_reading = result["row_instrument"].values[result["observation_row"].values]
    mine = (of_reading == instrument) & (result["observation_units"].values == unit)
    mine &= ~odd_readings(result)
    names = ("residual_before", "residual_after", "uncertainty")
    before, after, stated = (rms(result[name].values[mine]) for name in names)
    return before, after, stated


def _scale(study: Study, unit: str) -> Shown:
    """The unit in which residuals are shown."""
    return Shown("1", 1.0) if unit == "1" else study.units.small(unit)


def _named(study: Study) -> np.ndarray:
    """(n_observation,) readings that are named as not fitting."""
    flags: np.ndarray = np.abs(study.calibrated["standardised"].values) >= OUTLIER
    return flags


def _labels(study: Study) -> np.ndarray:
    """(n_observation,) what each reading is: "tracker, x"."""
    result = study.calibrated
    names = result["row_instrument"].values[result["observation_row"].values]
    return np.array(
        [
            f"{name}, {what}"
            for name, what in zip(names, result["observation_what"].values, strict=True)
        ],
        dtype=np.str_,
    )


def _points(
    at: np.ndarray,
    values: Floats,
    text: np.ndarray,
    name: str,
    colour: str,
    legend: bool,
    symbol: str = "circle",
) -> Keys:
    return trace(
        "scatter",
        x=at,
        y=small(values),
        text=text,
        name=name,
        legendgroup=name,
        showlegend=legend,
        mode="markers",
        # Thin and translucent, the colour of a ring would not be seen.
        marker={
            "color": colour,
            "size": 7,
            "symbol": symbol,
            "line": {"width": 1.6, "color": colour},
        },
        hovertemplate="%{text}: %{y:.3f}<extra>" + name + "</extra>",
    )


def _band(at: np.ndarray, sigma: Floats) -> list[Keys]:
    """Twice the stated uncertainty either side, the largest at each row."""
    where = np.unique(at)
    half = COVERAGE * np.array([sigma[at == place].max() for place in where])
    # Half a row further at both ends, so that points at the ends lie in it too.
    where = np.concatenate([[where[0] - 0.5], where, [where[-1] + 0.5]])
    half = np.concatenate([half[:1], half, half[-1:]])
    common = {"x": small(where), "mode": "lines", "line": {"width": 0}, "showlegend": False,
              "hoverinfo": "skip"}  # fmt: skip
    return [
        trace("scatter", y=small(-half), **common),
        trace("scatter", y=small(half), fill="tonexty", fillcolor=SHADE, **common),
    ]
