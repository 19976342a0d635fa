"""Sphinx's settings for the site; build.py lays out the pages and calls Sphinx."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

from pygments.lexers.special import TextLexer
from sphinx.application import Sphinx

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

project = "truepose"
author = "truepose's authors"
release = os.environ["TRUEPOSE_SITE_VERSION"]
extensions = ["myst_nb", "mathml"]
root_doc = "index"
exclude_patterns = ["crates", "examples", "machines", "python", "tests"]
nitpicky = True

myst_enable_extensions = ["dollarmath", "attrs_inline", "deflist"]
myst_heading_anchors = 4
nb_execution_mode = "force"
nb_execution_timeout = 900  # there for what hangs: a busy machine is several times slower
nb_execution_raise_on_error = True
nb_merge_streams = True

html_theme = "furo"
html_title = f"truepose {release}"
html_static_path = [str(HERE / "static")]
html_css_files = ["site.css"]
html_math_renderer = "mathml"
html_copy_source = False
html_show_sphinx = False
html_show_search_summary = False  # it would fetch pages, which a page from disk may not
html_theme_options = {"navigation_with_keys": False}
highlight_language = "text"
pygments_style = "a11y-high-contrast-light"
pygments_dark_style = "a11y-high-contrast-dark"


def _scripts_of_figures(
    app: Sphinx, page: str, template: str, context: dict[str, Any], document: Any
) -> None:
    """Plotly's script, the package's own copy, on pages that have a figure, and nowhere else."""
    if 'class="plotly-figure"' in context.get("body", ""):
        app.add_js_file("plotly.min.js")


def _for_all_readers(
    app: Sphinx, page: str, template: str, context: dict[str, Any], document: Any
) -> None:
    """What scrolls is reached by the keyboard, and captions of the contents have a level."""
    if "body" in context:
        context["body"] = context["body"].replace("<pre>", '<pre tabindex="0">')
    tree = context.get("furo_navigation_tree", "")
    context["furo_navigation_tree"] = tree.replace(
        'role="heading"', 'role="heading" aria-level="2"'
    )


def setup(app: Sphinx) -> None:
    """Connect what is ours."""
    app.add_lexer("csv", TextLexer)
    app.connect("html-page-context", _scripts_of_figures)
    app.connect("html-page-context", _for_all_readers, priority=900)  # after the theme's
