"""Run before a page: its Plotly figures become places that the page fills by its own script."""

from __future__ import annotations

import json
from itertools import count
from typing import Any

import plotly.io
from plotly.io.base_renderers import MimetypeRenderer

NUMBERS = count(1)


class SiteRenderer(MimetypeRenderer):
    """HTML without Plotly's script, which conf.py gives to pages with a figure."""

    def to_mimebundle(self, figure: dict[str, Any]) -> dict[str, str]:
        """The place, and the call that draws into it once the script is there."""
        name = f"figure-{next(NUMBERS)}"
        data, layout = json.dumps(figure["data"]), json.dumps(figure["layout"])
        settings = json.dumps({"displaylogo": False, "responsive": True, "displayModeBar": False})
        title = figure["layout"].get("title", {}).get("text", "Figure")
        return {
            "text/html": f'<div id="{name}" class="plotly-figure" role="img" '
            f'aria-label="{title}"></div>'
            f'<script>window.addEventListener("load", () => Plotly.newPlot("{name}", {data}, '
            f"{layout}, {settings}));</script>"
        }


plotly.io.renderers["site"] = SiteRenderer()
plotly.io.renderers.default = "site"
