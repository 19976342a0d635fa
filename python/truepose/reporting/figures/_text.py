"""Text of a figure as plotly draws it, which takes some HTML for markup.

Figures are written in plain text, with a newline where a line ends: a name of the machine file
that reads like a tag, or like an entity, is shown as it stands there.
"""

from __future__ import annotations

import html
import re
from typing import Any

import numpy as np

from truepose.reporting.figures._plot import Plot

MARKUP = re.compile("[&<>\n]")

NO_BOX = "<extra></extra>"
"""At the end of a hover text: no second box with the name of the trace."""


def as_text(figure: Plot) -> Plot:
    """The figure with every text marked so that plotly shows it as it is."""
    marked = Plot(*_marked(figure.data))
    marked.update_layout(**_marked(figure.layout))
    return marked


def _marked(value: Any) -> Any:
    if isinstance(value, str):
        if not MARKUP.search(value):
            return value
        text = value.removesuffix(NO_BOX)
        return html.escape(text, quote=False).replace("\n", "<br>") + value[len(text) :]
    if isinstance(value, dict):
        return {key: _marked(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_marked(each) for each in value]
    if isinstance(value, np.ndarray) and value.dtype.kind in "OU":
        return np.array([_marked(each) for each in value.ravel()], object).reshape(value.shape)
    return value


__all__ = ["NO_BOX", "as_text"]
