"""How the sampled error is distributed at the worst pose, with its coverage interval."""

from __future__ import annotations

import numpy as np

from truepose.arrays import Flags, Floats
from truepose.reporting.display import MISSING, ROUNDING, number
from truepose.reporting.figures._plot import Plot, grid, trace
from truepose.reporting.figures._style import GRID, INK, OVERALL, finish, small, source_colour
from truepose.reporting.reading import at_text, percent_text, quantities, worst_pose
from truepose.reporting.study import Study
from truepose.runs.poses import not_assembled_text

TITLE = "How the error is distributed"
NEEDS = "monte_carlo"

BARS = 40
PANEL_HEIGHT = 215
WITHIN, OUTSIDE = source_colour(0), "#B9CCDD"
ASKED = "#B23A48"


def caption(study: Study) -> str:
    """Which pose, how many samples, and what the colours are."""
    result = study.monte_carlo
    assert result is not None
    pose = worst_pose(result, "magnitude_upper")
    percent = percent_text(float(result.attrs["probability"]))
    failed = int(result["failed"].values[pose])
    count = int(result["samples"].values[pose])
    lost = (
        f" {not_assembled_text(failed, count + failed)}: they are in no bar and no interval, "
        "and the bars add up to the rest."
        if failed
        else ""
    )
    return (
        f"Exact error of {count:,} samples of all bands at "
        f"{at_text(study.machine, result, pose)}, the pose of those sampled where the position is "
        f"farthest off. Dark: the {percent} coverage interval; the line is the mean. Of a "
        f"magnitude, {percent} lie below the end of the dark part." + lost
    )


def figure(study: Study) -> Plot:
    """One panel for each component and magnitude: share of the samples, % a bar."""
    result = study.monte_carlo
    assert result is not None
    pose = worst_pose(result, "magnitude_upper")
    rows = _rows(study)
    columns = max(map(len, rows))
    figure = grid(
        rows=len(rows),
        cols=columns,
        spans={
            (row, at): 1 for row, names in enumerate(rows, 1) for at in range(1, len(names) + 1)
        },
        vertical_spacing=0.22 if len(rows) > 1 else 0.0,
        horizontal_spacing=0.07,
    )
    levels = np.asarray(result["level"].values, np.float64)
    for row, names in enumerate(rows, start=1):
        for at, name in enumerate(names, start=1):
            panel = {"row": row, "col": at}
            values, interval, mean = _of(study, name, pose)
            unit = study.units.error(name)
            per_si = unit.per_si
            _draw(figure, levels, values * per_si, interval * per_si, mean * per_si, panel)
            title = f"|{name}|" if name in quantities(result) else f"error in {name}"
            figure.update_xaxes(title={"text": f"{title}, {unit.label}"}, zeroline=False, **panel)
            if at == 1:
                figure.update_yaxes(title={"text": "samples, %"}, **panel)
    _add_legend(figure, percent_text(float(result.attrs["probability"])))
    finish(
        figure,
        90 + (PANEL_HEIGHT + 30) * len(rows),
        margin={"l": 70, "r": 20, "t": 45, "b": 55},
        bargap=0.0,
        barmode="overlay",
    )
    figure.update_yaxes(rangemode="tozero", gridcolor=GRID)
    return figure


def _rows(study: Study) -> list[list[str]]:
    """Names of the panels: lengths and their magnitude, below them angles and theirs."""
    assert study.monte_carlo is not None
    sizes = quantities(study.monte_carlo)
    rows = []
    for indices, size in ((study.positions, "position"), (study.rotations, "orientation")):
        if indices:
            names = [study.components[at] for at in indices]
            # The magnitude of a single component is the component without its sign.
            rows.append([*names, size] if len(names) > 1 and size in sizes else names)
    return rows


def _of(study: Study, name: str, pose: int) -> tuple[Floats, Floats, float]:
    """Quantiles (n_level,), both ends of the coverage interval and the mean, m or rad."""
    result = study.monte_carlo
    assert result is not None
    sizes = quantities(result)
    if name in sizes:
        at = sizes.index(name)
        values = np.asarray(result["magnitude_quantile"].values)[pose, at]
        upper = result["magnitude_upper"].values[pose, at]
        return values, np.array([-np.inf, upper]), float(result["magnitude_mean"].values[pose, at])
    at = study.components.index(name)
    ends = [result[end].values[pose, at] for end in ("lower", "upper")]
    values = np.asarray(result["quantile"].values)[pose, at]
    return values, np.array(ends), float(result["mean"].values[pose, at])


def histogram(levels: Floats, quantiles: Floats, bars: int = BARS) -> tuple[Floats, Floats]:
    """Edges (bars + 1,) and share of the samples (bars,) from quantiles (n_level,) at `levels`.

    Where the lowest level is not 0 or the highest not 1, the rest has no error and is in no bar.
    The distribution function between two quantiles is taken as a straight line; where quantiles
    are equal, as of a discrete distribution, it steps.
    """
    edges = np.linspace(quantiles[0], quantiles[-1], bars + 1)
    # A step at an edge counts below it.
    just_above = edges + ROUNDING * (edges[-1] - edges[0])
    below = np.interp(just_above, quantiles, levels)
    below[0], below[-1] = levels[0], levels[-1]
    return edges, np.diff(below)


def _draw(
    figure: Plot,
    levels: Floats,
    quantiles: Floats,
    interval: Floats,
    mean: float,
    panel: dict[str, int],
) -> None:
    finite = np.isfinite(quantiles)
    if finite.sum() < 2:
        figure.add_annotation(text=MISSING, x=0.5, y=0.5, showarrow=False, **panel)
        return
    edges, share = histogram(levels[finite], quantiles[finite])
    if not edges[-1] > edges[0]:
        # Nothing spreads this one: a single line at its value.
        edges, share = np.array([mean - 0.5, mean + 0.5]), np.array([1.0])
    middle = (edges[1:] + edges[:-1]) / 2
    figure.add_trace(
        trace(
            "bar",
            x=small(middle),
            y=small(100.0 * share),
            width=small(np.diff(edges)),
            marker={"color": _colours(middle, interval), "line": {"width": 0}},
            customdata=small(np.stack([edges[:-1], edges[1:]], axis=-1)),
            hovertemplate="%{customdata[0]:.3f} to %{customdata[1]:.3f}: %{y:.2f} %<extra></extra>",
            showlegend=False,
        ),
        **panel,
    )
    figure.add_trace(
        trace(
            "scatter",
            x=small([mean, mean]),
            y=small([0.0, 100.0 * share.max()]),
            mode="lines",
            line={"color": OVERALL, "width": 2},
            hovertemplate=f"mean {number(mean, 3)}<extra></extra>",
            showlegend=False,
        ),
        **panel,
    )
    for end in interval[np.isfinite(interval)]:
        figure.add_vline(x=end, line={"color": INK, "width": 1, "dash": "dot"}, **panel)


def _colours(middle: Floats, interval: Floats) -> list[str]:
    inside: Flags = (middle >= interval[0]) & (middle <= interval[1])
    return [WITHIN if is_inside else OUTSIDE for is_inside in inside]


def _add_legend(figure: Plot, percent: str) -> None:
    for name, colour in ((f"{percent} coverage interval", WITHIN), ("outside of it", OUTSIDE)):
        figure.add_trace(trace("bar", x=[None], y=[None], name=name, marker={"color": colour}))
    figure.add_trace(
        trace("scatter", x=[None], y=[None], name="mean", mode="lines", line={"color": OVERALL})
    )
