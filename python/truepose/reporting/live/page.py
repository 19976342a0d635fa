"""The live part of the report alone: one HTML file, which opens without any network."""

from __future__ import annotations

from typing import TYPE_CHECKING

from truepose.language import say
from truepose.reporting.live.part import live_of
from truepose.reporting.page import write_text
from truepose.reporting.shell import page_parts, template

if TYPE_CHECKING:
    from truepose.machine import Machine

ENDINGS = (".html",)


def html(machine: Machine) -> str:
    """The page as text. Raises `RequestError` (no-live-kernel), and as `truepose.live.bundle`."""
    title = say("{machine} · live", machine=machine.name)
    return template("live/live_page.html.jinja").render(
        machine=machine, **page_parts(title, live_of(machine), figures=False)
    )


__all__ = ["ENDINGS", "html", "write_text"]
