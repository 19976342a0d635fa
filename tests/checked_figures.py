"""A figure of the report as plotly's own class, which refuses keys and values it does not know."""

from __future__ import annotations

import plotly.graph_objects as go

from truepose.reporting.figures._plot import Plot


def checked(plot: Plot) -> go.Figure:
    """The figure, after every key and value of it was checked."""
    return go.Figure(plot.data, plot.layout)
