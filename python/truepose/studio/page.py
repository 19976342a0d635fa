"""The page of a studio: the live page, which may talk with its own server and nobody else."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from truepose.errors import RequestError
from truepose.language import say
from truepose.reporting.live.part import LivePart, live_of
from truepose.reporting.shell import page_parts, template

if TYPE_CHECKING:
    from truepose.machine import Machine


@dataclass(frozen=True)
class Page:
    """A page, and its policy, which goes as a header."""

    text: str
    policy: str


def studio_page(machine: Machine, host: str) -> Page:
    """The page of a machine with its edits, for a server that the browser calls `host`, with port.

    Where a machine cannot be made into a live page, or no kernel was built, it says so instead.
    """
    live: LivePart | None = None
    why = ""
    try:
        live = live_of(machine)
    except RequestError as failure:
        why = failure.problems[0].message
    parts = page_parts(say("{machine} · studio", machine=machine.name), live, figures=False)
    policy = f"{parts.pop('policy')}; connect-src 'self' ws://{host}; frame-ancestors 'none'"
    text = template("live/studio_page.html.jinja").render(
        machine=machine, why=why, policy="", **parts
    )
    return Page(text, policy)


__all__ = ["Page", "studio_page"]
