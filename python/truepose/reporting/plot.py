"""A figure of the report on its own: what shows itself in a notebook, and can be written."""

from __future__ import annotations

import json
import math
from contextlib import suppress
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from truepose.errors import Problem, RequestError
from truepose.files.wording import did_you_mean
from truepose.files.writing import replacing, require_writable
from truepose.language import say
from truepose.machine import Machine
from truepose.reporting import assembly
from truepose.reporting.drawing_packages import module_that_draws
from truepose.reporting.figures import FIGURES, DrawnFigure, draw_one, is_there
from truepose.reporting.study import Study
from truepose.representation import Facts, Represented, facts_html
from truepose.runs.arguments import checked

MIME = "application/vnd.plotly.v1+json"
"""What notebooks call a figure of plotly.js."""

HOW_SURE = ("sampled", "worst_case", "monte_carlo", "ellipses", "bounds", "shares")
"""Results that `assembly.with_how_sure` adds."""

MACHINE = "machine_drawing"
"""The figure of the machine itself."""

BESIDE = "tp.report(machine, measurements=...).plot(...) has those of a calibration"


@dataclass(frozen=True, eq=False, repr=False)
class MachinePlot(Represented):
    """A figure of a machine: `name`, `title`, what it `says`, how it is read (`caption`).

    `figure` is that of plotly.js: a dictionary of `data` and `layout`, lists and numbers in it.
    """

    machine: Machine
    name: str
    title: str
    says: str
    caption: str
    figure: dict[str, Any]
    drawn: DrawnFigure
    is_live: bool = False
    """Whether a notebook shows the live page of the machine in place of the figure."""

    def write(self, path: str | PathLike[str]) -> None:
        """Write a page that opens without a network, FILE.html, or the figure, FILE.json.

        Raises `RequestError` (output-ending, output-is-input, ...) where that cannot be.
        """
        target = Path(path)
        require_writable(target, (".html", ".json"), [])
        text = self._page() if target.suffix.lower() == ".html" else json.dumps(self.figure)
        with replacing(target) as temporary:
            temporary.write_text(text, encoding="utf-8")

    def _page(self) -> str:
        shell = module_that_draws("truepose.reporting.shell")
        title = f"{self.machine.name} · {say(self.title)}"
        text: str = shell.template("figure_page.html.jinja").render(
            machine=self.machine, drawn=self.drawn, **shell.page_parts(title)
        )
        return text

    def _facts(self) -> Facts:
        yield "machine", self.machine.name
        yield "figure", self.title
        yield "says", self.says or None
        yield "how to read it", self.caption

    def _repr_mimebundle_(self, include: object = None, exclude: object = None) -> dict[str, Any]:
        """The live page, or the figure for what draws it and what it says for what does not."""
        if self.is_live:
            page = module_that_draws("truepose.reporting.live.framed")
            # Without a kernel for browsers, or of a machine that has no live part: the figure.
            with suppress(RequestError):
                return {"text/html": page.framed(self.machine), "text/plain": repr(self)}
        return {
            MIME: self.figure,
            "text/html": facts_html("MachinePlot", self._facts()),
            "text/plain": repr(self),
        }


@checked
def plot(machine: Machine, figure: str | None = None) -> MachinePlot:
    """A figure of the report of a machine, by its name; what it needs is computed.

    Without a name the machine drawn, in place of which a notebook shows the live page.

    Raises `RequestError` (extra-missing, unknown-choice, no-source), and as `truepose.budget`.
    """
    if figure is None:
        return replace(plot(machine, MACHINE), is_live=True)
    module = _module_named(figure)
    needs: str | None = getattr(module, "NEEDS", None)
    if needs == "calibration":
        raise _not_there(figure, "it is of a calibration", BESIDE)
    watcher = assembly.Watcher()
    study = assembly.compared(machine, watcher)
    if needs == "over_time":
        study = assembly.with_time(study)
    elif needs == "strain":
        study = assembly.with_strain(study, watcher)
    elif needs in HOW_SURE:
        study = assembly.with_how_sure(study, watcher)
    return drawn(study, figure)


def drawn(study: Study, figure: str) -> MachinePlot:
    """A figure of a study by its name."""
    module = _module_named(figure)
    if not is_there(study, module):
        names = ", ".join(_name(one) for one in FIGURES if is_there(study, one))
        raise _not_there(figure, "the machine has no such result", f"one of {names}")
    one = draw_one(study, module)
    layout = {**one.figure.layout, "template": _template()}
    return MachinePlot(
        study.machine,
        one.name,
        one.title,
        one.says,
        one.caption,
        {"data": _plain(one.figure.data), "layout": _plain(layout)},
        one,
    )


def _module_named(figure: str) -> ModuleType:
    by_name = {_name(module): module for module in FIGURES}
    if figure not in by_name:
        raise RequestError(
            Problem(
                "unknown-choice",
                "there is no such figure",
                found=figure,
                expected=", ".join(by_name),
                hint=did_you_mean(figure, by_name),
            )
        )
    return by_name[figure]


def _name(module: ModuleType) -> str:
    return module.__name__.rpartition(".")[2]


def _not_there(figure: str, why: str, expected: str) -> RequestError:
    return RequestError(
        Problem(
            "unknown-choice", f"this figure is not there: {why}", found=figure, expected=expected
        )
    )


def _template() -> Any:
    """The look of plotly's own figures under that of these."""
    shell = module_that_draws("truepose.reporting.shell")
    return shell.template_of_figures()


def _plain(value: Any) -> Any:
    """Dictionaries, lists and numbers: what every notebook reads; None where a number is none."""
    if isinstance(value, dict):
        return {key: _plain(part) for key, part in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [_plain(part) for part in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


__all__ = ["MIME", "MachinePlot", "drawn", "plot"]
