"""What every page has around its content: its head, its contents, its numbers, its figures' data.

A page is one HTML file that opens from disk without any network. plotly.js and the data of all
figures stand in it compressed; a small script, `page.js`, unpacks and draws them. The policy in the
head lets that script run, by its hash, and what it loads, and nothing else.
"""

from __future__ import annotations

import base64
import hashlib
import zlib
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import jinja2

from truepose.calibration.acceptance.sentences import sentence
from truepose.language import say, spoken
from truepose.reporting.figures import DrawnFigure
from truepose.reporting.figures._json import as_json
from truepose.reporting.figures._style import AXIS, DARK, GRID, INK, PAPER, SCENE_GRID
from truepose.reporting.live.part import LivePart
from truepose.reporting.result_words import verdict_of
from truepose.reporting.table import Table
from truepose.version import version


def _folder_of_plotly() -> Path:
    """Where the package plotly keeps its files, of which no module is run: that takes long.

    Raises `ImportError` where the package is not there.
    """
    found = find_spec("plotly")
    if found is None or not found.submodule_search_locations:
        raise ImportError("no plotly", name="plotly")
    return Path(found.submodule_search_locations[0], "package_data")


# Looked for at once, so that a report without it is refused before it is worked out.
PLOTLY = _folder_of_plotly()

SETTINGS = {"displaylogo": False, "responsive": True, "displayModeBar": "hover"}

DRAWING = ("figure_data.js", "page.js")
"""Scripts of a page with figures."""

LEVEL = 4
"""Of compression: plotly.js takes 2.0 MB in the page in 0.09 s; at level 9 1.9 MB in 0.21 s."""

TEMPLATE_DARK = {
    "white": DARK[PAPER],
    "#2a3f5f": DARK[INK],
    "#EBF0F8": DARK[GRID],
    "#DFE8F3": DARK[SCENE_GRID],
    "#C8D4E3": DARK[AXIS],
    "#A2B1C6": DARK[AXIS],
}
"""What the colours of plotly's own template are on dark paper."""


@dataclass(frozen=True)
class ContentsEntry:
    """A line of the contents: a section, or with `number` a figure in one."""

    name: str
    title: str
    number: int | None = None


@dataclass
class Contents:
    """What stands on a page, in its order: it grows while the page is written, and so counts."""

    entries: list[ContentsEntry] = field(default_factory=list)
    drawn: dict[str, DrawnFigure] = field(default_factory=dict)
    tables: list[Table] = field(default_factory=list)

    def section(self, name: str, title: str) -> str:
        """Note a section; returns its title."""
        self.entries.append(ContentsEntry(name, title))
        return title

    def figure(self, figure: DrawnFigure) -> str:
        """Number a figure: "Figure 3"."""
        self.drawn[figure.name] = figure
        count = len(self.drawn)
        self.entries.append(ContentsEntry(figure.name, say(figure.title), count))
        return say("Figure {number}", number=count)

    def table(self, table: Table) -> str:
        """Number a table: "Table 2"."""
        self.tables.append(table)
        return say("Table {number}", number=len(self.tables))

    @property
    def packed(self) -> str:
        """What `page.js` draws of, compressed."""
        return packed(
            as_json(
                {
                    "template": template_of_figures(),
                    "settings": SETTINGS,
                    "dark": DARK,
                    "templateDark": TEMPLATE_DARK,
                    "figures": {
                        name: {"data": each.figure.data, "layout": each.figure.layout}
                        for name, each in self.drawn.items()
                    },
                }
            ).encode()
        )


def packed(content: bytes) -> str:
    """In gzip's form and base64, the same bytes at any time."""
    # Of `wbits` the 16 asks for gzip's header, which then has no time in it.
    squeezed = zlib.compressobj(LEVEL, zlib.DEFLATED, 16 + zlib.MAX_WBITS)
    return base64.b64encode(squeezed.compress(content) + squeezed.flush()).decode("ascii")


def template(name: str) -> jinja2.Template:
    """A template of a page, with the filters that it needs."""
    environment = jinja2.Environment(
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        loader=jinja2.FunctionLoader(_resource),
    )
    environment.filters["capitalise"] = sentence
    environment.filters["css_text"] = css_text
    environment.globals["say"] = say
    environment.globals["verdict_of"] = verdict_of
    return environment.get_template(name)


def page_parts(title: str, live: LivePart | None = None, *, figures: bool = True) -> dict[str, Any]:
    """What every page has, of its title.

    `live`: its live part, if it has one; without `figures` it has neither plotly.js nor what that
    draws of.
    """
    loader = (live.script if live else "") + (_together(DRAWING) if figures else "")
    return {
        "title": title,
        "language": spoken().code,
        "version": version(),
        "css": _together(["page.css", "page_one.css"]) + (live.style if live else ""),
        "live": live,
        "loader": loader,
        "policy": policy(loader, live=live is not None, beside=bool(live and live.beside)),
        "plotly": packed(PLOTLY.joinpath("plotly.min.js").read_bytes()) if figures else "",
        "contents": Contents(),
        "words": _words(),
        "page_number": _page_number(),
    }


def policy(script: str, *, live: bool, beside: bool = False) -> str:
    """What a page may load and run: its script, by its hash, and what that loads.

    A `live` part compiles WebAssembly, and has a worker whose script it makes itself. One whose
    kernel stands `beside` it loads that, of where it is from itself, and its script loads nothing.
    """
    loads = "'self'" if beside else "'strict-dynamic'"
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    return "; ".join(
        [
            "default-src 'none'",
            "img-src data: blob:",
            "style-src 'unsafe-inline'",
            f"script-src 'sha256-{digest}' {loads}"
            + (" 'wasm-unsafe-eval'; worker-src blob:" if live else ""),
            "base-uri 'none'",
            "form-action 'none'",
        ]
    )


def css_text(text: str) -> str:
    """A text as CSS has it between quotes, whatever is in it."""
    plain = "".join(letter if letter.isalnum() or letter in " .,:·_-" else f"\\{ord(letter):x} "
                    for letter in text)  # fmt: skip
    return f'"{plain}"'


def _words() -> dict[str, str]:
    """What every page says around its content."""
    return {
        "contents": say("Contents"),
        "how_to_read": say("How to read it"),
        "bold": say("Bold: the largest of what is compared."),
        "csv": say("CSV"),
        "not_drawn": say(
            "The figures are not drawn: that takes a browser that runs scripts and knows "
            "DecompressionStream (Chrome 80, Firefox 113, Safari 16.4 or newer). What each figure "
            "says stands in its place, and all numbers stand in the tables."
        ),
    }


def _page_number() -> str:
    """What stands at the foot of a printed page, as CSS puts it together."""
    text = say("page {page} of {pages}", page="\0page\0", pages="\0pages\0")
    parts = text.split("\0")
    return " ".join(
        f"counter({part})" if at % 2 else css_text(part) for at, part in enumerate(parts)
    )


@cache
def template_of_figures() -> Any:
    """What plotly's figures look like, where they do not say it."""
    import json

    return json.loads(PLOTLY.joinpath("templates", "plotly_white.json").read_text("utf-8"))


def _together(names: Iterable[str]) -> str:
    return "\n".join(_resource(name) for name in names)


def _resource(name: str) -> str:
    return files("truepose.reporting").joinpath(name).read_text(encoding="utf-8")


__all__ = [
    "Contents",
    "ContentsEntry",
    "css_text",
    "packed",
    "page_parts",
    "policy",
    "template",
    "template_of_figures",
]
