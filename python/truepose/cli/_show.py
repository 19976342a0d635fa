"""Tables on the terminal."""

from __future__ import annotations

import io
import sys
from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.table import Table as RichTable

    from truepose.report.tables import Table

PIPED_WIDTH = 160
"""Columns where the output is no terminal, so that no table is squeezed."""


def show_tables(tables: Iterable[Table]) -> None:
    """Print tables for people on stdout, in colour on a terminal."""
    from rich.console import Console

    terminal = sys.stdout.isatty()
    # Written as one text: rich itself would answer a closed pipe by leaving with exit code 1.
    text = io.StringIO()
    console = Console(
        file=text,
        highlight=False,
        force_terminal=terminal,
        width=None if terminal else PIPED_WIDTH,
    )
    for table in tables:
        console.print(f"[bold]{table.title}[/bold]")
        console.print(_rich(table))
        if table.note:
            console.print(table.note, style="dim")
        console.print()
    sys.stdout.write(text.getvalue())


def _rich(table: Table) -> RichTable:
    from rich import box
    from rich.table import Table as RichTable
    from rich.text import Text

    shown = RichTable(box=box.SIMPLE_HEAD, show_header=any(table.header), pad_edge=False)
    for index, name in enumerate(table.header):
        shown.add_column(
            Text(name), justify="left" if index < table.words else "right", overflow="fold"
        )
    for row in table.rows:
        shown.add_row(*(Text(cell) for cell in row))
    return shown
