"""The program `truepose`: its help is a page written before, all else is of `truepose.cli`.

Who asks what there is waits for the interpreter alone.
"""

from __future__ import annotations

import os
import sys

PAGE = "help.txt"
"""Beside this file. A test holds it against click's; `pytest --update-golden` writes it anew."""
WIDTH = 80
"""Of the page. Where a terminal is narrower, it is set for that."""
ASKED_BY = (["-h"], ["--help"])
COMPLETION = "_TRUEPOSE_COMPLETE"
"""Set by a shell that asks how a line goes on."""


def main() -> None:
    """Entry point of the `truepose` program."""
    if sys.argv[1:] in ASKED_BY and COMPLETION not in os.environ and _page_is_printed():
        return
    from truepose.cli import main as any_command

    any_command()


def _page_is_printed() -> bool:
    """Whether it could be; where not, the command line says why, or sets it for the terminal."""
    if sys.stdout is None or sys.stderr is None or _columns() < WIDTH:
        return False
    try:
        # Of `pathlib` the import alone would take longer.
        beside = os.path.join(os.path.dirname(__file__), PAGE)  # noqa: PTH118, PTH120
        with open(beside, encoding="ascii") as file:  # noqa: PTH123
            page = file.read()
        sys.stdout.write(page)
        sys.stdout.flush()
    except (OSError, UnicodeError):
        return False
    return True


def _columns() -> int:
    """Of the terminal, as `shutil.get_terminal_size` finds them, which imports much more."""
    try:
        columns = int(os.environ.get("COLUMNS", ""))
    except ValueError:
        columns = 0
    if columns > 0:
        return columns
    try:
        return os.get_terminal_size(1).columns or WIDTH
    except OSError:
        return WIDTH


if __name__ == "__main__":
    main()
