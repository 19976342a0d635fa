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


def html(
    machine: Machine, beside: str | None = None, back: str | None = None, *, in_frame: bool = False
) -> str:
    """The page as text.

    `beside`: the address of a script with the kernel (`part.shared_kernel`), which then is not in
    the page. `back`: of the page that lists all of them. `in_frame`: it tells the page around it
    how high it is. Raises `RequestError` (no-live-kernel), and as `truepose.live.bundle`.
    """
    title = say("{machine} · live", machine=machine.name)
    return template("live/live_page.html.jinja").render(
        machine=machine,
        back=back,
        **page_parts(title, live_of(machine, beside, in_frame=in_frame), figures=False),
    )


__all__ = ["ENDINGS", "html", "write_text"]
