"""The live page in a frame, for the output of a notebook's cell.

The frame is sandboxed: its page runs its own scripts, under its own policy, and reaches neither the
notebook around it nor any network. All that it says is how high it is, and the frame becomes so.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from truepose.language import say
from truepose.reporting.live.page import html
from truepose.representation import attribute_text

if TYPE_CHECKING:
    from truepose.machine import Machine

HEIGHT = 1400
"""Pixels until the page has said how high it is, and where the notebook runs no script."""

LEAST, MOST = 200, 6000
"""Pixels that the frame may be high."""

LISTENER = f"""(() => {{
  const frame = document.currentScript && document.currentScript.previousElementSibling;
  if (!frame) return;
  addEventListener("message", ({{source, data}}) => {{
    const height = data && data.trueposeHeight;
    if (source !== frame.contentWindow || !Number.isFinite(height)) return;
    frame.style.height = `${{Math.min({MOST}, Math.max({LEAST}, height))}}px`;
  }});
}})();"""
"""What the notebook runs: it listens to this frame alone, and takes a number."""


def framed(machine: Machine) -> str:
    """The live page of a machine as a piece of HTML: a frame that holds it, and its height.

    Raises `RequestError` (no-live-kernel), and as `truepose.live.bundle`.
    """
    title = attribute_text(say("{machine} · live", machine=machine.name))
    page = attribute_text(html(machine, in_frame=True))
    look = f"width: 100%; height: {HEIGHT}px; border: 0"
    return (
        f'<iframe sandbox="allow-scripts" title="{title}" style="{look}" srcdoc="{page}"></iframe>'
        f"<script>{LISTENER}</script>"
    )


__all__ = ["framed"]
