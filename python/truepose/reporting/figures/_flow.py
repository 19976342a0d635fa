"""Panels one after the other in rows: more in a row of a wide page than of a small screen.

What a small screen changes stands in `layout.meta.narrow`, keys of `Plotly.relayout` with their
values: where the panels are, and the height.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from truepose.reporting.figures._plot import Keys, Plot, grid

PANEL_TITLE_SIZE, NARROW_TITLE_SIZE = 12, 10


LEGEND_ROW, LETTER, LEGEND_MARK = 19, 6.6, 48
"""Pixels: a row of a legend, the width of a letter in it, and what stands beside each name."""


def legend_height(names: Sequence[str], width: float) -> int:
    """Pixels that a legend of `names` takes on top of a figure so wide: columns of equal width."""
    widest = max((LETTER * len(name) + LEGEND_MARK for name in names), default=0.0)
    in_a_row = max(1, int(width // max(widest, 1.0)))
    return LEGEND_ROW * -(-len(names) // in_a_row)


@dataclass(frozen=True)
class Flow:
    """`titles` of the panels in their order, and how many of them stand in a row.

    Pixels: `panel` and `narrow_panel` their heights, `gap` between rows, where the lower one's
    titles and the upper one's axes are, `top`, `narrow_top` and `bottom` of the whole. `apart`:
    between the panels of a row, a share of the width, for both widths.
    """

    titles: Sequence[str]
    columns: int
    narrow: int
    panel: int = 150
    narrow_panel: int = 120
    gap: int = 66
    top: int = 35
    narrow_top: int = 35
    bottom: int = 45
    apart: tuple[float, float] = (0.06, 0.14)

    def place(self, number: int) -> dict[str, int]:
        """Row and column of a panel, which counts from 0."""
        columns = self._in_a_row(self.columns)
        return {"row": number // columns + 1, "col": number % columns + 1}

    @property
    def height(self) -> int:
        """Of the whole on a wide page, px."""
        return self.top + self._inside(self.columns, self.panel) + self.bottom

    def empty(self) -> Plot:
        """The panels with their titles and nothing in them."""
        plot = self._grid(self.columns, self.panel, self.apart[0])
        for title in plot.layout["annotations"]:
            title["font"] = {"size": PANEL_TITLE_SIZE}
        small = self._grid(self.narrow, self.narrow_panel, self.apart[1]).layout
        inside = self._inside(self.narrow, self.narrow_panel)
        changed: Keys = {
            "height": self.narrow_top + inside + self.bottom,
            "margin.t": self.narrow_top,
        }
        for axis in (name for name in small if "axis" in name):
            changed[f"{axis}.domain"] = small[axis]["domain"]
        for number, title in enumerate(small["annotations"]):
            changed |= {f"annotations[{number}].{key}": title[key] for key in "xy"}
            changed[f"annotations[{number}].font.size"] = NARROW_TITLE_SIZE
        plot.update_layout(
            meta={"narrow": changed},
            height=self.height,
            margin={"t": self.top, "b": self.bottom},
        )
        return plot

    def _in_a_row(self, columns: int) -> int:
        return min(columns, len(self.titles))

    def _rows(self, columns: int) -> int:
        return -(-len(self.titles) // self._in_a_row(columns))

    def _inside(self, columns: int, panel: int) -> int:
        rows = self._rows(columns)
        return rows * panel + (rows - 1) * self.gap

    def _grid(self, columns: int, panel: int, apart: float) -> Plot:
        rows, cols = self._rows(columns), self._in_a_row(columns)
        places = [(at // cols + 1, at % cols + 1) for at in range(len(self.titles))]
        return grid(
            rows=rows,
            cols=cols,
            spans=dict.fromkeys(places, 1),
            titles=self.titles,
            horizontal_spacing=apart,
            vertical_spacing=self.gap / self._inside(columns, panel),
        )


__all__ = ["Flow", "legend_height"]
