"""Answers and tables as text, as a terminal shows them: for commands, and for `str` of a result."""

from __future__ import annotations

import io
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

from truepose.language import say

if TYPE_CHECKING:
    from rich.table import Table as RichTable

    from truepose.machine import Machine
    from truepose.plausibility import Oddity
    from truepose.reporting.table import Table
    from truepose.verdict.answer import Answer

PIPED_WIDTH = 160
"""Columns where the output is no terminal, so that no table is squeezed."""

COLOURS = {"met": "green", "missed": "red", "open": "yellow", "none": "default"}
"""Of an answer's word."""

LOOKS_ODD = "looks odd"


def tables_text(tables: Iterable[Table], *, terminal: bool = False) -> str:
    """Tables for people, an empty line after each. `terminal`: in colour, as wide as that is."""
    from rich.text import Text

    shown: list[Any] = []
    for table in tables:
        shown += [Text(table.title, style="bold"), _rich(table)]
        if table.note:
            shown.append(Text(table.note, style="dim"))
        shown.append(Text())
    return _rendered(shown, terminal)


def oddities_text(oddities: Iterable[Oddity], *, terminal: bool = False) -> str:
    """What looks odd, a paragraph each."""
    from rich.text import Text

    lines = [
        Text.assemble((LOOKS_ODD, "bold yellow"), f"[{oddity.code}]: {oddity.sentence}")
        for oddity in oddities
    ]
    return _rendered([*lines, Text()], terminal) if lines else ""


def answers_text(machine: Machine, answers: Sequence[Answer], *, terminal: bool = False) -> str:
    """For which poses the answers are, then each; at the end what compensation gains."""
    from rich.table import Table as RichTable
    from rich.text import Text

    from truepose.reporting.accuracy import gains, told, where_answered

    lines = RichTable.grid(padding=(0, 2))
    if answers:
        lines.add_row("", Text(where_answered(answers)))
    for answer in told(machine, answers):
        lines.add_row(Text(answer.word, f"bold {COLOURS[answer.colour]}"), Text(answer.line))
        if answer.witness:
            lines.add_row("", Text(say("witness: {causes}", causes=answer.witness), style="dim"))
    for sentence in gains(answers):
        lines.add_row("", Text(sentence))
    return _rendered([lines, Text()], terminal) if lines.row_count else ""


def lines_text(lines: Iterable[tuple[str, str, str]], *, terminal: bool = False) -> str:
    """Answers, each its word, the name of its colour (`COLOURS`), and what it says."""
    from rich.table import Table as RichTable
    from rich.text import Text

    grid = RichTable.grid(padding=(0, 2))
    for word, colour, text in lines:
        grid.add_row(Text(word, f"bold {COLOURS.get(colour, colour)}".strip()), Text(text))
    return _rendered([grid, Text()], terminal) if grid.row_count else ""


def _rendered(shown: Iterable[Any], terminal: bool) -> str:
    """What rich can render, as one text: rich itself would answer a closed pipe by leaving."""
    from rich.console import Console

    text = io.StringIO()
    console = Console(
        file=text,
        highlight=False,
        force_terminal=terminal,
        width=None if terminal else PIPED_WIDTH,
    )
    for part in shown:
        console.print(part)
    return "".join(f"{line.rstrip(' ')}\n" for line in text.getvalue().splitlines())


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


__all__ = [
    "COLOURS",
    "LOOKS_ODD",
    "PIPED_WIDTH",
    "answers_text",
    "lines_text",
    "oddities_text",
    "tables_text",
]
