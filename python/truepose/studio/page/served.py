"""The page of a studio: the live page, which may talk with its own server and nobody else.

Its scripts stand behind those of the live part in one function, and use them.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib.resources import files
from typing import TYPE_CHECKING, Any

from truepose.errors import RequestError
from truepose.language import say
from truepose.live.bundle import bundle, units_for_people
from truepose.reporting.live.part import assembled, machine_in_page, packed_kernel, plain_text
from truepose.reporting.shell import page_parts, template
from truepose.studio.page.labels import labels

if TYPE_CHECKING:
    from truepose.machine import Machine

SCRIPTS = (
    "socket.js", "standing.js", "shown.js", "without_kernel.js",
    "stepped.js", "field_row.js", "fields.js", "changes.js", "dialogs.js",
    "tables.js", "chart.js", "answers.js", "witness.js", "sources.js", "shares.js",
    "budget.js", "over_time.js", "part.js", "dropped_files.js", "calibration.js", "studies.js",
    "modes.js", "tabs.js", "studio.js",
)  # fmt: skip
STYLE = "studio.css"


@dataclass(frozen=True)
class Page:
    """A page, and its policy, which goes as a header."""

    text: str
    policy: str


def studio_page(machine: Machine, host: str) -> Page:
    """The page of a machine with its edits, for a server that the browser calls `host`, with port.

    Where a machine cannot be made into a live page, or no kernel was built, it says so, and the
    server's numbers stand alone.
    """
    kernel = why = ""
    of_machine: dict[str, Any] = {"bundle": None}
    try:
        of_machine = machine_in_page(machine, bundle(machine))
    except RequestError as failure:
        why = failure.problems[0].message
    try:
        kernel = packed_kernel()
    except RequestError as failure:
        why = why or failure.problems[0].message
    setting = of_machine | {"units": units_for_people(machine), "studio": labels(), "why": why}
    more = plain_text(_resource(name) for name in SCRIPTS)
    live = assembled(kernel, setting, more, "startStudio", plain_text([_resource(STYLE)]))
    parts = page_parts(say("{machine} · studio", machine=machine.name), live, figures=False)
    policy = f"{parts.pop('policy')}; connect-src 'self' ws://{host}; frame-ancestors 'none'"
    text = template("live/studio_page.html.jinja").render(
        machine=machine, policy="", studio=True, **parts
    )
    return Page(text, policy)


def _resource(name: str) -> str:
    return files("truepose.studio.page").joinpath(name).read_text(encoding="utf-8")


__all__ = ["Page", "studio_page"]
