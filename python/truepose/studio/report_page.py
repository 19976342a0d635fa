"""The report of the file with its edits: what `truepose report` writes of the saved file.

Made in a process of its own, for it takes seconds, and memory that the server then has back.
"""

from __future__ import annotations

import signal
from multiprocessing.connection import Connection
from pathlib import Path

from truepose.errors import TrueposeError
from truepose.language import speaking
from truepose.machine.loader import load_text
from truepose.reporting.assembly import Watcher
from truepose.reporting.report import made
from truepose.sources import REGISTRY


def report_of(path: Path, text: str) -> str:
    """The page of a text as of a machine file at a path. Raises as `truepose.report`."""
    machine = load_text(path, text, registry=REGISTRY)
    page, _ = made(machine, None, None, None, text, Watcher()).rendered()
    return page


def work(connection: Connection, path: Path, text: str, language: str) -> None:
    """What a process of its own does: sends the page, in a language, or what is wrong."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # Ctrl-C ends it without a word
    with connection, speaking(language):
        try:
            connection.send(report_of(path, text))
        except TrueposeError as failure:
            connection.send(failure.problems)


__all__ = ["report_of", "work"]
